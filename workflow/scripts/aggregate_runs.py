"""Put the blocks' tables together: a row per run, a row per cell, and each cell's learning curve."""

import pandas as pd
from job import logged

from reacher_shaping import aggregate, artifacts, curves, schemas
from reacher_shaping.provenance import unchanged

params, output = snakemake.params, snakemake.output
files = list(zip(params.cells, snakemake.input.progress, snakemake.input.episodes, strict=True))

with logged(snakemake.log[0]):
    blocks = (
        (
            cell,
            artifacts.read_table(unchanged(progress), schemas.PROGRESS),
            artifacts.read_table(unchanged(episodes), schemas.EPISODES),
        )
        for cell, progress, episodes in files
    )
    runs = aggregate.runs_frame(blocks)
    progress = pd.concat(
        [artifacts.read_table(path, schemas.PROGRESS).assign(**cell) for cell, path, _ in files], ignore_index=True
    )
    artifacts.write_table(output.runs, runs, schemas.RUNS)
    artifacts.write_table(output.cells, aggregate.cells_frame(runs, params.root_seed), schemas.CELLS)
    artifacts.write_table(output.curves, curves.curve_table(progress), schemas.CURVES)
