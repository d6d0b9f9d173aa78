"""Run a notebook source to an executed notebook whose bytes depend only on what it shows."""

from pathlib import Path
from typing import Any


def clean(notebook: dict[str, Any]) -> dict[str, Any]:
    """The notebook without times, ids and paths of its execution."""
    raise NotImplementedError


def execute(source: Path, out: Path, parameters: dict[str, Any], log: Path | None = None) -> None:
    """Execute the percent-format `source` with `parameters` and write the clean copy to `out`."""
    raise NotImplementedError
