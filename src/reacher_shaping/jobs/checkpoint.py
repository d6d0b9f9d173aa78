"""Checkpoints of a training: written, and read again by the job that goes on.

A checkpoint lies outside the job's outputs, because Snakemake deletes the outputs of a failed job, and in a folder
named by a hash of all that determines the training, so that a changed setting or code never goes on from it.
"""

from __future__ import annotations

import io
from pathlib import Path

import torch

from reacher_shaping.storage.files import ArtifactError, read_sealed, write_sealed
from reacher_shaping.storage.policy_format import load_tensors
from reacher_shaping.training.network import Shape
from reacher_shaping.training.ppo import Adam
from reacher_shaping.training.rollout import RolloutLayout
from reacher_shaping.training.train import TrainState


def save_checkpoint(path: Path, state: TrainState, seconds: tuple[float, float] = (0.0, 0.0)) -> None:
    """Write all that training needs to go on, as plain tensors; the folder's name tells which training it is of.

    `seconds` are the wall and CPU time spent so far.
    """
    content = {
        "training": path.parent.name,
        "seeds": list(state.seeds),
        "shape": list(state.shape),
        "iteration": state.iteration,
        "parameters": state.parameters,
        "adam": {"first": state.adam.first, "second": state.adam.second, "steps": state.adam.steps},
        "progress": {name: torch.from_numpy(values) for name, values in state.progress.items()},
        "episode_returns": torch.from_numpy(state.episode_returns),
        "layout": [state.layout.steps, state.layout.episode_steps],
        "shaping": {name: torch.from_numpy(values) for name, values in state.shaping.items()},
        "unlogged": torch.from_numpy(state.unlogged),
        "seconds": list(seconds),
    }
    buffer = io.BytesIO()
    torch.save(content, buffer)
    write_sealed(path, buffer.getvalue())


def load_checkpoint(path: Path) -> tuple[TrainState, tuple[float, float]]:
    """Read a checkpoint of this training and the wall and CPU seconds it took.

    Raises ArtifactError if it is damaged or of another training.
    """
    content = load_tensors(path, read_sealed(path))
    if content.get("training") != path.parent.name:
        raise ArtifactError(path, "is the checkpoint of another training")
    try:
        wall, cpu = content["seconds"]
        state = TrainState(
            seeds=tuple(content["seeds"]),
            shape=Shape(*content["shape"]),
            parameters=content["parameters"],
            adam=Adam(**content["adam"]),
            iteration=content["iteration"],
            progress={name: values.numpy() for name, values in content["progress"].items()},
            episode_returns=content["episode_returns"].numpy(),
            layout=RolloutLayout(*content["layout"]),
            shaping={name: values.numpy() for name, values in content["shaping"].items()},
            unlogged=content["unlogged"].numpy(),
        )
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise ArtifactError(path, f"is no checkpoint ({error!r})") from None
    return state, (float(wall), float(cpu))
