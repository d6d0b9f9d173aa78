# What a run says while it goes on: one line a minute for the whole study, and what fails. `--quiet host` says the rest.
import logging
from time import strftime

from snakemake.logging import logger
from snakemake.settings.enums import Quietness

from reacher_shaping.jobs import study_progress


def watch():
    """Tell the progress of all jobs that are to run, with the time left by what they cost."""
    if Quietness.RULES not in workflow.output_settings.quiet:
        return
    for handler in logger.handlers:
        if isinstance(handler, logging.StreamHandler) and not isinstance(handler, logging.FileHandler):
            handler.addFilter(is_news)
    rates = cost.measured_rates(Path("results"), HERE / "report/reference/manifest.json")
    jobs = [job for job in workflow.dag.needrun_jobs() if not job.is_norun]
    if not jobs:  # `--until` with nothing left to do comes here too
        return
    at_a_time = min(len(jobs), workflow.cores if workflow.local_exec else workflow.nodes)
    seconds = {job: expected_seconds(job.rule.name, job.wildcards_dict, rates) for job in jobs}
    progress = study_progress.StudyProgress(seconds, at_a_time)
    study_progress.tell(progress, lambda: {job: share(job) for job in jobs}, say)
    say(progress.line({}, progress.begun))


def is_news(record):
    """Whether a message says what nothing else does: a script tells itself why it failed or that it was stopped."""
    told = str(record.msg).rstrip().endswith(("non-zero exit status 1.", "non-zero exit status 130."))
    return record.levelno >= logging.WARNING and not told


def expected_seconds(name, wildcards, rates):
    """What a job takes on one core."""
    seeds = len(SEEDS.get(wildcards.get("block"), ()))
    return cost.job_seconds(name, CELLS.get(wildcards.get("cell")), STUDY.evaluation, seeds, rates)


def share(job):
    """How much of a job is done, a training's by its log."""
    if workflow.dag.finished(job):
        return 1.0
    return study_progress.share_of_log(Path(job.log[0])) if job.rule.name == "train_block" else 0.0


def say(line):
    print(f"[{strftime('%H:%M')}] {line}", file=sys.stderr, flush=True)
