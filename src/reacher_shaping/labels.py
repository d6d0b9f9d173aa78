"""Names, groups and orders of variants, cells and protocols, and numbers as people read them."""

import re
from collections.abc import Mapping, Sequence
from typing import Any

import pandas as pd

CELL = ["variant", "budget", "alpha0"]
KEY = ["protocol", *CELL]
"""Columns that name a cell: within its protocol, and in the whole study."""
_SUPERSCRIPTS = str.maketrans("0123456789", "⁰¹²³⁴⁵⁶⁷⁸⁹")
Setting = tuple[int, float]  # budget in environment steps, alpha0


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
    """A number with a real minus sign and a fixed count of decimals; from a million on as a power of ten."""
    if abs(value) >= 1e6:
        mantissa, _, power = f"{value:.1e}".partition("e+")
        text = f"{mantissa} \N{MULTIPLICATION SIGN} 10{str(int(power)).translate(_SUPERSCRIPTS)}" if power else mantissa
    else:
        text = f"{value:.{digits}f}"
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
