"""The paper's three tables: our value, its 95 % interval and the published value side by side."""

from pathlib import Path

import pandas as pd


def published_cells(table2: pd.DataFrame, table3: pd.DataFrame) -> pd.DataFrame:
    """Published rows under our cell keys: `variant, budget, alpha0, run, success_rate, mean_return`."""
    raise NotImplementedError


def table_1(cells: pd.DataFrame, published: pd.DataFrame, protocol: str | None = None) -> pd.DataFrame:
    """The six cells of Table 2 with the highest success rate."""
    raise NotImplementedError


def table_2(cells: pd.DataFrame, published: pd.DataFrame, protocol: str | None = None) -> pd.DataFrame:
    """Every cell of the main grid, best success rate first."""
    raise NotImplementedError


def table_3(cells: pd.DataFrame, published: pd.DataFrame, protocol: str | None = None) -> pd.DataFrame:
    """Every decay cell with the L2-squared potential, best success rate first."""
    raise NotImplementedError


def to_markdown(frame: pd.DataFrame, caption: str) -> str:
    """The table formatted for reading, its caption above."""
    raise NotImplementedError


def save(frame: pd.DataFrame, caption: str, stem: Path) -> list[Path]:
    """Write the numbers as `stem.csv` and the formatted table as `stem.md`."""
    raise NotImplementedError
