"""The report: one HTML file that needs no network and in which every number comes from a table or a setting."""

import base64
import csv
import io
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import jinja2
import pandas as pd
from markupsafe import Markup

from reacher_shaping.analysis.baselines import ALGORITHMS, by_algorithm, peer_table
from reacher_shaping.figures import interactive
from reacher_shaping.labels import budget_label, of_protocol
from reacher_shaping.report import (
    arm,
    captions,
    claims_view,
    computation,
    paper_tables,
    pictures,
    seed_uncertainty,
    small_pictures,
    study_sections,
)
from reacher_shaping.report.loader import Study
from reacher_shaping.report.markup import to_html
from reacher_shaping.report.sources import sources
from reacher_shaping.report.summary import VERDICTS, summary
from reacher_shaping.report.text import entry, say
from reacher_shaping.report.text_tables import (
    Grid,
    controllers_grid,
    departures_grid,
    of_table,
    settings_grid,
    study_grid,
)
from reacher_shaping.settings import outputs
from reacher_shaping.settings.study import MAIN

TEMPLATE = Path(__file__).with_name("report.html.j2")
SORTABLE = Path(__file__).parent / "vendor" / "sortable.js"
OWN_SECTION = ("lottery", "peers")  # figures that stand in a section of their own; other further ones come together
NOTEBOOKS = "notebooks"
RELEASED = "released"  # the study that computes as the released code does


@dataclass(frozen=True)
class Inputs:
    """What a report is made of; what is not there is left out, and the report says so.

    `settings` holds the resolved settings; `study` the tables; `figures` maps names such as `figure_1` to SVG files, in
    the order to show; `manifests` are those of the study's blocks; `headings` has the `title` and `question` of each
    study; `policies` is the summary of the policies that the page lets its reader play.
    """

    settings: Mapping[str, Any]
    study: Study
    figures: Mapping[str, Path]
    media: Sequence[Path] = ()
    manifests: Sequence[Mapping[str, Any]] = ()
    headings: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    notebooks: Sequence[Path] = ()
    policies: Path | None = None
    settings_hash: str = ""
    protocol: str | None = None
    template: Path = TEMPLATE


def build(inputs: Inputs) -> str:
    """The whole report as HTML text. Raises jinja2's error where the template names what is not there."""
    environment = jinja2.Environment(
        autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    environment.filters["markup"] = to_html
    environment.globals |= {"text": say, "sort_key": sort_key, "csv": csv_uri}
    template = environment.from_string(inputs.template.read_text(encoding="utf-8"))
    return template.render(contents(inputs))


def contents(inputs: Inputs) -> dict[str, Any]:
    """Everything the template may name."""
    study = inputs.study
    cells = of_protocol(study.tables["cells"], inputs.protocol)
    protocol = inputs.protocol or (str(cells["protocol"].iloc[0]) if len(cells) else "")
    places = study_sections.figures_of(study)
    drawn = {name: _figure(*places[name], path, inputs) for name, path in inputs.figures.items()}
    tables, videos = _tables(cells, inputs), pictures.videos(inputs.media, cells)
    main = [name for name in drawn if places[name][0] == MAIN]
    further = [drawn[name] for name in main if not name.startswith("figure_") and name not in OWN_SECTION]
    facts = computation.facts(cells, inputs.manifests, inputs.settings_hash, protocol)
    first = summary(study, inputs.protocol)
    charts = {
        name: Markup(chart)
        for name, chart in interactive.charts(study.tables, inputs.protocol).items()
        if name in drawn
    }
    played = arm.arm(inputs.policies, inputs.settings["evaluation"]["radius"])
    absent = {"further": not further, "rollouts": not videos, "arm": not played}
    sections = [name for name in entry("page.sections") if not absent.get(name, False)]
    return {
        "summary": first,
        "arm": played,
        "first_picture": small_pictures.bars(first.bars, say("first.picture")) if first.bars else "",
        "facts": facts,
        "print_facts": re.sub(r"[\"\\\n]", "", " · ".join(facts)),
        "toy": computation.toy(cells),
        "sections": sections,
        "anchors": {*sections, *drawn, *tables, *study.experiments},
        "claims": claims_view.claims(
            study.ledger, study.tables, study.experiments.get(RELEASED), study.tables.get("sensitivity")
        ),
        "verdicts": VERDICTS,
        "words": {word: meaning.format(radius=_radius(inputs)) for word, meaning in entry("page.words").items()},
        "study": inputs.settings,
        "evaluation": say(
            "page.evaluation", episodes=f"{inputs.settings['evaluation']['episodes']:,}", radius=_radius(inputs)
        ),
        "asked": " ".join(headed(inputs, MAIN).values()),
        "settings": settings_grid(inputs.settings, set(cells["protocol"])),
        "departures": departures_grid(inputs.settings),
        "grid": study_grid(cells),
        "pictures": drawn,
        "charts": charts,
        "chart_notes": {} if "seed_curves" in study.tables else {"figure_1": say("page.charts_no_seeds")},
        "charts_code": Markup(interactive.code()) if charts else "",
        "further": further,
        "experiments": [
            study_sections.section(
                name,
                tables,
                study.training_logs,
                study.tables.get("correlation"),
                study.every_published,
                headed(inputs, name),
            )
            for name, tables in study.experiments.items()
        ],
        "tables": tables,
        "sentences": _sentences(inputs),
        "controllers": controllers_grid(study.tables.get("controllers"), inputs.protocol),
        "videos": videos,
        "notebooks": ", ".join(f"[{_words(path.stem)}]({NOTEBOOKS}/{path.name})" for path in inputs.notebooks),
        "computation": computation.grid(inputs.manifests),
        "settings_hash": inputs.settings_hash,
        "limits": entry("page.limits"),
        "references": entry("page.references"),
        "sortable": Markup(SORTABLE.read_text(encoding="utf-8")),
        "arm_script": Markup(arm.SCRIPT.read_text(encoding="utf-8")),
        "script_words": {name: say(f"page.{name}") for name in ("filter", "enlarge", "shrink")},
    }


def headed(inputs: Inputs, study: str) -> dict[str, str]:
    """Title and question of a study, as far as they are known."""
    own = inputs.headings.get(study, {})
    return {name: own[name] for name in ("title", "question") if own.get(name)}


def _words(name: str) -> str:
    return name.replace("_", " ")


def _radius(inputs: Inputs) -> str:
    return f"{1000 * inputs.settings['evaluation']['radius']:g}"


def sort_key(text: str) -> str:
    """What a column of numbers is sorted by: the first number of an entry; nothing where there is none."""
    found = re.match(r"[<>]?\s*(\N{MINUS SIGN}?[\d.,]+(?:e\d+)?)", text)
    return found[1].replace("\N{MINUS SIGN}", "-").replace(",", "") if found else ""


def csv_uri(grid: Grid) -> str:
    """A table's rows as a CSV file within the page."""
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    writer.writerows([grid.headings, *grid.rows])
    content = grid.csv or buffer.getvalue()
    return f"data:text/csv;charset=utf-8;base64,{base64.b64encode(content.encode()).decode()}"


def _tables(cells: pd.DataFrame, inputs: Inputs) -> dict[str, dict[str, Any]]:
    """The tables with titles and captions: the paper's three, our measures, and those whose tables are there."""
    tables, published, protocol = inputs.study.tables, inputs.study.published, inputs.protocol
    runs = of_protocol(tables["runs"], protocol)
    grids = {
        "table_1": of_table(paper_tables.table_1(cells, published)),
        "table_2": of_table(paper_tables.table_2(cells, published)),
        "table_3": of_table(paper_tables.table_3(cells, published)),
        "behaviour": of_table(paper_tables.behaviour(cells)),
        "learning": of_table(paper_tables.learning(cells, runs)),
    }
    if "scores" in tables:
        grids["robust"] = of_table(paper_tables.robust(tables["scores"], protocol))
    if "power" in tables:
        grids["power"] = seed_uncertainty.power_grid(tables["power"], protocol)
    if "variance" in tables:
        grids["variance"] = seed_uncertainty.variance_grid(tables["variance"], protocol)
    if "winners" in tables:
        grids["winners"] = seed_uncertainty.winners_grid(tables["winners"])
    if "spread" in tables:
        grids["spread"] = seed_uncertainty.spread_grid(tables["spread"], published)
    if "peers" in tables:
        grids["peer_table"] = of_table(peer_table(tables["peers"], cells, tables.get("controllers"), protocol))
    return {
        name: {"title": captions.title(name), "caption": captions.caption(name, cells, runs), "grid": grid}
        for name, grid in grids.items()
    }


def _sentences(inputs: Inputs) -> dict[str, str]:
    """What the tables that are there say, in a sentence each."""
    tables, said = inputs.study.tables, {}
    if "power" in tables:
        said["power"] = seed_uncertainty.power_sentence(tables["power"], inputs.protocol)
    if "variance" in tables:
        said["variance"] = seed_uncertainty.variance_sentence(tables["variance"], inputs.protocol)
    if "winners" in tables:
        said["winners"] = seed_uncertainty.winners_sentence(tables["winners"])
    if "peers" in tables:
        said["peers"] = budgets_sentence(tables["peers"])
    return said


def _figure(owner: str, view: str, path: Path, inputs: Inputs) -> pictures.Picture:
    study = inputs.study
    title = captions.title(view, owner)
    if owner == MAIN:
        caption = captions.caption(view, study.tables["cells"], study.tables["runs"], inputs.protocol)
    else:
        caption = study_sections.caption(view, study.experiments[owner], study.training_logs)
    alternative = f"{title}. {caption.split('. ')[0].rstrip('.')}."
    name = outputs.stem(owner, view)
    return pictures.Picture(name, title, caption, alternative, pictures.data_uri(path), sources(owner, view))


def budgets_sentence(peers: pd.DataFrame) -> str:
    """Which algorithm had how many environment steps and seeds."""
    parts = [
        f"{ALGORITHMS.get(name, name)} {budget_label(int(budget))} ({len(own)} seed{'s' if len(own) != 1 else ''})"
        for (name, budget), own in by_algorithm(peers)
    ]
    return say("computation.budgets", budgets=", ".join(parts))
