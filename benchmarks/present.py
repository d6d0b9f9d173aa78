"""The measures as CSV, as Markdown and as a plot."""

from collections.abc import Mapping, Sequence
from itertools import groupby
from pathlib import Path

import cost
import matplotlib
import pandas as pd
from matplotlib.figure import Figure
from side_by_side import Measure, machine, versions

from reacher_shaping.settings.study import load_study

BLOCK = 10
"""Seeds of the block whose rates the cost of a study is reckoned with."""

TITLES = {
    "training": "Training, paper protocol",
    "floor": "Training against its floor: its own mj_step calls and matrix products, alone",
    "evaluation": "Evaluation, stochastic",
    "jobs": "A training job in a fresh process",
    "ladder": "What each idea brings",
    "ladder gain": "Gain of each idea over the rung before it",
    "seeds per block": "Cost against seeds per block",
    "budget": "Cost against budget",
    "workflow": "Planning the workflow",
}


def write(folder: Path, measures: Sequence[Measure], facts: Mapping[str, object]) -> None:
    """Write results.csv, results.md and results.svg into `folder`."""
    folder.mkdir(parents=True, exist_ok=True)
    table = pd.DataFrame([found.row() for found in measures])
    table = table.assign(machine=machine(), threads=1, versions=versions())
    table.to_csv(folder / "results.csv", index=False, float_format="%.6g")
    (folder / "results.md").write_text(markdown(measures, facts), encoding="utf-8")
    draw(measures, folder / "results.svg")


def markdown(measures: Sequence[Measure], facts: Mapping[str, object]) -> str:
    lines = [
        "# Speed, side by side",
        "",
        f"- Machine: {machine()}; one thread, pinned to core {facts['core']}.",
        f"- Versions: {versions()}.",
        f"- Load average when it began: {facts['load']:.1f}; took {facts['minutes']:.1f} minutes.",
        "- Workloads take turns within each part (A B A B ...), after one round to warm up; ratios are taken round by",
        "  round; the value is the median, the range goes from the smallest to the largest. Rates are per CPU second;",
        "  only a job's start is wall time.",
        *([f"- {facts['note']}"] if facts["note"] else []),
        "",
    ]
    for part, found in groupby(measures, key=lambda row: row.part):
        lines += [f"## {TITLES[part]}", "", "| measure | value | range | unit | rounds | must | aim | reached |"]
        lines += ["|---|---:|---:|---|---:|---:|---:|---|"]
        for row in found:
            targets = [f"{value:g}" if value is not None else "" for value in (row.must, row.aim)]
            spread = f"{number(row.low)} to {number(row.high)}"
            cells = [row.name, number(row.value), spread, row.unit, str(row.repeats), *targets, row.verdict]
            lines.append(f"| {' | '.join(cells)} |")
        lines.append("")
    lines += cost_table(measures)
    return "\n".join(lines)


def cost_table(measures: Sequence[Measure]) -> list[str]:
    """Return what studies take at the rates measured, as Markdown; nothing unless all that it needs was measured."""
    found = {(row.part, row.name): row.value for row in measures}
    names = [
        ("training", f"{BLOCK} seeds"),
        ("evaluation", f"{BLOCK} policies"),
        ("jobs", f"job of {BLOCK} seeds, CPU time of the start"),
    ]
    if any(name not in found for name in names):
        return []
    rates = cost.Rates(*(found[name] for name in names))
    study = load_study(Path(__file__).parents[1] / "config.yaml")
    lines = [
        "## What a study takes at these rates",
        "",
        f"Formula in docs/cost.md; the {len(study.cells)} cells of config.yaml, blocks of {BLOCK} seeds (all seeds in",
        "one block where there are fewer); the rates of one core at the time of measuring; reports left out.",
        "",
        "| cells | seeds per cell | environment steps | core hours | cores | hours |",
        "|---:|---:|---:|---:|---:|---:|",
    ]
    for seeds, cores in ((1, 2), (10, 2), (10, 64), (100, 64), (1000, 64), (1000, 2300)):
        total = cost.study(study, seeds=seeds, seeds_per_block=min(seeds, BLOCK), rates=rates)
        wall = max(total.core_seconds / cores, total.longest_job) / 3600
        core_hours = total.core_seconds / 3600
        cells = [
            str(len(study.cells)),
            str(seeds),
            f"{total.env_steps:,}",
            f"{core_hours:.3g}",
            str(cores),
            f"{wall:.3g}",
        ]
        lines.append(f"| {' | '.join(cells)} |")
    return [*lines, ""]


def number(value: float) -> str:
    return f"{value:,.0f}" if abs(value) >= 100 else f"{value:.3g}"


def draw(measures: Sequence[Measure], path: Path) -> None:
    """Draw the ladder and the cost of blocks, as far as they were measured."""
    panels = [
        (part, label, found)
        for part, label in (
            ("ladder", "steps/s over the plain loop"),
            ("seeds per block", "steps/s over the default block"),
            ("budget", "time over the shortest run"),
        )
        if (found := [row for row in measures if row.part == part])
    ]
    with matplotlib.rc_context({"svg.hashsalt": "benchmarks", "svg.fonttype": "none", "font.size": 9}):
        figure = Figure(figsize=(4 * max(1, len(panels)), 3), layout="constrained")
        for number_, (part, label, found) in enumerate(panels):
            axes = figure.add_subplot(1, len(panels), number_ + 1)
            values = [row.value for row in found]
            below = [row.value - row.low for row in found]
            above = [row.high - row.value for row in found]
            names = [row.name for row in found]
            axes.barh(names, values, xerr=[below, above], color="#0072B2", ecolor="#555555", capsize=2)
            axes.invert_yaxis()
            axes.set_xlabel(label)
            axes.set_title(TITLES[part], fontsize=9)
            for position, value in enumerate(values):
                axes.annotate(f"{value:.2g}", (0, position), xytext=(3, 0), textcoords="offset points",
                              va="center", color="white", fontsize=8)  # fmt: skip
        figure.savefig(path, metadata={"Date": None})
