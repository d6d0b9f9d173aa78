"""Set the paper's three tables, our values beside the published ones."""

from pathlib import Path

import pandas as pd
from job import logged

from reacher_shaping import artifacts, captions, tables

with logged(snakemake.log[0]):
    cells = artifacts.read_table(snakemake.input.cells, artifacts.CELLS)
    published = tables.published_cells(pd.read_csv(snakemake.input.table2), pd.read_csv(snakemake.input.table3))
    for table in (tables.table_1, tables.table_2, tables.table_3):
        name = table.__name__
        tables.save(table(cells, published), captions.caption(name, cells), Path("results/tables") / name)
