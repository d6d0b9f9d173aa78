"""The further studies in the report: for each, what it asks, sentences and tables from its files, and its figures.

Every number comes from the experiment's tables; here they are only chosen, rounded and put into words.
"""

import base64
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import pandas as pd

from reacher_shaping import experiment_figures, grids, tables, views
from reacher_shaping.experiment_figures import KINDS, protocol_label, switch_label
from reacher_shaping.grids import Grid, of_table
from reacher_shaping.learning import WINDOW
from reacher_shaping.style import budget_label, cell_order, number, of_protocol, setting_label, to_bytes, variant_label

LEVEL = 0.05
TITLES = {
    "released": "The study as the released code computes it",
    "attribution": "What each departure does",
    "standard": "Does shaping help once PPO works?",
    "tuned": "How good can it get?",
    "ablation": "What made the difference",
}
INTROS = {
    "released": "The text and the code released with it differ in a few places, as easily happens: the weight of the "
    "control cost (D1), an axis too many that pairs every new probability of a minibatch with every old one (D2), a "
    "recursion whose carry is not stored, so that advantages look one step ahead (D3), a learning rate that changes "
    "with a late commit (D4), a log of the shaped return over the last ten episodes (D5), the potential under a decay "
    "(D6), and a start weight α₀ that is a label: every run starts at 1 (D7). Here the cells of Table 2 are trained as "
    "that code trains them, labels as published; the runs labelled 0.5 have the late commit's learning rate and, where "
    "their weight decays, its potential L2².",
    "attribution": "Both ends and, between them, every switch alone from the text, and taken back alone from the "
    "release. If switches acted independently, the two would agree.",
    "standard": "The same variants under settings that are usual for PPO on this task: a network each for policy and "
    "value, orthogonal first weights, clipped actions, values bootstrapped at the time limit, no entropy bonus.",
    "tuned": "Settings of PPO and shaping that a search on seeds of its own found, trained on fresh seeds, with and "
    "without the shaping.",
    "ablation": "From usual settings to the tuned ones, both shaped, and the tuned ones with each part of the change "
    "taken back.",
}
SHORT = {"success_rate": "success", "unit_return": "return", "final_distance": "distance"}
METRICS = ("success_rate", "unit_return", "final_distance")
NAMES = {
    "success_rate": "Success, any step",
    "final_success_rate": "Success, last step",
    "mean_return": "Mean return",
    "final_distance": "Distance at the last step (mm)",
    "deterministic_success_rate": "Success, any step, mean action",
    "deterministic_final_success_rate": "Success, last step, mean action",
    "deterministic_mean_return": "Mean return, mean action",
    "deterministic_final_distance": "Distance at the last step, mean action (mm)",
    "unit_return": "Mean return at control weight 1",
    "area_under_curve": "Mean return while training",
}
PAIRS = {
    ("alpha0", "mean_return"): "r(α₀, return)",
    ("success_rate", "mean_return"): "r(success, return)",
    ("success_rate", "budget"): "r(success, budget)",
}
DASH = "\N{EN DASH}"


@dataclass(frozen=True)
class Section:
    """One experiment: anchor, title, introduction, sentences, tables by caption, and names of its figures."""

    name: str
    title: str
    intro: str
    sentences: list[str]
    grids: dict[str, Grid]
    figures: list[str]


def section(
    name: str,
    given: Mapping[str, pd.DataFrame],
    training_logs: pd.DataFrame,
    main: pd.DataFrame | None = None,
) -> Section:
    """What the report says of one experiment.

    `given` are its tables by name (`experiments.SCHEMAS`), `training_logs` the published logs' summaries, and `main`
    the main study's correlations.
    """
    said, found = [], {}
    keys = [{str(name): value for name, value in row.items()} for row in given["cells"].to_dict("records")]
    shown = views.views(keys, switches="effects" in given)
    if "effects" not in shown:
        said.append(best_sentence(given["cells"]))
    if "effects" in shown:
        said.append(effects_sentence(given["effects"]))
        found[
            "What each switch does, mean over seeds [95 % interval]; p is Holm-corrected over the rows of one kind of "
            "effect"
        ] = effects_grid(given["effects"])
    if "correlation" in shown:
        said.append(correlation_sentence(given["correlation"]))
        found["Pearson's correlation over cells [95 % bootstrap interval], and its range over studies of one seed"] = (
            correlation_grid(given["correlation"], main)
        )
    if "log" in shown:
        found[
            f"What the protocol's own log shows while training, its moving average over {WINDOW} iterations, mean over "
            "seeds [least, greatest]; the last column is the standard deviation of the torques at the end. Below, "
            "published runs of the same cells"
        ] = logs_grid(given["logs"], training_logs)
    if "agreement" in given:
        said.append(agreement_sentence(given["agreement"]))
        found["Beside Stable-Baselines3 with the same settings: means, and Welch's interval of the difference"] = (
            agreement_grid(given["agreement"])
        )
    shaped = given["comparisons"][given["comparisons"]["family"] == "none"]
    if "effects" not in shown and len(shaped):
        said.append(shaping_sentence(shaped))
        found["Paired differences to none, mean over seeds [95 % interval]; p is Holm-corrected over a column"] = (
            shaping_grid(shaped)
        )
    found["Every cell, mean over seeds [95 % interval]"] = cells_grid(given["cells"])
    title = TITLES.get(name, protocol_label(name).capitalize())
    figures = [f"{name}_{view}" for view in shown]
    return Section(name, title, INTROS.get(name, ""), [text for text in said if text], found, figures)


def document(
    given: Mapping[str, Mapping[str, pd.DataFrame]], training_logs: pd.DataFrame, main: pd.DataFrame | None = None
) -> str:
    """All experiments for a notebook, in Markdown with their figures in it; empty where there are none."""
    parts: list[str] = []
    for name, own_tables in given.items():
        own = section(name, own_tables, training_logs, main)
        parts += [f"## {own.title}", own.intro, *own.sentences]
        for figure in own.figures:
            drawn = experiment_figures.draw(figure.removeprefix(f"{name}_"), own_tables, training_logs)
            picture = base64.b64encode(to_bytes(drawn, "svg")).decode()
            parts.append(f'<img alt="{figure}" src="data:image/svg+xml;base64,{picture}">')
        parts += [f"{caption}:\n\n{grids.to_markdown(grid)}" for caption, grid in own.grids.items()]
    return "\n\n".join(part for part in parts if part)


def within(heading: str) -> str:
    """A heading as it stands within a sentence."""
    return heading[0].lower() + heading[1:]


def decimals(metric: str) -> tuple[int, float]:
    """Decimals of a measure, and the factor it is shown with: distances in mm."""
    return (1, 1000.0) if metric.endswith("distance") else (2, 1.0) if metric.endswith("return") else (3, 1.0)


def _interval(row: Mapping[Any, Any], name: str, low: str, high: str, digits: int, factor: float = 1.0) -> str:
    """A number with its limits, from three columns of a row."""
    if pd.isna(row[name]):
        return DASH
    text = number(factor * row[name], digits)
    if pd.isna(row[low]):
        return text
    return f"{text} [{number(factor * row[low], digits)}, {number(factor * row[high], digits)}]"


def _p(value: float) -> str:
    return DASH if pd.isna(value) else "< 0.001" if value < 0.001 else number(value, 3)


def best_sentence(cells: pd.DataFrame) -> str:
    """The cell with the highest success rate, and what it reaches at the last step."""
    row = cells.sort_values("success_rate", ascending=False).iloc[0].to_dict()
    name = f"{protocol_label(row['protocol'])}, {variant_label(row['variant'])}"
    texts = [
        f"{within(NAMES[metric])} {_interval(row, metric, f'{metric}_low', f'{metric}_high', *decimals(metric))}"
        for metric in ("success_rate", "final_success_rate", "mean_return")
    ]
    setting = setting_label(int(row["budget"]), row["alpha0"])
    return f"The cell with the highest success rate is {name} ({setting}): {'; '.join(texts)}."


def effects_grid(effects: pd.DataFrame) -> Grid:
    """A row per switch, variant and kind of effect; for each measure the difference and its corrected p."""
    rows = []
    kinds = {**KINDS, "interaction": "last less alone"}
    for (switch, variant, kind), own in effects.groupby(["switch", "variant", "effect"], sort=False):
        by_metric = {str(row["metric"]): row for row in own.to_dict("records")}
        first = next(iter(by_metric.values()))
        entries = [switch_label(first), variant_label(str(variant)), kinds[str(kind)]]
        for metric in METRICS:
            row, (digits, factor) = by_metric[metric], decimals(metric)
            entries += [_interval(row, "difference", "ci_low", "ci_high", digits, factor), _p(row["p_holm"])]
        rows.append((list(dict.fromkeys(effects["switch"])).index(switch), entries))
    headings = ["Switch", "Variant", "Effect"]
    headings += [text for metric in METRICS for text in (NAMES[metric], "p")]
    return Grid(headings, [entries for _, entries in sorted(rows, key=lambda row: row[0])], frozenset({0, 1, 2}))


def effects_sentence(effects: pd.DataFrame) -> str:
    """Which switch moves each measure most, and where switches interact beyond chance."""
    parts = []
    for metric in METRICS:
        digits, factor = decimals(metric)
        single = effects[(effects["metric"] == metric) & effects["effect"].isin(["alone", "last"])]
        single = single.dropna(subset="difference")
        if single.empty:
            continue
        row = single.iloc[int(single["difference"].abs().to_numpy().argmax())].to_dict()
        parts.append(
            f"{within(NAMES[metric])}: {switch_label(row)} "
            f"({variant_label(row['variant'])}, {KINDS[row['effect']]}), "
            f"{_interval(row, 'difference', 'ci_low', 'ci_high', digits, factor)}"
        )
    text = f"The largest effect of one switch on each measure: {'; '.join(parts)}." if parts else ""
    found = effects[(effects["effect"] == "interaction") & (effects["p_holm"] < LEVEL)]
    if not (effects["effect"] == "interaction").any():
        return text
    found = found[found["metric"].isin(METRICS)]
    if found.empty:
        return f"{text} No switch's effect depends on the others beyond chance."
    parts = []
    for switch, own in found.groupby("switch"):
        parts.append(
            f"{protocol_label(str(switch))} ({', '.join(dict.fromkeys(SHORT[name] for name in own['metric']))})"
        )
    return f"{text} What a switch does depends on the others beyond chance for {', '.join(parts)}."


def correlation_grid(correlation: pd.DataFrame, main: pd.DataFrame | None = None) -> Grid:
    """A row per pair of the paper: published, over the same cells and over all of the study, single seeds.

    The last column is the main study's, whose start weights are what they say.
    """
    rows = []
    for (x, y), name in PAIRS.items():
        own = correlation[(correlation["method"] == "pearson") & (correlation["x"] == x) & (correlation["y"] == y)]
        by_level = {row["level"]: row for row in own.to_dict("records")}
        seeds = own[own["level"].str.startswith("seed")]["r"].dropna()
        span = f"{number(seeds.min(), 2)} to {number(seeds.max(), 2)}" if len(seeds) else DASH
        texts = [
            _interval(by_level[level], "r", "ci_low", "ci_high", 2) if level in by_level else DASH
            for level in ("published", "cells", "cells_all")
        ]
        rows.append([name, *texts, span, _main_correlation(main, x, y)])
    headings = ["", "Published", "Over the same cells", "over all of them", "One seed a cell, range"]
    return Grid([*headings, "The text's protocol, true α₀"], rows)


def _main_correlation(main: pd.DataFrame | None, x: str, y: str) -> str:
    if main is None:
        return DASH
    ours = of_protocol(main, None)
    ours = ours[(ours["method"] == "pearson") & (ours["level"] == "cells") & (ours["x"] == x) & (ours["y"] == y)]
    return _interval(ours.iloc[0].to_dict(), "r", "ci_low", "ci_high", 2) if len(ours) else DASH


def correlation_sentence(correlation: pd.DataFrame) -> str:
    """The paper's strongest correlation beside ours."""
    own = correlation[(correlation["method"] == "pearson") & (correlation["x"] == "alpha0")]
    by_level = {row["level"]: row for row in own[own["y"] == "mean_return"].to_dict("records")}
    theirs, ours = (_interval(by_level[level], "r", "ci_low", "ci_high", 2) for level in ("published", "cells"))
    return (
        f"With the published labels, the start weight and the mean return of these cells correlate at {ours}; "
        f"published {theirs}. No run behind it has a start weight other than 1."
    )


def logs_grid(logs: pd.DataFrame, training_logs: pd.DataFrame) -> Grid:
    """A row per cell, and a row per published log of one of them."""

    def span(values: "pd.Series[float]", digits: int) -> str:
        low, mean, high = (number(value, digits) for value in (values.min(), values.mean(), values.max()))
        return f"{mean} [{low}, {high}]"

    rows = []
    groups = logs.groupby(["protocol", "variant", "budget", "alpha0"], sort=False)
    ordered = sorted(groups, key=lambda group: (group[1]["protocol"].iloc[0], cell_order(group[1].iloc[0].to_dict())))
    for _, own in ordered:
        cell = own.iloc[0].to_dict()
        texts = [span(own[name], digits) for name, digits in LOGGED.items()]
        texts.append(span(own["action_std"], 2))
        setting = setting_label(int(cell["budget"]), cell["alpha0"])
        rows.append([protocol_label(cell["protocol"]), variant_label(cell["variant"]), setting, *texts])
    keys = ["protocol", "variant", "budget"]
    cells = set(logs.loc[logs["alpha0"] == 1, keys].itertuples(index=False, name=None))
    for run in training_logs.to_dict("records"):
        if tuple(run[name] for name in keys) not in cells:
            continue
        texts = [number(run[name], digits) for name, digits in LOGGED.items()]
        setting = budget_label(int(run["budget"]))
        std = f"{number(run['std_1'], 2)} and {number(run['std_2'], 2)}"
        rows.append([f"published, {run['run']}", variant_label(str(run["variant"])), setting, *texts, std])
    headings = ["Protocol", "Variant", "Budget, label", "Iteration of the peak", "Peak", "End", "Deviation at the end"]
    return Grid(headings, rows, frozenset({0, 1, 2}))


LOGGED = {"peak_iteration": 0, "peak_return": 1, "final_return": 1}


def agreement_grid(agreement: pd.DataFrame) -> Grid:
    """A row per measure: ours, theirs, the difference with its interval, p."""
    rows = []
    for row in agreement.to_dict("records"):
        digits, factor = decimals(row["metric"])
        means = [number(factor * row[name], digits) for name in ("ours", "theirs")]
        difference = _interval(row, "difference", "ci_low", "ci_high", digits, factor)
        rows.append([NAMES[row["metric"]], *means, difference, _p(row["p"]), _p(row["p_holm"])])
    return Grid(["Measure", "Ours", "Stable-Baselines3", "Difference", "p (Welch)", "p (Holm)"], rows)


def agreement_sentence(agreement: pd.DataFrame) -> str:
    """Whether the two implementations differ beyond chance."""
    apart = agreement[agreement["p_holm"] < LEVEL]
    seeds = f"{agreement['our_seeds'].max():.0f} seeds beside {agreement['their_seeds'].max():.0f}"
    if apart.empty:
        return f"None of {len(agreement)} measures differs from Stable-Baselines3's beyond chance ({seeds})."
    names = ", ".join(within(NAMES[name]) for name in apart["metric"])
    return (
        f"{len(apart)} of {len(agreement)} measures differ from Stable-Baselines3's beyond chance ({seeds}): {names}."
    )


SHAPING = ("success_rate", "final_success_rate", "mean_return", "final_distance", "area_under_curve")


def shaping_grid(shaped: pd.DataFrame) -> Grid:
    """A row per shaped cell: its paired difference to `none` in each measure, with the corrected p."""
    rows = []
    ordered = sorted(shaped.to_dict("records"), key=lambda row: (row["protocol"], cell_order(row)))
    by_cell: dict[tuple[Any, ...], dict[str, dict[Any, Any]]] = {}
    for row in ordered:
        key = (row["protocol"], row["variant"], row["budget"], row["alpha0"])
        by_cell.setdefault(key, {})[row["metric"]] = row
    for (protocol, variant, budget, alpha0), own in by_cell.items():
        entries = [protocol_label(protocol), variant_label(variant), setting_label(int(budget), alpha0)]
        for metric in SHAPING:
            digits, factor = decimals(metric)
            entries.append(_interval(own[metric], "difference", "ci_low", "ci_high", digits, factor))
            entries.append(_p(own[metric]["p_holm"]))
        rows.append(entries)
    headings = ["Protocol", "Variant", "Budget, α₀", *(text for name in SHAPING for text in (NAMES[name], "p"))]
    return Grid(headings, rows, frozenset({0, 1, 2}))


def shaping_sentence(shaped: pd.DataFrame) -> str:
    """In how many comparisons a shaped cell differs from `none` beyond chance, measure by measure."""
    family = shaped.groupby(["protocol", "metric"]).size().max()
    seeds = int(shaped["seeds"].max())
    if 2.0 ** (1 - seeds) * family > LEVEL:  # the smallest p of a sign-flip test, corrected
        return f"With {seeds} seeds no difference between {family} shaped cells and none can be told from chance."
    tested = {metric: shaped[shaped["metric"] == metric].dropna(subset="p_holm") for metric in SHAPING}
    apart = {metric: own[own["p_holm"] < LEVEL] for metric, own in tested.items()}
    better = {metric: _better(metric, own["difference"]) for metric, own in apart.items()}
    if family == 1:
        changed = [
            f"{within(NAMES[metric])} (for the {'better' if better[metric] else 'worse'})"
            for metric, own in apart.items()
            if len(own)
        ]
        same = [within(NAMES[metric]) for metric, own in apart.items() if own.empty]
        text = f"Beyond chance (Holm, 5 %) shaping changes {'; '.join(changed) or 'nothing'}"
        return f"{text}. It does not: {'; '.join(same)}." if changed and same else f"{text}."
    parts = [
        f"{within(NAMES[metric])} in {len(own)} of {len(tested[metric])}"
        + (f" ({better[metric]} for the better)" if len(own) else "")
        for metric, own in apart.items()
    ]
    return f"Shaped cells that differ from none beyond chance (Holm, 5 %): {', '.join(parts)}."


def _better(metric: str, differences: "pd.Series[float]") -> int:
    """How many differences to the baseline are improvements."""
    return int(((differences < 0) if metric.endswith("distance") else (differences > 0)).sum())


def cells_grid(cells: pd.DataFrame) -> Grid:
    """Every cell with the measures of the study's tables, protocol by protocol."""
    order = list(dict.fromkeys(cells["protocol"]))
    rows = sorted(cells.to_dict("records"), key=lambda row: (order.index(row["protocol"]), *cell_order(row)))
    frame = pd.DataFrame(rows, columns=cells.columns)
    frame["policy"] = [protocol_label(name) for name in frame["protocol"]]
    keep = ["policy", "variant", "budget", "alpha0", "seeds", "diverged"]
    keep += [f"{name}{end}" for name in tables.MEASURED for end in ("", "_low", "_high")]
    grid = of_table(frame[keep])
    return Grid(["Protocol", *grid.headings[1:]], grid.rows, grid.texts)
