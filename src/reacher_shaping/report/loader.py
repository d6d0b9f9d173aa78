"""All that a report or a notebook reads: the study's tables, those of the further studies, and the published values."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd
import yaml

from reacher_shaping.report import paper_tables
from reacher_shaping.report.text import entry
from reacher_shaping.storage.reference import read_tables
from reacher_shaping.storage.tables import of_study


@dataclass(frozen=True)
class Study:
    """A study as read from its files.

    `tables` are the study-wide ones by the catalogue's names, those that are there; `experiments` those of each further
    study; `published` the paper's Tables 2 and 3 under our cell keys, `every_published` with the run that they leave
    out; `training_logs` the summaries of the published logs; `ledger` the claims with their tests.
    """

    tables: Mapping[str, pd.DataFrame]
    experiments: Mapping[str, Mapping[str, pd.DataFrame]]
    published: pd.DataFrame
    every_published: pd.DataFrame
    training_logs: pd.DataFrame
    ledger: Sequence[Mapping[str, Any]] = ()


def load(results: Path | str, published: Path | str) -> Study:
    """Read a study from its folder (`results/`, or a reference run's) and the folder of published values.

    The ledger of claims lies beside the latter.

    Raises ArtifactError where a table is damaged.
    """
    results, published = Path(results), Path(published)
    further = {path.name: read_tables(path) for path in (results / "experiments").glob("*")}
    table2, table3, left_out, logs = (
        pd.read_csv(published / f"{name}.csv") for name in ("table2", "table3", "left_out", "training_logs")
    )
    return Study(
        read_tables(results),
        _complete(further),
        paper_tables.published_cells(table2, table3),
        paper_tables.published_cells(table2, table3, left_out),
        logs,
        yaml.safe_load((published.parent / "claims.yaml").read_text(encoding="utf-8")),
    )


def _complete(found: Mapping[str, Mapping[str, pd.DataFrame]]) -> dict[str, Mapping[str, pd.DataFrame]]:
    """The further studies that have all their tables, in the order in which the words know them."""
    needed = of_study(["further"]).keys()
    order = [
        *(name for name in entry("study_order") if name in found),
        *sorted(found.keys() - set(entry("study_order"))),
    ]
    return {name: found[name] for name in order if needed <= found[name].keys()}
