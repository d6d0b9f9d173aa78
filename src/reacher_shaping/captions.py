"""Titles and captions of figures and tables; what numbers they hold come from the table of cells."""

import pandas as pd

from reacher_shaping.style import of_protocol

TITLES = {
    "figure_1": "Training curves",
    "figure_2": "Success rates",
    "figure_3": "Correlations",
    "figure_4": "Decay with the squared distance",
    "table_1": "The six best cells",
    "table_2": "Every cell of the main grid",
    "table_3": "Decay with the squared distance",
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
    "seed_strip": "Success rate of every run: a dot per seed, the bar is the mean and the line its interval "
    "({interval}); diamonds are the published single runs.",
    "forest": "Paired differences between variants on common seeds and the same evaluation episodes: mean and 95 % "
    "interval.",
    "success_by_radius": "Share of episodes in which the fingertip came within a given distance of the target at any "
    "step, mean over seeds with 95 % interval. The dotted line is the study's radius.",
    "lottery": "How often each statement would have come out had the study trained one seed per cell, from "
    "resampling the runs of this study.",
    "long_episodes": "The trained policies on episodes longer than they were trained on, mean over seeds with 95 % "
    "interval.",
}


def title(stem: str) -> str:
    """`figure_1` as `Figure 1. Training curves`; a figure the paper does not have is named without a number."""
    kind, _, number = stem.partition("_")
    name = TITLES.get(stem, stem.replace("_", " ").capitalize())
    return f"{kind.capitalize()} {number}. {name}" if kind in ("figure", "table") and number.isdigit() else name


def caption(stem: str, cells: pd.DataFrame, runs: pd.DataFrame | None = None, protocol: str | None = None) -> str:
    """The caption of a figure or table, with the counts of seeds and episodes found in the tables."""
    ours = of_protocol(cells, protocol)
    episodes = sorted(runs["episodes"].unique()) if runs is not None else []
    return TEXTS.get(stem, "").format(
        seeds=_count(sorted(ours["seeds"].unique()), "seed"),
        episodes=" to ".join(f"{count:,}" for count in (episodes[:1] + episodes[1:][-1:])) or "the",
        interval=" or ".join(sorted(ours["interval"].unique())),
    )


def _count(numbers: list[int], noun: str) -> str:
    """`10 seeds`, `1 seed`, `1 to 10 seeds`."""
    if not numbers:
        return f"no {noun}"
    span = f"{numbers[0]}" if len(numbers) == 1 else f"{numbers[0]} to {numbers[-1]}"
    return f"{span} {noun}{'' if numbers[-1] == 1 else 's'}"
