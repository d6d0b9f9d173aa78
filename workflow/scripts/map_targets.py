"""Count over an experiment's targets how often its policies end at them."""

import json

import pandas as pd
from job import logged

from reacher_shaping.analysis.target_maps import reacher_targets, target_map
from reacher_shaping.storage import block_schemas, schemas
from reacher_shaping.storage.files import read_table, write_table
from reacher_shaping.storage.provenance import unchanged

given, params = snakemake.input, snakemake.params

with logged(snakemake):
    blocks = zip(params.cells, given.episodes, given.manifests, map(json.loads, params.asked), strict=True)
    parts = [read_table(unchanged(*file), block_schemas.EPISODES).assign(**cell) for cell, *file in blocks]
    episodes = pd.concat(parts, ignore_index=True)
    targets = reacher_targets(params.root_seed, int(episodes["episode"].max()) + 1)
    write_table(snakemake.output.targets, target_map(episodes, targets), schemas.TARGETS)
