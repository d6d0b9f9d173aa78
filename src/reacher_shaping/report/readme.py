"""The README's block about the reference run."""

import re
from collections.abc import Mapping, Sequence
from typing import Any

from reacher_shaping.report.loader import Study
from reacher_shaping.report.summary import summary
from reacher_shaping.report.text import say

_BLOCK = re.compile(r"(<!-- reference: begin -->\n).*(<!-- reference: end -->)", re.DOTALL)


def headline(study: Study, record: Mapping[str, Any], figure: str) -> str:
    """Return the README's account of the reference run as Markdown, in at most 150 words.

    `record` comes from `reference.manifest`; `figure` is the path of the headline figure.
    """
    first = summary(study)
    answers = [f"- {answer.question} **{answer.short}** {answer.because}" for answer in first.answers]
    picture = f"![{say('readme.picture')}]({figure})"
    return "\n\n".join(["\n".join(answers), " ".join(first.counts), picture, _facts(record)]) + "\n"


def _facts(record: Mapping[str, Any]) -> str:
    """Say in one sentence what the reference run was and which code trained it."""
    blocks = record["blocks"]
    seeds = sorted({seed for block in blocks for seed in block["seeds"]})
    every = [*blocks, *(block for study in record.get("experiments", {}).values() for block in study)]
    return say("readme.facts", seeds=len(seeds), code=_code(every))


def _code(blocks: Sequence[Mapping[str, Any]]) -> str:
    """Name the commit that blocks were trained from, or count several, and the blocks that no commit tells of.

    The manifest has the commit of each block, and the hash of its training code.
    """
    commits = {str(block["git"]["commit"])[:12] for block in blocks}
    untold = sum(block["git"]["dirty"] is not False for block in blocks)
    code = say("readme.commits", count=len(commits)) if len(commits) > 1 else commits.pop()
    return code + (say("readme.untold", count=untold, blocks=len(blocks)) if untold else "")


def put_headline(readme: str, text: str) -> str:
    """Return the README with `text` between its reference marks. Raises ValueError where the marks are missing."""
    if not _BLOCK.search(readme):
        raise ValueError("README.md: the marks <!-- reference: begin --> and <!-- reference: end --> are missing")
    return _BLOCK.sub(lambda found: f"{found[1]}{text}{found[2]}", readme)
