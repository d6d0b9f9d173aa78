"""Cost of an environment step of every task, beside its solver steps alone and beside Gymnasium's step.

    python benchmarks/tasks.py

Microseconds of processor time, the least of five rounds taken in turns; the machine should be idle.
"""

import time
import types
import warnings
from collections.abc import Callable

import gymnasium
import mujoco
import numpy as np

from reacher_shaping.storage.code_hash import modules_defining
from reacher_shaping.tasks.base import Lanes, Task, load_task, profiling_clock

LANES, STEPS, ROUNDS = 41, 50, 5


def make(task: Task) -> gymnasium.Env:
    """Gymnasium's environment of a task; Gymnasium-Robotics' asks for a joint's type in a way that fails with these
    bindings, so it gets plain numbers (see tests/tasks/test_fetch_reach.py)."""
    if task.gymnasium_id.startswith("Fetch"):
        import gymnasium_robotics
        from gymnasium_robotics.utils import mujoco_utils

        numbers = {name: int(member) for name, member in mujoco.mjtJoint.__members__.items()}
        mujoco_utils.mujoco = types.SimpleNamespace(**vars(mujoco) | {"mjtJoint": types.SimpleNamespace(**numbers)})
        gymnasium.register_envs(gymnasium_robotics)
    return gymnasium.make(task.gymnasium_id).unwrapped


def measure(task: Task) -> dict[str, float]:
    """Return microseconds of a step: all of it in lanes, its solver steps alone, and Gymnasium's."""
    clock = profiling_clock()
    stock = clock.value  # before lanes switch it off
    rng = np.random.default_rng(0)
    lanes, env = Lanes(task, LANES), make(task)
    draws = [task.draw_reset(rng) for _ in range(LANES)]
    actions = rng.uniform(-1, 1, (STEPS, LANES, task.action_size))
    env.reset(seed=0)

    def all_of_it() -> float:
        lanes.reset(draws)
        begun = time.process_time()
        for action in actions:
            lanes.step(action)
        return (time.process_time() - begun) / (STEPS * LANES)

    def solver() -> float:
        lanes.reset(draws)
        seconds = 0.0
        for action in actions:
            task.control(lanes.data, action)
            begun = time.process_time()
            lanes.batch.step(nstep=task.frame_skip)
            seconds += time.process_time() - begun
        return seconds / (STEPS * LANES)

    def gymnasiums() -> float:
        clock.value = stock
        env.reset()
        begun = time.process_time()
        for action in actions:
            env.step(action[0])
        seconds = time.process_time() - begun
        clock.value = None
        return seconds / STEPS

    parts: dict[str, Callable[[], float]] = {"lanes": all_of_it, "solver": solver, "gymnasium": gymnasiums}
    rounds = [{name: 1e6 * part() for name, part in parts.items()} for _ in range(ROUNDS)]
    return {name: min(one[name] for one in rounds) for name in parts}


if __name__ == "__main__":
    warnings.simplefilter("ignore")
    print(f"{'task':12} {'lanes':>8} {'solver':>8} {'gymnasium':>10} {'x faster':>9}   us a step")
    for name in modules_defining("tasks", "TASK"):
        found = measure(load_task(name))
        ratio = found["gymnasium"] / found["lanes"]
        print(f"{name:12} {found['lanes']:8.1f} {found['solver']:8.1f} {found['gymnasium']:10.1f} {ratio:9.2f}")
