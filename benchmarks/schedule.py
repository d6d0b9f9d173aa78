"""The wall time of the study on machines of any size, by list scheduling of what its blocks cost (docs/cost.md).

    python benchmarks/schedule.py [RESULTS]

Rates are those of the blocks under RESULTS, else of the reference run. A block is one job: train, then evaluate. Jobs
start in the order in which Snakemake submits them, each on the core that is free first, and not before it is submitted.
The rate is taken to be the same for every size of a block; `run.py --part scaling` measures how it grows with it.
"""

import heapq
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from reacher_shaping.jobs import cost
from reacher_shaping.settings.study import Study, load_study, read_settings

ROOT = Path(__file__).parents[1]
CORES = (1, 2, 64, 2300)
BLOCK_SIZES = (1, 2, 5, 10)
SECONDS_PER_SUBMISSION = 0.1
"""Of a queue; nothing on one computer."""


@dataclass(frozen=True)
class Schedule:
    """Seconds from the first start to the last end, and the share of the cores' time that jobs used."""

    wall: float
    efficiency: float


def simulate(seconds: Sequence[float], cores: int, seconds_per_submission: float = 0.0) -> Schedule:
    """Return the schedule of jobs that take `seconds` each, in their order."""
    free = [0.0] * min(cores, len(seconds))
    for number, taken in enumerate(seconds):
        start = max(heapq.heappop(free), number * seconds_per_submission)
        heapq.heappush(free, start + taken)
    wall = max(free)
    return Schedule(wall, sum(seconds) / (wall * cores))


def blocks(study: Study, seeds: int, size: int, rates: cost.Rates) -> list[float]:
    """Seconds of every block of the main study, with `seeds` runs a cell in blocks of `size`."""
    sizes = [min(size, seeds - first) for first in range(0, seeds, size)]
    jobs = ("train_block", "evaluate_block")
    return [
        sum(cost.job_seconds(rule, cell, study.evaluation, part, rates) for rule in jobs)
        for cell in study.cells
        for part in sizes
    ]


def main(results: Path) -> None:
    """Print a row for each number of cores, seeds and size of a block."""
    study = load_study(read_settings(ROOT / "config.yaml"))
    rates = cost.measured_rates(results, ROOT / "report/reference/manifest.json")
    print(f"Rates: {rates.training:,.0f} training and {rates.evaluation:,.0f} evaluation steps/s, {rates.source}.\n")
    print("| cores | seeds | seeds a block | jobs | wall (min) | efficiency | longest job (min) |")
    print("|---:|---:|---:|---:|---:|---:|---:|")
    for cores in CORES:
        for seeds in (study.seeds, 100):
            for size in BLOCK_SIZES:
                seconds = blocks(study, seeds, size, rates)
                found = simulate(seconds, cores, SECONDS_PER_SUBMISSION if cores > 64 else 0.0)
                row = [f"{cores:,}", seeds, size, len(seconds), f"{found.wall / 60:.1f}", f"{found.efficiency:.0%}"]
                print("| " + " | ".join(map(str, [*row, f"{max(seconds) / 60:.1f}"])) + " |")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else ROOT / "results"))
