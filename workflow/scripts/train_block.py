"""Train one seed block of one cell."""

import hashlib
import json
from pathlib import Path

from job import logged

from reacher_shaping.jobs import training_job
from reacher_shaping.jobs.checkpoint_store import CheckpointStore
from reacher_shaping.processor import kernels
from reacher_shaping.settings.cell import Cell
from reacher_shaping.storage import block_schemas
from reacher_shaping.storage.code_hash import reached_files
from reacher_shaping.storage.files import write_json, write_monitors, write_table
from reacher_shaping.storage.policy_format import weights_checksum, write_policy
from reacher_shaping.storage.provenance import Record, exact_versions
from reacher_shaping.tasks.base import load_task

RADIUS = 0.02
"""m, that counts as success in training unless the protocol says another: the paper's, whatever the evaluation's is."""

record = Record()
params, output = snakemake.params, snakemake.output
cell = Cell.model_validate_json(params.cell)
task = load_task(cell.protocol.environment.task)
block = Path(output.policy).parent
key = hashlib.sha256(
    json.dumps([params.cell, params.seeds, params.code, kernels(), exact_versions()]).encode()
).hexdigest()[:16]
success_radius = cell.protocol.environment.radius(RADIUS)
settings = {"cell": cell.settings(), "radius": success_radius}

with logged(snakemake) as say:
    checkpoints = Path("results/.checkpoints") / key
    store = CheckpointStore(snakemake.resources.checkpoints.removeprefix("local"))
    with training_job.trained_block(
        cell, params.seeds, success_radius=success_radius, folder=checkpoints, report=say, record=record, store=store
    ) as (state, _):
        weights = state.policy().weights()
        write_policy(output.policy, params.seeds, weights, settings)
        write_table(output.progress, state.progress_frame(), block_schemas.PROGRESS)
        write_monitors(output.monitor, state.episodes_frame(), task.gymnasium_id, task.step_seconds)
        files = [Path(output.policy), Path(output.progress), *sorted(Path(output.monitor).iterdir())]
        steps = state.iteration * state.layout.steps * len(params.seeds)
        training = record.to_dict(block, reached_files(__file__, cell.chosen_code), files, steps, snakemake.threads)
        who = {"settings": settings, "seeds": params.seeds, "code": params.code, "diverged": state.diverged()}
        write_json(output.training, {**who, "weights": weights_checksum(weights), **training})
