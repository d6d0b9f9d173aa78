"""Titles and captions of figures and tables; what numbers they hold come from the table of cells."""

import pandas as pd

from reacher_shaping.analysis.learning_curves import BURN_IN, WINDOW
from reacher_shaping.analysis.runs import LEARNED
from reacher_shaping.labels import in_groups, of_protocol
from reacher_shaping.report.text import say
from reacher_shaping.settings.study import MAIN

# What to say of runs that diverged (`diverged` in the file of words), and the groups of cells whose runs it counts.
_MAIN, _APPENDIX = ("main",), ("appendix",)
_ALL = (*_MAIN, *_APPENDIX, "extra")
DIVERGED = {
    "figure_1": (_MAIN, "curves"),
    "figure_4": (_APPENDIX, "curves"),
    "figure_2": (_ALL, "bars"),
    "seed_strip": (_ALL, "strip"),
    "table_2": (_MAIN, "tables"),
    "table_3": (_APPENDIX, "tables"),
    "behaviour": (_ALL, "tables"),
    "learning": (_ALL, "tables"),
}


def title(stem: str, study: str = MAIN) -> str:
    """`figure_1` as `Figure 1. Training curves`; a figure the paper does not have is named without a number.

    `stem` is a figure or table of the main study, or a view of another. Raises KeyError where the file of words has no
    title for it.
    """
    if study != MAIN:
        return say("study_figure", title=say(f"views.{stem}.title"), study=study.replace("_", " "))
    kind, _, number = stem.partition("_")
    name = say(f"titles.{stem}")
    return f"{kind.capitalize()} {number}. {name}" if kind in ("figure", "table") and number.isdigit() else name


def caption(stem: str, cells: pd.DataFrame, runs: pd.DataFrame | None = None, protocol: str | None = None) -> str:
    """The caption of a figure or table of the main study, with the counts of seeds and episodes found in the tables.

    Raises KeyError where the file of words has none.
    """
    ours = of_protocol(cells, protocol)
    episodes = sorted(runs["episodes"].unique()) if runs is not None else []
    text = say(
        f"captions.{stem}",
        seeds=_count(sorted(ours["seeds"].unique()), "seed"),
        episodes=" to ".join(f"{count:,}" for count in (episodes[:1] + episodes[1:][-1:])) or "the",
        interval=" or ".join(sorted(ours["interval"].unique())),
        window=WINDOW,
        learned=f"{100 * LEARNED:g} %",
        burn_in=f"{100 * BURN_IN:g} %",
    )
    return f"{text} {_divergence(stem, ours)}".strip()


def _divergence(stem: str, cells: pd.DataFrame) -> str:
    """A sentence on the runs behind a figure or table that diverged; nothing where none did."""
    groups, text = DIVERGED.get(stem, ((), ""))
    shown = in_groups(cells, groups)
    count = int(shown["diverged"].sum())
    return say(f"diverged.{text}", count=count, runs=int(shown["seeds"].sum())) if count else ""


def _count(numbers: list[int], noun: str) -> str:
    """`10 seeds`, `1 seed`, `1 to 10 seeds`."""
    if not numbers:
        return f"no {noun}"
    span = f"{numbers[0]}" if len(numbers) == 1 else f"{numbers[0]} to {numbers[-1]}"
    return f"{span} {noun}{'' if numbers[-1] == 1 else 's'}"
