"""A training job in a fresh process, for its start and its memory: prints three numbers.

Seconds since the epoch and CPU seconds of the process when the first rollout was collected; peak memory in MB at the
end, when the files are written.
"""

import json
import sys
import tempfile
import time
from pathlib import Path

from reacher_shaping.jobs import training_job
from reacher_shaping.settings.cell import Cell
from reacher_shaping.storage import block_schemas
from reacher_shaping.storage.files import write_table
from reacher_shaping.storage.policy_format import write_policy
from reacher_shaping.storage.provenance import Record
from reacher_shaping.training.rollout import Collector

cell = Cell.model_validate_json(sys.argv[1])
seeds = range(int(sys.argv[2]))
record = Record()
collected = []
collect = Collector.collect


def noting_the_time(self, policy, iteration):
    rollout = collect(self, policy, iteration)
    collected.append((time.time(), time.process_time()))
    return rollout


Collector.collect = noting_the_time  # type: ignore[method-assign]

with tempfile.TemporaryDirectory() as folder:
    block = Path(folder)
    training = training_job.trained_block(cell, seeds, success_radius=0.02, folder=block / "checkpoint", report=print)
    with training as (state, _):
        write_policy(block / "policy.pt", list(seeds), state.policy().weights(), {})
        write_table(block / "progress.parquet", state.progress_frame(), block_schemas.PROGRESS)
# Not getrusage: its peak starts from that of the process that started this one.
peak = next(line for line in Path("/proc/self/status").read_text().splitlines() if line.startswith("VmHWM"))
print(json.dumps([*collected[0], int(peak.split()[1]) / 1024]))
