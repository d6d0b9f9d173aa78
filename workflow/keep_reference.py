"""Make the run in `results/` the reference run: keep its summaries, and tell them in the README.

python workflow/keep_reference.py
"""

import shutil
import sys
from collections.abc import Iterable
from itertools import product
from pathlib import Path
from typing import Any

from reacher_shaping.report.loader import load
from reacher_shaping.report.readme import headline, put_headline
from reacher_shaping.settings.cell import Cell
from reacher_shaping.settings.outputs import judged, table_files
from reacher_shaping.settings.study import block_name, load_study, read_settings, settings_hash
from reacher_shaping.storage.files import ArtifactError, read_json, write_json, write_text
from reacher_shaping.storage.reference import keep_experiments, keep_tables, manifest, published_bits

RESULTS, KEPT, README = Path("results"), Path("report/reference"), Path("README.md")
FIGURE = "headline.svg"


def manifests(cells: Iterable[Cell], blocks: Iterable[range]) -> list[dict[str, Any]]:
    """The manifests of the blocks of cells."""
    folders = [RESULTS / cell.folder / block_name(seeds) for cell, seeds in product(cells, blocks)]
    return [read_json(folder / "manifest.json") for folder in folders]


def main() -> None:
    settings = read_settings("config.yaml", *sys.argv[1:2])
    study = load_study(settings)
    blocks = manifests(study.cells, study.blocks())
    bits = published_bits(blocks)
    keep_tables(RESULTS, KEPT)
    files = {
        name: table_files(
            switches=own.switches is not None,
            peers=own.peers is not None,
            claims=judged(cell.key for cell in study.experiment_cells[name]),
        )
        for name, own in study.experiments.items()
    }
    made = keep_experiments(RESULTS, KEPT, files)
    further = {
        name: manifests(study.experiment_cells[name], study.blocks(study.experiments[name].seeds)) for name in made
    }
    resolved = study.model_dump(mode="json")
    peers = [read_json(path) for path in sorted(RESULTS.glob("**/peers/*/seed*.json"))]
    record = manifest(resolved, settings_hash(study), blocks, further, peers)
    write_json(KEPT / "manifest.json", record)
    write_json(KEPT / "bits.json", bits)
    shutil.copyfile("figures/figure_2.svg", KEPT / FIGURE)

    text = headline(load(KEPT, "report/published"), record, f"{KEPT}/{FIGURE}")
    write_text(README, put_headline(README.read_text(encoding="utf-8"), text))
    print(f"The reference run: {KEPT} and README.md")


if __name__ == "__main__":
    try:
        main()
    except (ArtifactError, OSError, ValueError) as error:
        sys.exit(f"{error}")
