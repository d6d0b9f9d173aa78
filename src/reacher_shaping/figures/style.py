"""One look for every figure: colours, dashes, markers, and how a figure becomes bytes.

A variant keeps its look in every figure. The base hues are those of Okabe and Ito (2008), told apart under the common
colour-vision deficiencies; a decayed variant with the L2-squared potential takes the darker shade of its horizon's hue
and dashes of its own, since the three darker shades are not. So does a variant that the paper does not have, where its
hue is near another's.
"""

import io
import re
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, PercentFormatter

from reacher_shaping.labels import variant_label, variant_order
from reacher_shaping.storage.files import write_bytes


class Look(NamedTuple):
    """How a variant is drawn: hex colour, dashes of its lines (points on and off), marker of lines with few points."""

    color: str
    dashes: tuple[float, ...] = (1, 0)
    marker: str = "o"


LOOKS = {
    "none": Look("#3D3D3D"),
    "l2": Look("#0072B2", marker="s"),
    "l2sq": Look("#E69F00", marker="D"),
    "decay200k": Look("#009E73", marker="^"),
    "decay300k": Look("#D55E00", marker="v"),
    "decay500k": Look("#CC79A7", marker="P"),
    "decay200k_l2sq": Look("#00573F", (5, 1.5), "<"),
    "decay300k_l2sq": Look("#863B00", (4, 1.2, 1, 1.2), ">"),
    "decay500k_l2sq": Look("#7D3459", (1, 1), "X"),
    "success": Look("#332288", marker="*"),
    "bilevel": Look("#56B4E9", marker="p"),
    "exponential100k": Look("#B8A100", (3, 1), "h"),
    "cosine300k": Look("#44AA99", (7, 1.5, 1, 1.5, 1, 1.5), "8"),
    "decay120k": Look("#999933", (10, 2, 2, 2), "H"),
}
SPARE_COLORS = ("#56B4E9", "#999933", "#882255", "#44AA99", "#332288", "#B8A100")
SPARE_DASHES = (5, 1, 1, 1, 1, 1, 1, 1)
BORROWED = (9, 3)
"""Dashes of a curve that stands beside others for comparison alone."""
INK, QUIET, BAND = "#333333", "#555555", "#F3F5F7"
"""Text, helping lines and explanations, the ground behind every second group of rows."""
PUBLISHED: dict[str, Any] = {"marker": "D", "color": "black", "markeredgecolor": "white", "markersize": 6}
STYLE: Any = {
    "font.family": "sans-serif",
    # The first is matplotlib's own and measures the text; the next is as wide where a browser has not the first.
    "font.sans-serif": ["DejaVu Sans", "Verdana", "sans-serif"],
    "font.size": 9,
    "axes.titlesize": 10,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.labelsize": 9,
    "axes.facecolor": "white",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.edgecolor": QUIET,
    "axes.linewidth": 0.8,
    "axes.axisbelow": True,
    "axes.grid": True,
    "grid.color": "#E4E4E4",
    "grid.linewidth": 0.6,
    "xtick.color": INK,
    "ytick.color": INK,
    **{
        f"{axis}tick.{key}": value
        for axis in "xy"
        for key, value in (("labelsize", 9), ("major.size", 3.5), ("major.width", 0.8))
    },
    "xtick.bottom": True,
    "ytick.left": True,
    "legend.frameon": False,
    "legend.fontsize": 8.5,
    "lines.linewidth": 1.2,
    "figure.dpi": 100,
    "savefig.dpi": 160,
    "figure.constrained_layout.use": True,
    "svg.hashsalt": "reacher-shaping",  # fixed ids: matplotlib otherwise salts them anew in every process
    "svg.fonttype": "none",  # text stays text: small, found by a search, read aloud
}
# Fields that would carry the time of drawing into the file.
METADATA: dict[str, dict[str, None]] = {"svg": {"Date": None}, "pdf": {"CreationDate": None}, "png": {}}
DARK = (
    "<style>@media screen and (prefers-color-scheme: dark) { svg { filter: invert(0.92) hue-rotate(180deg); } }</style>"
)
"""Turns light and dark of an SVG round, hues apart, for readers who ask for dark pages."""


@contextmanager
def look() -> Iterator[None]:
    """Matplotlib in the study's look, whatever a person's matplotlibrc says; also a decorator."""
    with mpl.rc_context():
        mpl.rcdefaults()
        mpl.rcParams.update(STYLE)
        yield


def variant_look(variant: str) -> Look:
    """The look of a variant; one that the paper does not have gets a fixed spare colour."""
    spare = SPARE_COLORS[zlib.crc32(variant.encode()) % len(SPARE_COLORS)]
    return LOOKS.get(variant, Look(spare, SPARE_DASHES, "d"))


def variant_color(variant: str) -> str:
    """Hex colour of a variant."""
    return variant_look(variant).color


def variant_line(variant: str, marked: bool = False) -> Line2D:
    """A line as a legend shows it, named as people read the variant."""
    found = variant_look(variant)
    marker: dict[str, Any] = {"marker": found.marker, "markersize": 4.5, "markeredgewidth": 0} if marked else {}
    style: Any = (0, found.dashes) if found.dashes[1] else "-"
    return Line2D([], [], color=found.color, linestyle=style, label=variant_label(variant), **marker)


def variant_legend(figure: Figure, variants: list[str], marked: bool = False, more: tuple[Line2D, ...] = ()) -> None:
    """One legend at the right of all panels: the variants in their order, then `more`."""
    lines = [variant_line(name, marked) for name in sorted(set(variants), key=variant_order)]
    figure.legend(handles=[*lines, *more], loc="outside right center", handlelength=2.2)


def percent(axis: Axis, symbol: str = " %") -> None:
    """Write shares of 1 on an axis in percent."""
    axis.set_major_formatter(PercentFormatter(xmax=1, decimals=0, symbol=symbol))


def millimetres(axis: Axis) -> None:
    """Write metres on an axis in millimetres."""
    axis.set_major_formatter(FuncFormatter(lambda metres, _: f"{1000 * metres:g}".replace("-", "\N{MINUS SIGN}")))


def empty_panel(axes: Axes, text: str = "not in this study") -> None:
    """Say in the panel that there is nothing to draw; panels that share its axes keep their ticks."""
    axes.text(0.5, 0.5, text, transform=axes.transAxes, ha="center", va="center", color="#666666")
    axes.tick_params(left=False, bottom=False, labelleft=False, labelbottom=False)
    axes.set(xlabel="", ylabel="")
    axes.spines[:].set_visible(False)
    axes.grid(visible=False)


def empty_figure() -> Figure:
    """A figure that says that there is nothing to draw."""
    figure = Figure(figsize=(4.5, 1.8))
    empty_panel(figure.subplots())
    return figure


@look()
def to_bytes(figure: Figure, kind: str) -> bytes:
    """The figure as `svg`, `pdf` or `png`; the same figure gives the same bytes. Paths are kept to 0.1 points."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format=kind, metadata=METADATA[kind])
    content = buffer.getvalue()
    if kind == "svg":
        content = re.sub(rb'(?<= d=")[^"]*', lambda path: _short(path[0]), content)
        content = content.replace(b"<defs>", DARK.encode() + b"\n <defs>", 1)
    return content


def _short(path: bytes) -> bytes:
    """A path of an SVG in one line: numbers with one decimal, and the points of a run of lines without their letter."""
    path = re.sub(rb"-?\d+\.\d+", lambda number: b"%g" % round(float(number[0]), 1), path)
    path = b" ".join(path.split())
    return re.sub(rb"(?<=[ML] )[^A-Za-z]*(?:L [^A-Za-z]*)+", lambda lines: lines[0].replace(b"L ", b""), path)


def save(figure: Figure, stem: Path, kinds: tuple[str, ...] = ("svg", "pdf", "png")) -> list[Path]:
    """Write `stem.svg`, `stem.pdf`, `stem.png` and return the paths."""
    paths = [stem.with_name(f"{stem.name}.{kind}") for kind in kinds]
    for path, kind in zip(paths, kinds, strict=True):
        write_bytes(path, to_bytes(figure, kind))
    return paths
