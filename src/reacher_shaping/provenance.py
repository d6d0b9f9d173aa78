"""Where a result comes from: the code that made it, the repository's state, the machine.

`code_hash` answers one question for the workflow: would this script compute anything else than before? It looks at
the script and at the definitions of the package that the script reaches, not at whole files. So an edit of a plot
never retrains, and a comment, a docstring, a line break or an unrelated definition reruns nothing.
"""

from __future__ import annotations

import ast
import hashlib
import os
import platform
import subprocess
import time
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import Any

from reacher_shaping import artifacts

PACKAGE = __package__ or "reacher_shaping"
VERSIONED = (
    "torch", "mujoco", "gymnasium", "numpy", "pandas", "pyarrow", "scipy", "matplotlib", "snakemake",
    "stable-baselines3", "optuna",
)  # fmt: skip

NEUTRAL = ("meter", "provenance")  # modules that tell of a result and never change one
WHOLE = "*"  # in place of a definition's name: all definitions of its module

Definition = tuple[str, str]  # (module, name)


def code_hash(script: Path | str) -> str:
    """Hash of the code that a Python script runs in itself and in this package, as hexadecimal text.

    Found by reading, not by running: names reached through `getattr` or `import_module` are not seen. Raises
    SyntaxError or OSError for a script that cannot be read.
    """
    code = reachable_code(Path(script))
    return hashlib.sha256("\n".join(f"{where}: {code[where]}" for where in sorted(code)).encode()).hexdigest()


def reachable_code(script: Path) -> dict[str, str]:
    """Source without comments, docstrings and layout of the script and of every definition of the package it reaches.

    Keys are `script` and `module.name`; statements of a reached module that define no name stand under `module.`.
    """
    start = _Source(script)
    code = {"script": _normalised(start.tree)}
    waiting = start.references(start.tree)
    while waiting:
        module, name = waiting.pop()
        if module in NEUTRAL:
            continue
        source = _source(module)
        names = source.definitions if name == WHOLE else {name, ""} & source.definitions.keys()
        for found in names:
            if f"{module}.{found}" not in code:
                nodes = source.definitions[found]
                code[f"{module}.{found}"] = "\n".join(map(_normalised, nodes))
                waiting |= {reference for node in nodes for reference in source.references(node, module)}
        waiting |= {source.imports[name]} if name in source.imports else set()
    return code


def reached_files(script: Path | str) -> list[Path]:
    """The script and the package's modules it reaches, less those that never change a result."""
    modules = sorted({where.split(".")[0] for where in reachable_code(Path(script))} - {"script"})
    return [Path(script), *map(_path, modules)]


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


def recorded_checksum(path: Path | str) -> tuple[str, Path] | None:
    """Return the checksum of a block's file by the manifest beside it, and that manifest; None if none tells.

    Raises ArtifactError for a manifest that cannot be read.
    """
    path = Path(path)
    for manifest in (path.parent / "training.json", path.parent / "manifest.json"):
        outputs = artifacts.read_json(manifest).get("outputs") if manifest.exists() else None
        if isinstance(outputs, Mapping) and path.name in outputs:
            return str(outputs[path.name]), manifest
    return None


def unchanged(path: Path | str) -> Path:
    """Return the path of a block's file if its content is what its job wrote, by the checksum beside it.

    Raises ArtifactError that names the file that has changed, or the manifest that cannot tell.
    """
    path = Path(path)
    recorded = recorded_checksum(path)
    if recorded is None:
        raise artifacts.ArtifactError(path.parent / "training.json", f"has no checksum of {path.name}")
    checksum, manifest = recorded
    if artifacts.sha256(path) != checksum:
        raise artifacts.ArtifactError(path, f"is not the file that {manifest} has the checksum of")
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
    return {
        str(path.relative_to(folder) if path.is_relative_to(folder) else path.name): artifacts.sha256(path)
        for path in paths
    }


class _Source:
    """One parsed file: its definitions by name (statements that define none under ""), its imports of the package."""

    def __init__(self, path: Path):
        self.tree = ast.parse(path.read_text(encoding="utf-8"), str(path))
        self.imports: dict[str, Definition] = {}
        self.definitions: dict[str, list[ast.stmt]] = {}
        for node in ast.walk(self.tree):
            if isinstance(node, ast.Import | ast.ImportFrom):
                self._add_import(node)
        for statement in self.tree.body:
            if not isinstance(statement, ast.Import | ast.ImportFrom):
                for name in _names(statement) or [""]:
                    self.definitions.setdefault(name, []).append(statement)

    def _add_import(self, node: ast.Import | ast.ImportFrom) -> None:
        for alias in node.names:
            name = alias.asname or alias.name
            origin = alias.name if isinstance(node, ast.Import) else f"{'.' * node.level}{node.module or ''}"
            origin = f"{PACKAGE}.{origin.lstrip('.')}".rstrip(".") if origin.startswith(".") else origin
            if origin.split(".")[0] != PACKAGE:
                continue
            module = origin.removeprefix(PACKAGE).removeprefix(".")
            if isinstance(node, ast.Import):
                self.imports[name.split(".")[0]] = (module, WHOLE)
            elif not module:
                self.imports[name] = (alias.name, WHOLE) if _path(alias.name).exists() else ("__init__", alias.name)
            else:
                self.imports[name] = (module, alias.name)

    def references(self, node: ast.AST, module: str = "") -> set[Definition]:
        """Definitions that a piece of this file names: its own (if it is `module`), imported, or `imported.name`."""
        found: set[Definition] = set()
        inside = set()
        for part in ast.walk(node):
            if isinstance(part, ast.Attribute) and isinstance(part.value, ast.Name):
                origin = self.imports.get(part.value.id)
                if origin and origin[1] == WHOLE:
                    found.add((origin[0], part.attr))
                    inside.add(part.value)
        for part in ast.walk(node):
            if isinstance(part, ast.Name) and part not in inside:
                if part.id in self.imports:
                    found.add(self.imports[part.id])
                elif module and part.id in self.definitions:
                    found.add((module, part.id))
        return found


@cache
def _source(module: str) -> _Source:
    return _Source(_path(module))


def _path(module: str) -> Path:
    return Path(__file__).parent / f"{module.replace('.', '/')}.py"


def _names(statement: ast.stmt) -> list[str]:
    """Names that a top-level statement defines."""
    if isinstance(statement, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
        return [statement.name]
    if isinstance(statement, ast.Assign | ast.AnnAssign):
        targets = statement.targets if isinstance(statement, ast.Assign) else [statement.target]
        return [part.id for target in targets for part in ast.walk(target) if isinstance(part, ast.Name)]
    return []


def _normalised(node: ast.AST) -> str:
    """Source of a node without comments, layout and docstrings."""
    copy = ast.parse(ast.unparse(node))
    for part in ast.walk(copy):
        body = getattr(part, "body", None)
        if isinstance(body, list):
            body[:] = [line for line in body if not _is_text(line)] or [ast.Pass()]
    return ast.unparse(copy)


def _is_text(statement: ast.stmt) -> bool:
    """Whether a statement is a bare string: a docstring, or a comment in a string's clothes."""
    return (
        isinstance(statement, ast.Expr)
        and isinstance(statement.value, ast.Constant)
        and isinstance(statement.value.value, str)
    )


def _cpu() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
        return next(line.split(":", 1)[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor() or platform.machine()
