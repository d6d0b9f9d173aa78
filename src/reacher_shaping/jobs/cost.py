"""What the jobs of a study take: from their steps, the work of a step and the rates of one core (docs/cost.md)."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Any

from reacher_shaping.settings.cell import Cell, Protocol
from reacher_shaping.settings.parts import Evaluation

EPISODE_STEPS = {"reacher": 50, "reacher_closed_form": 50, "fetch_reach": 50, "pusher": 100}
"""Of each task; its record says so too, but would load the simulation. A task that is not here counts as Reacher."""
SIMULATION = {"reacher": 1.0, "reacher_closed_form": 0.2, "fetch_reach": 36.0, "pusher": 3.0}
"""How long a step of a task's simulation takes, that of Reacher being 1."""

MODES = 2
"""Every run is evaluated twice, stochastic and deterministic."""
LONG_STEPS = 42_500
"""Steps of one run's evaluation over long episodes, 50 of each length."""

SMALL_JOB_SECONDS = 10.0
"""Of a job that neither trains nor evaluates: mostly its imports."""


@dataclass(frozen=True)
class Rates:
    """Speed of one core: environment steps per second, and seconds before a job's first step.

    training: with the paper's settings, of which a step has the work 1. source: where the rates come from, in words.
    """

    training: float = 25_000.0
    evaluation: float = 60_000.0
    start: float = 4.0
    source: str = "a guess, nothing was measured yet"


def work(protocol: Protocol) -> float:
    """Return the work of one environment step of training, 1 with the paper's settings.

    A sixth of it is the simulation, the rest the updates, which grow with epochs, networks, their width and the number
    of minibatches. Fitted to the core minutes of the reference run's studies, for estimates and nothing else.
    """
    ppo, simulation = protocol.ppo, SIMULATION.get(protocol.environment.task, 1.0)
    trunks, width, minibatches = 0.65 + 0.35 * ppo.towers, max(1.0, ppo.hidden_units / 64), 64 / ppo.minibatch_size
    return 0.16 * simulation + 0.84 * ppo.epochs / 10 * trunks * width * (0.5 + 0.5 * minibatches)


def training_seconds(cell: Cell, seeds: int, rates: Rates) -> float:
    """Return the seconds of one core that a block of `seeds` runs trains."""
    steps = cell.iterations * cell.protocol.ppo.rollout_steps
    return rates.start + seeds * steps * work(cell.protocol) / rates.training


def evaluation_work(protocol: Protocol) -> float:
    """Return the work of one environment step of evaluation, 1 for Reacher, near half of it the simulation."""
    return 0.55 + 0.45 * SIMULATION.get(protocol.environment.task, 1.0)


def evaluation_steps(cell: Cell, evaluation: Evaluation) -> int:
    """Return the environment steps of one run's evaluation."""
    return MODES * evaluation.episodes * EPISODE_STEPS.get(cell.protocol.environment.task, EPISODE_STEPS["reacher"])


def job_seconds(rule: str, cell: Cell | None, evaluation: Evaluation, seeds: int, rates: Rates) -> float:
    """Return the seconds of one core that a job of a rule takes for `seeds` runs of a cell, None where it has none."""
    if cell is None:
        return SMALL_JOB_SECONDS
    if rule == "train_block":
        return training_seconds(cell, seeds, rates)
    steps = {"evaluate_block": evaluation_steps(cell, evaluation), "evaluate_long": LONG_STEPS}.get(rule)
    if steps is None:
        return SMALL_JOB_SECONDS
    return rates.start + seeds * steps * evaluation_work(cell.protocol) / rates.evaluation


def measured_rates(results: Path, reference: Path) -> Rates:
    """Return the rates of the blocks under `results`, else of the manifest of a reference run, else a guess."""
    found = {path.parent: _read(path) for path in results.glob("*/*/*/*/*/manifest.json")}
    records = list(found.values())
    told = [(record, _protocol(record)) for record in records if "settings" in record]
    training = _rate((record, work(protocol)) for record, protocol in told)
    evaluation = _rate((record.get("evaluation", {}), evaluation_work(protocol)) for record, protocol in told)
    if training and evaluation:
        source = f"the {len(records)} blocks in {results}"
        return Rates(training, evaluation, start=_start(results, found) or Rates.start, source=source)
    training = _rate((block, 1.0) for block in _read(reference).get("blocks", []))
    return Rates(training, source="the reference run, on its machine") if training else Rates()


def _start(results: Path, records: Mapping[Path, Mapping[str, Any]]) -> float:
    """Median seconds of a training job, by Snakemake's benchmark of it, that its own record does not count.

    0 without a benchmark, or where most jobs went on from a checkpoint, so that their records count more than one job.
    """
    beside = []
    for folder, record in records.items():
        benchmark = results / "benchmarks" / folder.relative_to(results) / "train.tsv"
        if benchmark.exists() and "wall_seconds" in record:
            job = float(benchmark.read_text(encoding="utf-8").splitlines()[1].split("\t")[0])
            beside.append(job - record["wall_seconds"])
    return max(0.0, median(beside)) if beside else 0.0


def _protocol(record: Mapping[str, Any]) -> Protocol:
    return Cell.model_validate_json(json.dumps(record["settings"]["cell"])).protocol


def _rate(records: Iterable[tuple[Mapping[str, Any], float]]) -> float:
    """Steps of work per second over all records; 0 where none tells."""
    told = [
        (record["env_steps"] * work, record["wall_seconds"]) for record, work in records if "wall_seconds" in record
    ]
    return sum(steps for steps, _ in told) / sum(seconds for _, seconds in told) if told else 0.0


def _read(path: Path) -> Mapping[str, Any]:
    """A record, or an empty one where there is none that can be read: an estimate does without."""
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return content if isinstance(content, Mapping) else {}
