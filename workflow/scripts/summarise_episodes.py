"""From evaluation episodes to success against the radius, and to what changes with an episode's length."""

import json

import pandas as pd
from job import logged

from reacher_shaping.analysis.runs import length_cells, radius_cells, radius_frame
from reacher_shaping.labels import KEY
from reacher_shaping.storage import block_schemas, schemas
from reacher_shaping.storage.files import read_table, write_table
from reacher_shaping.storage.provenance import unchanged

given, params, output = snakemake.input, snakemake.params, snakemake.output

with logged(snakemake):
    asked = list(map(json.loads, params.asked))
    episodes = (
        (cell, read_table(unchanged(path, manifest, block), block_schemas.EPISODES))
        for cell, block, path, manifest in zip(params.cells, asked, given.episodes, given.manifests, strict=True)
    )
    radii = radius_frame(episodes)
    write_table(output.run_radii, radii, schemas.RUN_RADII)
    write_table(output.radii, radius_cells(radii), schemas.RADII)
    long = pd.concat(
        [
            read_table(unchanged(path, manifest, block), block_schemas.LONG_EPISODES).assign(
                **{name: cell[name] for name in KEY}
            )
            for cell, block, path, manifest in zip(
                params.cells, asked, given.long_episodes, given.long_manifests, strict=True
            )
        ],
        ignore_index=True,
    )
    write_table(output.long_episodes, long, schemas.ALL_LONG_EPISODES)
    write_table(output.lengths, length_cells(long), schemas.LENGTHS)
