"""From evaluation episodes to success against the radius."""

import json

from job import logged

from reacher_shaping.analysis.runs import radius_cells, radius_frame
from reacher_shaping.storage import block_schemas, schemas
from reacher_shaping.storage.files import read_table, write_table
from reacher_shaping.storage.provenance import unchanged

given, params, output = snakemake.input, snakemake.params, snakemake.output

with logged(snakemake):
    blocks = zip(params.cells, given.episodes, given.manifests, map(json.loads, params.asked), strict=True)
    radii = radius_frame((cell, read_table(unchanged(*file), block_schemas.EPISODES)) for cell, *file in blocks)
    write_table(output.run_radii, radii, schemas.RUN_RADII)
    write_table(output.radii, radius_cells(radii), schemas.RADII)
