"""The measures as CSV, as Markdown and as a plot."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import groupby
from pathlib import Path

import cost
import matplotlib
import pandas as pd
from matplotlib.figure import Figure
from side_by_side import Measure, machine, versions
from sizes import BLOCK

from reacher_shaping.settings.study import load_study

HERE = Path(__file__).parent
TITLES = {
    "against": "Two checkouts in turns",
    "training": "Training, paper protocol",
    "first call": "Until the first iteration is done: imports apart, compilation included",
    "return": "Learning: mean return of five iterations (Stable-Baselines3 clips actions before they are charged)",
    "floor": "Training against its floor: mj_step on one hot simulation in C, each matrix product at its best",
    "evaluation": "Evaluation, stochastic",
    "jobs": "A training job in a fresh process",
    "ladder": "What each idea brings",
    "ladder gain": "Gain of each idea over the rung before it",
    "seeds per block": "Speed against seeds per block",
    "budget": "Time against budget",
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
    if folder == HERE and any(row.name == "Stable-Baselines3" for row in measures):
        page = HERE.parent / "README.md"
        page.write_text(put_sentence(page.read_text(encoding="utf-8"), readme_sentence(table)), encoding="utf-8")


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
    for part, found in groupby(sorted(measures, key=lambda row: list(TITLES).index(row.part)), lambda row: row.part):
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


def readme_sentence(table: pd.DataFrame) -> str:
    """Return what the README says of speed, from the rows of results.csv."""
    rows = table[table["part"] == "training"].set_index("name")["value"]
    machine, base = table["machine"].iloc[0], rows["Stable-Baselines3"]
    ten, native, one = (
        rows[f"{name} kernels"] for name in ("10 seeds, portable", "10 seeds, native", "1 seed, portable")
    )
    text = (
        f"Speed, on one core of this machine: {machine}. Ten seeds of the `paper` protocol train at {ten:,.0f} "
        f"environment steps/s, {ten / base:.0f} times Stable-Baselines3's PPO ({native:,.0f} with `kernels=native`), "
        f"one seed at {one:,.0f}. "
    )
    if "JAX, 10 seeds" in rows:
        jax, jax_one = rows["JAX, 10 seeds"], rows["JAX, 1 seed"]
        text += (
            f"The fastest peer, PPO compiled by JAX with the arm in closed form instead of MuJoCo, trains ten seeds at "
            f"{jax:,.0f} and one at {jax_one:,.0f}. "
        )
    return text + "All peers: [benchmarks/results.md](benchmarks/results.md)."


def put_sentence(page: str, sentence: str) -> str:
    """Return a page with the sentence between its marks."""
    return re.sub(
        r"(<!-- speed: begin -->\n).*(<!-- speed: end -->)", rf"\g<1>{sentence}\n\g<2>", page, flags=re.DOTALL
    )


def cost_table(measures: Sequence[Measure]) -> list[str]:
    """Return what studies take at the rates measured, as Markdown; nothing unless all that it needs was measured."""
    found = {(row.part, row.name): row.value for row in measures}
    names = [
        ("training", f"{BLOCK} seeds, portable kernels"),
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
    """Draw the peers, the ladder, the speed of blocks and the time of budgets, as far as they were measured."""
    rates = [row for row in measures if row.part == "training" and row.unit == "steps/s"]
    base = next((row.value for row in rates if row.name == "Stable-Baselines3"), 1.0)
    over = [replace(row, value=row.value / base, low=row.low / base, high=row.high / base) for row in rates]
    parts = {part: [row for row in measures if row.part == part] for part in TITLES} | {"training": over}
    labels = {
        "training": "steps/s over Stable-Baselines3's",
        "ladder": "steps/s over the plain loop",
        "seeds per block": "steps/s over the default block",
        "budget": "time over the shortest run",
    }
    panels = [(part, label, parts[part]) for part, label in labels.items() if parts[part]]
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
            axes.margins(x=0.15)
            for position, row in enumerate(found):
                axes.annotate(f"{row.value:.2g}", (row.high, position), xytext=(4, 0), textcoords="offset points",
                              va="center", fontsize=8)  # fmt: skip
        figure.savefig(path, metadata={"Date": None})
