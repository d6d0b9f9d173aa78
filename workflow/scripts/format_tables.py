"""Set the paper's three tables, our values beside the published ones, and the tables of further measures."""

from pathlib import Path

import pandas as pd
from job import logged

from reacher_shaping import artifacts, captions, schemas, tables

with logged(snakemake.log[0]):
    cells = artifacts.read_table(snakemake.input.cells, schemas.CELLS)
    runs = artifacts.read_table(snakemake.input.runs, schemas.RUNS)
    published = tables.published_cells(pd.read_csv(snakemake.input.table2), pd.read_csv(snakemake.input.table3))
    frames = {
        "table_1": tables.table_1(cells, published),
        "table_2": tables.table_2(cells, published),
        "table_3": tables.table_3(cells, published),
        "behaviour": tables.behaviour(cells),
        "learning": tables.learning(cells, runs),
    }
    for name, frame in frames.items():
        tables.save(frame, captions.caption(name, cells), Path("results/tables") / name)
