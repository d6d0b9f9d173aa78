"""Titles and captions of figures and tables; what numbers they hold come from the table of cells."""

import pandas as pd

from reacher_shaping.analysis.learning_curves import BURN_IN, WINDOW
from reacher_shaping.analysis.runs import LEARNED
from reacher_shaping.labels import in_groups, of_protocol

TITLES = {
    "figure_1": "Training curves",
    "figure_2": "Success rates",
    "figure_3": "Correlations",
    "figure_4": "Decay with the squared distance",
    "table_1": "The six best cells",
    "table_2": "Every cell of the main grid",
    "table_3": "Decay with the squared distance",
    "behaviour": "What the policies do",
    "learning": "How they learn",
    "power": "Seeds that the published gains take",
    "variance": "Seeds and evaluation",
    "winners": "The best cell of one seed per cell",
    "spread": "What one seed per cell reports",
    "peers": "Other algorithms",
    "peer_table": "Other algorithms in numbers",
    "seed_strip": "Every run",
    "forest": "Paired differences",
    "success_by_radius": "Success against the radius",
    "lottery": "What one seed can show",
    "long_episodes": "Longer episodes",
}
TEXTS = {
    "figure_1": "Unshaped episode return while training, mean over {seeds} per cell. Above: constant shaping, below: "
    "decayed shaping; a column per budget (environment steps) and start weight α₀. The unshaped reference none has no "
    "weight and stands with α₀ = 1. Bands are 95 % t intervals over seeds; the dashed line is the highest point of a "
    "panel's mean curves.",
    "figure_2": "Share of {episodes} evaluation episodes in which the fingertip came within the success radius at any "
    "step, mean over {seeds}; lines: {interval}. Left the main grid, right decay with the squared distance. Diamonds "
    "are the published values, each from one run.",
    "figure_3": "Pearson's correlation over the cells of the main grid: start weight, success rate, mean return and "
    "budget, with 95 % bootstrap intervals; beside it the same from the published Table 2.",
    "figure_4": "Unshaped episode return while training with decayed shaping by the squared distance, mean over "
    "{seeds} per cell. Bands and dashed line as in Figure 1.",
    "table_1": "The six cells of the main grid with the highest success rate, mean over {seeds} [{interval}], the "
    "published value beside each.",
    "table_2": "All cells of the main grid by success rate, mean over {seeds} [{interval}], the published value and "
    "rank beside each. Returns are the environment's own, without shaping.",
    "table_3": "The cells of the paper's appendix, mean over {seeds} [{interval}], the published value beside each.",
    "behaviour": "Every cell, mean over {seeds} [{interval}]. Success at the last step and the share of an episode's "
    "steps that end within the radius tell staying at the target from passing it; the step of the first hit is a mean "
    "over the episodes that have one. The return is the sum of its two parts, minus the distances and minus the "
    "control cost.",
    "learning": "Measures of the unshaped training return, mean over {seeds} [{interval}]. Steps to the threshold: "
    "environment steps until the curve has made {learned} of the way from where the unshaped agent starts to its peak, "
    "over the runs that get there; the mean return while training is the area under the curve per iteration. "
    "Smoothness is measured twice. Drop from the peak: the highest point of the curve less its last one, both of its "
    "moving average over {window} iterations, so that a single lucky iteration is no peak. Roughness: the standard "
    "deviation of the changes from one iteration to the next, divided by the mean absolute return. Changes leave out "
    "the level and slow trends; the division keeps cells with larger returns from looking rougher for that alone; the "
    "first {burn_in} of training, where the steep rise is learning and no instability, does not count.",
    "power": "Per shaped cell: the published gain in success over none at the same budget, the standard deviation of "
    "the paired differences to none over our seeds, and the power of a two-sided paired t test at 5 % to see such a "
    "gain.",
    "variance": "The variance of the success rate over the runs of a cell, in two parts, each as a standard deviation. "
    "The part of the evaluation is the binomial noise of so many episodes, an upper bound since all runs meet the "
    "same resets.",
    "winners": "How often each cell of the main grid has the highest success rate in a study with one seed per cell.",
    "spread": "Quantiles over studies with one seed per cell of what such a study reports; the last column is the "
    "published one.",
    "peers": "A dot per seed, the bar is the mean and the line its 95 % interval. The budgets differ. The controller "
    "solves the task by inverse kinematics, without learning.",
    "peer_table": "Mean over seeds [95 % interval]: of the peers a t interval, since their seeds are few, of none as "
    "in the other tables. Actions are sampled as in the paper's evaluation, in the last two columns the mean action.",
    "seed_strip": "Success rate of every run: a dot per seed, the bar is the mean and the line its interval "
    "({interval}); diamonds are the published single runs.",
    "forest": "Paired differences between variants on common seeds and the same evaluation episodes: mean and 95 % "
    "interval.",
    "success_by_radius": "Share of episodes in which the fingertip came within a given distance of the target at any "
    "step, mean over seeds with 95 % interval. The dotted line is the study's radius; dashed stands none of the same "
    "budget where a setting has none of its own.",
    "lottery": "How often each statement would have come out had the study trained one seed per cell, from "
    "resampling the runs of this study.",
    "long_episodes": "The trained policies on episodes longer than they were trained on, mean over seeds with 95 % "
    "interval. Dashed: none of the same budget where a setting has none of its own.",
}
# Figures of the further studies, by the last part of their names.
VIEWS = {
    "cells": (
        "Every run",
        "Every run of every protocol: a dot per seed, the bar is the mean and the line its 95 % interval; returns are "
        "those of each protocol's own reward. Dotted: the controller that solves the task by inverse kinematics, under "
        "that reward. An axis with returns below \N{MINUS SIGN}150 is logarithmic beyond 10.",
    ),
    "effects": (
        "What each switch does",
        "Differences on common seeds, mean and 95 % interval, filled where it leaves zero out: a switch alone from the "
        "start, as the last one to the end, and all together. Returns are taken at control weight 1, whatever a "
        "protocol trained with; their axis is logarithmic beyond 10 where they spread that far.",
    ),
    "log": (
        "Training as logged",
        "What each protocol's own log shows: mean over seeds, moving average over {window} iterations. Diamonds: peak "
        "and end of the published logs of the same cell, averaged alike. Curves that collapse leave the scale.",
    ),
    "correlation": (
        "The labels' correlations",
        "Pearson's correlation over the published cells and over these, with the labels as published and 95 % "
        "bootstrap intervals.",
    ),
    "forest": (
        "Differences to none",
        "Paired differences in success to none of the same budget, on common seeds: mean and 95 % interval.",
    ),
}
# What to say of runs that diverged, and the groups of variants whose runs it counts.
_MAIN, _APPENDIX = ("none", "constant", "decay"), ("decay_l2sq",)
_IN_CURVES = "{count} of these {runs} runs diverged: past its last finite return a run is no longer in the mean."
_IN_TABLES = "{count} of these {runs} runs diverged (see Seeds): a measure without a finite value is not in the mean."
DIVERGED = {
    "figure_1": (_MAIN, _IN_CURVES),
    "figure_4": (_APPENDIX, _IN_CURVES),
    "figure_2": ((*_MAIN, *_APPENDIX), "{count} of these {runs} runs diverged."),
    "seed_strip": (
        (*_MAIN, *_APPENDIX),
        "Crosses are the runs that diverged, {count} of {runs}; one without a value stands at the left edge.",
    ),
    "table_2": (_MAIN, _IN_TABLES),
    "table_3": (_APPENDIX, _IN_TABLES),
    "behaviour": ((*_MAIN, *_APPENDIX), _IN_TABLES),
    "learning": ((*_MAIN, *_APPENDIX), _IN_TABLES),
}


def title(stem: str) -> str:
    """`figure_1` as `Figure 1. Training curves`; a figure the paper does not have is named without a number."""
    kind, _, number = stem.partition("_")
    view = _view(stem)
    if view:
        return f"{view[0]} of the study “{stem.rpartition('_')[0].replace('_', ' ')}”"
    name = TITLES.get(stem, stem.replace("_", " ").capitalize())
    return f"{kind.capitalize()} {number}. {name}" if kind in ("figure", "table") and number.isdigit() else name


def caption(stem: str, cells: pd.DataFrame, runs: pd.DataFrame | None = None, protocol: str | None = None) -> str:
    """The caption of a figure or table, with the counts of seeds and episodes found in the tables."""
    ours = of_protocol(cells, protocol)
    episodes = sorted(runs["episodes"].unique()) if runs is not None else []
    text = (TEXTS.get(stem) or (_view(stem) or ("", ""))[1]).format(
        seeds=_count(sorted(ours["seeds"].unique()), "seed"),
        episodes=" to ".join(f"{count:,}" for count in (episodes[:1] + episodes[1:][-1:])) or "the",
        interval=" or ".join(sorted(ours["interval"].unique())),
        window=WINDOW,
        learned=f"{100 * LEARNED:g} %",
        burn_in=f"{100 * BURN_IN:g} %",
    )
    return f"{text} {_divergence(stem, ours)}".strip()


def _view(stem: str) -> tuple[str, str] | None:
    """Title and text of a further study's figure, by its name."""
    return VIEWS.get(stem.rpartition("_")[2])


def _divergence(stem: str, cells: pd.DataFrame) -> str:
    """A sentence on the runs behind a figure or table that diverged; nothing where none did."""
    groups, text = DIVERGED.get(stem, ((), ""))
    shown = in_groups(cells, groups)
    count = int(shown["diverged"].sum())
    return text.format(count=count, runs=int(shown["seeds"].sum())) if count else ""


def _count(numbers: list[int], noun: str) -> str:
    """`10 seeds`, `1 seed`, `1 to 10 seeds`."""
    if not numbers:
        return f"no {noun}"
    span = f"{numbers[0]}" if len(numbers) == 1 else f"{numbers[0]} to {numbers[-1]}"
    return f"{span} {noun}{'' if numbers[-1] == 1 else 's'}"
