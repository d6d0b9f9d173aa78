"""One look for every figure: colours, labels, and how a figure becomes bytes.

A variant keeps its colour in every figure. The palette is Okabe and Ito's (2008), told apart
under the common colour-vision deficiencies.
"""

from pathlib import Path

from matplotlib.figure import Figure


def variant_color(name: str) -> str:
    """Hex colour of a variant, the same in every figure."""
    raise NotImplementedError


def to_bytes(figure: Figure, kind: str) -> bytes:
    """The figure as `svg`, `pdf` or `png`; equal figures give equal bytes."""
    raise NotImplementedError


def save(figure: Figure, stem: Path, kinds: tuple[str, ...] = ("svg", "pdf", "png")) -> list[Path]:
    """Write `stem.svg`, `stem.pdf`, `stem.png` and return their paths."""
    raise NotImplementedError
