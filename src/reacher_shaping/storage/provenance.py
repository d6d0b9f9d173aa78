"""Where a result comes from: its inputs and outputs with checksums, the repository's state, versions, the machine."""

from __future__ import annotations

import os
import platform
import subprocess
import time
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path
from typing import Any

from reacher_shaping import processor
from reacher_shaping.storage.files import ArtifactError, read_json, sha256

PACKAGE = "reacher_shaping"
VERSIONED = (
    "torch", "mujoco", "gymnasium", "numpy", "pandas", "pyarrow", "scipy", "matplotlib", "snakemake",
    "stable-baselines3", "optuna",
)  # fmt: skip


def git_state(folder: Path | str) -> dict[str, Any]:
    """Commit of the repository at `folder` and whether files differ from it; None where there is no repository."""

    def git(*arguments: str) -> str | None:
        command = ["git", "-C", str(folder), *arguments]
        try:
            return subprocess.run(command, capture_output=True, text=True, check=True, timeout=30).stdout.strip()
        except (OSError, subprocess.SubprocessError):
            return None

    status = git("status", "--porcelain")
    return {"commit": git("rev-parse", "HEAD"), "dirty": None if status is None else bool(status)}


def versions() -> dict[str, str]:
    """Versions of Python and of the packages that results depend on."""
    return {"python": platform.python_version(), PACKAGE: metadata.version(PACKAGE)} | {
        name: metadata.version(name) for name in VERSIONED
    }


def machine() -> dict[str, Any]:
    """CPU model, number of cores this process may use, and system."""
    return {"cpu": _cpu(), "cores": len(os.sched_getaffinity(0)), "system": f"{platform.system()} {platform.release()}"}


def recorded_checksum(path: Path | str, *manifests: Path | str) -> tuple[str, Path] | None:
    """Return the checksum of a block's file by one of `manifests`, and that manifest; None if none tells.

    Without manifests, those beside the file are asked.

    Raises ArtifactError for a manifest that cannot be read.
    """
    path = Path(path)
    for manifest in map(Path, manifests or (path.parent / "training.json", path.parent / "manifest.json")):
        outputs = read_json(manifest).get("outputs") if manifest.exists() else None
        if isinstance(outputs, Mapping) and path.name in outputs:
            return str(outputs[path.name]), manifest
    return None


def unchanged(path: Path | str, manifest: Path | str | None = None) -> Path:
    """Return the path of a block's file if its content is what its job wrote, by the checksum in the block's manifest.

    manifest: the one to go by; without it, the one that lies beside the file.

    Raises ArtifactError that names the file that has changed, or the manifest that cannot tell.
    """
    path = Path(path)
    recorded = recorded_checksum(path, *([] if manifest is None else [manifest]))
    if recorded is None:
        raise ArtifactError(path.parent / "training.json", f"has no checksum of {path.name}")
    checksum, manifest = recorded
    if sha256(path) != checksum:
        raise ArtifactError(path, f"is not the file that {manifest} has the checksum of")
    return path


@dataclass
class Record:
    """What a job was: started when the object is made, told by `to_dict` at its end."""

    started: datetime = field(default_factory=lambda: datetime.now(UTC))
    wall: float = field(default_factory=time.perf_counter)
    cpu: float = field(default_factory=time.process_time)

    def add(self, wall: float, cpu: float) -> None:
        """Count the seconds that a process before this one spent on the same job."""
        self.wall -= wall
        self.cpu -= cpu

    def seconds(self) -> tuple[float, float]:
        """Wall and CPU seconds so far."""
        return time.perf_counter() - self.wall, time.process_time() - self.cpu

    def to_dict(
        self, folder: Path, inputs: Iterable[Path], outputs: Iterable[Path], env_steps: int, threads: int
    ) -> dict[str, Any]:
        """The job's part of a manifest; `env_steps` are those it took, in this and in earlier processes.

        Files are named relative to `folder`, or by their name alone outside it.
        """
        wall, cpu = self.seconds()
        return {
            "inputs": _checksums(folder, inputs),
            "outputs": _checksums(folder, outputs),
            "versions": versions(),
            "git": git_state(Path(__file__).parent),
            "machine": machine(),
            "threads": threads,
            "kernels": processor.kernels(),
            "core_type": processor.core_type(),
            "started": self.started.isoformat(timespec="seconds"),
            "finished": datetime.now(UTC).isoformat(timespec="seconds"),
            "wall_seconds": round(wall, 3),
            "cpu_seconds": round(cpu, 3),
            "env_steps": env_steps,
            "env_steps_per_second": round(env_steps / wall, 1),
        }


def merged_manifest(training: Mapping[str, Any], evaluation: Mapping[str, Any]) -> dict[str, Any]:
    """`manifest.json` of a block: the training's record, with the evaluation's beside it and all outputs together."""
    return {
        **training,
        "outputs": {**training["outputs"], **evaluation["outputs"]},
        "evaluation": evaluation,
    }


def _checksums(folder: Path, paths: Iterable[Path]) -> dict[str, str]:
    return {str(path.relative_to(folder) if path.is_relative_to(folder) else path.name): sha256(path) for path in paths}


def _cpu() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
        return next(line.split(":", 1)[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor() or platform.machine()
