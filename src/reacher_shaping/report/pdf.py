"""The paper of the study: a PDF of at most ten pages in the order of a replication report, from the same data.

Typst sets it; equal data give equal bytes, since neither a date nor a font of the machine goes into it.
"""

import json
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import typst

from reacher_shaping.labels import of_protocol
from reacher_shaping.report import captions, claims_view, computation, paper_tables, seed_uncertainty, study_sections
from reacher_shaping.report.html import RELEASED, Inputs, headed
from reacher_shaping.report.markup import to_typst
from reacher_shaping.report.summary import summary
from reacher_shaping.report.text import entry, say
from reacher_shaping.report.text_tables import Grid, controllers_grid, of_table, study_grid

TEMPLATE = Path(__file__).with_name("report.typ")
Part = dict[str, Any]


def build(inputs: Inputs) -> bytes:
    """The PDF. Figures are read beside those of `inputs`, as PDF."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "main.typ").write_text(TEMPLATE.read_text(encoding="utf-8"), encoding="utf-8")
        content = contents(inputs)
        for section in content["sections"]:
            for part in section["parts"]:
                if part["kind"] == "picture":
                    (folder / part["file"]).write_bytes(Path(part.pop("path")).read_bytes())
        (folder / "data.json").write_text(json.dumps(content, ensure_ascii=False), encoding="utf-8")
        made: bytes = typst.compile(folder / "main.typ", root=folder, ignore_system_fonts=True)
        return made


def contents(inputs: Inputs) -> dict[str, Any]:
    """Everything the template sets: what stands first, then the sections with their parts."""
    study = inputs.study
    cells = of_protocol(study.tables["cells"], inputs.protocol)
    protocol = str(cells["protocol"].iloc[0]) if len(cells) else ""
    first = summary(study, inputs.protocol)
    makers = {
        "scope": _scope,
        "claims": _claims,
        "method": _method,
        "results": _results,
        "easy": _said("easy"),
        "difficult": _said("difficult"),
        "code": _code,
        "limits": _limits,
        "references": _references,
    }
    return {
        "title": say("page.title"),
        "keywords": computation.facts(cells, inputs.manifests, inputs.settings_hash, protocol),
        "facts": " · ".join(computation.facts(cells, inputs.manifests, inputs.settings_hash, protocol)),
        "toy": computation.toy(cells),
        "lead": to_typst(first.lead),
        "answers": [vars(answer) for answer in first.answers],
        "counts": first.counts,
        "sections": [{"title": say(f"pdf.sections.{name}"), "parts": make(inputs)} for name, make in makers.items()],
    }


def _text(text: str) -> Part:
    return {"kind": "text", "text": to_typst(text)}


def _list(items: Sequence[str]) -> Part:
    return {"kind": "list", "items": [to_typst(item) for item in items]}


def _table(grid: Grid, caption: str, widths: Sequence[str] | None = None) -> Part:
    columns = list(widths or ["auto"] * len(grid.headings))
    align = ["left" if place in grid.texts else "right" for place in range(len(grid.headings))]
    table = {"headings": grid.headings, "rows": grid.rows, "columns": columns, "align": align}
    return {"kind": "table", "table": table, "caption": caption}


def _picture(name: str, inputs: Inputs) -> list[Part]:
    """A figure with its caption; nothing where it was not drawn."""
    path = inputs.figures.get(name)
    if path is None:
        return []
    caption = captions.caption(name, inputs.study.tables["cells"], inputs.study.tables["runs"], inputs.protocol)
    file = path.with_suffix(".pdf")
    parts = {"kind": "picture", "file": file.name, "path": str(file), "caption": caption}
    return [parts | {"alternative": captions.title(name)}]


def _said(name: str) -> Any:
    """The maker of a section that is a list of sentences."""
    return lambda inputs: [_list(entry(f"pdf.{name}"))]


def _scope(inputs: Inputs) -> list[Part]:
    texts = [say("page.question"), say("page.formula"), say("page.question_after")]
    return [_text(" ".join(texts)), _list(summary(inputs.study, inputs.protocol).why)]


def _claims(inputs: Inputs) -> list[Part]:
    study = inputs.study
    rows = claims_view.claims(study.ledger, study.tables, study.experiments.get(RELEASED))
    if not rows:
        return [_text(say("page.claims_none"))]
    grid = Grid(
        list(entry("pdf.claims_headings")),
        [
            [row.name, row.text, row.measured, *(verdict.word or say("claim.not_run") for verdict in row.verdicts)]
            for row in rows
        ],
        frozenset(range(5)),
    )
    return [_text(say("pdf.claims")), _table(grid, say("pdf.claims_caption"), ["auto", "1fr", "auto", "auto", "auto"])]


def _method(inputs: Inputs) -> list[Part]:
    evaluation = inputs.settings["evaluation"]
    radius = f"{1000 * evaluation['radius']:g}"
    cells = of_protocol(inputs.study.tables["cells"], inputs.protocol)
    meanings = [f"*{word}*: {meaning.format(radius=radius)}" for word, meaning in entry("page.words").items()]
    parts = [
        _text(say("page.setup")),
        _table(study_grid(cells), say("page.setup_caption")),
        _list(meanings),
        _text(say("page.evaluation", episodes=f"{evaluation['episodes']:,}", radius=radius)),
    ]
    parts.append(_text(say("pdf.method")))
    grid = computation.grid(inputs.manifests)
    return [*parts, _table(grid, say("page.computation_caption"), ["auto", "1fr"])] if grid else parts


def _results(inputs: Inputs) -> list[Part]:
    study = inputs.study
    tables = study.tables
    cells = of_protocol(tables["cells"], inputs.protocol)
    parts = _picture("figure_2", inputs)
    shown = of_table(paper_tables.table_1(cells, study.published))
    parts.append(_table(shown, captions.caption("table_1", cells, tables["runs"])))
    controllers = controllers_grid(tables.get("controllers"), inputs.protocol)
    if controllers:
        parts.append(_table(controllers, say("page.controllers_caption")))
    parts += _picture("figure_1", inputs)
    said = []
    if "power" in tables:
        said.append(seed_uncertainty.power_sentence(tables["power"], inputs.protocol))
    if "winners" in tables:
        said.append(seed_uncertainty.winners_sentence(tables["winners"]))
    parts += [_text(text) for text in said]
    for name, own in study.experiments.items():
        if name != RELEASED:
            parts += _study(inputs, name, own)
    return parts


def _study(inputs: Inputs, name: str, own: Any) -> list[Part]:
    """A further study: its title, its question and what it found."""
    study = inputs.study
    section = study_sections.section(
        name, own, study.training_logs, study.tables.get("correlation"), None, headed(inputs, name)
    )
    texts = [section.intro, *section.sentences]
    return [{"kind": "heading", "text": section.title}, _text(" ".join(text for text in texts if text))]


def _code(inputs: Inputs) -> list[Part]:
    own = inputs.study.experiments.get(RELEASED)
    if own is None:
        return [_text(say("page.no_protocols"))]
    return _study(inputs, RELEASED, own)[1:]


def _limits(inputs: Inputs) -> list[Part]:
    return [_list(entry("page.limits"))]


def _references(inputs: Inputs) -> list[Part]:
    return [_list(entry("page.references"))]
