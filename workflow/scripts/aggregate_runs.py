"""Put the blocks' tables together: a row per run, a row per cell, and each cell's learning curve."""

import json
import sys

import pandas as pd
from job import logged

from reacher_shaping.analysis import learning_curves
from reacher_shaping.analysis.runs import cells_frame, runs_frame
from reacher_shaping.storage import block_schemas, schemas
from reacher_shaping.storage.files import read_json, read_table, write_table
from reacher_shaping.storage.provenance import mixed_versions, unchanged

params, output = snakemake.params, snakemake.output
given = snakemake.input
asked = map(json.loads, params.asked)
files = list(zip(params.cells, asked, given.progress, given.episodes, given.manifests, strict=True))

with logged(snakemake):
    blocks = (
        (
            cell,
            read_table(unchanged(progress, manifest, block), block_schemas.PROGRESS),
            read_table(unchanged(episodes, manifest, block), block_schemas.EPISODES),
        )
        for cell, block, progress, episodes, manifest in files
    )
    runs = runs_frame(blocks)
    if mixed := mixed_versions(map(read_json, given.manifests)):
        print(f"Blocks of different versions, so of bits that no one machine makes again: {mixed}", file=sys.stderr)
    progress = pd.concat(
        [read_table(path, block_schemas.PROGRESS).assign(**cell) for cell, _, path, *_ in files], ignore_index=True
    )
    write_table(output.runs, runs, schemas.RUNS)
    write_table(output.cells, cells_frame(runs), schemas.CELLS)
    write_table(output.curves, learning_curves.curve_table(progress), schemas.CURVES)
    write_table(output.seed_curves, learning_curves.seed_curves(progress), schemas.SEED_CURVES)
