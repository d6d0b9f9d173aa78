"""Make the run in `results/` the reference run: keep its summaries, and tell them in the README.

python workflow/keep_reference.py
"""

import shutil
import sys
from pathlib import Path

import pandas as pd

from reacher_shaping import artifacts, reference, tables
from reacher_shaping.config import block_name, load_study, require_mapping, settings_hash

RESULTS, KEPT, README = Path("results"), Path("report/reference"), Path("README.md")
FIGURE = "headline.svg"


def main() -> None:
    overlay = require_mapping(sys.argv[1]) if len(sys.argv) > 1 else {}
    study = load_study({**require_mapping("config.yaml"), **overlay})
    folders = [RESULTS / cell.folder / block_name(seeds) for cell in study.cells for seeds in study.blocks()]
    blocks = [artifacts.read_json(folder / "manifest.json") for folder in folders]
    reference.keep_tables(RESULTS, KEPT)
    settings = study.model_dump(mode="json")
    record = reference.manifest(settings, settings_hash(study), blocks)
    artifacts.write_json(KEPT / "manifest.json", record)
    shutil.copyfile("figures/figure_2.svg", KEPT / FIGURE)

    cells = artifacts.read_table(KEPT / "cells.parquet", artifacts.CELLS)
    claims = artifacts.read_table(KEPT / "claims.csv", artifacts.CLAIMS)
    published = tables.published_cells(*(pd.read_csv(f"report/published/table{number}.csv") for number in (2, 3)))
    text = reference.headline(cells, claims, published, record, f"{KEPT}/{FIGURE}")
    artifacts.write_text(README, reference.put_headline(README.read_text(encoding="utf-8"), text))
    print(f"The reference run: {KEPT} and README.md")


if __name__ == "__main__":
    try:
        main()
    except (artifacts.ArtifactError, OSError, ValueError) as error:
        sys.exit(f"{error}")
