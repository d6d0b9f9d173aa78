"""The further studies in the report: for each, what it asks, sentences and tables from its files, and its figures.

Every number comes from the experiment's tables; here they are only chosen, rounded and put into words.
"""

import base64
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import pandas as pd

from reacher_shaping.analysis.comparisons import corrected, only_cell
from reacher_shaping.analysis.hypotheses import TAKE_OFF_WINDOW
from reacher_shaping.analysis.learning_curves import WINDOW
from reacher_shaping.analysis.target_maps import SQUARE
from reacher_shaping.figures import drawing
from reacher_shaping.figures.studies import KINDS, protocol_label, switch_label
from reacher_shaping.figures.style import to_bytes
from reacher_shaping.labels import KEY, setting_label, variant_label
from reacher_shaping.report import study_tables, text_tables
from reacher_shaping.report.loader import Study
from reacher_shaping.report.quantities import in_words
from reacher_shaping.report.study_tables import METRICS, SHAPING, decimals, interval, p_value
from reacher_shaping.report.text import entry, say
from reacher_shaping.report.text_tables import Grid
from reacher_shaping.settings import outputs
from reacher_shaping.settings.study import MAIN

LEVEL = 0.05
DIFFERENCE = ("difference", "ci_low", "ci_high")
COLLAPSE = 1000  # a difference in return that no policy near its target can make


@dataclass(frozen=True)
class Section:
    """One experiment: anchor, title, introduction, sentences, tables by caption, and names of its figures.

    `first` are tables that answer its question and so stand before the figures.
    """

    name: str
    title: str
    intro: str
    sentences: list[str]
    grids: dict[str, Grid]
    figures: list[str]
    first: dict[str, Grid] = field(default_factory=dict)


def section(
    name: str,
    given: Mapping[str, pd.DataFrame],
    training_logs: pd.DataFrame,
    main: pd.DataFrame | None = None,
    published: pd.DataFrame | None = None,
    words: Mapping[str, str] | None = None,
) -> Section:
    """What the report says of one experiment.

    `given` are its tables by name (`storage.tables`), `words` its title and question, `training_logs` the
    published logs' summaries, `main` the main study's correlations, and `published` all published runs
    (`paper_tables.published_cells`).
    """
    said, found, first = [], {}, {}
    shown = views(name, given)
    if "hypotheses" in given:
        said += hypotheses_sentences(given["hypotheses"])
        said.append(say("study_sentences.exploratory"))
        first[say("study_tables.hypotheses")] = study_tables.hypotheses(given["hypotheses"])
    if "lengths" in given:
        said.append(lengths_sentence(given["lengths"]))
    if "effects" not in shown:
        said.append(best_sentence(given["cells"]))
    if "effects" in shown:
        said.append(effects_sentence(given["effects"]))
        found[say("study_tables.effects")] = study_tables.effects(given["effects"])
    if "lengths" in given:
        found[say("study_tables.lengths")] = study_tables.lengths(given["lengths"])
    if "correlation" in shown:
        said.append(correlation_sentence(given["correlation"]))
        found[say("study_tables.correlation")] = study_tables.correlation(given["correlation"], main)
        if published is not None:
            found[say("study_tables.beside")] = study_tables.beside(given["cells"], published)
    if "log" in shown:
        logs = study_tables.logs(given["logs"], training_logs)
        told = say("study_tables.logs", window=WINDOW)
        beside = len(logs.rows) > len(given["logs"].drop_duplicates(KEY))
        found[say("study_tables.logs_published", caption=told) if beside else told] = logs
    if "agreement" in given:
        said.append(agreement_sentence(given["agreement"]))
        found[say("study_tables.agreement")] = study_tables.agreement(given["agreement"])
    shaped = given["comparisons"][given["comparisons"]["family"] == "none"]
    if "effects" not in shown and len(shaped):
        said.append(shaping_sentence(shaped))
        family = "row" if only_cell(shaped) else "column"
        found[say(f"study_tables.shaping_{family}")] = study_tables.shaping(corrected(shaped, SHAPING))
    found[say("study_tables.cells")] = study_tables.cells(given["cells"])
    words = {"title": protocol_label(name).capitalize(), "question": "", **(words or {})}
    figures = [outputs.stem(name, view) for view in shown]
    question = words["question"]
    question += "" if question.endswith((".", "?")) or not question else "."
    return Section(name, words["title"], question, [text for text in said if text], found, figures, first)


def views(name: str, tables: Mapping[str, pd.DataFrame]) -> list[str]:
    """Names of the figures that a study with these tables has."""
    keys = [{str(key): value for key, value in row.items()} for row in tables["cells"].to_dict("records")]
    return outputs.views(name, keys, tables)


def figures_of(study: Study) -> dict[str, tuple[str, str]]:
    """The figures of all studies by the names of their files: of each its study and view."""
    studies = {MAIN: study.tables, **study.experiments}
    return {outputs.stem(name, view): (name, view) for name, own in studies.items() for view in views(name, own)}


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
        parts += [f"{caption}:\n\n{text_tables.to_markdown(grid)}" for caption, grid in own.first.items()]
        for view, figure in zip(views(name, own_tables), own.figures, strict=True):
            tables = {**own_tables, "training_logs": training_logs}
            drawn = drawing.draw(view, tables, drawing.modules_of(name))
            picture = base64.b64encode(to_bytes(drawn, "svg")).decode()
            parts.append(f'<img alt="{figure}" src="data:image/svg+xml;base64,{picture}">')
        parts += [f"{caption}:\n\n{text_tables.to_markdown(grid)}" for caption, grid in own.grids.items()]
    return "\n\n".join(part for part in parts if part)


def caption(view: str, tables: Mapping[str, pd.DataFrame], training_logs: pd.DataFrame) -> str:
    """The caption of a study's figure; of the log only what can be seen there."""
    texts = [say(f"views.{view}.caption", window=WINDOW, take_off=TAKE_OFF_WINDOW, square=f"{1000 * SQUARE:g}")]
    if view == "log":
        logged = tables["logged"]
        keys = ["protocol", "budget"]
        labelled = set(logged.loc[logged["alpha0"] == 1, keys].itertuples(index=False, name=None))
        if labelled & set(training_logs[keys].itertuples(index=False, name=None)):
            texts.append(say("views.log.published"))
        if logged["episode_return"].min() < 4 * training_logs["final_return"].min():
            texts.append(say("views.log.collapse"))
    return " ".join(texts)


def within(metric: str) -> str:
    """A measure's name as it stands within a sentence, without its unit."""
    heading = say(f"measures.{metric}").partition(" (")[0]
    return heading[0].lower() + heading[1:]


def with_unit(row: Mapping[Any, Any], metric: str, name: str, low: str, high: str) -> str:
    """A value or difference of a measure with its limits and the unit that the measure's heading gives."""
    unit = say(f"measures.{metric}").partition(" (")[2].removesuffix(")")
    if name != metric and unit == "%":
        unit = say("study_sentences.points")
    return f"{interval(row, name, low, high, *decimals(metric))}{unit and ' '}{unit}"


def hypotheses_sentences(table: pd.DataFrame) -> list[str]:
    """How many of our own hypotheses are supported, contradicted and left open; the first decided one in numbers."""
    counts = table["verdict"].value_counts()
    named = {verdict: int(counts.get(verdict, 0)) for verdict in ("supported", "contradicted", "open")}
    texts = [say("study_sentences.hypotheses", hypotheses=len(table), **named)]
    texts += [say("study_sentences.hypotheses_open")] if named["open"] else []
    row = table.iloc[int((table["verdict"] != "open").to_numpy().argmax())].to_dict()
    shown = {f"solved_{side}": round(row[f"solved_{side}"] * row["runs"]) for side in ("a", "b")}
    shown |= {end: f"{100 * row[f'{end}_a']:.1f}" for end in ("least", "greatest")}
    told = say(
        "study_sentences.hypothesis",
        claim=in_words(row["claim"]).rstrip("."),
        verdict=row["verdict"],
        difference=interval(row, "difference", "ci_low", "ci_high", 1, 100.0),
        p=p_value(row["p_holm"]),
        runs=f"{row['runs']:.0f}",
        a=study_tables.hypothesis_cell(row["a"]),
        b=study_tables.hypothesis_cell(row["b"]),
        **shown,
    )
    return [*texts, told]


def lengths_sentence(lengths: pd.DataFrame) -> str:
    """Where the tip is at the end of the longest episodes, by cell, the highest share first."""
    longest = lengths[lengths["steps"] == lengths["steps"].max()].sort_values("final_success_rate", ascending=False)
    shares = [
        say(
            "study_sentences.length",
            share=interval(
                row, "final_success_rate", "final_success_rate_low", "final_success_rate_high",
                *decimals("final_success_rate"),
            ),
            cell=f"{protocol_label(row['protocol'])}, {variant_label(row['variant'])}",
        )
        for row in longest.to_dict("records")
    ]  # fmt: skip
    return say("study_sentences.lengths", steps=int(longest["steps"].max()), shares="; ".join(shares))


def best_sentence(cells: pd.DataFrame) -> str:
    """The cell with the highest success rate, and what it reaches at the last step."""
    row = cells.sort_values("success_rate", ascending=False).iloc[0].to_dict()
    name = f"{protocol_label(row['protocol'])}, {variant_label(row['variant'])}"
    texts = [
        f"{within(metric)} {with_unit(row, metric, metric, f'{metric}_low', f'{metric}_high')}"
        for metric in ("success_rate", "final_success_rate", "mean_return")
    ]
    setting = setting_label(int(row["budget"]), row["alpha0"])
    return say("study_sentences.best", cell=name, setting=setting, measures="; ".join(texts))


def effects_sentence(effects: pd.DataFrame) -> str:
    """Which switch moves each measure most, which let returns collapse, and where switches interact beyond chance."""
    parts, collapsed = [], []
    for metric in METRICS:
        single = effects[(effects["metric"] == metric) & effects["effect"].isin(["alone", "last"])]
        single = single.dropna(subset="difference")
        beyond = (single["difference"].abs() >= COLLAPSE) & (metric == "unit_return")
        collapsed += [protocol_label(str(name)) for name in single.loc[beyond, "switch"]]
        single = single[~beyond]
        if single.empty:
            continue
        row = single.iloc[int(single["difference"].abs().to_numpy().argmax())].to_dict()
        difference = with_unit(row, metric, *DIFFERENCE)
        parts.append(
            say(
                "study_sentences.effect",
                measure=within(metric),
                switch=switch_label(row),
                variant=variant_label(row["variant"]),
                kind=KINDS[row["effect"]],
                difference=difference,
            )
        )
    text = say("study_sentences.effects", effects="; ".join(parts)) if parts else ""
    if collapsed:
        switches = ", ".join(dict.fromkeys(collapsed))
        text += f" {say('study_sentences.collapse', limit=f'{COLLAPSE:,}', switches=switches)}"
    found = effects[(effects["effect"] == "interaction") & (effects["p_holm"] < LEVEL)]
    if not (effects["effect"] == "interaction").any():
        return text
    found = found[found["metric"].isin(METRICS)]
    if found.empty:
        return f"{text} {say('study_sentences.no_interaction')}"
    parts = []
    for switch, own in found.groupby("switch"):
        measures = dict.fromkeys(entry("short_measures")[name] for name in own["metric"])
        parts.append(f"{protocol_label(str(switch))} ({', '.join(measures)})")
    return f"{text} {say('study_sentences.interaction', switches=', '.join(parts))}"


def correlation_sentence(correlation: pd.DataFrame) -> str:
    """The paper's strongest correlation beside ours."""
    own = correlation[(correlation["method"] == "pearson") & (correlation["x"] == "alpha0")]
    by_level = {row["level"]: row for row in own[own["y"] == "mean_return"].to_dict("records")}
    published, ours = (interval(by_level[level], "r", "ci_low", "ci_high", 2) for level in ("published", "cells"))
    return say("study_sentences.correlation", ours=ours, published=published)


def agreement_sentence(agreement: pd.DataFrame) -> str:
    """Whether the two implementations differ beyond chance."""
    tested = agreement.dropna(subset="p_holm")
    counts = {"ours": f"{agreement['our_seeds'].max():.0f}", "theirs": f"{agreement['their_seeds'].max():.0f}"}
    seeds = say("study_sentences.agreement_seeds", **counts)
    if tested.empty:
        return say("study_sentences.agreement_unknown", seeds=seeds)
    apart = tested[tested["p_holm"] < LEVEL]
    if apart.empty:
        first = tested.iloc[0].to_dict()
        difference = with_unit(first, first["metric"], *DIFFERENCE)
        measure, algorithm = within(first["metric"]), first["algorithm"].upper()
        return say(
            "study_sentences.agreement_none",
            measures=len(tested),
            seeds=seeds,
            algorithm=algorithm,
            measure=measure,
            difference=difference,
        )
    names = ", ".join(within(name) for name in apart["metric"])
    return say("study_sentences.agreement_some", apart=len(apart), measures=len(tested), seeds=seeds, names=names)


def shaping_sentence(shaped: pd.DataFrame) -> str:
    """In how many comparisons a shaped cell differs from `none` beyond chance, measure by measure."""
    measured, only = corrected(shaped, SHAPING), only_cell(shaped)
    if not measured["p_holm"].notna().any():
        return say("study_sentences.shaping_few")
    if only:
        return _only_cell_sentence(measured)
    parts = []
    for metric in SHAPING:
        own = measured[measured["metric"] == metric].dropna(subset="p_holm")
        apart = own[own["p_holm"] < LEVEL]
        better = (apart["difference"] < 0).sum() if metric.endswith("distance") else (apart["difference"] > 0).sum()
        text = "study_sentences.shaping_better" if len(apart) else "study_sentences.shaping_measure"
        measure = within(metric)
        parts.append(say(text, measure=measure, apart=len(apart), cells=len(own), better=better))
    return say("study_sentences.shaping", measures=", ".join(parts))


def _only_cell_sentence(measured: pd.DataFrame) -> str:
    """What the only shaped cell of a study changes."""
    rows = measured.set_index("metric").loc[list(SHAPING)]
    changed: list[str] = []
    chance: list[str] = []
    for row in rows.reset_index().to_dict("records"):
        difference = with_unit(row, row["metric"], *DIFFERENCE)
        measure, p = within(row["metric"]), p_value(row["p_holm"])
        text = say("study_sentences.only_measure", measure=measure, difference=difference, p=p)
        (changed if row["p_holm"] < LEVEL else chance).append(text)
    told = say("study_sentences.only", measures="; ".join(changed) or say("study_sentences.only_nothing"))
    return f"{told} {say('study_sentences.only_chance', measures='; '.join(chance))}" if chance else told
