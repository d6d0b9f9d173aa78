"""Timing that means something on a machine whose speed drifts: workloads take turns on one pinned core.

Every round runs every workload once, in the same order (A B A B ...), and ratios are taken within a round. Time is
CPU time of this single-threaded process, which is wall time on an idle core and does not count other people's work.
"""

import json
import os
import platform
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from importlib.metadata import distributions, version
from pathlib import Path

PACKAGES = (
    "torch", "mujoco", "gymnasium", "stable-baselines3", "numpy", "snakemake", "jax", "brax", "envpool", "sbx-rl",
)  # fmt: skip

CHECKOUT = Path(__file__).resolve().parents[1]

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


class Worker:
    """A workload in a process of its own, pinned with this one: see worker.py.

    Attributes:
        first_seconds: CPU seconds from its construction to the end of its first iteration, compilation included.
        returns: mean return of each iteration's episodes, of all its seeds.
        seconds: CPU seconds of the last iteration, its own count.
    """

    def __init__(self, name: str, seeds: int, kernels: str, quick: bool, checkout: Path = CHECKOUT) -> None:
        """Start it, of this checkout or another, and wait for its first iteration.

        Raises ImportError if it lacks a package, RuntimeError if it ends for another reason.
        """
        command = [sys.executable, str(checkout / "benchmarks" / "worker.py"), name, str(seeds), kernels]
        self._errors = tempfile.TemporaryFile("w+")  # noqa: SIM115  # it lives as long as the process
        self._process = subprocess.Popen(
            [*command, "quick" if quick else "whole"],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self._errors, text=True,
            env=os.environ | {"PYTHONPATH": str(checkout / "src")},
        )  # fmt: skip
        first = self._made()
        self.first_seconds, self.seconds, self.returns = first["seconds"], 0.0, [first["episode_return"]]

    def __call__(self) -> float:
        self._process.stdin.write("\n")
        self._process.stdin.flush()
        made = self._made()
        self.seconds = made["seconds"]
        self.returns.append(made["episode_return"])
        return made["units"]

    def _made(self) -> dict[str, float]:
        line = self._process.stdout.readline()
        if not line:
            self._errors.seek(0)
            problem = self._errors.read().strip().splitlines()[-1]
            raise (ImportError if problem.startswith("ModuleNotFoundError") else RuntimeError)(problem)
        return json.loads(line)

    def end(self) -> None:
        self._process.communicate()


def take_turns(workloads: Mapping[str, Workload], repeats: int) -> dict[str, list[float]]:
    """Return units per CPU second, a value a round, after a round to warm up."""
    rates: dict[str, list[float]] = {name: [] for name in workloads}
    for turn in range(repeats + 1):
        for name, work in workloads.items():
            begun = time.process_time()
            units = work()
            seconds = work.seconds if isinstance(work, Worker) else time.process_time() - begun
            if turn:
                rates[name].append(units / seconds)
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
    """Return the versions that decide speed, of the packages that are there."""
    installed = {distribution.name.lower().replace("_", "-") for distribution in distributions()}
    there = (f"{name} {version(name)}" for name in PACKAGES if name in installed)
    return ", ".join([f"Python {platform.python_version()}", *there])
