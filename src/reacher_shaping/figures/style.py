"""One look for every figure: names, colours, and how a figure becomes bytes.

A variant keeps its colour in every figure. The base hues are those of Okabe and Ito (2008), told
apart under the common colour-vision deficiencies; a decayed variant with the L2-squared potential
takes the darker shade of its horizon's hue.
"""

import io
import zlib
from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from reacher_shaping.storage.files import write_bytes

COLORS = {
    "none": "#3D3D3D",
    "l2": "#0072B2",
    "l2sq": "#E69F00",
    "decay200k": "#009E73",
    "decay300k": "#D55E00",
    "decay500k": "#CC79A7",
    "decay200k_l2sq": "#00573F",
    "decay300k_l2sq": "#863B00",
    "decay500k_l2sq": "#7D3459",
}
SPARE_COLORS = ("#56B4E9", "#999933", "#882255", "#44AA99", "#332288", "#B8A100")
STYLE: Any = {
    "font.family": "DejaVu Sans",
    "font.size": 9,
    "axes.titlesize": 10,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.labelsize": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.edgecolor": "#555555",
    "axes.axisbelow": True,
    "axes.grid": True,
    "grid.color": "#E4E4E4",
    "grid.linewidth": 0.6,
    "xtick.color": "#333333",
    "ytick.color": "#333333",
    "legend.frameon": False,
    "legend.fontsize": 8.5,
    "lines.linewidth": 1.2,
    "hatch.linewidth": 0.7,
    "figure.dpi": 100,
    "savefig.dpi": 160,
    "figure.constrained_layout.use": True,
    # Fixed ids: matplotlib otherwise salts them anew in every process.
    "svg.hashsalt": "reacher-shaping",
    "svg.fonttype": "path",
}
# Fields that would carry the time of drawing into the file.
METADATA: dict[str, dict[str, None]] = {
    "svg": {"Date": None},
    "pdf": {"CreationDate": None},
    "png": {},
}


def variant_color(variant: str) -> str:
    """Hex colour of a variant; one that the paper does not have gets a fixed spare colour."""
    spare = SPARE_COLORS[zlib.crc32(variant.encode()) % len(SPARE_COLORS)]
    return COLORS.get(variant, spare)


def empty_panel(axes: Axes, text: str) -> None:
    """Say in the panel that there is nothing to draw; panels that share its axes keep their ticks."""
    axes.text(0.5, 0.5, text, transform=axes.transAxes, ha="center", va="center", color="#666666")
    axes.tick_params(left=False, bottom=False, labelleft=False, labelbottom=False)
    axes.spines[:].set_visible(False)
    axes.grid(visible=False)


@mpl.rc_context(STYLE)
def to_bytes(figure: Figure, kind: str) -> bytes:
    """The figure as `svg`, `pdf` or `png`; the same figure gives the same bytes."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format=kind, metadata=METADATA[kind])
    return buffer.getvalue()


def save(figure: Figure, stem: Path, kinds: tuple[str, ...] = ("svg", "pdf", "png")) -> list[Path]:
    """Write `stem.svg`, `stem.pdf`, `stem.png` and return the paths."""
    paths = [stem.with_name(f"{stem.name}.{kind}") for kind in kinds]
    for path, kind in zip(paths, kinds, strict=True):
        write_bytes(path, to_bytes(figure, kind))
    return paths
