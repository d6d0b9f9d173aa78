"""The report: one HTML file that needs no network and in which every number comes from a table or a setting."""

import base64
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import jinja2
import numpy as np
import pandas as pd

from reacher_shaping.analysis.baselines import ALGORITHMS, by_algorithm, peer_table
from reacher_shaping.labels import budget_label, cell_order, of_protocol, setting_label, variant_label
from reacher_shaping.report import captions, paper_tables, seed_uncertainty, study_sections
from reacher_shaping.report.summary import effect, short_number, summary
from reacher_shaping.report.text import say
from reacher_shaping.report.text_tables import (
    Grid,
    controllers_grid,
    departures_grid,
    of_table,
    settings_grid,
    study_grid,
)
from reacher_shaping.settings.base import plain

TEMPLATE = Path(__file__).with_name("report.html.j2")
MEDIA_TYPES = {".svg": "image/svg+xml", ".png": "image/png", ".gif": "image/gif", ".mp4": "video/mp4"}
MEDIA_BUDGET = 11_000_000  # bytes of videos put into the file; the rest are links
MANIFEST_NUMBERS = ("env_steps", "wall_seconds", "cpu_seconds", "env_steps_per_second")
OWN_SECTION = ("lottery", "peers")  # figures that stand in a section of their own; other further ones come together
VERDICT_MARKS = {"reproduced": "✓", "not reproduced": "✗", "inconclusive": "?", "untestable": "\N{EN DASH}"}


@dataclass(frozen=True)
class Inputs:
    """What a report is made of; what is None or empty is left out, and the report says so.

    `study` holds the resolved settings; `published` comes from `paper_tables.published_cells`; `controllers` has
    `controller, success_rate, final_success_rate, mean_return, final_distance`; `figures` maps names such as
    `figure_1` to SVG files, in the order to show; `power`, `variance`, `winners` and `spread` are the study's tables of
    these names, `peers` that of the other algorithms, `experiments` those of each further study, `training_logs` the
    published logs' summaries, `every_published` is `published` with the run that the tables leave out; `ledger` has the
    claims' `id, evidence, shown_in`; relative links start at `folder`.
    """

    study: Mapping[str, Any]
    cells: pd.DataFrame
    runs: pd.DataFrame
    published: pd.DataFrame
    correlation: pd.DataFrame | None = None
    claims: pd.DataFrame | None = None
    controllers: pd.DataFrame | None = None
    power: pd.DataFrame | None = None
    variance: pd.DataFrame | None = None
    winners: pd.DataFrame | None = None
    spread: pd.DataFrame | None = None
    peers: pd.DataFrame | None = None
    experiments: Mapping[str, Mapping[str, pd.DataFrame]] = field(default_factory=dict)
    training_logs: pd.DataFrame = field(default_factory=pd.DataFrame)
    every_published: pd.DataFrame | None = None
    figures: Mapping[str, Path] = field(default_factory=dict)
    media: Sequence[Path] = ()
    manifests: Sequence[Mapping[str, Any]] = ()
    notebooks: Sequence[Path] = ()
    ledger: Sequence[Mapping[str, Any]] = ()
    settings_hash: str = ""
    protocol: str | None = None
    folder: Path = Path("report")
    template: Path = TEMPLATE


@dataclass(frozen=True)
class Picture:
    """A figure or video: name, title, caption, content as a data URI or a relative link, and links to other files."""

    name: str
    title: str
    caption: str
    source: str
    links: Mapping[str, str]
    kind: str = "image"


def build(inputs: Inputs) -> str:
    """The whole report as HTML text. Raises jinja2's error where the template names what is not there."""
    environment = jinja2.Environment(
        autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    template = environment.from_string(inputs.template.read_text(encoding="utf-8"))
    return template.render(contents(inputs))


def contents(inputs: Inputs) -> dict[str, Any]:
    """Everything the template may name."""
    cells = of_protocol(inputs.cells, inputs.protocol)
    pictures = {name: _figure(name, path, inputs) for name, path in inputs.figures.items()}
    own = ("figure_", *(f"{name}_" for name in inputs.experiments))
    return {
        "summary": summary(cells, inputs.claims),
        "study": inputs.study,
        "settings": settings_grid(inputs.study, set(cells["protocol"])),
        "grid": study_grid(cells),
        "cell_count": len(cells),
        "run_count": int(cells["seeds"].sum()) if len(cells) else 0,
        "diverged": int(cells["diverged"].sum()) if len(cells) else 0,
        "pictures": pictures,
        "further": [
            picture for name, picture in pictures.items() if not name.startswith(own) and name not in OWN_SECTION
        ],
        "experiments": [
            study_sections.section(name, given, inputs.training_logs, inputs.correlation, inputs.every_published)
            for name, given in inputs.experiments.items()
        ],
        "departures": departures_grid(inputs.study),
        "tables": _tables(cells, inputs),
        "sentences": _sentences(inputs),
        "controllers": controllers_grid(inputs.controllers, inputs.protocol),
        "claims": _claims(inputs),
        "videos": videos(inputs, cells),
        "notebooks": {path.stem.replace("_", " "): _link(path, inputs) for path in inputs.notebooks},
        "computation": computation(inputs),
        "settings_hash": inputs.settings_hash,
        "protocol": inputs.protocol or (str(cells["protocol"].iloc[0]) if len(cells) else ""),
    }


def _tables(cells: pd.DataFrame, inputs: Inputs) -> dict[str, dict[str, Any]]:
    """The tables with titles and captions: the paper's three, our measures, and those whose tables were given."""
    protocol = inputs.protocol
    grids = {
        name: of_table(make(cells, inputs.published))
        for name, make in (
            ("table_1", paper_tables.table_1),
            ("table_2", paper_tables.table_2),
            ("table_3", paper_tables.table_3),
        )
    }
    grids["behaviour"] = of_table(paper_tables.behaviour(cells))
    grids["learning"] = of_table(paper_tables.learning(cells, of_protocol(inputs.runs, protocol)))
    if inputs.power is not None:
        grids["power"] = seed_uncertainty.power_grid(inputs.power, protocol)
    if inputs.variance is not None:
        grids["variance"] = seed_uncertainty.variance_grid(inputs.variance, protocol)
    if inputs.winners is not None:
        grids["winners"] = seed_uncertainty.winners_grid(inputs.winners)
    if inputs.spread is not None:
        grids["spread"] = seed_uncertainty.spread_grid(inputs.spread, inputs.published)
    if inputs.peers is not None:
        grids["peer_table"] = of_table(peer_table(inputs.peers, cells, inputs.controllers, protocol))
    return {
        name: {"title": captions.title(name), "caption": captions.caption(name, cells, inputs.runs), "grid": grid}
        for name, grid in grids.items()
    }


def _sentences(inputs: Inputs) -> dict[str, str]:
    """What the tables that were given say, in a sentence each."""
    said = {}
    if inputs.power is not None:
        said["power"] = seed_uncertainty.power_sentence(inputs.power, inputs.protocol)
    if inputs.variance is not None:
        said["variance"] = seed_uncertainty.variance_sentence(inputs.variance, inputs.protocol)
    if inputs.winners is not None:
        said["winners"] = seed_uncertainty.winners_sentence(inputs.winners)
    if inputs.peers is not None:
        said["peers"] = budgets_sentence(inputs.peers)
    return said


def _claims(inputs: Inputs) -> list[dict[Any, Any]]:
    """Every claim with verdict, effect, evidence and the figures behind it."""
    if inputs.claims is None:
        return []
    ledger = {entry["id"]: entry for entry in inputs.ledger}
    rows: list[dict[Any, Any]] = []
    for row in inputs.claims.to_dict("records"):
        entry = ledger.get(row["id"], {})
        shown_in = [(name, captions.title(name).split(".")[0]) for name in entry.get("shown_in", [])]
        published = row["published"]
        text = short_number(published) if isinstance(published, float) else str(published)
        more = {"effect": effect(row), "mark": VERDICT_MARKS.get(row["verdict"], ""), "published": text}
        rows.append(row | more | {"evidence": entry.get("evidence", ""), "shown_in": shown_in})
    return rows


def videos(inputs: Inputs, cells: pd.DataFrame) -> list[Picture]:
    """One video per cell, MP4 where there is one, embedded while the size budget lasts."""
    chosen = {path.stem: path for path in sorted(inputs.media, key=lambda path: path.suffix != ".gif")}
    shown, left = [], MEDIA_BUDGET
    for row in sorted(cells.to_dict("records"), key=cell_order):
        stem = f"{row['protocol']}-{row['variant']}-{row['budget']}-alpha{plain(row['alpha0'])}"
        path = chosen.pop(stem, None)
        if path is None:
            continue
        size = path.stat().st_size
        source = data_uri(path) if size <= left else _link(path, inputs)
        left -= size if size <= left else 0
        title = f"{variant_label(str(row['variant']))}, {setting_label(int(row['budget']), row['alpha0'])}"
        caption = say("computation.video", rate=f"{100 * row['success_rate']:.1f}\N{NO-BREAK SPACE}%")
        kind = "video" if path.suffix == ".mp4" else "image"
        shown.append(Picture(stem, title, caption, source, {path.suffix[1:].upper(): _link(path, inputs)}, kind))
    return shown


def _figure(name: str, path: Path, inputs: Inputs) -> Picture:
    caption = captions.caption(name, inputs.cells, inputs.runs, inputs.protocol)
    others = [path.with_suffix(suffix) for suffix in (".svg", ".pdf") if path.with_suffix(suffix).exists()]
    links = {other.suffix[1:].upper(): _link(other, inputs) for other in others}
    return Picture(name, captions.title(name), caption, data_uri(path), links)


def _link(path: Path, inputs: Inputs) -> str:
    return Path(os.path.relpath(path, inputs.folder)).as_posix()


def data_uri(path: Path) -> str:
    """A file's content as a URI, so that the page needs no other file."""
    return f"data:{MEDIA_TYPES[path.suffix]};base64,{base64.b64encode(path.read_bytes()).decode()}"


def computation(inputs: Inputs) -> Grid | None:
    """How the study was computed, from the manifests of its blocks."""
    if not inputs.manifests:
        return None
    several = {
        "code": [_commit(manifest.get("git", {})) for manifest in inputs.manifests],
        "machine": [_machine(manifest.get("machine", {})) for manifest in inputs.manifests],
        "threads": [str(manifest.get("threads", "")) for manifest in inputs.manifests],
    }
    frame = pd.DataFrame([{name: row.get(name, np.nan) for name in MANIFEST_NUMBERS} for row in inputs.manifests])
    total = frame.sum()
    speed = frame["env_steps_per_second"].quantile([0.0, 0.5, 1.0]).tolist()
    rows = [[say(f"computation.{name}"), "; ".join(dict.fromkeys(values))] for name, values in several.items()]
    rows += [
        [say("computation.jobs"), f"{len(frame):,}"],
        [say("computation.steps"), f"{total['env_steps']:,.0f}"],
        [
            say("computation.time"),
            say("computation.hours", wall=total["wall_seconds"] / 3600, cpu=total["cpu_seconds"] / 3600),
        ],
        [say("computation.speed"), say("computation.speeds", least=speed[0], median=speed[1], most=speed[2])],
    ]
    packages: dict[str, dict[str, None]] = {}
    for manifest in inputs.manifests:
        for name, version in manifest.get("versions", {}).items():
            packages.setdefault(name, {})[str(version)] = None
    rows.append(
        [say("computation.versions"), ", ".join(f"{name} {' / '.join(found)}" for name, found in packages.items())]
    )
    return Grid(["", ""], rows, frozenset({0, 1}))


def _commit(git: Mapping[str, Any]) -> str:
    commit = str(git.get("commit") or say("computation.no_commit"))[:12]
    return say("computation.dirty", commit=commit) if git.get("dirty") else commit


def _machine(machine: Mapping[str, Any]) -> str:
    return ", ".join(str(machine[name]) + (" cores" if name == "cores" else "") for name in machine)


def budgets_sentence(peers: pd.DataFrame) -> str:
    """Which algorithm had how many environment steps and seeds."""
    parts = [
        f"{ALGORITHMS.get(name, name)} {budget_label(int(budget))} ({len(own)} seed{'s' if len(own) != 1 else ''})"
        for (name, budget), own in by_algorithm(peers)
    ]
    return say("computation.budgets", budgets=", ".join(parts))
