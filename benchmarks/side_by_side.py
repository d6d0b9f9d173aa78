"""Timing that means something on a machine whose speed drifts: workloads take turns on one pinned core.

Every round runs every workload once, in the same order (A B A B ...), and ratios are taken within a round. Time is
CPU time of this single-threaded process, which is wall time on an idle core and does not count other people's work.
"""

import os
import platform
import statistics
import time
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from importlib.metadata import version
from pathlib import Path

PACKAGES = ("torch", "mujoco", "gymnasium", "stable-baselines3", "numpy", "snakemake")

Workload = Callable[[], float]
"""Does a share of work and returns how many units (mostly environment steps) it was."""


@dataclass(frozen=True)
class Measure:
    """One row of the table: median and range over the rounds."""

    part: str
    name: str
    value: float
    low: float
    high: float
    unit: str
    repeats: int
    must: float | None = None
    aim: float | None = None
    lower_is_better: bool = False

    @property
    def verdict(self) -> str:
        if self.must is None:
            return ""
        sign = -1 if self.lower_is_better else 1
        if self.aim is not None and sign * self.value >= sign * self.aim:
            return "aim"
        return "must" if sign * self.value >= sign * self.must else "missed"

    def row(self) -> dict[str, object]:
        return {**asdict(self), "verdict": self.verdict}


def pin() -> int:
    """Keep this process and its children on one core, with one thread; return the core."""
    core = max(os.sched_getaffinity(0))
    os.sched_setaffinity(0, {core})
    return core


def take_turns(workloads: Mapping[str, Workload], repeats: int) -> dict[str, list[float]]:
    """Return units per CPU second, a value a round, after a round to warm up."""
    rates: dict[str, list[float]] = {name: [] for name in workloads}
    for turn in range(repeats + 1):
        for name, work in workloads.items():
            begun = time.process_time()
            units = work()
            if turn:
                rates[name].append(units / (time.process_time() - begun))
    return rates


def ratios(numerator: list[float], denominator: list[float]) -> list[float]:
    """Return the quotients round by round."""
    return [a / b for a, b in zip(numerator, denominator, strict=True)]


def measure(part: str, name: str, values: list[float], unit: str, **targets: object) -> Measure:
    """Return the row of the values of all rounds."""
    middle = statistics.median(values)
    return Measure(part, name, middle, min(values), max(values), unit, len(values), **targets)  # type: ignore[arg-type]


def machine() -> str:
    """Return processor and number of cores, as the system tells them."""
    text = Path("/proc/cpuinfo").read_text() if Path("/proc/cpuinfo").exists() else ""
    names = [line.split(":", 1)[1].strip() for line in text.splitlines() if line.startswith("model name")]
    return f"{names[0] if names else platform.machine()}, {os.cpu_count()} cores"


def versions() -> str:
    """Return the versions that decide speed."""
    return ", ".join([f"Python {platform.python_version()}", *(f"{name} {version(name)}" for name in PACKAGES)])
