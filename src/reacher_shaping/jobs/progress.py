"""Speed and time left of a training, as a line of text now and then."""

import time
from collections.abc import Iterator
from dataclasses import dataclass, field

SECONDS_PER_REPORT = 15.0


@dataclass
class Meter:
    """Speed and time left of a training, said every `SECONDS_PER_REPORT`.

    total: iterations of the run; steps: environment steps of one iteration over all seeds; start: iterations that
    were done before; unit: what an iteration is called.
    """

    total: int
    steps: int
    start: int = 0
    unit: str = "iteration"
    begun: float = field(default_factory=time.monotonic)
    said: float = field(default_factory=time.monotonic)

    def lines(self, iteration: int) -> Iterator[str]:
        """Nothing, or one line, after `iteration` of `total` iterations."""
        now = time.monotonic()
        if now - self.said < SECONDS_PER_REPORT and iteration < self.total:
            return
        self.said = now
        rate = (iteration - self.start) / max(now - self.begun, 1e-9)
        left = (self.total - iteration) / rate
        yield f"{self.unit} {iteration}/{self.total}, {rate * self.steps:,.0f} steps/s, {left / 60:.1f} min left"
