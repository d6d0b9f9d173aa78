"""Put the blocks' tables together: a row per run, a row per cell, and each cell's learning curve."""

import pandas as pd
from job import logged

from reacher_shaping.analysis import learning_curves
from reacher_shaping.analysis.runs import cells_frame, runs_frame
from reacher_shaping.storage import block_schemas, schemas
from reacher_shaping.storage.files import read_table, write_table
from reacher_shaping.storage.provenance import unchanged

params, output = snakemake.params, snakemake.output
given = snakemake.input
files = list(zip(params.cells, given.progress, given.episodes, given.manifests, strict=True))

with logged(snakemake.log[0]):
    blocks = (
        (
            cell,
            read_table(unchanged(progress, manifest), block_schemas.PROGRESS),
            read_table(unchanged(episodes, manifest), block_schemas.EPISODES),
        )
        for cell, progress, episodes, manifest in files
    )
    runs = runs_frame(blocks)
    progress = pd.concat(
        [read_table(path, block_schemas.PROGRESS).assign(**cell) for cell, path, *_ in files], ignore_index=True
    )
    write_table(output.runs, runs, schemas.RUNS)
    write_table(output.cells, cells_frame(runs), schemas.CELLS)
    write_table(output.curves, learning_curves.curve_table(progress), schemas.CURVES)
