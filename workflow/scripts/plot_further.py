"""Draw what the paper does not have: every run, paired differences, other radii, what one seed can show."""

from pathlib import Path

import pandas as pd
from job import logged

from reacher_shaping import artifacts, further, style, tables

given = snakemake.input

with logged(snakemake.log[0]):
    runs = artifacts.read_table(given.runs, artifacts.RUNS)
    cells = artifacts.read_table(given.cells, artifacts.CELLS)
    published = tables.published_cells(pd.read_csv(given.table2), pd.read_csv(given.table3))
    radius = artifacts.read_table(given.radius, artifacts.RADIUS)
    figures = {
        "seed_strip": further.seed_strip(runs, cells, published),
        "forest": further.forest(artifacts.read_table(given.comparisons, artifacts.COMPARISONS)),
        "success_by_radius": further.success_by_radius(radius, radius=snakemake.params.radius),
        "lottery": further.lottery(artifacts.read_table(given.lottery, artifacts.LOTTERY)),
    }
    for name, figure in figures.items():
        style.save(figure, Path("figures") / name)
