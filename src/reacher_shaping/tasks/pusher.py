"""Gymnasium's Pusher-v5: an arm of seven joints pushes a puck to a goal.

| observation | | unit |
|---|---|---|
| 0 to 6 | angles of the joints | rad |
| 7 to 13 | their velocities | rad/s |
| 14 to 16 | fingertip's position | m |
| 17 to 19 | puck's position | m |
| 20 to 22 | goal's position | m |

Actions are seven torques in [-2, 2], clamped by the actuators. Source: gymnasium/envs/mujoco/pusher_v5.py and its
pusher_v5.xml.
"""

from functools import cache
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from reacher_shaping.tasks.base import Array, Bounds, Data, Task, View, finite_controls, gymnasium_asset

NEAR_WEIGHT = 0.5
"""Reward per m from fingertip to puck; the distance of puck and goal counts once."""


class Bodies(NamedTuple):
    """Indices of the bodies that are observed."""

    tip: int
    puck: int
    goal: int


def load_model() -> mujoco.MjModel:
    """Load Gymnasium's pusher model. Contacts stay on: they are what pushes."""
    return mujoco.MjModel.from_xml_path(str(gymnasium_asset("pusher_v5.xml")))


@cache
def bodies() -> Bodies:
    """Find the bodies in the model."""
    model = load_model()
    return Bodies(*(model.body(name).id for name in ("tips_arm", "object", "goal")))


def draw_reset(generator: np.random.Generator) -> Array:
    """Draw (joint positions [11], joint velocities [11]) as `PusherEnv.reset_model` does, number for number."""
    while True:
        puck = np.array([generator.uniform(low=-0.3, high=0), generator.uniform(low=-0.2, high=0.2)])
        if np.linalg.norm(puck) > 0.17:
            break
    velocity = generator.uniform(low=-0.005, high=0.005, size=11)
    velocity[-4:] = 0
    return np.concatenate([np.zeros(7), puck, np.zeros(2), velocity])


def restart(data: Data, draws: Array) -> None:
    """Write positions and velocities of resets [N, 22]."""
    data.qpos[:], data.qvel[:] = draws[:, :11], draws[:, 11:]


def control(data: Data, action: NDArray[np.floating]) -> None:
    """Write torques [N, 7]."""
    data.ctrl[:] = finite_controls(action)


def observe(data: Data, draws: Array, observation: Array, measured: Array) -> None:
    """Read the observation [N, 23] and the distances [N, 2] of puck and goal, and of fingertip and puck.

    Body positions are those before the last solver step, as in Gymnasium.
    """
    tip, puck, goal = (data.xpos[:, body] for body in bodies())
    observation[:, :7], observation[:, 7:14] = data.qpos[:, :7], data.qvel[:, :7]
    observation[:, 14:17], observation[:, 17:20], observation[:, 20:23] = tip, puck, goal
    for column, offset in enumerate((puck - goal, puck - tip)):
        np.sqrt(np.vecdot(offset, offset), out=measured[:, column])


def dense(
    measured: Array, control: NDArray[np.floating] | float, *, control_weight: float, success_radius: float
) -> Array:
    """Return r [...] = -||puck - goal|| - w ||a||^2 - 0.5 ||puck - tip||; the environment has w = 0.1."""
    reward: Array = -measured[..., 0] - control_weight * control - NEAR_WEIGHT * measured[..., 1]
    return reward


def sparse(
    measured: Array, control: NDArray[np.floating] | float, *, control_weight: float, success_radius: float
) -> Array:
    """Return r [...] = 1 - w ||a||^2 with the puck within the success radius of the goal, -w ||a||^2 elsewhere."""
    reward: Array = (measured[..., 0] <= success_radius).astype(np.float64) - control_weight * control
    return reward


TASK = Task(
    gymnasium_id="Pusher-v5",
    model=load_model,
    simulated_model=load_model,
    frame_skip=5,
    step_seconds=0.05,
    episode_steps=100,
    observation_size=23,
    action_size=7,
    action_limit=2.0,
    measures=("distance", "near"),
    fields=("qpos", "qvel", "ctrl", "xpos"),
    draw_reset=draw_reset,
    restart=restart,
    control=control,
    observe=observe,
    rewards={"dense": dense, "sparse": sparse},
    bounds=Bounds(distance=15.0, highest_return={"dense": 0.0, "sparse": 100.0}),  # slides of 10.3 m each way
)
VIEW = View(
    lookat=(0.3, -0.2, -0.3),
    distance=1.9,
    azimuth=-90,
    elevation=-40,
    positions=lambda moving, draw: moving,
    goal=lambda draw: np.array([0.45, -0.05, -0.323]),  # pusher_v5.xml's body of the goal, whose slides stay at 0
    moved="puck",
)
