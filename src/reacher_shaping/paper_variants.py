"""The variants of the paper's tables: their names here, the group of tables they belong to, and what they are."""

from typing import NamedTuple


class PaperVariant(NamedTuple):
    """The group (`main`: Tables 1 and 2, `appendix`: Table 3), potential, schedule and horizon in environment steps."""

    group: str
    potential: str
    schedule: str
    horizon: int | None = None


VARIANTS = {
    "none": PaperVariant("main", "none", "constant"),
    "l2": PaperVariant("main", "l2", "constant"),
    "l2sq": PaperVariant("main", "l2sq", "constant"),
    "decay200k": PaperVariant("main", "l2", "linear", 200_000),
    "decay300k": PaperVariant("main", "l2", "linear", 300_000),
    "decay500k": PaperVariant("main", "l2", "linear", 500_000),
    "decay200k_l2sq": PaperVariant("appendix", "l2sq", "linear", 200_000),
    "decay300k_l2sq": PaperVariant("appendix", "l2sq", "linear", 300_000),
    "decay500k_l2sq": PaperVariant("appendix", "l2sq", "linear", 500_000),
}
"""In the order in which tables and figures show them. Claims, published values and colours go by these names."""


def of_group(group: str) -> list[str]:
    """The names of a group's variants."""
    return [name for name, variant in VARIANTS.items() if variant.group == group]
