"""Does the engine learn what the plain loop learns, and with the arm in closed form what it learns with MuJoCo's?

    python benchmarks/learning.py --variant none --budget 500000 --seeds 3 --out benchmarks/learning.json
    python benchmarks/learning.py --other "closed form" --seeds 10 --out benchmarks/learning_closed_form.json

Both train one cell; their final policies are compared in MuJoCo's environment. The plain loop
(tests/oracles/plain_loop.py) has the engine's random streams, as the closed form has: a seed starts from the same
numbers in both and drifts apart only by rounding, which training amplifies. After a whole run the two are samples of
one distribution. The engine trains ten seeds in the time of a fraction of one plain run.
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
MEASURES = {
    "success_rate": "success",
    "final_success_rate": "final_success",
    "mean_return": "episode_return",
    "final_distance": "final_distance",
    "share_within_radius": "share_within_radius",
}
"""Means over episodes, by their columns."""
RADIUS = 0.02
"""m; in the progress rows, which nothing here reads."""


def measures(policy, seeds, cell, study):
    """`MEASURES` of each seed [S] over the study's evaluation."""
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
    return {name: episodes[column].mean().to_list() for name, column in MEASURES.items()}


def plain_policy(cell, seed):
    """Train one seed in the plain loop, say how it goes, and return its policy."""
    begun, network = time.monotonic(), None
    for done, (network, _) in enumerate(plain_loop.train(cell, seed), start=1):  # noqa: B007  # the last is kept
        if done % 20 == 0 or done == cell.iterations:
            left = (time.monotonic() - begun) / done * (cell.iterations - done)
            print(f"plain loop, seed {seed}: iteration {done}/{cell.iterations}, {left / 60:.1f} min left", flush=True)
    weights = {name: tensor.detach()[None] for name, tensor in network.state_dict().items()}
    return Policy.from_weights(weights, TASK)


def plain_policies(cell, seeds):
    """Yield the names and the policy of one seed after the other."""
    for seed in range(seeds):
        yield [seed], plain_policy(cell, seed)


def closed_form_policies(cell, seeds):
    """Yield the names and the policies of all seeds, trained together."""
    environment = cell.protocol.environment.model_copy(update={"task": "reacher_closed_form"})
    closed = cell.model_copy(update={"protocol": cell.protocol.model_copy(update={"environment": environment})})
    *_, state = train(closed, range(seeds), success_radius=RADIUS)
    yield list(range(seeds)), state.policy()


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("--variant", default="none")
    parser.add_argument("--budget", type=int, default=500_000)
    parser.add_argument("--other", choices=("plain loop", "closed form"), default="plain loop")
    parser.add_argument("--seeds", type=int, default=3, help="of the other")
    parser.add_argument("--out", type=Path, default=ROOT / "benchmarks" / "learning.json")
    given = parser.parse_args()
    study = load_study(ROOT / "config.yaml")
    cell = next(cell for cell in study.cells if (cell.variant.name, cell.budget) == (given.variant, given.budget))

    trained = closed_form_policies if given.other == "closed form" else plain_policies
    other = {name: [] for name in MEASURES}
    for seeds, policy in trained(cell, given.seeds):
        for name, values in measures(policy, seeds, cell, study).items():
            other[name] += values
            print(f"{given.other}, seeds {seeds}: {name} {np.mean(values):.3f}", flush=True)
    *_, state = train(cell, range(ENGINE_SEEDS), success_radius=RADIUS)
    engine = measures(state.policy(), list(range(ENGINE_SEEDS)), cell, study)

    found = {"cell": cell.name, given.other: other, "engine": engine, "welch_p": {}}
    for name in MEASURES:
        found["welch_p"][name] = float(stats.ttest_ind(other[name], engine[name], equal_var=False).pvalue)
        for label, values in ((given.other, other[name]), ("engine", engine[name])):
            spread = np.std(values, ddof=1) if len(values) > 1 else float("nan")
            print(f"{name}, {label}: {np.mean(values):.3f} (sd {spread:.3f}, {len(values)} seeds)")
        print(f"{name}: Welch p = {found['welch_p'][name]:.2f}")
    given.out.write_text(json.dumps(found, indent=2) + "\n")


if __name__ == "__main__":
    main()
