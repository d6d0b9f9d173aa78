"""Build the report, one HTML file and one PDF, from everything the study made."""

import json
from dataclasses import replace
from pathlib import Path

from job import logged

from reacher_shaping.analysis import sanity
from reacher_shaping.report import html, pdf
from reacher_shaping.report.loader import load
from reacher_shaping.settings.study import MAIN
from reacher_shaping.storage.files import ArtifactError, read_json, write_bytes, write_text
from reacher_shaping.storage.provenance import differing, require_asked

given, params = snakemake.input, snakemake.params
manifests = [given.manifests] if isinstance(given.manifests, str) else given.manifests
results = Path(given.runs).parent

with logged(snakemake):
    records = [read_json(path) for path in manifests]
    if "study" not in records[0]:
        asked = [*params.asked, *params.further_asked]
        for path, block in zip([*manifests, *given.further_manifests], asked, strict=True):
            require_asked(path, json.loads(block))
    else:
        kept = {
            name: checksum for name, checksum in records[0].get("tables", {}).items() if str(results / name) in given
        }
        if changed := differing(results, kept):
            raise ValueError(changed[0])
    # The reference run brings its own settings: config.yaml may ask for another study by now.
    now = json.loads(params.study)
    told = records[0] if "study" in records[0] else {"study": now, "settings_hash": params.settings_hash}
    study = load(results, Path(given.table2).parent)
    if "study" not in records[0]:
        expected = {"seeds": params.seeds, "episodes": params.episodes}
        found = sanity.problems(study.tables["runs"], study.tables["cells"], params.cells, **expected, limits={})
        if found:
            raise ArtifactError(given.runs, f"is of another study than config.yaml's: {found[0]}", "run snakemake")
    inputs = html.Inputs(
        settings=told["study"],
        settings_hash=told["settings_hash"],
        study=study,
        figures={Path(path).stem: Path(path) for path in given.figures if path.endswith(".svg")},
        media=[Path(path) for path in given.media],
        notebooks=[Path(path) for path in given.notebooks],
        policies=next((Path(path) for path in given.policies), None),
        headings={MAIN: now, **now["experiments"]},
        manifests=[block for record in records for block in record.get("blocks", [record])],
        template=Path(given.template),
    )
    write_text(snakemake.output.page, html.build(inputs))
    if hasattr(snakemake.output, "alone"):  # the page where no notebook lies beside it
        write_text(snakemake.output.alone, html.build(replace(inputs, notebooks=[])))
    write_bytes(snakemake.output.paper, pdf.build(inputs))
