"""Draw the paper's four figures."""

from pathlib import Path

import pandas as pd
from job import logged

from reacher_shaping.figures import bars, paper
from reacher_shaping.figures.style import save
from reacher_shaping.report import paper_tables
from reacher_shaping.storage import schemas
from reacher_shaping.storage.files import read_table

given = snakemake.input

with logged(snakemake.log[0]):
    cells = read_table(given.cells, schemas.CELLS)
    curves = read_table(given.curves, schemas.CURVES)
    correlation = read_table(given.correlation, schemas.CORRELATION)
    theirs = read_table(given.correlation_published, schemas.CORRELATION)
    controllers = read_table(given.controllers, schemas.CONTROLLERS)
    published = paper_tables.published_cells(pd.read_csv(given.table2), pd.read_csv(given.table3))
    figures = {
        "figure_1": paper.figure_1(curves),
        "figure_2": bars.figure_2(cells, published, controllers=controllers),
        "figure_3": paper.figure_3(correlation, theirs),
        "figure_4": paper.figure_4(curves),
    }
    for name, figure in figures.items():
        save(figure, Path("figures") / name)
