"""The simulated schedule beside real ones: one small study on one core and on two (benchmarks/schedule.md).

    python benchmarks/schedule_check.py

Twelve blocks are trained and evaluated twice by the real workflow, about eight minutes; the machine should be idle.
Their own records give the rates with which `schedule.py` lays them on the cores. What Snakemake itself takes, by a run
with nothing left to do, is told apart.
"""

import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from schedule import blocks, simulate
from side_by_side import machine, versions

from reacher_shaping.jobs import cost
from reacher_shaping.settings.study import load_study, read_settings

ROOT = Path(__file__).parents[1]
OVERLAY = """
seeds: 6
seeds_per_block: 2
grid:
  - {group: main, variants: [none, l2], budgets: [204800, 409600]}
"""
CORES = (1, 2)


def run(folder: Path, cores: int) -> float:
    """Let the workflow make every block in `folder` on `cores` cores; return the seconds it took."""
    given: dict[str, object] = {"snakefile": ROOT / "Snakefile", "configfile": folder / "study.yaml", "cores": cores}
    given |= {"workflow-profile": ROOT / "profiles/default", "directory": folder, "until": "evaluate_block"}
    command = [sys.executable, "-m", "snakemake", *(f"--{name}={value}" for name, value in given.items())]
    begun = time.perf_counter()
    subprocess.run(command, check=True, capture_output=True)
    return time.perf_counter() - begun


def main() -> None:
    """Print the table of real and simulated wall times."""
    rows = []
    for cores in CORES:
        folder = Path(tempfile.mkdtemp(prefix="schedule-"))
        (folder / "study.yaml").write_text(OVERLAY)
        real, own = run(folder, cores), run(folder, cores)
        study = load_study(read_settings(ROOT / "config.yaml", folder / "study.yaml"))
        rates = cost.measured_rates(folder / "results", ROOT / "report/reference/manifest.json")
        seconds = blocks(study, study.seeds, study.seeds_per_block, rates)
        simulated = simulate(seconds, cores).wall
        rows.append((cores, len(seconds), simulated, own, simulated + own, real, (simulated + own) / real - 1))
        shutil.rmtree(folder)
    print(f"Simulated and real schedules, by `python benchmarks/schedule_check.py`. {machine()}; {versions()}.\n")
    print("| cores | blocks | simulated (s) | Snakemake itself (s) | together (s) | real (s) | error |")
    print("|---:|---:|---:|---:|---:|---:|---:|")
    for cores, jobs, *times, error in rows:
        print("| " + " | ".join([str(cores), str(jobs), *(f"{value:.0f}" for value in times), f"{error:+.0%}"]) + " |")


if __name__ == "__main__":
    main()
