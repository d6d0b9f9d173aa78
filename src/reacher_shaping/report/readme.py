"""The README's block about the reference run."""

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from reacher_shaping.report import paper_tables, study_sections
from reacher_shaping.report.summary import summary
from reacher_shaping.report.text import entry, say
from reacher_shaping.storage.reference import _spent, read_studies

_BLOCK = re.compile(r"(<!-- reference: begin -->\n).*(<!-- reference: end -->)", re.DOTALL)


def sections(kept: Path, training_logs: pd.DataFrame) -> list[study_sections.Section]:
    """Return what the report says of the further studies kept in a folder. Raises ArtifactError."""
    given = read_studies(str(path) for path in sorted(kept.glob("experiments/*/*.*")))
    order = [*(name for name in entry("studies") if name in given), *sorted(given.keys() - entry("studies"))]
    return [study_sections.section(name, given[name], training_logs) for name in order]


def headline(
    cells: pd.DataFrame,
    claims: pd.DataFrame,
    published: pd.DataFrame,
    record: Mapping[str, Any],
    figure: str,
    further: Sequence[study_sections.Section] = (),
) -> str:
    """Return the README's account of the reference run as Markdown.

    `record` comes from `manifest`; `figure` is the path of the headline figure; `further` comes from `sections`.
    """
    answered = summary(cells, claims)
    questions = [f"- {answer.question} **{answer.short}**" for answer in answered.answers]
    table = paper_tables.to_markdown(paper_tables.table_1(cells, published), say("readme.table"))
    picture = f"![{say('readme.picture')}]({figure})"
    studies = [
        f"- **{own.title.rstrip('?')}.** {' '.join(own.sentences)} {_took(record['experiments'][own.name])}"
        for own in further
    ]
    parts = [" ".join(answered.headline), "\n".join(questions), picture, table.strip()]
    parts += [say("readme.studies"), "\n".join(studies)] if studies else []
    parts.append(_facts(record))
    return "\n\n".join(parts) + "\n"


def _facts(record: Mapping[str, Any]) -> str:
    """Say in one sentence what the reference run was and what it took."""
    blocks = record["blocks"]
    seeds = sorted({seed for block in blocks for seed in block["seeds"]})
    commits = ", ".join(sorted({str(block["git"]["commit"])[:12] for block in blocks}))
    steps, hours = _spent(blocks)
    facts = say("readme.facts", seeds=len(seeds), steps=steps / 1e6, hours=hours, code=commits)
    return facts + _further_facts(record)


def _further_facts(record: Mapping[str, Any]) -> str:
    """Say what the further studies and the peers of a reference run took, each block counted once; nothing without."""
    blocks = {str(block["outputs"]): block for own in record.get("experiments", {}).values() for block in own}
    for block in record["blocks"]:
        blocks.pop(str(block["outputs"]), None)
    text = ""
    if blocks:
        steps, hours = _spent(list(blocks.values()))
        text += f" {say('readme.further', steps=steps / 1e6, hours=hours)}"
    if record.get("peers"):
        text += f" {say('readme.peers', hours=_spent(record['peers'])[1])}"
    return text


def _took(blocks: Sequence[Mapping[str, Any]]) -> str:
    """Say what the blocks of one further study took, those included that another study trained."""
    steps, hours = _spent(blocks)
    return say("readme.took", steps=steps / 1e6, minutes=60 * hours)


def put_headline(readme: str, text: str) -> str:
    """Return the README with `text` between its reference marks. Raises ValueError where the marks are missing."""
    if not _BLOCK.search(readme):
        raise ValueError("README.md: the marks <!-- reference: begin --> and <!-- reference: end --> are missing")
    return _BLOCK.sub(lambda found: f"{found[1]}{text}{found[2]}", readme)
