"""One contender in a process of its own, with kernels and packages of its own.

    python benchmarks/worker.py NAME SEEDS KERNELS QUICK

Prints a line of JSON when its first iteration is done and one for each line that it reads: environment steps, CPU
seconds, and the mean return of the rollouts' episodes.
"""

# ruff: noqa: E402 (the environment of a job must be set before the imports)
import sys

from reacher_shaping import processor

ANSWERS, sys.stdout = sys.stdout, sys.stderr  # some packages print
NAME, SEEDS, KERNELS, QUICK = sys.argv[1], int(sys.argv[2]), sys.argv[3], sys.argv[4] == "quick"
processor.fix(KERNELS)

import json
import time
from collections.abc import Callable
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "oracles"))  # the plain loop lives there

from sizes import QUICK_SIZE, Size

from reacher_shaping.settings.cell import Cell

Work = Callable[[], tuple[float, float]]


def engine(cell: Cell) -> Work:
    from ladder import engine

    iterations = engine(cell, range(SEEDS))

    def work() -> tuple[float, float]:
        state = next(iterations)
        last = state.progress["episode_return"][:, state.iteration - 1]
        return SEEDS * cell.protocol.ppo.rollout_steps, float(last.mean())

    return work


def closed_form(cell: Cell) -> Work:
    environment = cell.protocol.environment.model_copy(update={"task": "reacher_closed_form"})
    return engine(cell.model_copy(update={"protocol": cell.protocol.model_copy(update={"environment": environment})}))


def jax(cell: Cell) -> Work:
    import jax_ppo

    return jax_ppo.training(cell, SEEDS)


def stable_baselines(cell: Cell) -> Work:
    import peers

    return peers.stable_baselines(cell, shared=False)


def shared_trunk(cell: Cell) -> Work:
    import peers

    return peers.stable_baselines(cell, shared=True)


def envpool(cell: Cell) -> Work:
    import peers

    return peers.envpool(cell)


def sbx(cell: Cell) -> Work:
    import peers

    return peers.sbx(cell)


def brax(cell: Cell) -> Work:
    import jax_ppo

    return jax_ppo.training(cell, SEEDS, jax_ppo.spring_arm, observations=11)


def main() -> None:
    cell = (QUICK_SIZE if QUICK else Size()).cell()
    begun = time.process_time()
    work = globals()[NAME](cell)
    _, episode_return = work()
    say(seconds=time.process_time() - begun, units=0, episode_return=episode_return)
    for _ in sys.stdin:
        begun = time.process_time()
        units, episode_return = work()
        say(seconds=time.process_time() - begun, units=units, episode_return=episode_return)


def say(**facts: float) -> None:
    ANSWERS.write(json.dumps(facts) + "\n")
    ANSWERS.flush()


if __name__ == "__main__":
    main()
