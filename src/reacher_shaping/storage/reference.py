"""The reference run: its summaries, kept in the repository, and how another run compares with it."""

import shutil
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pandas as pd

from reacher_shaping.storage.files import (
    ArtifactError,
    read_json,
    read_table,
    sha256,
    write_bytes,
    write_json,
    write_table,
)
from reacher_shaping.storage.policy_format import read_policy, weights_checksum
from reacher_shaping.storage.tables import TABLES

POLICIES = "policies"
"""Folder of the policies that a report shows."""


def read_tables(folder: Path) -> dict[str, pd.DataFrame]:
    """The tables of a study that are in its folder, by name. Raises ArtifactError for a damaged one."""
    paths = {name: folder / entry.file for name, entry in TABLES.items()}
    return {name: read_table(path, TABLES[name].schema) for name, path in paths.items() if path.exists()}


@contextmanager
def replaced(kept: Path) -> Iterator[Path]:
    """Give an empty folder beside `kept`, and put it in that one's place, whole, if nothing was raised.

    Whenever it is killed, `kept` is the old folder or the new one; between two renames it is set aside, and put back by
    the next call.
    """
    new, old = (kept.with_name(f".{kept.name}.{word}") for word in ("new", "old"))
    if old.exists() and not kept.exists():
        old.rename(kept)
    for folder in (new, old):
        shutil.rmtree(folder, ignore_errors=True)
    new.mkdir(parents=True)
    yield new
    if kept.exists():
        kept.rename(old)
    new.rename(kept)
    shutil.rmtree(old, ignore_errors=True)


def checksums(folder: Path) -> dict[str, str]:
    """Checksum of each file of a reference run by its name in the folder, less the manifest that tells them."""
    files = [path for path in sorted(folder.rglob("*")) if path.is_file() and path != folder / "manifest.json"]
    return {str(path.relative_to(folder)): sha256(path) for path in files}


def copy_kept(kept: Path, new: Path, place: str) -> None:
    """Copy what a reference run has in `place`, a study's folder or one file, into another reference run.

    Raises ArtifactError for a file that is not the one that its manifest has the checksum of.
    """
    told = read_json(kept / "manifest.json").get("tables", {})
    for path in sorted(path for path in ((kept / place), *(kept / place).rglob("*")) if path.is_file()):
        name = str(path.relative_to(kept))
        if sha256(path) != told.get(name):
            raise ArtifactError(path, "is not the file that the reference run was kept with")
        write_bytes(new / name, path.read_bytes())


def objections(kept: Path, new: Path) -> list[str]:
    """Say what speaks against `new` in place of `kept`, both folders: what would be lost, blocks that cannot be traced.

    Each has its manifest; an empty or missing `kept` loses nothing. A study that stays as it was kept is not judged.
    """
    record, found = read_json(new / "manifest.json"), []
    before: Mapping[str, Any] = {"experiments": {}}
    if (kept / "manifest.json").exists():
        before = read_json(kept / "manifest.json")
        if _runs(record) < _runs(before):
            found.append(f"it has {_runs(record)} runs of the main study, the one that is kept {_runs(before)}")
        lost = sorted(checksums(kept).keys() - checksums(new).keys())
        if lost:
            found.append(f"it lacks {len(lost)} files of the one that is kept, such as {lost[0]}")
    made = [own for name, own in record["experiments"].items() if own != before["experiments"].get(name)]
    blocks = [*record["blocks"], *(block for own in made for block in own)]
    unknown = sum(block["git"]["dirty"] is not False for block in blocks)
    if unknown:
        found.append(f"{unknown} of its {len(blocks)} blocks were not trained from a clean commit")
    codes: dict[str, set[str]] = {}  # another task, potential or schedule is other code
    for block in blocks:
        codes.setdefault(", ".join(block["chosen"]), set()).add(block["code"])
    several = sorted(name for name, hashes in codes.items() if len(hashes) > 1)
    if several:
        found.append(f"its blocks with {several[0]} were trained by {len(codes[several[0]])} different codes")
    return found


def _runs(record: Mapping[str, Any]) -> int:
    return sum(len(block["seeds"]) for block in record["blocks"])


def keep_tables(results: Path, kept: Path, names: Iterable[str]) -> None:
    """Write tables of a study, by name, and those not always there that are, from its folder into the folder `kept`.

    Raises ArtifactError, and writes nothing, where one is missing or damaged.
    """
    more = [name for name, entry in TABLES.items() if not entry.always and (results / entry.file).exists()]
    found = {name: read_table(results / TABLES[name].file, TABLES[name].schema) for name in (*names, *more)}
    for name, table in found.items():
        write_table(kept / TABLES[name].file, table, TABLES[name].schema, sealed=False)


def keep_policies(results: Path, kept: Path, before: Path) -> None:
    """Copy the policies that a report shows, of `results`, into the folder `kept`, and those of `before` that it lacks.

    So those of a study that was not trained here stay. Raises ArtifactError, and writes nothing, for a policy that is
    not the one that its summary tells of.
    """
    shown: dict[str, Any] = {}
    files: dict[str, bytes] = {}
    for folder in (before / POLICIES, results / POLICIES):
        summary = folder / "policies.json"
        found = read_json(summary) if summary.exists() else {}
        for name, told in found.items():
            path = folder / f"{name}.pt"
            if "weights" in told and weights_checksum(read_policy(path).weights) != told["weights"]:
                raise ArtifactError(path, f"is not the policy that {summary} tells of")
            files |= {path.name: path.read_bytes()} if path.exists() else {}
        shown |= found
    for file, content in files.items():
        write_bytes(kept / POLICIES / file, content)
    if shown:
        write_json(kept / POLICIES / "policies.json", shown)


def records(manifests: Iterable[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Return what a reference run tells of blocks or peers: manifests without inputs; a block's names its cell."""
    numbers = ("env_steps", "env_steps_per_second", "wall_seconds", "cpu_seconds", "threads", "kernels", "core_type")
    kept = (
        "algorithm",
        "started",
        "finished",
        "seeds",
        "chosen",
        "code",
        "git",
        "machine",
        "versions",
        "outputs",
        *numbers,
    )
    return [_cell(one) | {name: one[name] for name in kept if name in one} for one in manifests]


def _cell(block: Mapping[str, Any]) -> dict[str, Any]:
    """The key of a block's cell, under `cell`, and its task; nothing for a peer, which has no cell."""
    cell = block["settings"].get("cell")
    if cell is None:
        return {}
    names = {"protocol": cell["protocol"]["name"], "variant": cell["variant"]["name"]}
    task = cell["protocol"]["environment"]["task"]
    return {"cell": names | {"budget": cell["budget"], "alpha0": cell["alpha0"]}, "task": task}


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
