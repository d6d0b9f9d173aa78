"""Names, groups and orders of variants, cells and protocols, and numbers as people read them."""

from collections.abc import Mapping, Sequence
from typing import Any

import pandas as pd

from reacher_shaping.paper_variants import VARIANTS

CELL = ["variant", "budget", "alpha0"]
KEY = ["protocol", *CELL]
"""Columns that name a cell: within its protocol, and in the whole study."""
DESIGN = ["study", "group", "potential", "schedule", "horizon"]
"""Columns that say what a cell is for: its study, where the paper has such cells, and what its variant is."""
_SUPERSCRIPTS = str.maketrans("0123456789", "⁰¹²³⁴⁵⁶⁷⁸⁹")
Setting = tuple[int, float]  # budget in environment steps, alpha0


def variant_order(variant: str) -> tuple[int, str]:
    """Sort key: the paper's variants in its order, then others by name."""
    known = list(VARIANTS)
    return known.index(variant) if variant in known else len(known), variant


def cell_order(row: Mapping[Any, Any]) -> tuple[Any, ...]:
    """Sort key of a cell's row: by variant, full alpha0 first, then by budget."""
    return variant_order(row["variant"]), -row["alpha0"], row["budget"]


def variant_label(variant: str) -> str:
    """A variant of the paper as people read it, such as `decay 200K, L2²`; any other by its name."""
    if variant not in VARIANTS:
        return variant
    _, potential, _, horizon = VARIANTS[variant]
    if horizon is None:
        return {"l2": "L2", "l2sq": "L2²"}.get(potential, potential)
    return f"decay {budget_label(horizon)}" + (", L2²" if potential == "l2sq" else "")


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
    """A number with a real minus sign and a fixed count of decimals; from a million on as a power of ten."""
    if abs(value) >= 1e6:
        mantissa, _, power = f"{value:.1e}".partition("e+")
        text = f"{mantissa} \N{MULTIPLICATION SIGN} 10{str(int(power)).translate(_SUPERSCRIPTS)}" if power else mantissa
    else:
        text = f"{round(value, digits) + 0.0:.{digits}f}"  # without a sign where nothing is left of the number
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
    """The rows of cells of these groups: `main`, `appendix`, `extra`."""
    return frame[frame["group"].isin(list(groups))]


def settings_of(frame: pd.DataFrame) -> list[Setting]:
    """Budgets and alpha0 met, full alpha0 first, then by budget: the paper's column order."""
    pairs = frame[["budget", "alpha0"]].drop_duplicates().itertuples(index=False)
    return sorted(((int(b), float(a)) for b, a in pairs), key=lambda pair: (-pair[1], pair[0]))
