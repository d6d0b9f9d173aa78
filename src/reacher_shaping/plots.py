"""The paper's four figures. Tables in, matplotlib figures out; no statistic is computed here."""

import pandas as pd
from matplotlib.figure import Figure

from reacher_shaping.style import save

__all__ = ["figure_1", "figure_2", "figure_3", "figure_4", "save"]


def figure_1(curves: pd.DataFrame, protocol: str | None = None) -> Figure:
    """Training curves: constant shaping above, decayed below, one column per budget and alpha0."""
    raise NotImplementedError


def figure_2(
    cells: pd.DataFrame,
    published: pd.DataFrame,
    protocol: str | None = None,
    controllers: pd.DataFrame | None = None,
) -> Figure:
    """Success rates as grouped bars with intervals; the published value is a mark."""
    raise NotImplementedError


def figure_3(
    correlation: pd.DataFrame, published_correlation: pd.DataFrame | None = None
) -> Figure:
    """Pearson correlation matrix of alpha0, success rate, mean return and budget over cells."""
    raise NotImplementedError


def figure_4(curves: pd.DataFrame, protocol: str | None = None) -> Figure:
    """Training curves of decay with the L2-squared potential, one panel per budget."""
    raise NotImplementedError
