"""Draw the main study's figures: the paper's four and those it does not have."""

from pathlib import Path

import pandas as pd
from job import logged

from reacher_shaping.figures.drawing import draw
from reacher_shaping.figures.style import save
from reacher_shaping.report import paper_tables
from reacher_shaping.storage.files import read_table
from reacher_shaping.storage.tables import STUDY_TABLES

given, params = snakemake.input, snakemake.params

with logged(snakemake):
    files = {Path(path).name: path for path in given}
    tables = {
        name: read_table(files[entry.file], entry.schema) for name, entry in STUDY_TABLES.items() if entry.file in files
    }
    published = paper_tables.published_cells(pd.read_csv(given.table2), pd.read_csv(given.table3))
    for name in params.names:
        figure = draw(name, {**tables, "published": published, "radius": params.radius})
        save(figure, Path(snakemake.output[0]).with_name(name))
