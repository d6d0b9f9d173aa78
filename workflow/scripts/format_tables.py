"""Set the paper's three tables, our values beside the published ones, and the tables of further measures."""

from pathlib import Path

import pandas as pd
from job import logged

from reacher_shaping.report import captions, paper_tables
from reacher_shaping.storage import schemas
from reacher_shaping.storage.files import read_table

with logged(snakemake):
    cells = read_table(snakemake.input.cells, schemas.CELLS)
    runs = read_table(snakemake.input.runs, schemas.RUNS)
    published = paper_tables.published_cells(pd.read_csv(snakemake.input.table2), pd.read_csv(snakemake.input.table3))
    frames = {
        "table_1": paper_tables.table_1(cells, published),
        "table_2": paper_tables.table_2(cells, published),
        "table_3": paper_tables.table_3(cells, published),
        "behaviour": paper_tables.behaviour(cells),
        "learning": paper_tables.learning(cells, runs),
    }
    for name, frame in frames.items():
        paper_tables.save(frame, captions.caption(name, cells), Path(snakemake.output[0]).with_name(name))
