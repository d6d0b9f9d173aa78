"""What a training job does around the training: lock its block, go on from a checkpoint, keep one, show progress."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from reacher_shaping.jobs.checkpoint import load_checkpoint, save_checkpoint
from reacher_shaping.jobs.checkpoint_store import CheckpointStore
from reacher_shaping.jobs.progress import Meter
from reacher_shaping.settings.cell import Cell
from reacher_shaping.storage.files import exclusive, write_text
from reacher_shaping.storage.provenance import Record
from reacher_shaping.training.train import TrainState, train

SECONDS_PER_CHECKPOINT = 30.0
FINISHED = "finished"
"""Marks, as a file beside it, a checkpoint whose result was saved."""


@contextmanager
def trained_block(
    cell: Cell,
    seeds: Sequence[int],
    *,
    success_radius: float,
    folder: Path,
    report: Callable[[str], None],
    record: Record | None = None,
    seconds_per_checkpoint: float = SECONDS_PER_CHECKPOINT,
    store: CheckpointStore | None = None,
) -> Iterator[tuple[TrainState, int]]:
    """Train a block to its end, from the checkpoint in `folder` if there is one, and give its final state.

    Beside it stands the number of iterations that were done here, the rest having been done before the checkpoint.

    Meanwhile no other process trains with the same folder. The last checkpoint stays, with the file `finished` beside
    it once the caller has saved the result, that is when the context ends without an exception: if the scheduler was
    killed meanwhile it knows of no result, and the job that it starts again takes the training over from there.
    `store` keeps a copy of each checkpoint where the disk is not shared or does not last.
    `report` gets a line of text now and then, and `record` the time that went into the checkpoint before.
    """
    record, store = record or Record(), store or CheckpointStore()
    checkpoint = folder / "checkpoint.pt"
    with exclusive(folder.with_suffix(".lock")):
        store.fetch(checkpoint)
        state, seconds = load_checkpoint(checkpoint) if checkpoint.exists() else (None, (0.0, 0.0))
        start = state.iteration if state else 0
        if start:
            record.add(*seconds)
            if start < cell.iterations:
                report(f"goes on from iteration {start} of {cell.iterations}")
            else:
                report("takes over the training that a job before has finished")
        meter = Meter(cell.iterations, len(seeds) * cell.protocol.ppo.rollout_steps, start)
        saved = time.monotonic()
        for current in train(cell, seeds, success_radius=success_radius, state=state):
            state = current
            for line in meter.lines(state.iteration):
                report(line)
            if time.monotonic() - saved > seconds_per_checkpoint:
                save_checkpoint(checkpoint, state, record.seconds())
                store.keep(checkpoint)
                saved = time.monotonic()
        assert state is not None, "a cell has at least one iteration"
        if state.iteration > start:
            save_checkpoint(checkpoint, state, record.seconds())
            store.keep(checkpoint)
        yield state, state.iteration - start
        write_text(folder / FINISHED, "")
