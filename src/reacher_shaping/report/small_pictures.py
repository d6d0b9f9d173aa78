"""Small pictures within the page, as SVG whose colours are those of the page: an interval against a band, and bars."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from markupsafe import Markup

WIDTH, HEIGHT, EDGE = 150.0, 22.0, 6.0


@dataclass(frozen=True)
class Bar:
    """A share with its interval: name, value, limits (NaN where there are none), and whether it is ours."""

    name: str
    value: float
    low: float
    high: float
    ours: bool


def band(rule: Mapping[str, Any]) -> tuple[float, float]:
    """The values between which a rule of the ledger holds; infinite where it has no limit."""
    if "within" in rule:
        low, high = rule["within"]
        return float(low), float(high)
    return float(rule.get("above", -np.inf)), float(rule.get("below", np.inf))


class Interval(NamedTuple):
    """A measured value with its limits, and the published one; NaN for what there is not."""

    value: float
    low: float
    high: float
    published: float


def interval(numbers: Interval, holds: tuple[float, float], label: str) -> Markup:
    """An interval on a line, the band where the claim holds shaded, the published value as a diamond.

    Nothing without a measured value.
    """
    value, low, high, published = numbers
    if not np.isfinite(value):
        return Markup()
    marks = np.array([*numbers, *holds])
    marks = marks[np.isfinite(marks)]
    least, most = float(marks.min()), float(marks.max())
    spread = (most - least) or abs(value) or 1.0
    least, most = least - 0.12 * spread, most + 0.12 * spread

    def at(mark: float) -> float:
        return round(EDGE + (WIDTH - 2 * EDGE) * (float(np.clip(mark, least, most)) - least) / (most - least), 1)

    first, last = at(holds[0]), at(holds[1])
    middle = HEIGHT / 2
    parts = [f'<rect class="band" x="{first}" y="3" width="{round(last - first, 1)}" height="16"/>']
    parts.append(f'<line class="axis" x1="{EDGE}" x2="{WIDTH - EDGE}" y1="{middle}" y2="{middle}"/>')
    if np.isfinite(low):
        parts.append(f'<line class="span" x1="{at(low)}" x2="{at(high)}" y1="{middle}" y2="{middle}"/>')
    if np.isfinite(published):
        x = at(published)
        corners = f"M{x - 4:g} {middle:g}l4 -4l4 4l-4 4Z"
        parts.append(f'<path class="published" d="{corners}"/>')
    parts.append(f'<circle class="dot" cx="{at(value)}" cy="{middle}" r="3.5"/>')
    return _svg("".join(parts), WIDTH, HEIGHT, label, "interval")


def bars(rows: Sequence[Bar], label: str) -> Markup:
    """Shares from 0 to 100 %, a row each, with the name before and the value behind."""
    width, step, left, right = 460.0, 24.0, 150.0, 60.0
    scale = width - left - right
    parts = []
    for number, row in enumerate(rows):
        y = step * number + step / 2
        kind = "ours" if row.ours else "theirs"
        x = round(left + scale * row.value, 1)
        parts.append(f'<text x="{left - 8}" y="{y + 4}" text-anchor="end">{Markup.escape(row.name)}</text>')
        parts.append(f'<rect class="{kind}" x="{left}" y="{y - 6}" width="{round(x - left, 1)}" height="12"/>')
        end = x
        if np.isfinite(row.low):
            first, end = (round(left + scale * mark, 1) for mark in (row.low, row.high))
            parts.append(f'<line class="span" x1="{first}" x2="{end}" y1="{y}" y2="{y}"/>')
        parts.append(f'<text x="{max(end, x) + 6}" y="{y + 4}">{100 * row.value:.0f}\N{NO-BREAK SPACE}%</text>')
    return _svg("".join(parts), width, step * len(rows), label, "bars")


def _svg(content: str, width: float, height: float, label: str, kind: str) -> Markup:
    """The picture with its words for those who do not see it."""
    size = f'viewBox="0 0 {width:g} {height:g}" width="{width:g}" height="{height:g}"'
    return Markup(f'<svg class="{kind}" {size} role="img" aria-label="{Markup.escape(label)}">{content}</svg>')
