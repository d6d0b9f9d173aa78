"""What the jobs of a study take: from their steps, the work of a step and the rates of one core (docs/cost.md)."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Any

from reacher_shaping.settings.cell import PPO, Cell
from reacher_shaping.settings.parts import Evaluation

EPISODE_STEPS = 50
"""Of Reacher and FetchReach; a task's record says so too, but would load the simulation. Pusher's 100 count as 50."""

MODES = 2
"""Every run is evaluated twice, stochastic and deterministic."""

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


def work(ppo: PPO) -> float:
    """Return the work of one environment step of training, 1 with the paper's settings.

    A sixth of it is the simulation, the rest the updates, which grow with epochs, networks, their width and the number
    of minibatches. Fitted to the core minutes of the reference run's studies, for estimates and nothing else.
    """
    trunks, width, minibatches = 0.65 + 0.35 * ppo.towers, max(1.0, ppo.hidden_units / 64), 64 / ppo.minibatch_size
    return 0.16 + 0.84 * ppo.epochs / 10 * trunks * width * (0.5 + 0.5 * minibatches)


def training_seconds(cell: Cell, seeds: int, rates: Rates) -> float:
    """Return the seconds of one core that a block of `seeds` runs trains."""
    ppo: PPO = cell.protocol.ppo
    return rates.start + seeds * cell.iterations * ppo.rollout_steps * work(ppo) / rates.training


def evaluation_seconds(evaluation: Evaluation, seeds: int, rates: Rates) -> float:
    """Return the seconds of one core that the evaluation of `seeds` runs takes."""
    return rates.start + seeds * MODES * evaluation.episodes * EPISODE_STEPS / rates.evaluation


def measured_rates(results: Path, reference: Path) -> Rates:
    """Return the rates of the blocks under `results`, else of the manifest of a reference run, else a guess."""
    found = {path.parent: _read(path) for path in results.glob("*/*/*/*/*/manifest.json")}
    records = list(found.values())
    training = _rate((record, work(_ppo(record))) for record in records if "settings" in record)
    evaluation = _rate((record.get("evaluation", {}), 1.0) for record in records)
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


def _ppo(record: Mapping[str, Any]) -> PPO:
    return Cell.model_validate_json(json.dumps(record["settings"]["cell"])).protocol.ppo


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
