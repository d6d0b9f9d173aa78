"""Make the run in `results/` the reference run: keep its summaries, and tell them in the README.

    python workflow/keep_reference.py [--force] [OVERLAY.yaml]

    python workflow/keep_reference.py --policies [OVERLAY.yaml]

keeps the policies of `results/policies` alone, and leaves all else of the reference run as it is.

    python workflow/keep_reference.py --report

keeps the report of the reference run, as `make report` builds it where there are no results, in `report/site`: one page
and one PDF to read without building anything, and for a static host to serve as they are.

The folder is made anew beside the old one and takes its place whole; what targets of their own make and `results/` does
not have, further studies, peers and the search, stays as it was kept. Ends with 1, and changes nothing, where something
would be lost or a block cannot be traced to a commit; --force keeps the run all the same, and says what is against it.
"""

import argparse
import shutil
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import yaml

from reacher_shaping.report.loader import load
from reacher_shaping.report.readme import headline, put_headline
from reacher_shaping.settings import outputs
from reacher_shaping.settings.cell import Cell
from reacher_shaping.settings.study import MAIN, Study, block_name, load_study, read_settings, settings_hash
from reacher_shaping.storage.files import ArtifactError, check_seal, read_json, write_bytes, write_json, write_text
from reacher_shaping.storage.provenance import require_asked
from reacher_shaping.storage.reference import (
    POLICIES,
    checksums,
    copy_kept,
    keep_policies,
    keep_tables,
    manifest,
    objections,
    published_bits,
    replaced,
)
from reacher_shaping.storage.tables import TABLES

RESULTS, KEPT, README = Path("results"), Path("report/reference"), Path("README.md")
BUILT, SITE = Path("build/reference/report"), Path("report/site")
FIGURE = "headline.svg"


def manifests(study: Study, cells: Iterable[Cell], seeds: int) -> list[dict[str, Any]]:
    """The manifests of the blocks of cells, each with what its training chose by name, under `chosen`.

    Raises ArtifactError for a block that was made with other settings.
    """
    found = []
    for cell in cells:
        for block in study.blocks(seeds):
            path = RESULTS / cell.folder / block_name(block) / "manifest.json"
            record = require_asked(path, {"settings": {"cell": cell.settings()}, "seeds": list(block)})
            found.append(record | {"chosen": list(cell.chosen_code)})
    return found


def write_folder(study: Study, folder: Path) -> tuple[dict[str, Any], list[str]]:
    """Write all of the reference run into an empty folder; return its manifest, and what stays as it was kept."""
    blocks = manifests(study, study.cells, study.seeds)
    write_json(folder / "bits.json", published_bits(blocks))
    hypotheses = outputs.ledgers(yaml.safe_load(Path("report/hypotheses.yaml").read_text(encoding="utf-8")))
    further = {}
    for name, own in study.studies.items():
        tables, place = outputs.tables_of(study, name, hypotheses), outputs.folder(name)
        if name != MAIN and not all((RESULTS / place / file).exists() for file in tables.values()):
            continue
        keep_tables(RESULTS / place, folder / place, tables)
        if name != MAIN:
            further[name] = manifests(study, study.cells_of[name], own.seeds)
    keep_policies(RESULTS, folder, KEPT)
    figure = Path("figures/figure_2.svg")
    check_seal(figure)
    shutil.copyfile(figure, folder / FIGURE)
    peers = [read_json(path) for path in sorted(RESULTS.glob("**/peers/*/seed*.json"))]
    record = manifest(study.model_dump(mode="json"), settings_hash(study), blocks, further, peers)
    others = keep_others(study, folder, record) if (KEPT / "manifest.json").exists() else []
    record["tables"] = checksums(folder)
    write_json(folder / "manifest.json", record)
    return record, others


def keep_others(study: Study, folder: Path, record: dict[str, Any]) -> list[str]:
    """Add what targets of their own make and were not asked for here, as it was kept, to `record` too; return what."""
    before = read_json(KEPT / "manifest.json")
    names = [name for name in study.experiments if name in before["experiments"] and name not in record["experiments"]]
    files = [TABLES[name].file for name in ("peers", "trials")]
    files = [file for file in files if (KEPT / file).exists() and not (folder / file).exists()]
    for place in (*map(outputs.folder, names), *files):
        copy_kept(KEPT, folder, place)
    record["experiments"] |= {name: before["experiments"][name] for name in names}
    made = [peer["outputs"] for peer in record["peers"]]
    if TABLES["peers"].file in files or any(study.experiments[name].peers for name in names):
        record["peers"] += [peer for peer in before["peers"] if peer["outputs"] not in made]
    return [*names, *files]


def main() -> None:
    parser = argparse.ArgumentParser(description="Make the run in results/ the reference run.")
    parser.add_argument("overlay", nargs="*", help="a YAML file laid over config.yaml")
    parser.add_argument("--policies", action="store_true", help="keep its policies alone")
    parser.add_argument("--force", action="store_true", help="whatever is lost by it")
    parser.add_argument("--report", action="store_true", help="keep its report alone")
    options = parser.parse_args()
    if options.report:
        for built, kept in (("site/index.html", "index.html"), ("reference.pdf", "report.pdf")):
            check_seal(BUILT / built)
            write_bytes(SITE / kept, (BUILT / built).read_bytes())
        print(f"The report of the reference run, to be read: {SITE}")
        return
    if options.policies:
        keep_policies(RESULTS, KEPT, KEPT)
        write_json(KEPT / "manifest.json", read_json(KEPT / "manifest.json") | {"tables": checksums(KEPT)})
        print(f"The reference run's policies: {KEPT / POLICIES}")
        return
    study = load_study(read_settings("config.yaml", *options.overlay))
    with replaced(KEPT) as folder:
        record, others = write_folder(study, folder)
        against = objections(KEPT, folder)
        if against and not options.force:
            raise ValueError(f"results/ does not become the reference run: {'; '.join(against)}. --force keeps it")
        if against:
            print(f"Kept all the same: {'; '.join(against)}", file=sys.stderr)
        text = headline(load(folder, "report/published"), record, f"{KEPT}/{FIGURE}")
        readme = put_headline(README.read_text(encoding="utf-8"), text)
    write_text(README, readme)
    print(f"The reference run: {KEPT} and README.md")
    if others:
        print(f"Not in results/, so as they were kept: {', '.join(others)}")


if __name__ == "__main__":
    try:
        main()
    except (ArtifactError, OSError, ValueError) as error:
        sys.exit(f"{error}")
