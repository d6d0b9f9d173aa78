"""The file of trained policies: what `policy.pt` holds, written and read."""

from __future__ import annotations

import hashlib
import io
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from torch import Tensor
from reacher_shaping.storage.files import ArtifactError, write_bytes

POLICY_FORMAT = 1


def write_policy(
    path: Path | str, seeds: Sequence[int], weights: Mapping[str, Tensor], settings: Mapping[str, Any]
) -> None:
    """Write S trained policies, each weight stacked over [S]eeds, for `torch.load(weights_only=True)`."""
    import torch

    content = {
        "format": POLICY_FORMAT,
        "seeds": torch.tensor(list(seeds), dtype=torch.int64),
        "weights": {name: weights[name].detach().clone().contiguous() for name in sorted(weights)},
        "settings": json.dumps(settings, sort_keys=True),
    }
    buffer = io.BytesIO()  # not the path: torch stores a file's name in it
    torch.save(content, buffer)
    write_bytes(path, buffer.getvalue())


def weights_checksum(weights: Mapping[str, Tensor]) -> str:
    """Return the sha256 of the weights' bytes, in the order of their names: equal for equal bits and nothing else."""
    digest = hashlib.sha256()
    for name in sorted(weights):
        digest.update(weights[name].detach().contiguous().numpy().tobytes())
    return digest.hexdigest()


@dataclass(frozen=True)
class PolicyFile:
    """What a `policy.pt` holds: run seeds, weights stacked over [S]eeds, and the settings of the training."""

    seeds: list[int]
    weights: dict[str, Tensor]
    settings: dict[str, Any]


def read_policy(path: Path | str) -> PolicyFile:
    """Read a `policy.pt` without executing anything in it. Raises ArtifactError."""
    content = load_tensors(path)
    try:
        if content["format"] != POLICY_FORMAT:
            raise ValueError(f"format {content['format']} is unknown")
        seeds = [int(seed) for seed in content["seeds"]]
        weights = dict(content["weights"])
        if any(len(weight) != len(seeds) for weight in weights.values()):
            raise ValueError("weights and seeds differ in number")
        return PolicyFile(seeds, weights, json.loads(content["settings"]))
    except (KeyError, TypeError, ValueError) as error:
        raise ArtifactError(path, f"is no policy file of this project ({error!r})") from None


def load_tensors(path: Path | str, content: bytes | None = None) -> dict[str, Any]:
    """Load a dict saved by torch, tensors and plain values only: a file with pickled code is refused.

    `content` is the file's, where it has been read already. Raises ArtifactError.
    """
    import torch

    source = path if content is None else io.BytesIO(content)
    try:
        tensors = torch.load(source, map_location="cpu", weights_only=True)
    except FileNotFoundError:
        raise ArtifactError(path, "does not exist", "check the path") from None
    except Exception as error:  # torch raises whatever its unpickler and zip reader meet in a damaged file
        problem = type(error).__name__  # its text would advise to load the file in a way that executes code
        raise ArtifactError(path, f"is no file of plain tensors ({problem})", "nothing in it was executed") from None
    if not isinstance(tensors, dict):
        raise ArtifactError(path, "holds no dict of tensors", "nothing in it was executed")
    return tensors
