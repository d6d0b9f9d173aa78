"""Stop the study where its results are not what results can be: missing runs, impossible values."""

import json

from job import logged

from reacher_shaping.analysis import sanity
from reacher_shaping.settings.cell import Protocol
from reacher_shaping.storage import schemas
from reacher_shaping.storage.files import read_table, write_text
from reacher_shaping.tasks.base import load_task

params = snakemake.params

with logged(snakemake):
    runs = read_table(snakemake.input.runs, schemas.RUNS)
    cells = read_table(snakemake.input.cells, schemas.CELLS)
    limits = {}
    for protocol in map(Protocol.model_validate, json.loads(params.protocols)):
        bounds = load_task(protocol.environment.task).bounds
        limits[protocol.name] = sanity.Limits(bounds.distance, bounds.highest_return[protocol.environment.reward])
    problems = sanity.problems(runs, cells, params.cells, seeds=params.seeds, episodes=params.episodes, limits=limits)
    if problems:
        raise ValueError("; ".join(problems))
    write_text(snakemake.output[0], f"{len(runs)} runs of {len(cells)} cells: complete and plausible\n")
