"""Measure the engine against its peers and its floor, side by side on one pinned core.

    python benchmarks/run.py [--quick] [--part PART ...] [--repeats N] [--out FOLDER]
    python benchmarks/run.py --against CHECKOUT      # before and after a change

Writes results.csv, results.md and results.svg into FOLDER (default: this folder; with --quick or --against:
build/benchmarks). JAX, brax, EnvPool and sbx are measured where they are installed: pip install -e .[bench]
"""

# ruff: noqa: E402 (the environment of a job and the path of the plain loop must be set before the imports)
from reacher_shaping import processor

processor.fix()

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parent / "tests" / "oracles"))  # the plain loop lives there

import peers
from floor import Floor, fraction
from ladder import RADIUS, engine, rungs
from present import write
from side_by_side import Measure, Worker, Workload, measure, pin, ratios, take_turns
from sizes import BLOCK, QUICK_SIZE, Size

from reacher_shaping.evaluation.evaluate import LANES_PER_SEED, Conditions, evaluate
from reacher_shaping.jobs import training_job
from reacher_shaping.jobs.checkpoint import save_checkpoint
from reacher_shaping.settings.cell import Cell
from reacher_shaping.settings.study import load_study
from reacher_shaping.tasks.reacher import TASK
from reacher_shaping.training.network import Shape
from reacher_shaping.training.policy import Policy, initialise
from reacher_shaping.training.train import TrainState

TRAINED_LOG_STD = -2.2
"""Policies are evaluated with the spread that training leaves, 0.11; a wide one keeps the arm at its joint limit."""


@dataclass
class Training:
    """An iteration of training a call, worth `steps` environment steps over all seeds."""

    iterations: Iterator[Any]
    steps: int
    state: Any = None
    """What the last iteration left."""

    done: int = 0

    def __call__(self) -> float:
        self.state = next(self.iterations)
        self.done += 1
        return self.steps


def training(cell: Cell, seeds: int) -> Training:
    return Training(engine(cell, range(seeds)), seeds * cell.protocol.ppo.rollout_steps)


ENGINES = {"": "engine", " in closed form": "closed_form"}
"""The engine as it is and with the arm in closed form: their names in worker.py."""
CONTENDERS = {
    "Stable-Baselines3": ("stable_baselines", 1),
    "Stable-Baselines3, shared trunk": ("shared_trunk", 1),
    "EnvPool + Stable-Baselines3": ("envpool", 1),
    "sbx": ("sbx", 1),
    "JAX, 10 seeds": ("jax", BLOCK),
    "JAX, 1 seed": ("jax", 1),
    "JAX on brax spring, 10 seeds": ("brax", BLOCK),
}
"""Peers by the name they are shown with: their name in worker.py, and seeds."""


def measure_training(size: Size) -> Iterator[Measure]:
    """Training against its peers, each in a process of its own with its fastest kernels; the engine also with those.

    A peer that is not installed is left out. Stable-Baselines3 and what is built on it know one run a process.
    """
    part = "training"
    workers = {}
    for seeds in (size.block, 1):
        for kernels in processor.KERNELS:
            for label, name in ENGINES.items():
                workers[f"{named(seeds)}{label}, {kernels} kernels"] = Worker(name, seeds, kernels, size.quick)
    for label, (name, seeds) in CONTENDERS.items():
        try:
            workers[label] = Worker(name, min(seeds, size.block), "native", size.quick)
        except ImportError as error:
            print(f"{label} is left out: {error}")
    rates = take_turns(workers, size.repeats)
    for seeds in (size.block, 1):
        for kernels in processor.KERNELS:
            name = f"{named(seeds)}, {kernels} kernels"
            for peer in ("Stable-Baselines3", f"JAX, {named(seeds)}"):
                targets = {"must": 13 if seeds > 1 else 5, "aim": 18 if seeds > 1 else 8} if "Base" in peer else {}
                if peer in rates:
                    yield measure(part, f"{name} / {peer}", ratios(rates[name], rates[peer]), "x", **targets)
            closed = f"{named(seeds)} in closed form, {kernels} kernels"
            yield measure(part, f"{closed} / MuJoCo", ratios(rates[closed], rates[name]), "x")
    for name, values in rates.items():
        yield measure(part, name, values, "steps/s")
    for name, worker in workers.items():
        yield measure("first call", name, [worker.first_seconds], "s")
        while len(worker.returns) < size.curve[-1]:
            worker()
        for iteration in size.curve:
            steps = iteration * size.cell().protocol.ppo.rollout_steps
            yield measure("return", f"{name}, {steps:,} steps a run", worker.returns[:iteration][-5:], "per episode")
        worker.end()


def measure_against(size: Size, other: Path) -> Iterator[Measure]:
    """Training of this checkout against that of another, with portable kernels."""
    for seeds in (size.block, 1):
        checkouts = {"this": HERE.parent, "other": other}
        workers = {name: Worker("engine", seeds, "portable", size.quick, root) for name, root in checkouts.items()}
        rates = take_turns(workers, size.repeats)
        yield measure("against", f"{named(seeds)}, this checkout / {other}", ratios(rates["this"], rates["other"]), "x")
        for worker in workers.values():
            worker.end()


def named(seeds: int) -> str:
    return f"{seeds} seeds" if seeds > 1 else "1 seed"


def measure_floor(size: Size) -> Iterator[Measure]:
    """The engine's time against its `mj_step` calls and matrix products at their best, early in training and later."""
    cell = size.cell()
    for seeds in (size.block, 1):
        engine, floor = training(cell, seeds), Floor(cell, seeds)
        targets = {"must": 0.6, "aim": 0.8} if seeds > 1 else {}
        physics = floor.alone(partial(physics_seconds, floor, engine))
        workloads = {"engine": engine, "physics": physics, "products": floor.alone(floor.products_seconds)}
        for begun in size.floor_begins:
            while engine.done < begun:
                engine()
            rates = take_turns(workloads, size.repeats)
            label = f"{named(seeds)} from iteration {begun + 1} on"
            values = list(map(fraction, rates["engine"], rates["physics"], rates["products"]))
            yield measure("floor", f"{label}, fraction of the floor", values, "of 1", **targets)
            share = ratios(rates["engine"], rates["physics"])
            yield measure("floor", f"{label}, share of mj_step calls", share, "of 1")


def physics_seconds(floor: Floor, engine: Training) -> float:
    return floor.physics(engine.state)


def measure_evaluation(size: Size) -> Iterator[Measure]:
    """Evaluation against a loop over gymnasium.make_vec with the same policy."""
    cell, block = size.cell(), size.block
    weight, network = cell.protocol.environment.control_weight, cell.protocol.ppo
    conditions = Conditions(
        environment=cell.protocol.environment,
        root_seed=0,
        success_radius=RADIUS,
        episodes=size.chunks * LANES_PER_SEED,
    )
    shape = Shape.of(TASK, network)

    def policies(seeds: int) -> Policy:
        stack = Policy(initialise(range(seeds), 0, network, shape), shape)
        stack.layers.log_std.fill_(TRAINED_LOG_STD)
        return stack

    def ours(seeds: int) -> Workload:
        policy = policies(seeds)

        def episodes() -> float:
            return TASK.episode_steps * len(evaluate(policy.act, range(seeds), conditions))

        return episodes

    workloads = {
        "block": ours(block),
        "one": ours(1),
        "make_vec": peers.make_vec_evaluation(policies(1), weight, LANES_PER_SEED, size.chunks),
    }
    rates = take_turns(workloads, size.repeats)
    part = "evaluation"
    ratio = ratios(rates["one"], rates["make_vec"])
    yield measure(part, "1 policy / gymnasium.make_vec", ratio, "x", must=3, aim=5)
    ratio = ratios(rates["block"], rates["make_vec"])
    yield measure(part, f"{block} policies / gymnasium.make_vec", ratio, "x", must=3, aim=5)
    for name, label in (("block", f"{block} policies"), ("one", "1 policy"), ("make_vec", "gymnasium.make_vec")):
        yield measure(part, label, rates[name], "steps/s")


def fresh_job(cell: Cell, seeds: int) -> tuple[float, float, float]:
    """Train in a new process: wall and CPU seconds until its first rollout is collected, and peak memory in MB."""
    begun = time.time()
    command = [sys.executable, str(HERE / "fresh_job.py"), cell.model_dump_json(), str(seeds)]
    done = subprocess.run(command, check=True, capture_output=True, text=True)
    collected, seconds, memory = json.loads(done.stdout.splitlines()[-1])
    return collected - begun, seconds, memory


def measure_jobs(size: Size) -> Iterator[Measure]:
    """Start and memory of a training job; the start is wall time, files in the disk cache."""
    cell = size.cell(iterations=size.job_iterations)
    found = [fresh_job(cell, size.block) for _ in range(size.repeats + 1)][1:]
    start, seconds, memory = ([numbers[n] for numbers in found] for n in range(3))
    label = f"job of {size.block} seeds"
    yield measure("jobs", f"{label}, start to first rollout", start, "s", must=6, aim=4, lower_is_better=True)
    yield measure("jobs", f"{label}, CPU time of the start", seconds, "s")
    yield measure("jobs", f"{label}, peak memory", memory, "MB", must=800, aim=500, lower_is_better=True)
    share = [100 * seconds / training_job.SECONDS_PER_CHECKPOINT for seconds in checkpoint_seconds(size)]
    yield measure("jobs", f"{label}, checkpoints' share of its time", share, "%", must=2, lower_is_better=True)


def checkpoint_seconds(size: Size) -> list[float]:
    """Wall seconds to keep one checkpoint of the study's longest cell."""
    cell = max(load_study(HERE.parent / "config.yaml").cells, key=lambda cell: cell.budget)
    state, seconds = TrainState.start(cell, range(size.block)), []
    with tempfile.TemporaryDirectory(dir=HERE.parent) as folder:
        for _ in range(size.repeats + 1):
            begun = time.perf_counter()
            save_checkpoint(Path(folder) / "key" / "checkpoint.pt", state)
            seconds.append(time.perf_counter() - begun)
    return seconds[1:]


def measure_ladder(size: Size) -> Iterator[Measure]:
    """What each idea brings, from the plain loop to the engine."""
    cell = size.cell()
    steps = cell.protocol.ppo.rollout_steps
    workloads = {
        name: Training(iterator, seeds * steps) for name, (seeds, iterator) in rungs(cell, range(size.block)).items()
    }
    rates = take_turns(workloads, size.repeats)
    for name in rates:
        yield measure("ladder", name, ratios(rates[name], rates["plain loop"]), "x plain loop")
    for before, name in pairwise(rates):
        yield measure("ladder gain", name, ratios(rates[name], rates[before]), "x rung before")


def measure_scaling(size: Size) -> Iterator[Measure]:
    """Speed against seeds per block, and time against budget."""
    cell = size.cell()
    rates = take_turns({str(seeds): training(cell, seeds) for seeds in size.seeds}, size.repeats)
    for seeds in size.seeds:
        ratio = ratios(rates[str(seeds)], rates[str(size.block)])
        yield measure("seeds per block", str(seeds), ratio, f"x steps/s of {size.block}")

    def whole_run(count: int) -> Workload:
        def run() -> float:
            for _ in engine(size.cell(iterations=count), range(size.block)):
                pass
            return 1.0

        return run

    runs = take_turns({str(count): whole_run(count) for count in size.budgets}, max(1, size.repeats // 2))
    for count in size.budgets:
        ratio = ratios(runs[str(size.budgets[0])], runs[str(count)])
        yield measure("budget", f"{count} iterations", ratio, f"x time of {size.budgets[0]}")


ACCOUNT = """
import json, resource, subprocess, sys
subprocess.run(sys.argv[1:], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=True)
used = resource.getrusage(resource.RUSAGE_CHILDREN)
print(json.dumps([used.ru_utime + used.ru_stime, used.ru_maxrss / 1024]))
"""


def dry_run(seeds: int, folder: Path) -> tuple[int, float, float]:
    """Let Snakemake plan the study with so many seeds a cell: training jobs, CPU seconds, and peak memory in MB."""
    overlay = folder / "seeds.yaml"
    overlay.write_text(f"seeds: {seeds}\nseeds_per_block: {BLOCK}\n")
    command = [
        sys.executable, "-m", "snakemake", "--snakefile", str(HERE.parent / "Snakefile"), "--directory", str(folder),
        "--cores", "1", "--dry-run", "--quiet", "--configfile", str(overlay),
    ]  # fmt: skip
    # Started by a small process: the peak that the system reports of a process begins with that of its parent.
    between = [sys.executable, "-c", ACCOUNT, *command]
    done = subprocess.run(between, capture_output=True, text=True, check=True)
    training_job = len(load_study(HERE.parent / "config.yaml").cells) * -(-seeds // BLOCK)
    seconds, memory = json.loads(done.stdout.splitlines()[-1])
    return training_job, seconds, memory


def measure_workflow(size: Size) -> Iterator[Measure]:
    """What planning costs Snakemake, from one block a cell to a hundred."""
    for blocks in size.blocks:
        found = []
        for _ in range(max(1, size.repeats // 2)):
            with tempfile.TemporaryDirectory() as folder:
                found.append(dry_run(blocks * BLOCK, Path(folder)))
        training_job = f"dry run of {found[0][0]} training jobs"
        yield measure("workflow", f"{training_job}, CPU time", [numbers[1] for numbers in found], "s")
        yield measure("workflow", f"{training_job}, peak memory", [numbers[2] for numbers in found], "MB")


PARTS = {
    "training": measure_training,
    "floor": measure_floor,
    "evaluation": measure_evaluation,
    "jobs": measure_jobs,
    "ladder": measure_ladder,
    "scaling": measure_scaling,
    "workflow": measure_workflow,
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="tiny workloads: shows that it runs, measures nothing")
    parser.add_argument("--part", action="append", choices=PARTS, help="only this part; may be given again")
    parser.add_argument("--against", type=Path, metavar="CHECKOUT", help="only: this checkout and another in turns")
    parser.add_argument("--repeats", type=int, help="rounds per part, after one to warm up")
    parser.add_argument("--out", type=Path, help="folder of the results")
    parser.add_argument("--note", default="", help="a sentence on the circumstances, for the head of the table")
    options = parser.parse_args()
    if options.part and options.against:
        parser.error("--against measures one part of its own; give no --part with it")
    size = QUICK_SIZE if options.quick else Size()
    if options.repeats is not None:
        size = Size(**{**vars(size), "repeats": max(1, options.repeats)})
    out = options.out or (HERE.parent / "build" / "benchmarks" if options.quick or options.against else HERE)
    core = pin()
    load, begun, measures = os.getloadavg()[0], time.time(), []
    parts = {"against": partial(measure_against, other=options.against.resolve())} if options.against else PARTS
    for part in options.part or parts:
        for found in parts[part](size):
            measures.append(found)
            print(f"{found.part:16s} {found.name:52s} {found.value:10.3f} {found.unit}", flush=True)
        facts = {"core": core, "load": load, "minutes": (time.time() - begun) / 60, "note": options.note}
        write(out, measures, facts)
    print(f"written to {out}")


if __name__ == "__main__":
    main()
