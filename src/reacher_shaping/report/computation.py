"""How a study was computed, from the manifests of its blocks, and the facts of the page's header."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from reacher_shaping.analysis.comparisons import extent
from reacher_shaping.report.text import say
from reacher_shaping.report.text_tables import Grid
from reacher_shaping.storage.provenance import mixed_versions

Manifests = Sequence[Mapping[str, Any]]
NUMBERS = ("env_steps", "wall_seconds", "cpu_seconds", "env_steps_per_second")
PAPERS_BUDGET = 500_000


def facts(cells: pd.DataFrame, manifests: Manifests, settings_hash: str, protocol: str) -> list[str]:
    """What was computed, when, with which code and settings, in a few words each."""
    diverged = int(cells["diverged"].sum()) if len(cells) else 0
    lost = say("page.facts_diverged", count=diverged) if diverged else ""
    runs = int(cells["seeds"].sum()) if len(cells) else 0
    found = [say("page.study", name=protocol)] if protocol else []
    found.append(say("page.facts", cells=len(cells), runs=runs, diverged=lost))
    days = sorted(str(row["finished"])[:10] for row in manifests if "finished" in row)
    if days:
        name = "page.date" if days[0] == days[-1] else "page.dates"
        found.append(say(name, first=days[0], last=days[-1]))
    elif manifests:
        found.append(say("page.undated"))
    commits = list(dict.fromkeys(_commit(row.get("git", {})) for row in manifests))
    found += [say("page.commit", commit=", ".join(commits))] if commits else []
    return [*found, say("page.settings", hash=settings_hash[:12])] if settings_hash else found


def toy(cells: pd.DataFrame) -> str:
    """A warning where no cell was trained as long as the paper's shortest; else nothing."""
    if cells.empty or cells["budget"].max() >= PAPERS_BUDGET:
        return ""
    return say("page.toy", budget=f"{cells['budget'].max():,}")


def grid(manifests: Manifests) -> Grid | None:
    """Code, machine, threads, sums of steps and time, speed and versions (a word where bits mix); None without any."""
    if not manifests:
        return None
    several = {
        "code": [_commit(manifest.get("git", {})) for manifest in manifests],
        "machine": [_machine(manifest.get("machine", {})) for manifest in manifests],
        "threads": [str(manifest.get("threads", "")) for manifest in manifests],
    }
    frame = pd.DataFrame([{name: row.get(name, np.nan) for name in NUMBERS} for row in manifests])
    total = frame.sum()
    least, median, most = extent(frame["env_steps_per_second"])
    rows = [[say(f"computation.{name}"), "; ".join(dict.fromkeys(values))] for name, values in several.items()]
    rows += [
        [say("computation.jobs"), f"{len(frame):,}"],
        [say("computation.steps"), f"{total['env_steps']:,.0f}"],
        [
            say("computation.time"),
            say("computation.hours", wall=total["wall_seconds"] / 3600, cpu=total["cpu_seconds"] / 3600),
        ],
        [say("computation.speed"), say("computation.speeds", least=least, median=median, most=most)],
    ]
    packages: dict[str, dict[str, None]] = {}
    for manifest in manifests:
        for name, version in manifest.get("versions", {}).items():
            packages.setdefault(name, {})[str(version)] = None
    rows.append([say("computation.versions"), ", ".join(f"{name} {' / '.join(own)}" for name, own in packages.items())])
    if mixed := mixed_versions(manifest for manifest in manifests if "versions" in manifest):
        rows.append([say("computation.bits"), say("computation.mixed", packages=mixed)])
    return Grid([say("computation.what"), say("computation.value")], rows, frozenset({0, 1}))


def _commit(git: Mapping[str, Any]) -> str:
    commit = str(git.get("commit") or say("computation.no_commit"))[:12]
    return say("computation.dirty", commit=commit) if git.get("dirty") else commit


def _machine(machine: Mapping[str, Any]) -> str:
    return ", ".join(str(machine[name]) + (" cores" if name == "cores" else "") for name in machine)
