"""Which figures a further study has: what its cells can show. Imports nothing heavy, since the workflow asks it too."""

from collections.abc import Iterable, Mapping
from typing import Any

NAMES = ("cells", "effects", "log", "correlation", "forest")


def views(keys: Iterable[Mapping[str, Any]], *, switches: bool) -> list[str]:
    """Return the names of a study's figures.

    Args:
        keys: `protocol, variant, budget, alpha0` of its cells.
        switches: whether it compares two protocols switch by switch.
    """
    cells = list(keys)
    labels = {cell["alpha0"] for cell in cells if cell["variant"] == "none"}
    variants = {cell["protocol"]: {c["variant"] for c in cells if c["protocol"] == cell["protocol"]} for cell in cells}
    shown = {
        "cells": True,
        "effects": switches,
        "log": not switches and any(name.startswith("released") for name in variants),
        "correlation": len(labels) > 1,  # a baseline of several weights: alpha0 is a label there
        "forest": not switches and any("none" in own and len(own) > 2 for own in variants.values()),
    }
    return [name for name in NAMES if shown[name]]
