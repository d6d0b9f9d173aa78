"""Build the report, one HTML file, from everything the study made."""

import json
from pathlib import Path

import pandas as pd
import yaml
from job import logged

from reacher_shaping.report import html, paper_tables
from reacher_shaping.storage import schemas
from reacher_shaping.storage.files import read_json, read_table, write_text
from reacher_shaping.storage.reference import read_studies

given, params = snakemake.input, snakemake.params

manifests = [given.manifests] if isinstance(given.manifests, str) else given.manifests

with logged(snakemake.log[0]):
    records = [read_json(path) for path in manifests]
    # The reference run brings its own settings: config.yaml may ask for another study by now.
    told = (
        records[0]
        if "study" in records[0]
        else {"study": json.loads(params.study), "settings_hash": params.settings_hash}
    )
    published = [pd.read_csv(path) for path in (given.table2, given.table3, given.left_out)]
    inputs = html.Inputs(
        study=told["study"],
        settings_hash=told["settings_hash"],
        cells=read_table(given.cells, schemas.CELLS),
        runs=read_table(given.runs, schemas.RUNS),
        correlation=read_table(given.correlation, schemas.CORRELATION),
        claims=read_table(given.claims, schemas.CLAIMS),
        controllers=read_table(given.controllers, schemas.CONTROLLERS),
        power=read_table(given.power, schemas.POWER),
        variance=read_table(given.variance, schemas.VARIANCE),
        winners=read_table(given.winners, schemas.WINNERS),
        spread=read_table(given.spread, schemas.SPREAD),
        peers=read_table(given.peers[0], schemas.PEERS) if given.peers else None,
        experiments=read_studies(given.experiments),
        training_logs=pd.read_csv(given.training_logs),
        published=paper_tables.published_cells(*published[:2]),
        every_published=paper_tables.published_cells(*published),
        ledger=yaml.safe_load(Path(given.ledger).read_text(encoding="utf-8")),
        figures={Path(path).stem: Path(path) for path in given.figures if path.endswith(".svg")},
        media=[Path(path) for path in given.media],
        notebooks=[Path(path) for path in given.notebooks],
        manifests=[block for record in records for block in record.get("blocks", [record])],
        template=Path(given.template),
    )
    write_text(snakemake.output[0], html.build(inputs))
