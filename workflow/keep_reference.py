"""Make the run in `results/` the reference run: keep its summaries, and tell them in the README.

    python workflow/keep_reference.py [--force] [OVERLAY.yaml]

    python workflow/keep_reference.py --policies [OVERLAY.yaml]

keeps the policies of `results/policies` alone, and leaves all else of the reference run as it is.

    python workflow/keep_reference.py --report

keeps the report of the reference run, as `make report` builds it where there are no results, in `report/site`: one page
and one PDF to read without building anything, and for a static host to serve as they are.

The folder is made anew beside the old one and takes its place whole; what targets of their own make and `results/` does
not have, further studies, peers and the search, stays as it was kept, and so does the main study beside a further one
that was made alone. Ends with 1, and changes nothing, where something
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
    objections,
    published_bits,
    records,
    replaced,
)
from reacher_shaping.storage.tables import TABLES

RESULTS, KEPT, README = Path("results"), Path("report/reference"), Path("README.md")
BUILT, SITE = Path("build/reference/report"), Path("report/site")
FIGURE = "headline.svg"
OPTIONAL = tuple(TABLES[name].file for name in ("peers", "trials"))
"""What a study may have, by targets of its own."""
OF_MAIN = ("grid", "seeds", "seeds_per_block", "root_seed", "evaluation")
"""Settings that are the main study's alone."""


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
    hypotheses = outputs.ledgers(yaml.safe_load(Path("report/hypotheses.yaml").read_text(encoding="utf-8")))
    asked = {name: outputs.tables_of(study, name, hypotheses) for name in study.studies}
    further = {}
    for name, tables in asked.items():
        place = outputs.folder(name)
        if all((RESULTS / place / file).exists() for file in tables.values()):
            keep_tables(RESULTS / place, folder / place, tables)
            further[name] = manifests(study, study.cells_of[name], study.studies[name].seeds)
    keep_policies(RESULTS, folder, KEPT)
    main = further.pop(MAIN, None)
    if main is None and (not further or not (KEPT / "manifest.json").exists()):
        keep_tables(RESULTS, folder, asked[MAIN])  # says which is missing
    if main is None:
        record = keep_main(study, folder)
    else:
        write_json(folder / "bits.json", published_bits(main))
        figure = Path("figures/figure_2.svg")
        check_seal(figure)
        shutil.copyfile(figure, folder / FIGURE)
        record = {"blocks": records(main)}
    record |= {"study": study.model_dump(mode="json"), "settings_hash": settings_hash(study)}
    record["experiments"] = {name: records(blocks) for name, blocks in further.items()}
    record["peers"] = records([read_json(path) for path in sorted(RESULTS.glob("**/peers/*/seed*.json"))])
    others = keep_others(study, folder, record) if (KEPT / "manifest.json").exists() else []
    record["tables"] = checksums(folder)
    write_json(folder / "manifest.json", record)
    return record, others


def keep_main(study: Study, folder: Path) -> dict[str, Any]:
    """Copy the main study as it was kept; return the records of its blocks.

    Raises ValueError where today's configuration has other settings for anything that was kept.
    """
    record, now = read_json(KEPT / "manifest.json"), study.model_dump(mode="json")
    before = record["study"]
    other = [name for name in OF_MAIN if before[name] != now[name]]
    for kind in ("protocols", "variants"):
        other += [f"{kind}.{name}" for name, settings in before[kind].items() if now[kind].get(name) != settings]
    if other:
        raise ValueError(f"results/ lacks the main study, and the one that is kept has another {', '.join(other)}")
    for path in KEPT.iterdir():
        if path.is_file() and path.name not in (*OPTIONAL, "manifest.json"):
            copy_kept(KEPT, folder, path.name)
    return {"blocks": record["blocks"]}


def keep_others(study: Study, folder: Path, record: dict[str, Any]) -> list[str]:
    """Add what targets of their own make and were not asked for here, as it was kept, to `record` too; return what."""
    before = read_json(KEPT / "manifest.json")
    names = [name for name in study.experiments if name in before["experiments"] and name not in record["experiments"]]
    files = [file for file in OPTIONAL if (KEPT / file).exists() and not (folder / file).exists()]
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
