"""From evaluation episodes to success against the radius, and to what changes with an episode's length."""

import pandas as pd
from job import logged

from reacher_shaping import aggregate, artifacts, schemas
from reacher_shaping.provenance import unchanged

given, params, output = snakemake.input, snakemake.params, snakemake.output

with logged(snakemake.log[0]):
    episodes = (
        (cell, artifacts.read_table(unchanged(path), schemas.EPISODES))
        for cell, path in zip(params.cells, given.episodes, strict=True)
    )
    radii = aggregate.radius_cells(aggregate.radius_frame(episodes), params.root_seed)
    artifacts.write_table(output.radii, radii, schemas.RADII)
    long = pd.concat(
        [
            artifacts.read_table(path, schemas.LONG_EPISODES).assign(**cell)
            for cell, path in zip(params.cells, given.long_episodes, strict=True)
        ],
        ignore_index=True,
    )
    artifacts.write_table(output.long_episodes, long, schemas.ALL_LONG_EPISODES)
    artifacts.write_table(output.lengths, aggregate.length_cells(long, params.root_seed), schemas.LENGTHS)
