"""The reference run: its summaries, kept in the repository, and how another run compares with it."""

import shutil
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from reacher_shaping.storage.block_schemas import Table
from reacher_shaping.storage.files import read_table, write_table
from reacher_shaping.storage.tables import EXPERIMENT_TABLES, STUDY_TABLES

_KEPT = [entry for entry in STUDY_TABLES.values() if entry.kept]
TABLES = {entry.file: entry.schema for entry in _KEPT if entry.always}
"""The study-wide tables that make a reference run; all it takes to draw and tell the study again."""
OPTIONAL = {entry.file: entry.schema for entry in _KEPT if not entry.always}
"""Tables that are kept with it where the run has them."""


def read_studies(paths: Iterable[str]) -> dict[str, dict[str, pd.DataFrame]]:
    """The tables of further studies by study and name, from their files. Raises ArtifactError."""
    found: dict[str, dict[str, pd.DataFrame]] = {}
    for path in map(Path, paths):
        found.setdefault(path.parent.name, {})[path.stem] = read_table(path, EXPERIMENT_TABLES[path.stem].schema)
    return found


def keep_tables(results: Path, kept: Path) -> None:
    """Write the reference tables of `results` into the folder `kept`; an optional one that is not there is none there.

    Raises ArtifactError where another is missing or damaged.
    """
    for name, table in (TABLES | OPTIONAL).items():
        if name in OPTIONAL and not (results / name).exists():
            (kept / name).unlink(missing_ok=True)
            continue
        _keep(results / name, kept / name, table)


def keep_experiments(results: Path, kept: Path, files: Mapping[str, Sequence[str]]) -> list[str]:
    """Write the tables of those further studies that are complete; return their names. Raises ArtifactError.

    `files` are the names of each study's tables.
    """
    folders = {name: results / "experiments" / name for name in files}
    made = [name for name, folder in folders.items() if all((folder / file).exists() for file in files[name])]
    found = read_studies(str(folders[name] / file) for name in made for file in files[name])
    shutil.rmtree(kept / "experiments", ignore_errors=True)
    for name in made:
        for file in files[name]:
            stem = Path(file).stem
            target = kept / "experiments" / name / file
            write_table(target, found[name][stem], EXPERIMENT_TABLES[stem].schema, sealed=False)
    return made


def _keep(source: Path, target: Path, table: Table) -> None:
    write_table(target, read_table(source, table), table, sealed=False)


def manifest(
    settings: Mapping[str, Any],
    settings_hash: str,
    blocks: Sequence[Mapping[str, Any]],
    further: Mapping[str, Sequence[Mapping[str, Any]]],
    peers: Sequence[Mapping[str, Any]],
) -> dict[str, Any]:
    """Return what the reference run was: settings, and the record of each block, further study's block and peer.

    The records are without their inputs.
    """
    numbers = ("env_steps", "env_steps_per_second", "wall_seconds", "cpu_seconds", "threads", "kernels", "core_type")
    kept = ("algorithm", "started", "finished", "seeds", "git", "machine", "versions", "outputs", *numbers)

    def records(given: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
        return [{name: block[name] for name in kept if name in block} for block in given]

    return {
        "study": settings,
        "settings_hash": settings_hash,
        "blocks": records(blocks),
        "experiments": {name: records(given) for name, given in further.items()},
        "peers": records(peers),
    }


def published_bits(blocks: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Return what it takes to train the smallest block again and to see whether its weights have the same bits.

    Raises ValueError if a block was made with native kernels: only portable ones can be compared elsewhere.
    """
    for block in blocks:
        if block.get("kernels") != "portable":
            name = block["settings"]["cell"]["variant"]["name"]
            raise ValueError(f"a block of {name} was made with native kernels; allowed in a reference run: portable")
    smallest = min(blocks, key=lambda block: int(block["env_steps"]))
    kept = ("settings", "seeds", "weights", "kernels", "core_type", "machine", "versions")
    return {name: smallest[name] for name in kept}


def spent(blocks: Sequence[Mapping[str, Any]]) -> tuple[int, float]:
    """Environment steps and core hours of blocks."""
    return sum(block["env_steps"] for block in blocks), sum(block["cpu_seconds"] for block in blocks) / 3600
