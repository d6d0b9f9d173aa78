"""The policies that a report's page lets its reader play: one run each, with what it did in the study's evaluation."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from torch import Tensor

from reacher_shaping.evaluation import controllers
from reacher_shaping.evaluation.evaluate import Actor, Conditions, evaluate
from reacher_shaping.evaluation.video import evaluation_episode
from reacher_shaping.settings.cell import Cell
from reacher_shaping.tasks.base import load_task
from reacher_shaping.training.network import Shape
from reacher_shaping.training.policy import Policy, initialise

LAYERS = ("0.weight", "0.bias", "2.weight", "2.bias")


def untrained(cell: Cell, seed: int) -> Policy:
    """The network from which a run of a cell starts its training."""
    shape = Shape.of(load_task(cell.protocol.environment.task), cell.protocol.ppo)
    return Policy(initialise([seed], cell.root_seed, cell.protocol.ppo, shape), shape)


def controller(cell: Cell) -> tuple[Actor, list[float]]:
    """The controller that needs no learning, and its numbers: two gains, and the elbow's greatest angle in rad."""
    weight = cell.protocol.environment.control_weight
    gains = controllers.TUNED_GAINS[min(controllers.TUNED_GAINS, key=lambda one: abs(one - weight))]
    return controllers.reach(gains), [*gains, controllers.ELBOW_LIMIT]


def measured(act: Actor, conditions: Conditions) -> dict[str, Any]:
    """What a policy of one run did: the shares of episodes that `touched` the target and that `ended` on it.

    `target` [x, y] and `path`, where the fingertip was at the start and after each step, `x,y x,y ...`, are of the
    first, in mm; `radius`, in m, is that of the success counted.
    """
    rows, first = evaluate(act, [0], conditions), evaluation_episode(act, 0, conditions)
    path = controllers.tip_position(first.positions[:, :2])
    return {
        "episodes": conditions.episodes,
        "radius": conditions.success_radius,
        "touched": float(rows["success"].mean()),
        "ended": float(rows["final_success"].mean()),
        "target": np.round(1000 * first.positions[0, 2:], 1).tolist(),
        "path": " ".join(f"{x:.1f},{y:.1f}" for x, y in 1000 * path),
    }


def acting_numbers(weights: Mapping[str, Tensor]) -> bytes:
    """All that one run's policy acts by, as float32: of each layer the rows of its weights, then its biases.

    The two hidden layers, the means of the torques, then the logarithm of their deviations. `weights` are of the
    run alone, [1, ...]; the part that guesses values is left out.
    """
    trunk = "policy_trunk" if "policy_trunk.0.weight" in weights else "shared"
    names = [*(f"{trunk}.{layer}" for layer in LAYERS), "policy_mean.weight", "policy_mean.bias", "log_std"]
    return b"".join(weights[name].detach().numpy().astype("<f4").tobytes() for name in names)
