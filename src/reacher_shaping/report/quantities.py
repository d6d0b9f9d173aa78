"""Numbers of the claims with their units, and the names of variants within sentences, as people read them."""

import re
from collections.abc import Mapping
from typing import Any

import numpy as np

from reacher_shaping.labels import number, variant_label
from reacher_shaping.report.text import entry, say

DASH = "\N{EN DASH}"
# Unit -> factor and decimals.
UNITS = {"points": (100.0, 1), "percent": (100.0, 1), "plain": (1.0, 2), "times": (1.0, 2), "whole": (1.0, 0)}
_VARIANT = re.compile(r"`?\b(decay\d+k(?:_l2sq)?|l2sq|l2)\b`?")


def shown(value: float, unit: str) -> str:
    """A number in its unit, without the unit's name."""
    factor, digits = UNITS[unit]
    return number(factor * value, digits) if np.isfinite(value) else DASH


def with_unit(text: str, unit: str) -> str:
    """The number's text followed by its unit."""
    return text if text == DASH else f"{text}{entry('units')[unit]}"


def with_interval(row: Mapping[Any, Any], unit: str) -> str:
    """The measured value with its limits and unit."""
    value, low, high = (shown(float(row[name]), unit) for name in ("measured", "ci_low", "ci_high"))
    text = value if DASH in (value, low) else say("summary.interval", value=value, low=low, high=high)
    return with_unit(text, unit)


def rule_text(rule: Mapping[str, Any], unit: str) -> str:
    """A rule of the ledger in words, its thresholds in the unit of the estimate."""

    def limit(value: float) -> str:
        return with_unit(shown(float(value), unit), unit)

    if "within" in rule:
        low, high = rule["within"]
        text = say("claim.rules.within", low=shown(float(low), unit), high=limit(high))
    else:
        side = "above" if "above" in rule else "below"
        text = say(f"claim.rules.{side}", value=limit(rule[side]))
    for name in ("refuted_below", "refuted_above"):
        if name in rule:
            text = say(f"claim.rules.{name}", rule=text, value=limit(rule[name]))
    return text


def in_words(text: str) -> str:
    """A sentence of the ledger with the variants' names as people read them."""
    text = _VARIANT.sub(lambda found: variant_label(found[1]), text).replace("`none`", "none")
    return text.replace("alpha0", "α₀").replace("alpha", "\N{GREEK SMALL LETTER ALPHA}")
