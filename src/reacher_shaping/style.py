"""One look for every figure: names, colours, and how a figure becomes bytes.

A variant keeps its colour in every figure. The base hues are those of Okabe and Ito (2008), told
apart under the common colour-vision deficiencies; a decayed variant with the L2-squared potential
takes the darker shade of its horizon's hue.
"""

import io
import re
import zlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib as mpl
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from reacher_shaping import artifacts

Setting = tuple[int, float]  # budget in environment steps, alpha0

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


def group(variant: str) -> str:
    """`none`, `constant`, `decay` or `decay_l2sq`: the part of the study a variant belongs to."""
    if variant == "none":
        return "none"
    if not variant.startswith("decay"):
        return "constant"
    return "decay_l2sq" if variant.endswith("_l2sq") else "decay"


def variant_order(variant: str) -> tuple[int, int, str]:
    """Sort key: the reference, constant shaping, then decay by horizon."""
    horizon = re.search(r"\d+", variant.removesuffix("_l2sq")) if "decay" in variant else None
    groups = ("none", "constant", "decay", "decay_l2sq")
    return groups.index(group(variant)), int(horizon.group()) if horizon else 0, variant


def cell_order(row: Mapping[Any, Any]) -> tuple[Any, ...]:
    """Sort key of a cell's row: by variant, full alpha0 first, then by budget."""
    return variant_order(row["variant"]), -row["alpha0"], row["budget"]


def variant_color(variant: str) -> str:
    """Hex colour of a variant; one that the paper does not have gets a fixed spare colour."""
    spare = SPARE_COLORS[zlib.crc32(variant.encode()) % len(SPARE_COLORS)]
    return COLORS.get(variant, spare)


def variant_label(variant: str) -> str:
    """`decay200k_l2sq` as people read it: `decay 200K, L2²`."""
    match = re.fullmatch(r"decay(\d+)k(_l2sq)?", variant)
    if match:
        return f"decay {match[1]}K" + (", L2²" if match[2] else "")
    return {"l2": "L2", "l2sq": "L2²"}.get(variant, variant)


def budget_label(steps: int) -> str:
    """Environment steps as the paper writes them: `500K`, `1M`; other numbers in full."""
    for unit, size in (("M", 1_000_000), ("K", 1_000)):
        if steps >= size and steps * 10 % size == 0:
            return f"{steps / size:g}{unit}"
    return f"{steps:,}"


def setting_label(budget: int, alpha0: float) -> str:
    """Budget and alpha0 of a cell: `500K, α₀ = 0.5`."""
    return f"{budget_label(budget)}, α₀ = {alpha0:g}"


def number(value: float, digits: int) -> str:
    """A number with a real minus sign and a fixed count of decimals; from a million on with an exponent."""
    text = f"{value:.{digits}f}" if abs(value) < 1e6 else f"{value:.1e}".replace("e+0", "e").replace("e+", "e")
    return text.replace("-", "\N{MINUS SIGN}")


def of_protocol(frame: pd.DataFrame, protocol: str | None) -> pd.DataFrame:
    """The rows of one protocol, of the first one met where none is named; all where the table has no protocol."""
    if frame.empty or "protocol" not in frame:
        return frame
    return frame[frame["protocol"] == (protocol or frame["protocol"].iloc[0])]


def stochastic(controllers: pd.DataFrame, protocol: str | None) -> pd.DataFrame:
    """The controllers' rows of one protocol in the mode of the paper's evaluation, where the table has several."""
    ours = of_protocol(controllers, protocol)
    if "mode" in ours:
        repeated = ours["controller"].duplicated(keep=False)
        ours = ours[~repeated | (ours["mode"] == "stochastic")]
    return ours


def in_groups(frame: pd.DataFrame, groups: Sequence[str]) -> pd.DataFrame:
    """The rows whose variant belongs to one of the groups."""
    return frame[frame["variant"].map(group).isin(list(groups))]


def settings_of(frame: pd.DataFrame) -> list[Setting]:
    """Budgets and alpha0 met, full alpha0 first, then by budget: the paper's column order."""
    pairs = frame[["budget", "alpha0"]].drop_duplicates().itertuples(index=False)
    return sorted(((int(b), float(a)) for b, a in pairs), key=lambda pair: (-pair[1], pair[0]))


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
        artifacts.write_bytes(path, to_bytes(figure, kind))
    return paths
