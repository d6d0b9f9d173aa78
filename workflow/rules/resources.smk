# What a job asks of a cluster's queue: memory and run time, both growing with each attempt. One thread a job, always.
# On one computer Snakemake reads none of it but the threads.
from math import ceil

from reacher_shaping.jobs import cost

SLOW_STEPS_PER_SECOND = 10_000  # of training on an old or busy core, see benchmarks/results.md for measured rates
SLOW_EVALUATION_STEPS_PER_SECOND = 20_000
LATE_JOB_MINUTES = 5  # a job's start on a full node and disk


def growing(amount):
    """A resource that the first attempt gets once, the second twice, and so on."""
    return lambda wildcards, attempt: amount * attempt


def minutes(seconds):
    """Run time in minutes for a job of so many seconds on a slow core."""
    return LATE_JOB_MINUTES + ceil(seconds / 60)


def training_minutes(wildcards, attempt):
    """By the block's steps and the work of a step."""
    cell, seeds = CELLS[wildcards.cell], SEEDS[wildcards.block]
    steps = cell.iterations * cell.protocol.ppo.rollout_steps * len(seeds)
    return attempt * minutes(steps * cost.work(cell.protocol) / SLOW_STEPS_PER_SECOND)


def evaluation_minutes(wildcards, attempt):
    """By the block's evaluation episodes, those of the long evaluation's added."""
    cell, seeds = CELLS[wildcards.cell], SEEDS[wildcards.block]
    steps = (cost.evaluation_steps(cell, STUDY.evaluation) + cost.LONG_STEPS) * len(seeds)
    return attempt * minutes(steps * cost.evaluation_work(cell.protocol) / SLOW_EVALUATION_STEPS_PER_SECOND)


# Jobs of seconds, not worth a place in a queue. Where Snakemake itself may not work on the login node, submit it as a job.
localrules:
    aggregate_runs,
    check_results,
    compare_runs,
    summarise_logs,
    summarise_lengths,
    summarise_radii,
    map_targets,
    judge_claims,
    question_claims,
    weigh_seeds,
    judge_hypotheses,
    measure_effects,
    compare_with_peers,
    plot_figure,
    format_tables,
    gather_peers,
    build_report,
    build_reference_report,
    build_crate,
