"""Does the engine learn what the plain loop learns? Both train one cell; their final policies are compared.

    python benchmarks/learning.py --variant none --budget 500000 --seeds 3 --out benchmarks/learning.json

The plain loop (tests/oracles/plain_loop.py) has the engine's random streams, so a seed starts from the same numbers in
both and drifts apart only by rounding, which training amplifies: after a whole run the two are samples of one
distribution.
The engine trains ten seeds in the time of a fraction of one plain run.
"""

# ruff: noqa: E402 (the environment of a job must be set before the imports)
from reacher_shaping import processor

processor.fix()

import argparse
import json
import sys
import time
from pathlib import Path

import numpy as np
from scipy import stats

from reacher_shaping.evaluation.evaluate import Conditions, evaluate
from reacher_shaping.settings.study import load_study
from reacher_shaping.tasks.reacher import TASK
from reacher_shaping.training.policy import Policy
from reacher_shaping.training.train import train

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "tests" / "oracles"))
import plain_loop

ENGINE_SEEDS = 10


def measures(policy, seeds, cell, study):
    """Success rate and mean return of each seed [S] over the study's evaluation."""
    episodes = evaluate(
        policy.act,
        seeds,
        Conditions(
            environment=cell.protocol.environment,
            root_seed=cell.root_seed,
            success_radius=study.evaluation.radius,
            episodes=study.evaluation.episodes,
        ),
    ).groupby("seed")
    return {
        "success_rate": episodes["success"].mean().to_list(),
        "mean_return": episodes["episode_return"].mean().to_list(),
    }


def plain_policy(cell, seed):
    """Train one seed in the plain loop, say how it goes, and return its policy."""
    begun, network = time.monotonic(), None
    for done, (network, _) in enumerate(plain_loop.train(cell, seed), start=1):  # noqa: B007  # the last is kept
        if done % 20 == 0 or done == cell.iterations:
            left = (time.monotonic() - begun) / done * (cell.iterations - done)
            print(f"plain loop, seed {seed}: iteration {done}/{cell.iterations}, {left / 60:.1f} min left", flush=True)
    weights = {name: tensor.detach()[None] for name, tensor in network.state_dict().items()}
    return Policy.from_weights(weights, TASK)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("--variant", default="none")
    parser.add_argument("--budget", type=int, default=500_000)
    parser.add_argument("--seeds", type=int, default=3, help="of the plain loop")
    parser.add_argument("--out", type=Path, default=ROOT / "benchmarks" / "learning.json")
    given = parser.parse_args()
    study = load_study(ROOT / "config.yaml")
    cell = next(cell for cell in study.cells if (cell.variant.name, cell.budget) == (given.variant, given.budget))

    plain = {"success_rate": [], "mean_return": []}
    for seed in range(given.seeds):
        for name, values in measures(plain_policy(cell, seed), [seed], cell, study).items():
            plain[name] += values
            print(f"plain loop, seed {seed}: {name} {values[0]:.3f}", flush=True)
    *_, state = train(cell, range(ENGINE_SEEDS), success_radius=study.evaluation.radius)
    engine = measures(state.policy(), list(range(ENGINE_SEEDS)), cell, study)

    found = {"cell": cell.name, "plain": plain, "engine": engine, "welch_p": {}}
    for name in plain:
        found["welch_p"][name] = float(stats.ttest_ind(plain[name], engine[name], equal_var=False).pvalue)
        rows = (("plain loop", plain[name]), ("engine", engine[name]))
        for label, values in rows:
            spread = np.std(values, ddof=1) if len(values) > 1 else float("nan")
            print(f"{name}, {label}: {np.mean(values):.3f} (sd {spread:.3f}, {len(values)} seeds)")
        print(f"{name}: Welch p = {found['welch_p'][name]:.2f}")
    given.out.write_text(json.dumps(found, indent=2) + "\n")


if __name__ == "__main__":
    main()
