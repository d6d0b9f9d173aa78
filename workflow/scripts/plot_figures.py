"""Draw the paper's four figures."""

from pathlib import Path

import pandas as pd
from job import logged

from reacher_shaping import artifacts, bars, plots, schemas, style, tables

given = snakemake.input

with logged(snakemake.log[0]):
    cells = artifacts.read_table(given.cells, schemas.CELLS)
    curves = artifacts.read_table(given.curves, schemas.CURVES)
    correlation = artifacts.read_table(given.correlation, schemas.CORRELATION)
    theirs = artifacts.read_table(given.published_correlation, schemas.CORRELATION)
    controllers = artifacts.read_table(given.controllers, schemas.CONTROLLERS)
    published = tables.published_cells(pd.read_csv(given.table2), pd.read_csv(given.table3))
    figures = {
        "figure_1": plots.figure_1(curves),
        "figure_2": bars.figure_2(cells, published, controllers=controllers),
        "figure_3": plots.figure_3(correlation, theirs),
        "figure_4": plots.figure_4(curves),
    }
    for name, figure in figures.items():
        style.save(figure, Path("figures") / name)
