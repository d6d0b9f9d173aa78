"""Say in a few lines what Snakemake would run, why, and how long it takes.

python workflow/plan.py [--directory FOLDER] [--configfile FILE] [--cores N] [TARGET ...]
"""

import argparse
import os
import re
import subprocess
import sys
from collections import Counter, defaultdict
from pathlib import Path

from study import HERE, end_with_reader, study

from reacher_shaping.jobs import cost
from reacher_shaping.jobs.blocks import blocks
from reacher_shaping.jobs.study_progress import duration

JOB = re.compile(r"^( *)(?:local)?rule (\w+):\n((?:\1    .*\n)*)", re.MULTILINE)
BLOCK = re.compile(r"^ +output: (results/\S+/seeds\d+-\d+)/", re.MULTILINE)
REASON = re.compile(r"^ +reason: (.*)$", re.MULTILINE)
SHOWN = 8
"""Rules with a line of their own; the others share one."""


def planned(arguments: list[str]) -> list[tuple[str, str, str]]:
    """Rule, block folder or nothing, and reason of every job of a dry run. Ends the process where that fails."""
    command = [sys.executable, "-m", "snakemake", "--dry-run", "--nocolor", "--quiet", "host", *arguments]
    done = subprocess.run(command, cwd=HERE, capture_output=True, text=True, check=False)
    if done.returncode:
        sys.exit(done.stderr.strip())
    jobs = []
    for _, rule, text in JOB.findall(done.stdout):
        block, reason = BLOCK.search(text), REASON.search(text)
        jobs.append((rule, block[1] if block else "", why(reason[1] if reason else "")))
    return jobs


def why(reason: str) -> str:
    """Snakemake's reasons without the files they name."""
    parts = [part.split(":")[0].strip().lower() for part in reason.split(";")]
    return ", ".join(dict.fromkeys(part for part in parts if part)) or "asked for"


def main(given: argparse.Namespace) -> None:
    """Print the plan."""
    settings = study(*given.configfile)
    options = ["--directory", str(given.directory.resolve())]
    options += ["--configfile", *(str(path.resolve()) for path in given.configfile)] if given.configfile else []
    jobs = planned([*options, *(["--", *given.targets] if given.targets else [])])
    jobs = [job for job in jobs if job[0] != "all"]
    if not jobs:
        print("Nothing to do: everything is there, made with these settings and this code.")
        return
    known = {str(block.folder): block for block in blocks(settings)}
    rates = cost.measured_rates(given.directory / "results", HERE / "report/reference/manifest.json")
    seconds: dict[str, list[float]] = defaultdict(list)
    reasons: dict[str, Counter[str]] = defaultdict(Counter)
    for rule, folder, reason in jobs:
        block = known.get(folder)
        reasons[rule][reason] += 1
        cell, runs = (block.cell, len(block.seeds)) if block else (None, 0)
        seconds[rule].append(cost.job_seconds(rule, cell, settings.evaluation, runs, rates))
    order = sorted(seconds, key=lambda rule: -sum(seconds[rule]))
    for rule in order[:SHOWN]:
        told = "; ".join(f"{count} x {reason}" for reason, count in reasons[rule].most_common(2))
        print(f"{rule:20} {len(seconds[rule]):5}  {duration(sum(seconds[rule])):>12}  {told}")
    rest = [value for rule in order[SHOWN:] for value in seconds[rule]]
    if rest:
        print(f"{'others':20} {len(rest):5}  {duration(sum(rest)):>12}  {', '.join(order[SHOWN:])}")
    trained = {known[folder].cell.name for rule, folder, _ in jobs if rule == "train_block" and folder in known}
    total, longest = sum(map(sum, seconds.values())), max(max(values) for values in seconds.values())
    print(f"{len(jobs)} jobs, {len(seconds['train_block'])} of them train blocks of {len(trained)} cells.")
    wall = max(total / given.cores, longest)
    print(f"About {duration(wall)} on {given.cores} cores, {duration(total)} of one core. Rates: {rates.source}.")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Say what Snakemake would run, why, and how long it takes.")
    parser.add_argument("targets", nargs="*", help="as for snakemake; the study without one")
    parser.add_argument("--directory", type=Path, default=Path(), help="the study's folder")
    parser.add_argument("--configfile", type=Path, nargs="+", default=[], help="settings laid over config.yaml")
    parser.add_argument("--cores", type=int, default=0, help="jobs at a time; this machine's cores without it")
    end_with_reader()
    asked = parser.parse_args()
    asked.cores = asked.cores or len(os.sched_getaffinity(0))
    main(asked)
