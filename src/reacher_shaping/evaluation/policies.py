"""Trained policies in files, this project's or the released code's, read without executing anything in them."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import torch

from reacher_shaping.settings.cell import Cell, Environment
from reacher_shaping.storage.files import ArtifactError
from reacher_shaping.storage.policy_format import load_tensors, policy_file, tensors_in
from reacher_shaping.storage.provenance import recorded, unchanged
from reacher_shaping.tasks.base import Task, load_task
from reacher_shaping.training.network import Shape, parameter_count
from reacher_shaping.training.policy import TRUNKS, Policy

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


PREFIXES = ("module.", "_orig_mod.")
"""What PyTorch's data parallel and compiled modules put before every name of their state dict."""
MOST_HIDDEN = 4096  # units, as in config.yaml
_SHOWN = 6  # tensors that a message names


def load_policies(path: Path | str) -> Trained:
    """Read a `policy.pt` of this project, or one state dict in the layout of the released code.

    Raises ArtifactError, one line that names the file, for anything else: no such file, pickled code, a tensor
    missing, of a wrong shape or not finite, or another content than the manifest beside the file says.
    """
    content = load_tensors(path)
    if recorded(path):  # it still lies where its training put it
        unchanged(path)
    ours = "format" in content and "weights" in content
    try:
        trained = _ours(path, content) if ours else _released(content)
    except (KeyError, TypeError, ValueError, RuntimeError, AttributeError) as error:
        if isinstance(error, ArtifactError):
            raise
        problem = " ".join(f"{type(error).__name__ if isinstance(error, KeyError) else ''} {error}".split())
        raise ArtifactError(path, f"holds no policy ({problem[:600]})", "give another file") from None
    if not trained.seeds:
        raise ArtifactError(path, "holds no runs", "give another file")
    bad = [name for name, tensor in trained.policy.weights().items() if not tensor.isfinite().all()]
    if bad:
        raise ArtifactError(path, f"{bad[0]} has weights that are not finite: the run diverged", "give another file")
    return trained


def _ours(path: Path | str, content: Mapping[Any, Any]) -> Trained:
    stored = policy_file(path, content)
    cell = Cell.model_validate_json(json.dumps(stored.settings["cell"]))
    if len(set(stored.seeds)) != len(stored.seeds):
        raise ValueError(f"a seed is there twice among {stored.seeds}")
    environment = cell.protocol.environment
    policy = _policy(stored.weights, load_task(environment.task), [len(stored.seeds)])
    return Trained(cell.name, stored.seeds, policy, environment, cell.root_seed, "as in its training")


def _released(content: Mapping[Any, Any]) -> Trained:
    state = _without_prefixes(content)
    return Trained("", [0], _policy(state, load_task(RELEASED.task), []), RELEASED, 0, "as for the released runs")


def _without_prefixes(content: Mapping[Any, Any]) -> Mapping[Any, Any]:
    for prefix in PREFIXES:
        if content and all(isinstance(name, str) and name.startswith(prefix) for name in content):
            return _without_prefixes({name.removeprefix(prefix): tensor for name, tensor in content.items()})
    return content


def _policy(weights: Mapping[Any, Any], task: Task, stack: list[int]) -> Policy:
    """Networks from their tensors, each with the sizes `stack` before its own: [seeds], or none for one network.

    Raises ValueError that says what is wanted and what is there.
    """
    towers = 2 if f"{TRUNKS[2][0]}.0.weight" in weights else 1
    first = weights.get(f"{TRUNKS[towers][0]}.0.weight")
    hidden = first.shape[-2] if torch.is_tensor(first) and first.ndim == len(stack) + 2 else 64
    if hidden > MOST_HIDDEN:
        raise ValueError(f"{hidden} hidden units; allowed: up to {MOST_HIDDEN}")
    wanted = {
        name: [*stack, *shape]
        for name, shape in _shapes(Shape(task.observation_size, task.action_size, hidden, towers)).items()
    }
    missing = [name for name in wanted if not torch.is_tensor(weights.get(name))]
    unknown = [name for name in weights if name not in wanted]
    if missing or unknown:
        lacks = f"{missing[0]} {wanted[missing[0]]} is missing" if missing else f"{unknown[0]!s} is unknown"
        raise ValueError(f"{lacks}; it holds {_held(weights)}; wanted: {', '.join(wanted)}")
    for name, shape in wanted.items():
        tensor = weights[name]
        if list(tensor.shape) != shape or not tensor.is_floating_point():
            kind = str(tensor.dtype).removeprefix("torch.")
            raise ValueError(f"{name} is {kind} {list(tensor.shape)}; allowed: floating point {shape}")
    with torch.no_grad():
        stacked = weights if stack else {name: weights[name].unsqueeze(0) for name in wanted}
        return Policy.from_weights(stacked, task)


def _shapes(network: Shape) -> dict[str, list[int]]:
    """Shape of each tensor of one network."""
    one = Policy(torch.zeros(1, parameter_count(network)), network)
    return {name: list(tensor.shape[1:]) for name, tensor in one.weights().items()}


def _held(content: Mapping[Any, Any]) -> str:
    """Say what a file holds: its first tensors with shapes; of a dict in the dict, where it is."""
    inner = [str(name) for name, value in content.items() if isinstance(value, Mapping)]
    if inner:
        return f"a dict with {', '.join(map(str, content))}, and tensors in {inner[0]!r}: save that part alone"
    tensors = [f"{name} {list(tensor.shape)}" for name, tensor in tensors_in(content)]
    more = f" and {len(tensors) - _SHOWN} more" if len(tensors) > _SHOWN else ""
    return f"{', '.join(tensors[:_SHOWN])}{more}" if tensors else "no tensor"
