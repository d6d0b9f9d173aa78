"""Trained policies in files, this project's or the released code's, read without executing anything in them."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import torch

from reacher_shaping.settings.cell import Cell, Environment
from reacher_shaping.storage.files import ArtifactError
from reacher_shaping.storage.policy_format import load_tensors, read_policy
from reacher_shaping.storage.provenance import recorded_checksum, unchanged
from reacher_shaping.tasks.base import load_task
from reacher_shaping.training.policy import Policy

RELEASED = Environment(control_weight=1.0)
"""The reward that the released code's runs were trained and evaluated on, whatever the paper's text says."""


@dataclass(frozen=True)
class Trained:
    """The runs of one file.

    Attributes:
        name: the cell's, empty for a released file.
        seeds: run seeds [S]; 0 for the one network of a released file, which names none.
        policy: the S networks.
        environment: weight of the control cost and clipping, as in the runs' training.
        root_seed: keys the study's evaluation episodes.
        source: where `environment` comes from, for people.
    """

    name: str
    seeds: list[int]
    policy: Policy
    environment: Environment
    root_seed: int
    source: str


def load_policies(path: Path | str) -> Trained:
    """Read a `policy.pt` of this project, or one state dict in the layout of the released code.

    Raises ArtifactError, one line that names the file, for anything else: no such file, pickled code, a tensor
    missing, of a wrong shape or not finite, or another content than the manifest beside the file says.
    """
    if recorded_checksum(path):  # it still lies where its training put it
        unchanged(path)
    content = load_tensors(path)
    ours = "format" in content and "weights" in content
    try:
        trained = _ours(path) if ours else _released(content)
    except (KeyError, TypeError, ValueError, RuntimeError, AttributeError) as error:
        if isinstance(error, ArtifactError):
            raise
        problem = " ".join(f"{type(error).__name__ if isinstance(error, KeyError) else ''} {error}".split())
        raise ArtifactError(path, f"holds no policy ({problem[:300]})", "give another file") from None
    if not trained.seeds:
        raise ArtifactError(path, "holds no runs", "give another file")
    bad = [name for name, tensor in trained.policy.weights().items() if not tensor.isfinite().all()]
    if bad:
        raise ArtifactError(path, f"{bad[0]} has weights that are not finite: the run diverged", "give another file")
    return trained


def _ours(path: Path | str) -> Trained:
    stored = read_policy(path)
    cell = Cell.model_validate_json(json.dumps(stored.settings["cell"]))
    if len(set(stored.seeds)) != len(stored.seeds):
        raise ValueError(f"a seed is there twice among {stored.seeds}")
    environment = cell.protocol.environment
    policy = _policy(stored.weights, environment.task)
    return Trained(cell.name, stored.seeds, policy, environment, cell.root_seed, "as in its training")


def _released(state: Mapping[str, Any]) -> Trained:
    one = {name: tensor.unsqueeze(0) if isinstance(tensor, torch.Tensor) else tensor for name, tensor in state.items()}
    return Trained("", [0], _policy(one, RELEASED.task), RELEASED, 0, "as for the released runs")


def _policy(weights: Mapping[str, Any], task: str) -> Policy:
    for name, tensor in weights.items():
        if not isinstance(name, str):
            raise ValueError(f"{name!r} is no name of a tensor")
        if isinstance(tensor, torch.Tensor) and (tensor.layout != torch.strided or tensor.device.type != "cpu"):
            raise ValueError(f"{name} is no plain tensor")
    with torch.no_grad():
        return Policy.from_weights(weights, load_task(task))
