"""What a study has, by name: a further one's tables and figures, policies to show. Nothing heavy, for the workflow."""

from collections import Counter
from collections.abc import Collection, Iterable, Mapping
from typing import Any

from reacher_shaping.settings.cell import Cell
from reacher_shaping.settings.study import Study
from reacher_shaping.storage.tables import EXPERIMENT_TABLES

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


def judged(keys: Iterable[Mapping[str, Any]]) -> bool:
    """Whether the paper's claims are judged on a study of these cells: no two protocols have the same one."""
    cells = [(cell["variant"], cell["budget"], cell["alpha0"]) for cell in keys]
    return len(set(cells)) == len(cells)


def table_files(
    *,
    switches: bool,
    peers: bool,
    claims: bool = False,
    hypotheses: bool = False,
    targets: bool = False,
    lengths: bool = False,
) -> list[str]:
    """Return the files of a study's tables: those of all, and those of a study that has what is named."""
    has = {"effects": switches, "agreement": peers, "hypotheses": hypotheses, "lengths": lengths}
    has |= {"claims": claims, "claim_parts": claims, "takeoff": hypotheses, "targets": targets}
    return [entry.file for name, entry in EXPERIMENT_TABLES.items() if has.get(name, True)]


def files_of(study: Study, name: str, hypotheses: Collection[str]) -> list[str]:
    """Return the files of a further study's tables; `hypotheses` are the studies that have some of their own."""
    own, cells = study.experiments[name], study.experiment_cells[name]
    return table_files(
        switches=own.switches is not None,
        peers=own.peers is not None,
        claims=judged(cell.key for cell in cells),
        hypotheses=name in hypotheses,
        targets=name in hypotheses and all(cell.protocol.environment.task == "reacher" for cell in cells),
        lengths=own.lengths,
    )


def views(keys: Iterable[Mapping[str, Any]], tables: Collection[str]) -> list[str]:
    """Return the names of a study's figures, what its cells can show.

    Args:
        keys: `protocol, variant, budget, alpha0` of its cells.
        tables: names of its tables; one that compares two protocols switch by switch has `effects`.
    """
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
