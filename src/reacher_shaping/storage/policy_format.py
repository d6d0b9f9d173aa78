"""The file of trained policies: what `policy.pt` holds, written and read.

A file may come from anywhere. So it is bounded before anything is made of it: by its size, by the kinds of things its
pickle names, and by the size that its tensors declare.
"""

from __future__ import annotations

import hashlib
import io
import json
import pickletools
import stat
import zipfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from torch import Tensor
from reacher_shaping.storage.files import ArtifactError, write_bytes

POLICY_FORMAT = 1
MOST_SEEDS = 1000  # of a file, as of a seed block
MOST_BYTES = 2**30  # of a file; ten seeds of 64 hidden units are 0.2 MB
MOST_REPEATED = 2**26  # bytes of tensors that may be more than a file holds, one number standing for many
MOST_PICKLED = 2**20  # bytes of a file's structure; 13 tensors take 2,000
_PLAIN = ("collections OrderedDict", "torch._utils _rebuild_tensor_v2", "torch._utils _rebuild_parameter")


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
    return policy_file(path, load_tensors(path))


def policy_file(path: Path | str, content: Mapping[str, Any]) -> PolicyFile:
    """Return what `load_tensors` found in a `policy.pt`. Raises ArtifactError where it is none of this project."""
    try:
        if content["format"] != POLICY_FORMAT:
            raise ValueError(f"format {content['format']} is unknown")
        seeds = _seeds(content["seeds"])
        weights = dict(content["weights"])
        if any(len(weight) != len(seeds) for weight in weights.values()):
            raise ValueError("weights and seeds differ in number")
        return PolicyFile(seeds, weights, json.loads(content["settings"]))
    except (KeyError, TypeError, ValueError, RecursionError) as error:
        raise ArtifactError(path, f"is no policy file of this project ({error!r})") from None


def _seeds(stored: Any) -> list[int]:
    """Run seeds [S] from their tensor. Raises ValueError."""
    import torch

    if not isinstance(stored, torch.Tensor) or stored.dtype != torch.int64 or stored.ndim != 1:
        kind = f"{stored.dtype} {list(stored.shape)}" if isinstance(stored, torch.Tensor) else type(stored).__name__
        raise ValueError(f"seeds are {kind}; allowed: a tensor of int64, one number a run")
    if len(stored) > MOST_SEEDS or (stored < 0).any():
        raise ValueError(f"{len(stored)} seeds from {stored.min()}; allowed: up to {MOST_SEEDS}, whole numbers from 0")
    seeds: list[int] = stored.tolist()
    return seeds


def load_tensors(path: Path | str, content: bytes | None = None) -> dict[Any, Any]:
    """Load a dict saved by torch, tensors and plain values only: a file with pickled code is refused.

    `content` is the file's, where it has been read already. Raises ArtifactError, for a file that asks for more memory
    than it has numbers, too.
    """
    import torch

    content = _bytes(path) if content is None else content
    problem = _unbounded(content)
    if problem:
        raise ArtifactError(path, f"is no file of plain tensors ({problem})", "nothing in it was executed")
    try:
        tensors = torch.load(io.BytesIO(content), map_location="cpu", weights_only=True)
    except Exception as error:  # torch raises whatever its unpickler and zip reader meet in a damaged file
        problem = type(error).__name__  # its text would advise to load the file in a way that executes code
        raise ArtifactError(path, f"is no file of plain tensors ({problem})", "nothing in it was executed") from None
    if not isinstance(tensors, dict):
        raise ArtifactError(path, "holds no dict of tensors", "nothing in it was executed")
    declared = sum(tensor.numel() * tensor.element_size() for _, tensor in tensors_in(tensors))
    if declared > max(len(content), MOST_REPEATED):
        problem = f"its {len(content)} bytes declare tensors of {declared}; allowed: as many as it has"
        raise ArtifactError(path, problem, "give another file")
    return tensors


def tensors_in(content: Mapping[Any, Any]) -> Iterator[tuple[str, Tensor]]:
    """Yield the tensors of a dict and of the dicts in it, by names such as `weights.log_std`."""
    import torch

    for name, value in content.items():
        if isinstance(value, torch.Tensor):
            yield str(name), value
        elif isinstance(value, Mapping):
            yield from ((f"{name}.{inner}", tensor) for inner, tensor in value.items() if torch.is_tensor(tensor))


def _bytes(path: Path | str) -> bytes:
    """Content of a file of bounded size; what is no file, a pipe that nobody writes to for one, is not opened."""
    path = Path(path)
    try:
        found = path.stat()
        if not stat.S_ISREG(found.st_mode):
            raise ArtifactError(path, "is no file", "give the path of a file")
        if found.st_size > MOST_BYTES:
            raise ArtifactError(path, f"has {found.st_size} bytes; allowed: up to {MOST_BYTES}", "give another file")
        return path.read_bytes()
    except FileNotFoundError:
        raise ArtifactError(path, "does not exist", "check the path") from None
    except OSError as error:
        raise ArtifactError(path, f"cannot be read ({error.strerror})", "check the path") from None


def _unbounded(content: bytes) -> str:
    """Say why a file's content could become more than it is, by its zip and its pickle; empty where it could not."""
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as packed:
            entries = packed.infolist()
            if any(entry.compress_type != zipfile.ZIP_STORED for entry in entries):
                return "it is compressed, which torch.save never does"
            if sum(entry.file_size for entry in entries) > len(content):
                return "its parts declare more bytes than it has"
            pickled = [entry for entry in entries if entry.filename.endswith("/data.pkl")]
            if len(pickled) != 1 or pickled[0].file_size > MOST_PICKLED:
                return f"one data.pkl of up to {MOST_PICKLED} bytes is wanted in it"
            named = [(code.name, str(of)) for code, of, _ in pickletools.genops(packed.read(pickled[0]))]
    except (zipfile.BadZipFile, NotImplementedError, ValueError, EOFError, RuntimeError, OSError) as error:
        return f"it is not as torch.save writes: {type(error).__name__}"
    for code, of in named:
        plain = of in _PLAIN or (of.startswith("torch ") and of.endswith("Storage"))
        if code in {"INST", "STACK_GLOBAL"} or (code == "GLOBAL" and not plain):
            return f"it names {of if code != 'STACK_GLOBAL' else 'code'}"
    return ""
