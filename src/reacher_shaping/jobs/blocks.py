"""The seed blocks that a configuration asks for, and what of them is there, by what the blocks' own records say."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, Literal

from reacher_shaping.settings.cell import Cell
from reacher_shaping.settings.study import Study, block_name
from reacher_shaping.storage.code_hash import code_hash
from reacher_shaping.storage.files import ArtifactError, read_json

State = Literal["done", "trained", "missing", "other settings", "other code", "damaged"]


@dataclass(frozen=True)
class Block:
    """Consecutive seeds of one cell that train together; `folder` is relative to the study's."""

    cell: Cell
    seeds: range

    @property
    def folder(self) -> Path:
        """Where its files lie."""
        return Path("results", self.cell.folder, block_name(self.seeds))


@dataclass(frozen=True)
class Codes:
    """Folder of the workflow's scripts, whose code a block's record is held against."""

    scripts: Path

    def training(self, cell: Cell) -> str:
        """Hash of the code that trains a cell."""
        return _hash(self.scripts / "train_block.py", cell.chosen_code)

    def evaluation(self, cell: Cell) -> str:
        """Hash of the code that evaluates its runs."""
        return _hash(self.scripts / "evaluate_block.py", cell.chosen_code[:1])


@cache
def _hash(script: Path, chosen: tuple[str, ...]) -> str:
    return code_hash(script, chosen)


def blocks(study: Study) -> dict[Block, list[str]]:
    """Return every block of a configuration, each once, with the names of the studies that ask for it."""
    found: dict[Block, list[str]] = {}
    for name, own in study.studies.items():
        for cell in study.cells_of[name]:
            for part in study.blocks(own.seeds):
                found.setdefault(Block(cell, part), []).append(name)
    return found


def state(block: Block, record: Mapping[str, Any], study: Study, codes: Codes) -> State:
    """Return what a block's record, `manifest.json` or `training.json`, says of it: "trained" if not evaluated so.

    "other settings" and "other code" are those of the training: it would be done again.
    """
    if record.get("settings", {}).get("cell") != block.cell.settings() or record.get("seeds") != list(block.seeds):
        return "other settings"
    if record.get("code") != codes.training(block.cell):
        return "other code"
    evaluation = record.get("evaluation", {})
    settings = study.evaluation.model_dump() | {"radius": study.radius_of(block.cell)}
    evaluated = evaluation.get("settings") == settings and evaluation.get("code") == codes.evaluation(block.cell)
    return "done" if evaluated else "trained"


def state_on_disk(block: Block, folder: Path, study: Study, codes: Codes) -> State:
    """The same, read from the study in `folder`."""
    for name in ("manifest.json", "training.json"):
        path = folder / block.folder / name
        if path.exists() and path.with_name("policy.pt").exists():
            try:
                return state(block, read_json(path), study, codes)
            except ArtifactError:
                return "damaged"
    return "missing"
