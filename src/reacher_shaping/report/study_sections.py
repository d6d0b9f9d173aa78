"""The further studies in the report: for each, what it asks, sentences and tables from its files, and its figures.

Every number comes from the experiment's tables; here they are only chosen, rounded and put into words.
"""

import base64
from collections.abc import Mapping
from dataclasses import dataclass

import pandas as pd

from reacher_shaping.analysis.comparisons import corrected, only_cell
from reacher_shaping.analysis.learning_curves import WINDOW
from reacher_shaping.figures import studies
from reacher_shaping.figures.studies import KINDS, protocol_label, switch_label
from reacher_shaping.figures.style import to_bytes
from reacher_shaping.labels import setting_label, variant_label
from reacher_shaping.report import study_tables, text_tables
from reacher_shaping.report.study_tables import METRICS, NAMES, SHAPING, decimals, interval, p_value
from reacher_shaping.report.text_tables import Grid
from reacher_shaping.settings import outputs

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
    "(D6), and a start weight α₀ that is a label: every run starts at 1 (D7). Here the published runs are trained as "
    "that code trains them, labels as published; the runs labelled 0.5 have the late commit's learning rate and, where "
    "their weight decays, its potential L2². So the appendix's runs of 500K would be those of the main table labelled "
    "0.5, number for number, and are not trained twice.",
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
    published: pd.DataFrame | None = None,
) -> Section:
    """What the report says of one experiment.

    `given` are its tables by name (`experiments.SCHEMAS`), `training_logs` the published logs' summaries, `main` the
    main study's correlations, and `published` all published runs (`paper_tables.published_cells`).
    """
    said, found = [], {}
    keys = [{str(name): value for name, value in row.items()} for row in given["cells"].to_dict("records")]
    shown = outputs.views(keys, switches="effects" in given)
    if "effects" not in shown:
        said.append(best_sentence(given["cells"]))
    if "effects" in shown:
        said.append(effects_sentence(given["effects"]))
        found[
            "What each switch does, mean over seeds [95 % interval]; p is Holm-corrected over the rows of one kind of "
            "effect"
        ] = study_tables.effects(given["effects"])
    if "correlation" in shown:
        said.append(correlation_sentence(given["correlation"]))
        found["Pearson's correlation over cells [95 % bootstrap interval], and its range over studies of one seed"] = (
            study_tables.correlation(given["correlation"], main)
        )
        if published is not None:
            found["Every published run, one seed, and ours of the same label, mean over seeds [95 % interval]"] = (
                study_tables.beside(given["cells"], published)
            )
    if "log" in shown:
        found[
            f"What the protocol's own log shows while training, its moving average over {WINDOW} iterations, mean over "
            "seeds [least, greatest]; the last column is the standard deviation of the torques at the end. Below, "
            "published runs of the same cells"
        ] = study_tables.logs(given["logs"], training_logs)
    if "agreement" in given:
        said.append(agreement_sentence(given["agreement"]))
        found["Beside Stable-Baselines3 with the same settings: means, and Welch's interval of the difference"] = (
            study_tables.agreement(given["agreement"])
        )
    shaped = given["comparisons"][given["comparisons"]["family"] == "none"]
    if "effects" not in shown and len(shaped):
        said.append(shaping_sentence(shaped))
        family = "a row" if only_cell(shaped) else "a column"
        found[f"Paired differences to none, mean over seeds [95 % interval]; p is Holm-corrected over {family}"] = (
            study_tables.shaping(corrected(shaped, SHAPING))
        )
    found["Every cell, mean over seeds [95 % interval]"] = study_tables.cells(given["cells"])
    title = TITLES.get(name, protocol_label(name).capitalize())
    figures = [f"{name}_{view}" for view in shown]
    return Section(name, title, INTROS.get(name, ""), [text for text in said if text], found, figures)


def document(
    given: Mapping[str, Mapping[str, pd.DataFrame]],
    training_logs: pd.DataFrame,
    main: pd.DataFrame | None = None,
    published: pd.DataFrame | None = None,
) -> str:
    """All experiments for a notebook, in Markdown with their figures in it; empty where there are none."""
    parts: list[str] = []
    for name, own_tables in given.items():
        own = section(name, own_tables, training_logs, main, published)
        parts += [f"## {own.title}", own.intro, *own.sentences]
        for figure in own.figures:
            drawn = studies.draw(figure.removeprefix(f"{name}_"), own_tables, training_logs)
            picture = base64.b64encode(to_bytes(drawn, "svg")).decode()
            parts.append(f'<img alt="{figure}" src="data:image/svg+xml;base64,{picture}">')
        parts += [f"{caption}:\n\n{text_tables.to_markdown(grid)}" for caption, grid in own.grids.items()]
    return "\n\n".join(part for part in parts if part)


def within(heading: str) -> str:
    """A heading as it stands within a sentence."""
    return heading[0].lower() + heading[1:]


def best_sentence(cells: pd.DataFrame) -> str:
    """The cell with the highest success rate, and what it reaches at the last step."""
    row = cells.sort_values("success_rate", ascending=False).iloc[0].to_dict()
    name = f"{protocol_label(row['protocol'])}, {variant_label(row['variant'])}"
    texts = [
        f"{within(NAMES[metric])} {interval(row, metric, f'{metric}_low', f'{metric}_high', *decimals(metric))}"
        for metric in ("success_rate", "final_success_rate", "mean_return")
    ]
    setting = setting_label(int(row["budget"]), row["alpha0"])
    return f"The cell with the highest success rate is {name} ({setting}): {'; '.join(texts)}."


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
            f"{interval(row, 'difference', 'ci_low', 'ci_high', digits, factor)}"
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


def correlation_sentence(correlation: pd.DataFrame) -> str:
    """The paper's strongest correlation beside ours."""
    own = correlation[(correlation["method"] == "pearson") & (correlation["x"] == "alpha0")]
    by_level = {row["level"]: row for row in own[own["y"] == "mean_return"].to_dict("records")}
    theirs, ours = (interval(by_level[level], "r", "ci_low", "ci_high", 2) for level in ("published", "cells"))
    return (
        f"With the published labels, the start weight and the mean return of these cells correlate at {ours}; "
        f"published {theirs}. No run behind it has a start weight other than 1."
    )


def agreement_sentence(agreement: pd.DataFrame) -> str:
    """Whether the two implementations differ beyond chance."""
    tested = agreement.dropna(subset="p_holm")
    seeds = f"{agreement['our_seeds'].max():.0f} seeds beside {agreement['their_seeds'].max():.0f}"
    if tested.empty:
        return f"Whether ours differs from Stable-Baselines3's cannot be told ({seeds})."
    apart = tested[tested["p_holm"] < LEVEL]
    if apart.empty:
        first = tested.iloc[0].to_dict()
        difference = interval(first, "difference", "ci_low", "ci_high", *decimals(first["metric"]))
        return (
            f"None of {len(tested)} measures differs from Stable-Baselines3's beyond chance ({seeds}); "
            f"the difference to its {first['algorithm'].upper()} in {within(NAMES[first['metric']])} is {difference}."
        )
    names = ", ".join(within(NAMES[name]) for name in apart["metric"])
    return f"{len(apart)} of {len(tested)} measures differ from Stable-Baselines3's beyond chance ({seeds}): {names}."


def shaping_sentence(shaped: pd.DataFrame) -> str:
    """In how many comparisons a shaped cell differs from `none` beyond chance, measure by measure."""
    measured, only = corrected(shaped, SHAPING), only_cell(shaped)
    family = measured.groupby(["protocol", "metric"]).size().max()
    seeds = int(shaped["seeds"].max())
    if (
        2.0 ** (1 - seeds) * (len(measured) if only else family) > LEVEL
    ):  # the smallest p of a sign-flip test, corrected
        cells = "the shaped cell" if only else f"{family} shaped cells"
        return f"With {seeds} seeds no difference between {cells} and none can be told from chance."
    if only:
        return _only_cell_sentence(measured)
    parts = []
    for metric in SHAPING:
        own = measured[measured["metric"] == metric].dropna(subset="p_holm")
        apart = own[own["p_holm"] < LEVEL]
        better = (apart["difference"] < 0).sum() if metric.endswith("distance") else (apart["difference"] > 0).sum()
        parts.append(
            f"{within(NAMES[metric])} in {len(apart)} of {len(own)}"
            + (f" ({better} for the better)" if len(apart) else "")
        )
    return f"Shaped cells that differ from none beyond chance (Holm, 5 %): {', '.join(parts)}."


def _only_cell_sentence(measured: pd.DataFrame) -> str:
    """What the only shaped cell of a study changes."""
    rows = measured.set_index("metric").loc[list(SHAPING)]
    changed: list[str] = []
    chance: list[str] = []
    for row in rows.reset_index().to_dict("records"):
        difference = interval(row, "difference", "ci_low", "ci_high", *decimals(row["metric"]))
        text = f"{within(NAMES[row['metric']])} {difference}, p {p_value(row['p_holm'])}"
        (changed if row["p_holm"] < LEVEL else chance).append(text)
    told = f"What shaping adds beyond chance (Holm over the measures, 5 %): {'; '.join(changed) or 'nothing'}."
    return f"{told} Not to be told from chance: {'; '.join(chance)}." if chance else told
