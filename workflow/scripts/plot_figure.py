"""Draw one figure of a study."""

from pathlib import Path

import pandas as pd
from job import logged

from reacher_shaping.figures import drawing
from reacher_shaping.figures.style import save
from reacher_shaping.report import paper_tables
from reacher_shaping.storage.files import read_table
from reacher_shaping.storage.tables import TABLES

given, params = snakemake.input, snakemake.params

with logged(snakemake):
    tables = {name: read_table(path, TABLES[name].schema) for name, path in given.items() if path and name in TABLES}
    published = paper_tables.published_cells(pd.read_csv(given.table2), pd.read_csv(given.table3))
    more = {"published": published, "training_logs": pd.read_csv(given.training_logs), "radius": params.radius}
    figure = drawing.draw(params.view, {**tables, **more}, drawing.modules_of(params.study))
    save(figure, Path(snakemake.output[0]).with_suffix(""))
