"""Where a result comes from: its inputs and outputs with checksums, the repository's state, versions, the machine."""

from __future__ import annotations

import os
import platform
import subprocess
import time
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path
from typing import Any

from reacher_shaping import processor
from reacher_shaping.storage.files import ArtifactError, read_json, sha256

PACKAGE = "reacher_shaping"
PROJECT = Path(__file__).parents[3]  # the clone's folder; of an installed package it is no repository's
EXACT = frozenset({"torch", "numpy", "mujoco", "gymnasium"})
"""Packages whose version the bits of a run hang on."""
VERSIONED = (
    "torch", "mujoco", "gymnasium", "numpy", "pandas", "pyarrow", "scipy", "matplotlib", "snakemake",
    "stable-baselines3", "optuna",
)  # fmt: skip


def git_state(folder: Path | str = PROJECT) -> dict[str, Any]:
    """Commit of the repository whose top is `folder`, and whether files differ from it; None where it is no such top.

    Git neither climbs to a repository around the folder nor obeys the environment's word of another.
    """
    folder = Path(folder).resolve()
    told = {name: value for name, value in os.environ.items() if not name.startswith("GIT_")}
    told |= {"GIT_CEILING_DIRECTORIES": str(folder.parent), "GIT_OPTIONAL_LOCKS": "0"}

    def git(*arguments: str) -> str | None:
        command = ["git", "-C", str(folder), *arguments]
        try:
            return subprocess.run(
                command, capture_output=True, text=True, check=True, timeout=30, env=told
            ).stdout.strip()
        except (OSError, subprocess.SubprocessError):
            return None

    status = git("status", "--porcelain", "--untracked-files=normal")
    return {"commit": git("rev-parse", "HEAD"), "dirty": None if status is None else bool(status)}


def versions() -> dict[str, str]:
    """Versions of Python and of the packages that results depend on."""
    return {"python": platform.python_version(), PACKAGE: metadata.version(PACKAGE)} | {
        name: metadata.version(name) for name in VERSIONED
    }


def exact_versions() -> dict[str, str]:
    """Versions of the packages that the bits of a run hang on."""
    return {name: metadata.version(name) for name in sorted(EXACT)}


def machine() -> dict[str, Any]:
    """CPU model, number of cores this process may use, and system."""
    return {"cpu": _cpu(), "cores": len(os.sched_getaffinity(0)), "system": f"{platform.system()} {platform.release()}"}


def recorded(path: Path | str, *manifests: Path | str) -> tuple[str, Path] | None:
    """Return the checksum of a job's file by one of `manifests`, and that manifest; None if none tells.

    Without manifests, those beside the file are asked: its own, or its block's.

    Raises ArtifactError for a manifest that cannot be read.
    """
    path = Path(path)
    beside = (path.with_suffix(".json"), path.parent / "training.json", path.parent / "manifest.json")
    for manifest in map(Path, manifests or beside):
        outputs = read_json(manifest).get("outputs") if manifest.exists() else None
        if isinstance(outputs, Mapping) and path.name in outputs:
            return str(outputs[path.name]), manifest
    return None


def unchanged(path: Path | str, manifest: Path | str | None = None, asked: Mapping[str, Any] | None = None) -> Path:
    """Return the path of a job's file if its content is what the job wrote, and the job did what is `asked`.

    manifest: tells both; without it, the one that lies beside the file does. `asked` is a part of it, such as
    `{"seeds": [0, 1]}`. Raises ArtifactError that names the file that has changed, the setting that differs, or the
    manifest that cannot tell.
    """
    path = Path(path)
    known = recorded(path, *([] if manifest is None else [manifest]))
    if known is None:
        raise ArtifactError(path.parent / "training.json", f"has no checksum of {path.name}")
    checksum, manifest = known
    if asked is not None:
        require_asked(manifest, asked)
    if sha256(path) != checksum:
        raise ArtifactError(path, f"is not the file that {manifest} has the checksum of")
    return path


def require_asked(manifest: Path | str, asked: Mapping[str, Any]) -> dict[str, Any]:
    """Return a manifest that records what was `asked`. Raises ArtifactError that names the first key that differs.

    A training's own manifest knows of no evaluation yet.
    """
    manifest = Path(manifest)
    record = read_json(manifest)
    wanted = {key: asked[key] for key in asked if manifest.name != "training.json" or key != "evaluation"}
    first = next(differences(record, wanted), None)
    if first:
        key, made, now = first
        raise ArtifactError(
            manifest,
            f"tells of {key} = {made}, where {now} is asked for",
            f"ask for the same, or delete {manifest.parent} and run snakemake again",
        )
    return record


def differences(record: object, asked: object, key: str = "") -> Iterator[tuple[str, object, object]]:
    """Yield each key of `asked` whose value in `record` is another, as `cell.budget`, and both values."""
    if isinstance(asked, Mapping) and isinstance(record, Mapping):
        for name, value in asked.items():
            yield from differences(record.get(name), value, f"{key}.{name}" if key else str(name))
    elif record != asked:
        yield key, record, asked


def changed_outputs(manifest: Path) -> list[str]:
    """One line per file that is not what the manifest beside it says. Raises ArtifactError."""
    outputs = read_json(manifest).get("outputs")
    if not isinstance(outputs, Mapping):
        raise ArtifactError(manifest, "holds no outputs")
    return differing(manifest.parent, outputs)


def differing(folder: Path, expected: Mapping[str, str]) -> list[str]:
    """One line per file of `folder` that has not the checksum expected."""
    found = []
    for name, checksum in expected.items():
        file = folder / name
        if not file.exists():
            found.append(f"{file}: is missing; snakemake makes it again")
        elif sha256(file) != checksum:
            found.append(f"{file}: has changed since it was made; delete it and run snakemake again")
    return found


def mixed_versions(records: Iterable[Mapping[str, Any]]) -> str:
    """Say which packages that the bits hang on differ between records; empty where all have the same."""
    found: dict[str, set[str]] = {}
    for record in records:
        for name in EXACT & record["versions"].keys():
            found.setdefault(name, set()).add(record["versions"][name])
    return "; ".join(f"{name} {' and '.join(sorted(found[name]))}" for name in sorted(found) if len(found[name]) > 1)


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
            "git": git_state(),
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
