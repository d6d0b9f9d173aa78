"""What stands in a panel of a figure, read back from it."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PathCollection
from matplotlib.colors import to_hex
from matplotlib.lines import Line2D

from reacher_shaping.figures.style import variant_color


def data_lines(axes: Axes) -> list[Line2D]:
    """Lines that show data; helping lines are labelled."""
    return [line for line in axes.lines if line.get_label().startswith("_child") and line.get_linewidth() > 0]


def curves(axes: Axes, variants) -> dict[str, Line2D]:
    """The lines of a panel by their variant, told by colour."""
    by_color = {variant_color(name).lower(): name for name in variants}
    return {by_color[to_hex(line.get_color())]: line for line in data_lines(axes)}


def runs(axes: Axes) -> list[tuple[float, float]]:
    """Places of the dots that are drawn without a line between them."""
    dots = [line for line in axes.lines if line.get_label().startswith("_child") and line.get_linewidth() == 0]
    return [(float(x), float(y)) for line in dots for x, y in line.get_xydata()]


def points(axes: Axes, marker_color: str | None = None) -> list[tuple[float, float]]:
    """Places of the marks in collections; of one fill colour, where that is given."""
    found = []
    for collection in axes.collections:
        if isinstance(collection, PathCollection):
            colors = collection.get_facecolors()
            for place, (x, y) in enumerate(collection.get_offsets()):
                color = to_hex(colors[place % len(colors)]) if len(colors) else ""
                if marker_color in (None, color):
                    found.append((float(x), float(y)))
    return found


def filled(axes: Axes) -> list[tuple[float, float, bool]]:
    """Marks that may be hollow: x, y and whether each is filled; the white ground under them is left out."""
    found = []
    for marks in axes.collections:
        if isinstance(marks, PathCollection):
            colors = np.broadcast_to(marks.get_facecolors(), (len(marks.get_offsets()), 4))
            for (x, y), color in zip(marks.get_offsets(), colors, strict=True):
                if tuple(color) != (1, 1, 1, 1):
                    found.append((float(x), float(y), bool(color[3])))
    return found


def segments(axes: Axes) -> list[np.ndarray]:
    """Ends of the intervals [2, 2] that stand in the panel."""
    return [ends for lines in axes.collections if isinstance(lines, LineCollection) for ends in lines.get_segments()]


def labelled(axes: Axes, label: str) -> list[Line2D]:
    """Helping lines of that label."""
    return [line for line in axes.lines if line.get_label() == label]


def dashed(line: Line2D) -> bool:
    """Whether a line has gaps; its style is reported as dashed for every pattern that is given by numbers."""
    return line._unscaled_dash_pattern[1] is not None
