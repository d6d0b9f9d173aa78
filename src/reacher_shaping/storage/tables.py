"""The catalogue of tables: of each its file, schema, what a row is, which rule makes it and which rules read it.

The rules, the reference run, the report, the notebooks and `docs/tables.md` come from here; what the columns mean
stands in `columns.yaml`. Nothing heavy is loaded, for the workflow.
"""

from collections.abc import Mapping
from dataclasses import dataclass

from reacher_shaping.storage import block_schemas, schemas
from reacher_shaping.storage.block_schemas import Table


@dataclass(frozen=True)
class Entry:
    """A table: its file, schema, what a row is, the rule that makes it, and those that read it.

    The file is named below the folder of a block, of `results/` or of a further study. `kept`: the reference run has
    it; `always`: every such folder does.
    """

    file: str
    schema: Table
    row: str
    made_by: str
    read_by: tuple[str, ...] = ()
    kept: bool = True
    always: bool = True


REPORT = ("build_report",)
BLOCK_TABLES = {
    "progress": Entry(
        "progress.parquet",
        block_schemas.PROGRESS,
        "a seed and training iteration",
        "train_block",
        ("aggregate_runs", "summarise_experiment"),
        kept=False,
    ),
    "episodes": Entry(
        "episodes.parquet",
        block_schemas.EPISODES,
        "a seed, mode and evaluation episode",
        "evaluate_block",
        ("aggregate_runs", "summarise_episodes"),
        kept=False,
    ),
    "long_episodes": Entry(
        "long_episodes.parquet",
        block_schemas.LONG_EPISODES,
        "a seed, mode and length of episodes",
        "evaluate_long",
        ("summarise_episodes",),
        kept=False,
    ),
}
"""Tables of a seed block, in `results/{protocol}/{variant}/{budget}/alpha{alpha0}/seeds{first}-{last}/`."""
_AGGREGATED = {
    "runs": ("runs.parquet", schemas.RUNS, "a run: one seed of one cell"),
    "cells": ("cells.parquet", schemas.CELLS, "a cell: means over its runs with intervals"),
    "curves": ("curves.parquet", schemas.CURVES, "a cell and training iteration"),
}
STUDY_TABLES = {
    "runs": Entry(
        *_AGGREGATED["runs"],
        "aggregate_runs",
        (
            "correlate",
            "compare_runs",
            "check_results",
            "judge_claims",
            "format_tables",
            "plot_figures",
            *REPORT,
        ),
    ),
    "cells": Entry(
        *_AGGREGATED["cells"],
        "aggregate_runs",
        ("check_results", "format_tables", "plot_figures", *REPORT),
    ),
    "curves": Entry(*_AGGREGATED["curves"], "aggregate_runs", ("plot_figures", *REPORT)),
    "seed_curves": Entry(
        "seed_curves.parquet",
        schemas.SEED_CURVES,
        "a run and every third training iteration",
        "aggregate_runs",
        REPORT,
        always=False,
    ),
    "correlation": Entry(
        "correlation.csv",
        schemas.CORRELATION,
        "a pair of quantities, a coefficient and a level",
        "correlate",
        ("plot_figures", *REPORT),
    ),
    "correlation_published": Entry(
        "correlation_published.csv",
        schemas.CORRELATION,
        "the same, over the published cells",
        "correlate",
        ("plot_figures",),
    ),
    "claims": Entry("claims.csv", schemas.CLAIMS, "a claim of the paper", "judge_claims", REPORT),
    "claim_parts": Entry("claim_parts.csv", schemas.CLAIM_PARTS, "an estimate behind a claim", "judge_claims", REPORT),
    "family_error": Entry(
        "family_error.csv", schemas.FAMILY_ERROR, "a way of reading the estimates of the claims", "judge_claims"
    ),
    "sensitivity": Entry(
        "sensitivity.csv", schemas.SENSITIVITY, "a claim and a choice of the analysis", "judge_claims"
    ),
    "controllers": Entry(
        "controllers.parquet",
        schemas.CONTROLLERS,
        "a policy that needs no learning, and a mode",
        "evaluate_controllers",
        ("judge_claims", "plot_figures", *REPORT),
    ),
    "run_radii": Entry(
        "run_radii.parquet", schemas.RUN_RADII, "a run, mode and success radius", "summarise_episodes", always=False
    ),
    "radii": Entry(
        "radii.parquet",
        schemas.RADII,
        "a cell, mode and success radius",
        "summarise_episodes",
        ("plot_figures", *REPORT),
    ),
    "long_episodes": Entry(
        "long_episodes.parquet",
        schemas.ALL_LONG_EPISODES,
        "a run, mode and length of episodes",
        "summarise_episodes",
        ("judge_claims",),
    ),
    "lengths": Entry(
        "lengths.parquet",
        schemas.LENGTHS,
        "a cell, mode and length of episodes",
        "summarise_episodes",
        ("plot_figures", *REPORT),
    ),
    "comparisons": Entry(
        "comparisons.parquet",
        schemas.COMPARISONS,
        "a pair of cells and a measure, paired by seed",
        "compare_runs",
        ("plot_figures", *REPORT),
    ),
    "variance": Entry(
        "variance.parquet", schemas.VARIANCE, "a cell: its variance from seeds and evaluation", "compare_runs", REPORT
    ),
    "power": Entry(
        "power.parquet", schemas.POWER, "a shaped cell: the power to see its published gain", "compare_runs", REPORT
    ),
    "lottery": Entry(
        "lottery.csv",
        schemas.LOTTERY,
        "a statement that a study of one seed a cell might make",
        "compare_runs",
        ("plot_figures", *REPORT),
    ),
    "winners": Entry(
        "winners.csv", schemas.WINNERS, "a cell: how often it wins a study of one seed a cell", "compare_runs", REPORT
    ),
    "spread": Entry(
        "spread.csv", schemas.SPREAD, "a quantity that a study of one seed a cell reports", "compare_runs", REPORT
    ),
    "scores": Entry("scores.parquet", schemas.SCORES, "a cell and a measure: robust averages", "compare_runs", REPORT),
    "profiles": Entry(
        "profiles.parquet",
        schemas.PROFILES,
        "a group of variants, a budget and a success rate",
        "compare_runs",
        ("plot_figures",),
    ),
    "peers": Entry("peers.parquet", schemas.PEERS, "a run of another algorithm", "gather_peers", always=False),
    "trials": Entry("search/trials.csv", schemas.TRIALS, "a trial of the search", "search", always=False),
}
"""Study-wide tables, in `results/`. Those not always there are inputs only once they are."""
EXPERIMENT_TABLES = {
    name: Entry(*_AGGREGATED[name], "aggregate_experiment", ("plot_experiment", *REPORT)) for name in _AGGREGATED
} | {
    "logs": Entry(
        "logs.parquet",
        schemas.LOGS,
        "a run: what its own log shows",
        "summarise_experiment",
        ("plot_experiment", *REPORT),
    ),
    "logged": Entry(
        "logged.parquet",
        schemas.CURVES,
        "a cell and training iteration, as logged",
        "summarise_experiment",
        ("plot_experiment", *REPORT),
    ),
    "comparisons": Entry(
        "comparisons.parquet",
        schemas.COMPARISONS,
        "a pair of cells and a measure, paired by seed",
        "summarise_experiment",
        ("plot_experiment", *REPORT),
    ),
    "correlation": Entry(
        "correlation.csv",
        schemas.CORRELATION,
        "a pair of quantities, a coefficient and a level",
        "summarise_experiment",
        ("plot_experiment", *REPORT),
    ),
    "controllers": Entry(
        "controllers.parquet",
        schemas.CONTROLLERS,
        "a policy that needs no learning, and a mode",
        "evaluate_experiment_controllers",
        ("plot_experiment", *REPORT),
    ),
    "claims": Entry("claims.csv", schemas.CLAIMS, "a claim of the paper", "judge_experiment", REPORT, always=False),
    "claim_parts": Entry(
        "claim_parts.csv", schemas.CLAIM_PARTS, "an estimate behind a claim", "judge_experiment", REPORT, always=False
    ),
    "effects": Entry(
        "effects.csv",
        schemas.EFFECTS,
        "a switch, variant, kind of effect and measure",
        "measure_effects",
        ("plot_experiment", *REPORT),
        always=False,
    ),
    "lengths": Entry(
        "lengths.parquet",
        schemas.LENGTHS,
        "a cell, mode and length of episodes",
        "summarise_lengths",
        REPORT,
        always=False,
    ),
    "hypotheses": Entry(
        "hypotheses.csv", schemas.HYPOTHESES, "a hypothesis of our own", "judge_hypotheses", REPORT, always=False
    ),
    "takeoff": Entry(
        "takeoff.parquet",
        schemas.TAKEOFF,
        "a run and every fifth training iteration",
        "judge_hypotheses",
        ("plot_experiment", *REPORT),
        always=False,
    ),
    "targets": Entry(
        "targets.parquet",
        schemas.TARGETS,
        "a cell and a square of the plane of targets",
        "map_targets",
        ("plot_experiment", *REPORT),
        always=False,
    ),
    "agreement": Entry(
        "agreement.csv",
        schemas.AGREEMENT,
        "a measure beside another implementation's",
        "compare_with_peers",
        ("plot_experiment", *REPORT),
        always=False,
    ),
}
"""Tables of a further study, in `results/experiments/{study}/`; `effects` needs switches, `agreement` peers,
`hypotheses`, `takeoff` and, on Reacher, `targets` a ledger, and `lengths` to be asked for; claims are judged where no
two protocols have the same cell."""


def made_by(rule: str, tables: Mapping[str, Entry], folder: str) -> dict[str, str]:
    """Paths of the tables that a rule makes, by name."""
    return {name: f"{folder}/{entry.file}" for name, entry in tables.items() if entry.made_by == rule}


def read_by(rule: str, tables: Mapping[str, Entry], folder: str) -> dict[str, str]:
    """Paths of the tables that a rule reads, by name; one that is not always there is left to the rule."""
    return {name: f"{folder}/{entry.file}" for name, entry in tables.items() if rule in entry.read_by and entry.always}
