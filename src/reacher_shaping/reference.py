"""The reference run: its summaries, kept in the repository, and how another run compares with it."""

import re
import shutil
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from reacher_shaping import answers, artifacts, experiment_report, experiments, schemas, stats, tables
from reacher_shaping.aggregate import KEY

TABLES = {
    "runs.parquet": schemas.RUNS,
    "cells.parquet": schemas.CELLS,
    "curves.parquet": schemas.CURVES,
    "correlation.csv": schemas.CORRELATION,
    "correlation_published.csv": schemas.CORRELATION,
    "claims.csv": schemas.CLAIMS,
    "claim_parts.csv": schemas.CLAIM_PARTS,
    "controllers.parquet": schemas.CONTROLLERS,
    "radii.parquet": schemas.RADII,
    "long_episodes.parquet": schemas.ALL_LONG_EPISODES,
    "lengths.parquet": schemas.LENGTHS,
    "comparisons.parquet": schemas.COMPARISONS,
    "variance.parquet": schemas.VARIANCE,
    "power.parquet": schemas.POWER,
    "lottery.csv": schemas.LOTTERY,
    "winners.csv": schemas.WINNERS,
    "spread.csv": schemas.SPREAD,
}
"""The study-wide tables that make a reference run; all it takes to draw and tell the study again."""

OPTIONAL = {"peers.parquet": schemas.PEERS, "search/trials.csv": schemas.TRIALS}
"""Tables that are kept with it where the run has them."""

COMPARED = ("success_rate", "mean_return")
LEVEL = 0.05
_BLOCK = re.compile(r"(<!-- reference: begin -->\n).*(<!-- reference: end -->)", re.DOTALL)


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
    found = experiments.read(str(folders[name] / file) for name in made for file in files[name])
    shutil.rmtree(kept / "experiments", ignore_errors=True)
    for name in made:
        for file in files[name]:
            stem = Path(file).stem
            target = kept / "experiments" / name / file
            artifacts.write_table(target, found[name][stem], experiments.SCHEMAS[stem], sealed=False)
    return made


def _keep(source: Path, target: Path, table: schemas.Table) -> None:
    artifacts.write_table(target, artifacts.read_table(source, table), table, sealed=False)


def compare(runs: pd.DataFrame, reference: pd.DataFrame) -> pd.DataFrame:
    """Set two runs of a study side by side: a row per common cell and metric, ours less the reference.

    The seeds of the two may differ, so the difference of means has Welch's interval, and its p value is
    Holm-corrected over all rows. Columns: the cell's key, metric, ours, reference, difference, ci_low, ci_high, p,
    p_holm; p is NaN with fewer than two seeds on a side, and 1 where the runs are the same.
    """
    by_cell = dict(iter(reference.groupby(KEY)))
    rows = []
    for key, own in runs.groupby(KEY):
        if key not in by_cell:
            continue
        for metric in COMPARED:
            ours, theirs = (stats.finite(frame[metric]) for frame in (own, by_cell[key]))
            low, high = stats.welch_interval(ours, theirs)
            difference = stats.mean(ours) - stats.mean(theirs)
            values = (stats.mean(ours), stats.mean(theirs), difference, low, high, stats.welch_p(ours, theirs))
            rows.append((*key, metric, *values))
    columns = [*KEY, "metric", "ours", "reference", "difference", "ci_low", "ci_high", "p"]
    frame = pd.DataFrame(rows, columns=columns)
    return frame.assign(p_holm=stats.holm(frame["p"].to_numpy(dtype=float)))


def agreement(compared: pd.DataFrame) -> str:
    """Say in one line whether two runs agree beyond seed noise."""
    tested = compared.dropna(subset="p_holm")
    if tested.empty:
        return "Cannot tell: no cell has two seeds in both runs."
    apart = tested[tested["p_holm"] < LEVEL]
    cells = len(tested.groupby(KEY))
    if apart.empty:
        return f"The runs agree: none of {cells} cells differs beyond seed noise (Welch, Holm-corrected, 5 %)."
    names = ", ".join("/".join(str(part) for part in key) for key, _ in apart.groupby(KEY))
    return f"The runs differ beyond seed noise in {len(apart.groupby(KEY))} of {cells} cells: {names}."


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
    numbers = ("env_steps", "env_steps_per_second", "wall_seconds", "cpu_seconds", "threads")
    kept = ("algorithm", "seeds", "git", "machine", "versions", "outputs", *numbers)

    def records(given: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
        return [{name: block[name] for name in kept if name in block} for block in given]

    return {
        "study": settings,
        "settings_hash": settings_hash,
        "blocks": records(blocks),
        "experiments": {name: records(given) for name, given in further.items()},
        "peers": records(peers),
    }


def sections(kept: Path, training_logs: pd.DataFrame) -> list[experiment_report.Section]:
    """Return what the report says of the further studies kept in a folder. Raises ArtifactError."""
    given = experiments.read(str(path) for path in sorted(kept.glob("experiments/*/*.*")))
    order = [*(name for name in experiment_report.TITLES if name in given), *(given.keys() - experiment_report.TITLES)]
    return [experiment_report.section(name, given[name], training_logs) for name in order]


def headline(
    cells: pd.DataFrame,
    claims: pd.DataFrame,
    published: pd.DataFrame,
    record: Mapping[str, Any],
    figure: str,
    further: Sequence[experiment_report.Section] = (),
) -> str:
    """Return the README's account of the reference run as Markdown.

    `record` comes from `manifest`; `figure` is the path of the headline figure; `further` comes from `sections`.
    """
    summary = answers.summary(cells, claims)
    questions = [f"- {answer.question} **{answer.short}**" for answer in summary.answers]
    table = tables.to_markdown(tables.table_1(cells, published), "The six best cells of the main grid:")
    picture = f"![Success rate of every cell, with intervals and the published values]({figure})"
    studies = [
        f"- **{own.title.rstrip('?')}.** {' '.join(own.sentences)} {_took(record['experiments'][own.name])}"
        for own in further
    ]
    parts = [" ".join(summary.headline), "\n".join(questions), picture, table.strip()]
    parts += ["The further studies:", "\n".join(studies)] if studies else []
    parts.append(_facts(record))
    return "\n\n".join(parts) + "\n"


def _facts(record: Mapping[str, Any]) -> str:
    """Say in one sentence what the reference run was and what it took."""
    blocks = record["blocks"]
    seeds = sorted({seed for block in blocks for seed in block["seeds"]})
    commits = ", ".join(sorted({str(block["git"]["commit"])[:12] for block in blocks}))
    steps, hours = _spent(blocks)
    return (
        f"The reference run: {len(seeds)} seeds a cell, {steps / 1e6:.0f} million environment steps of training in "
        f"{hours:.1f} core hours, code {commits}; its tables and manifest are in `report/reference/`."
    ) + _further_facts(record)


def _further_facts(record: Mapping[str, Any]) -> str:
    """Say what the further studies and the peers of a reference run took, each block counted once; nothing without."""
    blocks = {str(block["outputs"]): block for own in record.get("experiments", {}).values() for block in own}
    for block in record["blocks"]:
        blocks.pop(str(block["outputs"]), None)
    text = ""
    if blocks:
        steps, hours = _spent(list(blocks.values()))
        text += (
            f" Its further studies took {steps / 1e6:.0f} million steps more, in {hours:.1f} core hours; what several "
            "share is counted once here."
        )
    if record.get("peers"):
        text += f" The peers took {_spent(record['peers'])[1]:.1f} core hours."
    return text


def _took(blocks: Sequence[Mapping[str, Any]]) -> str:
    """Say what the blocks of one further study took, those included that another study trained."""
    steps, hours = _spent(blocks)
    return f"Training: {steps / 1e6:.0f} million steps, {60 * hours:.0f} core minutes."


def _spent(blocks: Sequence[Mapping[str, Any]]) -> tuple[int, float]:
    """Environment steps and core hours of blocks."""
    return sum(block["env_steps"] for block in blocks), sum(block["cpu_seconds"] for block in blocks) / 3600


def put_headline(readme: str, text: str) -> str:
    """Return the README with `text` between its reference marks. Raises ValueError where the marks are missing."""
    if not _BLOCK.search(readme):
        raise ValueError("README.md: the marks <!-- reference: begin --> and <!-- reference: end --> are missing")
    return _BLOCK.sub(lambda found: f"{found[1]}{text}{found[2]}", readme)
