"""The report: one HTML file that needs no network and in which every number comes from a table."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pandas as pd


@dataclass(frozen=True)
class Inputs:
    """What a report is made of; what is None or empty is left out, and the report says so."""

    study: Mapping[str, Any]
    cells: pd.DataFrame
    runs: pd.DataFrame
    published: pd.DataFrame
    correlation: pd.DataFrame | None = None
    claims: pd.DataFrame | None = None
    controllers: pd.DataFrame | None = None
    figures: Mapping[str, Path] = field(default_factory=dict)
    media: Sequence[Path] = ()
    manifests: Sequence[Mapping[str, Any]] = ()
    notebooks: Sequence[Path] = ()
    settings_hash: str = ""
    root: Path = Path(".")
    template: Path = Path("report/report.html.j2")


def build(inputs: Inputs) -> str:
    """The whole report as HTML text."""
    raise NotImplementedError
