"""What a training job does around the training: lock its block, go on from a checkpoint, keep one, show progress.

A checkpoint lies outside the job's outputs, because Snakemake deletes the outputs of a failed job, and in a folder
named by a hash of all that determines the training, so that a changed setting or code never goes on from it.
"""

from __future__ import annotations

import io
import shutil
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import torch

from reacher_shaping import artifacts
from reacher_shaping.cell import Cell
from reacher_shaping.meter import Meter
from reacher_shaping.ppo import Adam
from reacher_shaping.provenance import Record
from reacher_shaping.train import TrainState, train

SECONDS_PER_CHECKPOINT = 30.0


@contextmanager
def trained_block(
    cell: Cell,
    seeds: Sequence[int],
    *,
    radius: float,
    folder: Path,
    report: Callable[[str], None],
    record: Record | None = None,
    seconds_per_checkpoint: float = SECONDS_PER_CHECKPOINT,
) -> Iterator[tuple[TrainState, int]]:
    """Train a block to its end, from the checkpoint in `folder` if there is one, and give its final state.

    Beside it stands the number of iterations that were done here, the rest having been done before the checkpoint.

    Meanwhile no other process trains with the same folder; the checkpoint is removed once the caller has saved the
    result, that is when the context ends without an exception. `report` gets a line of text now and then, and `record`
    the time that went into the checkpoint before.
    """
    record = record or Record()
    torch.set_num_threads(1)  # a job is one thread, on any machine: the number of threads may change the last bits
    checkpoint = folder / "checkpoint.pt"
    with artifacts.exclusive(folder.with_suffix(".lock")):
        state, seconds = load_checkpoint(checkpoint) if checkpoint.exists() else (None, (0.0, 0.0))
        start = state.iteration if state else 0
        if start:
            record.add(*seconds)
            report(f"goes on from iteration {start} of {cell.iterations}")
        meter = Meter(cell.iterations, len(seeds) * cell.protocol.ppo.rollout_steps, start)
        saved = time.monotonic()
        for current in train(cell, seeds, radius=radius, state=state):
            state = current
            for line in meter.lines(state.iteration):
                report(line)
            if time.monotonic() - saved > seconds_per_checkpoint:
                save_checkpoint(checkpoint, state, record.seconds())
                saved = time.monotonic()
        assert state is not None, "a cell has at least one iteration"
        yield state, state.iteration - start
        shutil.rmtree(folder, ignore_errors=True)  # a process killed while it wrote has left a temporary file there


def save_checkpoint(path: Path, state: TrainState, seconds: tuple[float, float] = (0.0, 0.0)) -> None:
    """Write all that training needs to go on, as plain tensors; the folder's name tells which training it is of.

    `seconds` are the wall and CPU time spent so far.
    """
    content = {
        "training": path.parent.name,
        "seeds": list(state.seeds),
        "iteration": state.iteration,
        "rows": state.rows,
        "adam": {"first": state.adam.first, "second": state.adam.second, "steps": state.adam.steps},
        "progress": {name: torch.from_numpy(values) for name, values in state.progress.items()},
        "episode_returns": torch.from_numpy(state.episode_returns),
        "rollout_steps": state.rollout_steps,
        "unlogged": torch.from_numpy(state.unlogged),
        "seconds": list(seconds),
    }
    buffer = io.BytesIO()
    torch.save(content, buffer)
    artifacts.write_sealed(path, buffer.getvalue())


def load_checkpoint(path: Path) -> tuple[TrainState, tuple[float, float]]:
    """Read a checkpoint of this training and the wall and CPU seconds it took.

    Raises ArtifactError if it is damaged or of another training.
    """
    content = artifacts.load_tensors(path, artifacts.read_sealed(path))
    if content.get("training") != path.parent.name:
        raise artifacts.ArtifactError(path, "is the checkpoint of another training")
    try:
        wall, cpu = content["seconds"]
        state = TrainState(
            seeds=tuple(content["seeds"]),
            rows=content["rows"],
            adam=Adam(**content["adam"]),
            iteration=content["iteration"],
            progress={name: values.numpy() for name, values in content["progress"].items()},
            episode_returns=content["episode_returns"].numpy(),
            rollout_steps=content["rollout_steps"],
            unlogged=content["unlogged"].numpy(),
        )
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise artifacts.ArtifactError(path, f"is no checkpoint ({error!r})") from None
    return state, (float(wall), float(cpu))
