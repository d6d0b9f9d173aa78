"""Gymnasium's Reacher-v5: two joints bring a fingertip to a target.

| observation | | unit |
|---|---|---|
| 0, 1 | cosine of the shoulder's and the elbow's angle | |
| 2, 3 | their sine | |
| 4, 5 | target x, y | m |
| 6, 7 | angular velocities | rad/s |
| 8, 9 | fingertip less target x, y | m |

Actions are two torques in [-1, 1], clamped by the actuators. Source: gymnasium/envs/mujoco/reacher_v5.py and its
reacher.xml.
"""

import mujoco
import numpy as np
from numpy.typing import NDArray

from reacher_shaping.tasks.base import Array, Bounds, Data, Task, View, finite_controls, gymnasium_asset

TARGET_ORIGIN = np.array([0.1, -0.1, 0.01])
"""m; position of the target's body in reacher.xml, and the reference of its two slides."""
TIP = 3
"""The fingertip among the bodies."""


def load_model() -> mujoco.MjModel:
    """Load Gymnasium's reacher model."""
    return mujoco.MjModel.from_xml_path(str(gymnasium_asset("reacher.xml")))


def arm_model() -> mujoco.MjModel:
    """Return the model without what moves nothing: its geometries, no pair of which can collide, and the target.

    The bodies keep the inertia that their geometries gave them, and the solver the measure of the whole model by which
    it ends its iterations, so that the bits at a joint limit are those of the whole.
    """
    whole = load_model()
    arm = mujoco.MjSpec.from_file(str(gymnasium_asset("reacher.xml")))
    arm.delete(arm.body("target"))
    for body in arm.bodies[1:]:
        given = whole.body(body.name)
        body.mass, body.inertia, body.ipos, body.iquat = given.mass[0], given.inertia, given.ipos, given.iquat
        body.explicitinertial = True
    for geometry in list(arm.geoms):
        arm.delete(geometry)
    arm.compiler.inertiafromgeom = mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_FALSE
    model = arm.compile()
    model.stat.meaninertia = whole.stat.meaninertia * whole.nv / model.nv
    return model


def draw_reset(generator: np.random.Generator) -> Array:
    """Draw (joint positions [4], joint velocities [4]) as `ReacherEnv.reset_model` does.

    The order and shape of the draws are Gymnasium's, so a generator in the same state gives the
    same reset. Angles in rad, target coordinates in m.
    """
    position = generator.uniform(low=-0.1, high=0.1, size=4)
    while True:
        target = generator.uniform(low=-0.2, high=0.2, size=2)
        if np.linalg.norm(target) < 0.2:
            break
    position[2:] = target
    velocity = generator.uniform(low=-0.005, high=0.005, size=4)
    velocity[2:] = 0
    return np.concatenate([position, velocity])


def restart(data: Data, draws: Array) -> None:
    """Write the arm's angles and velocities of resets [N, 8]."""
    data.qpos[:, :2], data.qvel[:, :2] = draws[:, 0:2], draws[:, 4:6]


def control(data: Data, action: NDArray[np.floating]) -> None:
    """Write torques [N, 2]."""
    data.ctrl[:] = finite_controls(action)


def observe(data: Data, draws: Array, observation: Array, measured: Array) -> None:
    """Read the observation [N, 10] and the distance [N, 1] of fingertip and target.

    Body positions are those left by the integrator's last stage, not those of the final joint angles: Gymnasium's
    observation and reward read the same. The target rests where its slides put it.
    """
    offset = data.xpos[:, TIP] - target_position(draws)
    np.cos(data.qpos[:, :2], out=observation[:, 0:2])
    np.sin(data.qpos[:, :2], out=observation[:, 2:4])
    observation[:, 4:6] = draws[:, 2:4]
    observation[:, 6:8] = data.qvel[:, :2]
    observation[:, 8:10] = offset[:, :2]
    np.sqrt(np.vecdot(offset, offset), out=measured[:, 0])


def target_position(draws: Array) -> Array:
    """Return the position [N, 3] of the target's body, in the operations in which MuJoCo computes it."""
    position = np.tile(TARGET_ORIGIN, (len(draws), 1))
    position[:, :2] += draws[:, 2:4] - TARGET_ORIGIN[:2]
    return position


def dense(
    measured: Array, control: NDArray[np.floating] | float, *, control_weight: float, success_radius: float
) -> Array:
    """Return r [...] = -||tip - target|| - w ||a||^2 (paper, section 3.1), of distances [..., 1] after the steps.

    `control` is in the precision of the action: Gymnasium weighs it in that precision too.
    """
    reward: Array = -measured[..., 0] - control_weight * control
    return reward


def sparse(
    measured: Array, control: NDArray[np.floating] | float, *, control_weight: float, success_radius: float
) -> Array:
    """Return r [...] = 1 - w ||a||^2 within the success radius of the target, -w ||a||^2 elsewhere."""
    reward: Array = (measured[..., 0] <= success_radius).astype(np.float64) - control_weight * control
    return reward


TASK = Task(
    gymnasium_id="Reacher-v5",
    model=load_model,
    simulated_model=arm_model,
    frame_skip=2,
    step_seconds=0.02,
    episode_steps=50,
    observation_size=10,
    action_size=2,
    measures=("distance",),
    fields=("qpos", "qvel", "ctrl", "xpos"),
    draw_reset=draw_reset,
    restart=restart,
    control=control,
    observe=observe,
    rewards={"dense": dense, "sparse": sparse},
    # the arm's 0.21 m and the farthest target's 0.28 m, and some; a reward of 1 at each of 50 steps
    bounds=Bounds(distance=0.5, highest_return={"dense": 0.0, "sparse": 50.0}),
)
VIEW = View(
    lookat=(0.0, 0.0, 0.0),
    distance=0.25 / np.tan(np.radians(45 / 2)),  # with MuJoCo's field of view, 0.25 m from the centre to an edge
    azimuth=90,
    elevation=-90,
    positions=lambda moving, draw: np.concatenate([moving, np.broadcast_to(draw[2:4], moving.shape)], axis=-1),
    goal=lambda draw: np.append(draw[2:4], 0.001),
    moved="tip",
)
