"""Reference policies that need no learning: the floor and the ceiling beside every trained policy.

Each is an actor for `evaluate.evaluate`: (observation [S, L, F], standard normal noise [S, L, A] or None) ->
actions [S, L, A]. They are evaluated on the resets, and with the draws, of the trained policies.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy import stats as distributions

from reacher_shaping.evaluation.evaluate import Actor, Conditions, Mode, evaluate
from reacher_shaping.settings.cell import PPO, REACHERS
from reacher_shaping.stats import wilson_interval
from reacher_shaping.tasks.base import load_task
from reacher_shaping.training.network import Shape
from reacher_shaping.training.policy import Policy, initialise

Array = NDArray[np.float64]
Noise = NDArray[np.float32] | None
LINKS = (0.1, 0.11)
"""Lengths in m: shoulder to elbow, elbow to fingertip (Gymnasium's reacher.xml)."""
ELBOW_LIMIT = 2.99
"""rad; the elbow's joint ends at 3, and the stop is soft, so the target angle stays a little inside it."""


class Gains(NamedTuple):
    """Gains of a PD controller: torque units per rad, and per rad/s."""

    proportional: float
    derivative: float


TUNED_GAINS = {0.1: Gains(1.0, 0.11), 1.0: Gains(0.3, 0.05)}
"""Best of a coarse grid of gains at each weight of the control cost, by mean return over 100 episodes.

Stronger torques arrive sooner and cost more, so the best gains depend on the weight.
"""


def still(actions: int) -> Actor:
    """No action, of A numbers."""
    return lambda observation, noise: np.zeros((*observation.shape[:-1], actions))


def uniform(limit: float) -> Actor:
    """Actions uniform in [-limit, limit]: the normal draws through their own distribution function."""
    return lambda observation, noise: limit * (2 * distributions.norm.cdf(_required(noise)) - 1)


def gaussian(observation: Array, noise: Noise) -> NDArray[np.float32]:
    """Standard normal torques, not clipped, so that the control cost is charged on the raw draw."""
    return _required(noise)


def clipped_gaussian(limit: float) -> Actor:
    """Standard normal actions clipped to [-limit, limit]."""
    return lambda observation, noise: _required(noise).clip(-limit, limit)


def untrained_network(root_seed: int, task: str, settings: PPO) -> Actor:
    """The network that run seed 0 starts its training from."""
    shape = Shape.of(load_task(task), settings)
    return Policy(initialise([0], root_seed, settings, shape), shape).act


def reach(gains: Gains) -> Actor:
    """Inverse kinematics and PD control of Reacher: torques that lead the joints to angles with the tip on the target.

    Of the two solutions (elbow left or right) the one that needs less turning is taken, anew at every step. Torques
    are clipped to [-1, 1].
    """

    def act(observation: Array, noise: Noise) -> Array:
        angles = np.arctan2(observation[..., 2:4], observation[..., 0:2])
        turn = joint_angles(observation[..., 4:6]) - angles[..., None, :]
        turn[..., 0] = (turn[..., 0] + np.pi) % (2 * np.pi) - np.pi  # the shoulder turns freely
        nearer = np.square(turn).sum(axis=-1, keepdims=True).argmin(axis=-2, keepdims=True)
        turn = np.take_along_axis(turn, nearer, axis=-2)[..., 0, :]
        torque: Array = gains.proportional * turn - gains.derivative * observation[..., 6:8]
        return torque.clip(-1.0, 1.0)

    return act


def joint_angles(target: Array) -> Array:
    """Return both solutions [..., 2 solutions, 2 joints] in rad that bring the tip to targets [..., 2] in m.

    A target that the arm cannot reach (beyond its length, or nearer to the shoulder than the elbow's limit allows)
    gives the angles that bring the tip nearest to it.
    """
    first, second = LINKS
    square = np.square(target).sum(axis=-1)
    bend = np.arccos(((square - first**2 - second**2) / (2 * first * second)).clip(-1.0, 1.0))
    elbow = bend.clip(max=ELBOW_LIMIT)[..., None] * np.array([1.0, -1.0])
    direction = np.arctan2(target[..., 1], target[..., 0])[..., None]
    shoulder = direction - np.arctan2(second * np.sin(elbow), first + second * np.cos(elbow))
    return np.stack([shoulder, elbow], axis=-1)


def tip_position(angles: Array) -> Array:
    """Return the fingertip [..., 2] in m of joint angles [..., 2] in rad."""
    sums = np.cumsum(angles, axis=-1)[..., None]
    links = np.array(LINKS)[:, None] * np.concatenate([np.cos(sums), np.sin(sums)], axis=-1)
    position: Array = links.sum(axis=-2)
    return position


def evaluate_controllers(conditions: Conditions, network: PPO | None = None) -> pd.DataFrame:
    """Evaluate all reference policies, each in its own mode; `network` are the settings of the untrained one.

    Returns a row per controller: `controller, mode, episodes, control_weight`, then `success_rate` with its 95 %
    Wilson interval `success_low, success_high`, `mean_return` with its 95 % t interval `mean_return_low,
    mean_return_high`, and the means `final_success_rate, final_distance, min_distance` (m), `reward_distance,
    reward_control`. Both intervals are over episodes.
    """
    environment, root_seed = conditions.environment, conditions.root_seed
    task, control_weight = load_task(environment.task), environment.control_weight
    gains = TUNED_GAINS[min(TUNED_GAINS, key=lambda weight: abs(weight - control_weight))]
    actors: Sequence[tuple[str, Mode, Actor]] = [
        ("zero action", "deterministic", still(task.action_size)),
        ("uniform random", "stochastic", uniform(task.action_limit)),
        ("unit Gaussian", "stochastic", gaussian),
        ("unit Gaussian, clipped", "stochastic", clipped_gaussian(task.action_limit)),
        ("untrained network", "stochastic", untrained_network(root_seed, environment.task, network or PPO())),
        ("inverse kinematics + PD", "deterministic", reach(gains)),
    ]
    if environment.task not in REACHERS:
        actors = actors[:-1]
    rows = []
    for name, mode, act in actors:
        frame = evaluate(act, [0], replace(conditions, mode=mode))
        row = {"controller": name, "mode": mode, "episodes": conditions.episodes, "control_weight": control_weight}
        rows.append(row | _summary(frame))
    return pd.DataFrame(rows)


def _summary(frame: pd.DataFrame) -> dict[str, float]:
    success = wilson_interval(int(frame["success"].sum()), len(frame))
    returns = frame["episode_return"].to_numpy()
    reach_of_mean = float("nan")
    if len(returns) > 1:
        reach_of_mean = distributions.t.ppf(0.975, len(returns) - 1) * distributions.sem(returns)
    return {
        "success_rate": frame["success"].mean(),
        "success_low": success.low,
        "success_high": success.high,
        "mean_return": returns.mean(),
        "mean_return_low": returns.mean() - reach_of_mean,
        "mean_return_high": returns.mean() + reach_of_mean,
        "final_success_rate": frame["final_success"].mean(),
    } | {name: frame[name].mean() for name in ("final_distance", "min_distance", "reward_distance", "reward_control")}


def _required(noise: Noise) -> NDArray[np.float32]:
    if noise is None:
        raise ValueError("a random policy needs noise: evaluate it in mode 'stochastic'")
    return noise
