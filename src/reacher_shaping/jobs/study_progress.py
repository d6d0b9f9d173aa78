"""The whole study's progress and time left, as one line now and then: right in a terminal, in a log, on a cluster."""

from __future__ import annotations

import re
import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

SECONDS_PER_LINE = 60.0
ITERATION = re.compile(r"iteration (\d+)/(\d+)")


@dataclass
class StudyProgress:
    """Progress by the work of the jobs, not by their number.

    seconds: the expected seconds of each job that is to run, by its name; cores: how many run at a time before any
    speed was seen. What was seen so far replaces what was expected: a busy machine or a full queue shows at once.
    """

    seconds: Mapping[str, float]
    cores: int
    begun: float = field(default_factory=time.monotonic)

    def line(self, shares: Mapping[str, float], now: float) -> str:
        """Return the line. shares: done of each job, 0 to 1, the finished ones 1; now: on the clock of `begun`."""
        total = sum(self.seconds.values())
        done = sum(self.seconds[name] * share for name, share in shares.items())
        finished = sum(share == 1 for share in shares.values())
        elapsed = now - self.begun
        speed = done / elapsed if done > 0.02 * total and elapsed > 0 else float(self.cores)
        left = (total - done) / speed
        share = done / total if total else 1.0
        return f"{finished} of {len(self.seconds)} jobs, {share:.0%} of the work, about {duration(left)} left"


def duration(seconds: float) -> str:
    """A time in the two units that matter: `40 s`, `12 min`, `3 h 20 min`, `2 d 4 h`."""
    minutes = round(seconds / 60)
    if seconds < 90:
        return f"{seconds:.0f} s"
    if minutes < 60:
        return f"{minutes} min"
    if minutes < 48 * 60:
        return f"{minutes // 60} h {minutes % 60} min"
    return f"{minutes // 1440} d {minutes % 1440 // 60} h"


def share_of_log(log: Path) -> float:
    """Share of a training that its log tells of; 0 where it tells nothing, and below 1 until the job has ended."""
    try:
        told = ITERATION.findall(log.read_text(encoding="utf-8", errors="replace"))
    except OSError:
        return 0.0
    return min(int(told[-1][0]) / int(told[-1][1]), 0.99) if told else 0.0


def tell(
    progress: StudyProgress,
    shares: Callable[[], Mapping[str, float]],
    say: Callable[[str], None],
    seconds_per_line: float = SECONDS_PER_LINE,
) -> Callable[[], None]:
    """Say the line every `seconds_per_line`, in a thread that ends with the process; return what ends it before."""
    over = threading.Event()

    def run() -> None:
        while not over.wait(seconds_per_line):
            say(progress.line(shares(), time.monotonic()))

    threading.Thread(target=run, daemon=True).start()
    return over.set
