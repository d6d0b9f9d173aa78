"""What a study has, by name: its tables and figures, policies to show. Nothing heavy, for the workflow."""

from collections import Counter
from collections.abc import Collection, Iterable, Mapping
from typing import Any

from reacher_shaping.settings.base import ConfigError
from reacher_shaping.settings.cell import Cell
from reacher_shaping.settings.study import MAIN, Study
from reacher_shaping.storage import tables as catalogue

MAIN_VIEWS = (
    *("figure_1", "figure_2", "figure_3", "figure_4"),
    *("seed_strip", "profiles", "forest", "improvement", "success_by_radius", "long_episodes", "lottery", "peers"),
)
"""Figures of the main study, in the order of the report; `peers` once there are runs of other algorithms."""
VIEWS = ("cells", "dose", "takeoff", "targets", "effects", "log", "correlation", "forest")
DOSES = 3
"""Weights of one variant from which on its effect is shown against the weight."""

SHOWN = {
    "none": ("paper", "none"),
    "l2": ("paper", "l2"),
    "decay300k": ("paper", "decay300k"),
    "released": ("released", "decay300k"),
    "tuned": ("tuned", "none"),
}
"""Policies that the page lets its reader play: protocol and variant, by the name that the words know."""


def shown_cells(cells: Iterable[Cell]) -> dict[str, Cell]:
    """Return, by name, the cells whose first run the page shows: of each kind the one of most budget and alpha0."""
    found: dict[str, Cell] = {}
    for cell in sorted(cells, key=lambda cell: (cell.budget, cell.alpha0)):
        kind = (cell.protocol.name, cell.variant.name)
        found |= {name: cell for name, shown in SHOWN.items() if shown == kind}
    return {name: found[name] for name in SHOWN if name in found}


def judged(design: Iterable[Mapping[str, Any]]) -> bool:
    """Whether a study is one of the paper's kind: some of its cells stand in the paper, and none twice in it."""
    cells = [(cell["variant"], cell["budget"], cell["alpha0"], cell["group"]) for cell in design]
    return len(set(cells)) == len(cells) and any(group != "extra" for *_, group in cells)


def ledgers(entries: Iterable[Mapping[str, Any]]) -> dict[str, Mapping[str, Any]]:
    """Return the entries of report/hypotheses.yaml by their study. Raises ConfigError for a second one of a study."""
    found: dict[str, Mapping[str, Any]] = {}
    for entry in entries:
        if entry["study"] in found:
            raise ConfigError(f"report/hypotheses.yaml: study {entry['study']!r} has two entries; allowed: one")
        found[entry["study"]] = entry
    return found


def folder(name: str) -> str:
    """Where a study's tables lie below `results/`: the main one's in it, with a slash at the end where there is one."""
    return "" if name == MAIN else f"experiments/{name}/"


def features(study: Study, name: str, hypotheses: Collection[str]) -> frozenset[str]:
    """What a study has that others lack, and tables ask for; `hypotheses` are the studies that have some of their own.

    The paper's claims are judged on the main study (on its first protocol), and on another of the paper's kind.
    """
    own, cells = study.studies[name], study.cells_of[name]
    has = {
        "main": name == MAIN,
        "further": name != MAIN,
        "claims": name == MAIN or judged(study.design(name)),
        "switches": own.switches is not None,
        "peers": own.peers is not None,
        "lengths": own.lengths,
        "search": own.search is not None,
        "hypotheses": name in hypotheses,
        "targets": name in hypotheses and all(cell.protocol.environment.task == "reacher" for cell in cells),
    }
    return frozenset(feature for feature, there in has.items() if there)


def tables_of(study: Study, name: str, hypotheses: Collection[str]) -> dict[str, str]:
    """Return the files of the tables that a study always has, by their names, below its folder."""
    entries = catalogue.of_study(features(study, name, hypotheses))
    return {table: entry.file for table, entry in entries.items()}


def stem(name: str, view: str) -> str:
    """Name of the file of a study's figure: the main one's is called by its view alone."""
    return view if name == MAIN else f"{name}_{view}"


def views(name: str, keys: Iterable[Mapping[str, Any]], tables: Collection[str]) -> list[str]:
    """Return the names of a study's figures: the main one's are fixed, another's are what its cells can show.

    Args:
        name: of the study.
        keys: `protocol, variant, budget, alpha0` of its cells.
        tables: names of its tables; one that compares two protocols switch by switch has `effects`.
    """
    if name == MAIN:
        return [view for view in MAIN_VIEWS if view != "peers" or "peers" in tables]
    cells, switches = list(keys), "effects" in tables
    labels = {cell["alpha0"] for cell in cells if cell["variant"] == "none"}
    variants = {cell["protocol"]: {c["variant"] for c in cells if c["protocol"] == cell["protocol"]} for cell in cells}
    doses = Counter((cell["protocol"], cell["variant"]) for cell in cells if cell["variant"] != "none")
    shown = {
        "cells": True,
        "dose": max(doses.values(), default=0) >= DOSES,
        "takeoff": "takeoff" in tables,
        "targets": "targets" in tables,
        "effects": switches,
        "log": not switches,
        "correlation": len(labels) > 1,  # a baseline of several weights: alpha0 is a label there
        "forest": not switches and any("none" in own and len(own) > 2 for own in variants.values()),
    }
    return [name for name in VIEWS if shown[name]]
