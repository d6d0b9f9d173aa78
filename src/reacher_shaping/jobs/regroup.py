"""A seed block put together from blocks of the same cell and code: the files that training it would have written.

Batched training gives seed k the same numbers whatever else is in its block, and files of equal content have equal
bytes, so policies, logs and episodes are those of a training. The record tells from which blocks they were taken.
"""

from __future__ import annotations

import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd
import torch

from reacher_shaping.jobs.blocks import Block
from reacher_shaping.storage import block_schemas
from reacher_shaping.storage.files import read_table, sha256, write_json, write_table
from reacher_shaping.storage.policy_format import read_policy, weights_checksum, write_policy
from reacher_shaping.storage.provenance import merged_manifest

SAME = ("settings", "code", "versions", "machine", "threads")
"""What the records of all parts must agree in."""

SUMMED = ("wall_seconds", "cpu_seconds", "env_steps")


@dataclass(frozen=True)
class Part:
    """A trained and evaluated block that is there: its folder and its `manifest.json`."""

    folder: Path
    record: Mapping[str, Any]

    @property
    def seeds(self) -> list[int]:
        """Its run seeds."""
        return list(self.record["seeds"])


def fitting(block: Block, parts: Sequence[Part]) -> dict[int, Part]:
    """Return the part that each seed of a block is taken from; empty where a seed is missing or the parts differ."""
    found = {seed: part for part in parts for seed in part.seeds if seed in block.seeds}
    used = list(found.values())
    differ = any(_sameness(part) != _sameness(used[0]) for part in used)
    return {} if differ or len(found) < len(block.seeds) else {seed: found[seed] for seed in block.seeds}


def _sameness(part: Part) -> list[Any]:
    evaluation = part.record.get("evaluation", {})
    return [*(part.record.get(key) for key in SAME), evaluation.get("settings"), evaluation.get("code")]


def write(block: Block, parts: Mapping[int, Part], folder: Path) -> None:
    """Write a block's files into `folder`, each seed from its part.

    Raises ArtifactError for a part's file that cannot be read.
    """
    seeds = list(block.seeds)
    used = list({part.folder: part for part in parts.values()}.values())
    policies = {part.folder: read_policy(part.folder / "policy.pt") for part in used}
    rows = [(policies[parts[seed].folder], parts[seed].seeds.index(seed)) for seed in seeds]
    weights = {name: torch.stack([policy.weights[name][row] for policy, row in rows]) for name in rows[0][0].weights}
    write_policy(folder / "policy.pt", seeds, weights, rows[0][0].settings)
    tables = {
        "progress.parquet": (block_schemas.PROGRESS, ["seed"]),
        "episodes.parquet": (block_schemas.EPISODES, ["mode", "seed"]),
    }
    for name, (schema, order) in tables.items():
        frame = pd.concat([read_table(part.folder / name, schema) for part in used], ignore_index=True)
        frame = frame[frame["seed"].isin(seeds)]
        ascending = [key != "mode" for key in order]  # stochastic comes before deterministic
        write_table(
            folder / name, frame.sort_values(order, ascending=ascending, kind="stable", ignore_index=True), schema
        )
    monitors = [folder / "monitor" / f"{seed}.monitor.csv" for seed in seeds]
    monitors[0].parent.mkdir(parents=True, exist_ok=True)
    for seed, path in zip(seeds, monitors, strict=True):
        shutil.copyfile(parts[seed].folder / "monitor" / path.name, path)
    records = [(part.record, sum(other is part for other in parts.values()) / len(part.seeds)) for part in used]
    training = _merged(records) | {
        "seeds": seeds,
        "weights": weights_checksum(weights),
        "diverged": sorted(seed for record, _ in records for seed in record["diverged"] if seed in parts),
        "taken_from": sorted(part.folder.name for part in used),
        "outputs": _outputs(folder, [folder / "policy.pt", folder / "progress.parquet", *monitors]),
    }
    training.pop("evaluation", None)
    evaluation = _merged([(record["evaluation"], share) for record, share in records])
    evaluation |= {
        "inputs": _outputs(folder, [folder / "policy.pt"]),
        "outputs": _outputs(folder, [folder / "episodes.parquet"]),
    }
    write_json(folder / "training.json", training)
    write_json(folder / "manifest.json", merged_manifest(training, evaluation))


def _merged(records: Sequence[tuple[Mapping[str, Any], float]]) -> dict[str, Any]:
    """One record for the given shares of several: first to last time, sums of seconds and steps."""
    first = dict(records[0][0])
    for key in SUMMED:
        first[key] = round(sum(record[key] * share for record, share in records), 3)
    first["env_steps"] = round(first["env_steps"])
    first["env_steps_per_second"] = round(first["env_steps"] / first["wall_seconds"], 1)
    first["started"] = min(record["started"] for record, _ in records)
    first["finished"] = max(record["finished"] for record, _ in records)
    return first


def _outputs(folder: Path, paths: Sequence[Path]) -> dict[str, str]:
    return {str(path.relative_to(folder)): sha256(path) for path in paths}
