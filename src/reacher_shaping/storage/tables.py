"""The catalogue of tables: of each its file, schema, what a row is, which rule makes it and which rules read it.

The rules, the reference run, the report, the notebooks and `docs/tables.md` come from here; what the columns mean
stands in `columns.yaml`. Nothing heavy is loaded, for the workflow.
"""

from collections.abc import Collection
from dataclasses import dataclass

from reacher_shaping.storage import block_schemas, schemas
from reacher_shaping.storage.block_schemas import Table


@dataclass(frozen=True)
class Entry:
    """A table: its file, schema, what a row is, the rule that makes it, and those that read it.

    The file is named below the folder of a block or of a study. `of`: what a study must have to have the table, one of
    `settings.outputs.features`; without it every study has it; `always`: it is there as soon as the study is, else an
    input only once it is.
    """

    file: str
    schema: Table
    row: str
    made_by: str
    read_by: tuple[str, ...] = ()
    of: str = ""
    always: bool = True


REPORT = ("build_report",)
SHOWN = ("plot_figure", *REPORT)
BLOCK_TABLES = {
    "progress": Entry(
        "progress.parquet",
        block_schemas.PROGRESS,
        "a seed and training iteration",
        "train_block",
        ("aggregate_runs", "summarise_logs", "judge_hypotheses"),
    ),
    "episodes": Entry(
        "episodes.parquet",
        block_schemas.EPISODES,
        "a seed, mode and evaluation episode",
        "evaluate_block",
        ("aggregate_runs", "summarise_radii", "map_targets"),
    ),
    "long_episodes": Entry(
        "long_episodes.parquet",
        block_schemas.LONG_EPISODES,
        "a seed, mode and length of episodes",
        "evaluate_long",
        ("summarise_lengths",),
    ),
}
"""Tables of a seed block, in `results/{protocol}/{variant}/{budget}/alpha{alpha0}/seeds{first}-{last}/`."""
TABLES = {
    "runs": Entry(
        "runs.parquet",
        schemas.RUNS,
        "a run: one seed of one cell",
        "aggregate_runs",
        (
            "check_results",
            "compare_runs",
            "judge_claims",
            "judge_hypotheses",
            "measure_effects",
            "compare_with_peers",
            "weigh_seeds",
            "format_tables",
            *SHOWN,
        ),
    ),
    "cells": Entry(
        "cells.parquet",
        schemas.CELLS,
        "a cell: means over its runs with intervals",
        "aggregate_runs",
        ("check_results", "format_tables", *SHOWN),
    ),
    "curves": Entry("curves.parquet", schemas.CURVES, "a cell and training iteration", "aggregate_runs", SHOWN),
    "comparisons": Entry(
        "comparisons.parquet",
        schemas.COMPARISONS,
        "a pair of cells and a measure, paired by seed",
        "compare_runs",
        SHOWN,
    ),
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
        "compare_runs",
        SHOWN,
    ),
    "controllers": Entry(
        "controllers.parquet",
        schemas.CONTROLLERS,
        "a policy that needs no learning, and a mode",
        "evaluate_controllers",
        ("judge_claims", *SHOWN),
    ),
    "logs": Entry("logs.parquet", schemas.LOGS, "a run: what its own log shows", "summarise_logs", SHOWN, of="further"),
    "logged": Entry(
        "logged.parquet",
        schemas.CURVES,
        "a cell and training iteration, as logged",
        "summarise_logs",
        SHOWN,
        of="further",
    ),
    "claims": Entry("claims.csv", schemas.CLAIMS, "a claim of the paper", "judge_claims", REPORT, of="claims"),
    "claim_parts": Entry(
        "claim_parts.csv", schemas.CLAIM_PARTS, "an estimate behind a claim", "judge_claims", REPORT, of="claims"
    ),
    "family_error": Entry(
        "family_error.csv",
        schemas.FAMILY_ERROR,
        "a way of reading the estimates of the claims",
        "question_claims",
        of="main",
    ),
    "sensitivity": Entry(
        "sensitivity.csv",
        schemas.SENSITIVITY,
        "a claim and a choice of the analysis",
        "question_claims",
        of="main",
    ),
    "run_radii": Entry(
        "run_radii.parquet",
        schemas.RUN_RADII,
        "a run, mode and success radius",
        "summarise_radii",
        of="main",
        always=False,
    ),
    "radii": Entry(
        "radii.parquet", schemas.RADII, "a cell, mode and success radius", "summarise_radii", SHOWN, of="main"
    ),
    "long_episodes": Entry(
        "long_episodes.parquet",
        schemas.ALL_LONG_EPISODES,
        "a run, mode and length of episodes",
        "summarise_lengths",
        ("judge_claims",),
        of="lengths",
    ),
    "lengths": Entry(
        "lengths.parquet",
        schemas.LENGTHS,
        "a cell, mode and length of episodes",
        "summarise_lengths",
        SHOWN,
        of="lengths",
    ),
    "correlation_published": Entry(
        "correlation_published.csv",
        schemas.CORRELATION,
        "the same as correlation, over the published cells",
        "weigh_seeds",
        ("plot_figure",),
        of="main",
    ),
    "variance": Entry(
        "variance.parquet",
        schemas.VARIANCE,
        "a cell: its variance from seeds and evaluation",
        "weigh_seeds",
        REPORT,
        of="main",
    ),
    "power": Entry(
        "power.parquet",
        schemas.POWER,
        "a shaped cell: the power to see its published gain",
        "weigh_seeds",
        REPORT,
        of="main",
    ),
    "lottery": Entry(
        "lottery.csv",
        schemas.LOTTERY,
        "a statement that a study of one seed a cell might make",
        "weigh_seeds",
        SHOWN,
        of="main",
    ),
    "winners": Entry(
        "winners.csv",
        schemas.WINNERS,
        "a cell: how often it wins a study of one seed a cell",
        "weigh_seeds",
        REPORT,
        of="main",
    ),
    "spread": Entry(
        "spread.csv",
        schemas.SPREAD,
        "a quantity that a study of one seed a cell reports",
        "weigh_seeds",
        REPORT,
        of="main",
    ),
    "scores": Entry(
        "scores.parquet", schemas.SCORES, "a cell and a measure: robust averages", "weigh_seeds", REPORT, of="main"
    ),
    "profiles": Entry(
        "profiles.parquet",
        schemas.PROFILES,
        "a kind of variants, a budget and a success rate",
        "weigh_seeds",
        ("plot_figure",),
        of="main",
    ),
    "peers": Entry(
        "peers.parquet", schemas.PEERS, "a run of another algorithm", "gather_peers", of="main", always=False
    ),
    "trials": Entry(
        "search/trials.csv", schemas.TRIALS, "a trial of the search", "search_settings", of="search", always=False
    ),
    "effects": Entry(
        "effects.csv",
        schemas.EFFECTS,
        "a switch, variant, kind of effect and measure",
        "measure_effects",
        SHOWN,
        of="switches",
    ),
    "hypotheses": Entry(
        "hypotheses.csv", schemas.HYPOTHESES, "a hypothesis of our own", "judge_hypotheses", REPORT, of="hypotheses"
    ),
    "takeoff": Entry(
        "takeoff.parquet",
        schemas.TAKEOFF,
        "a run and every fifth training iteration",
        "judge_hypotheses",
        SHOWN,
        of="hypotheses",
    ),
    "targets": Entry(
        "targets.parquet",
        schemas.TARGETS,
        "a cell and a square of the plane of targets",
        "map_targets",
        SHOWN,
        of="targets",
    ),
    "agreement": Entry(
        "agreement.csv",
        schemas.AGREEMENT,
        "a measure beside another implementation's",
        "compare_with_peers",
        SHOWN,
        of="peers",
    ),
}
"""Tables of a study: in `results/` those of the main one, in `results/experiments/{study}/` those of another."""


def made_by(rule: str, folder: str) -> dict[str, str]:
    """Paths of a study's tables that a rule makes, by name."""
    return {name: f"{folder}{entry.file}" for name, entry in TABLES.items() if entry.made_by == rule}


def of_study(features: Collection[str]) -> dict[str, Entry]:
    """The tables that a study with these features (`settings.outputs.features`) always has, by name."""
    return {name: entry for name, entry in TABLES.items() if entry.always and entry.of in {"", *features}}
