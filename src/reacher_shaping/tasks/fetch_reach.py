"""Gymnasium-Robotics' FetchReach-v4: a robot's gripper, led by its position, goes to a goal in space.

| observation | | unit |
|---|---|---|
| 0 to 2 | gripper's position, the achieved goal | m |
| 3 to 5 | the desired goal | m |
| 6 to 8 | gripper's position again, as the environment has it | m |
| 9, 10 | positions of the two fingers, held at 0 | m |
| 11 to 13 | gripper's velocity times the 0.04 s of a step | m |
| 14, 15 | the fingers' velocities times the same | m |

It is the dictionary of Gymnasium's observation as its `FlattenObservation` lays it out. Actions are three shifts of the
gripper in units of 50 mm and one for the fingers, which is not used; all are clipped to [-1, 1]. Source:
gymnasium_robotics/envs/fetch/reach.py, fetch_env.py, robot_env.py and utils/mujoco_utils.py.
"""

from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from reacher_shaping.tasks.base import Array, Bounds, Data, Task, View

FRAME_SKIP = 20
STEP_SECONDS = 0.04
SHIFT = 0.05
"""m that an action of 1 moves the gripper by."""
REACH = 0.15
"""m from the gripper's first place that a goal may lie away along each axis."""
DOWNWARDS = np.array([1.0, 0.0, 1.0, 0.0])
"""What is added to the gripper's quaternion at each step, and where it points at the start."""


class Place(NamedTuple):
    """What is fixed in the model: indices of gripper and site, degrees of freedom that move it, and the first state."""

    gripper: int
    site: int
    root: int
    moving: NDArray[np.bool_]  # [V]
    qpos: Array  # [Q]
    qvel: Array  # [V]
    start: Array  # [3] m


def model_file() -> Path:
    """Return the path of the reach.xml that the installed Gymnasium-Robotics ships.

    Found without importing it. Raises FileNotFoundError if it is not installed.
    """
    package = find_spec("gymnasium_robotics")
    if package is None or package.origin is None:
        raise FileNotFoundError(
            "gymnasium-robotics is not installed: its reach.xml is the model of fetch_reach (pip install "
            "gymnasium-robotics==1.4.2)"
        )
    return Path(package.origin).parent / "envs" / "assets" / "fetch" / "reach.xml"


def load_model() -> mujoco.MjModel:
    """Load the model, its welds reset as the environment does. Contacts stay on: the arm may touch the table."""
    model = mujoco.MjModel.from_xml_path(str(model_file()))
    model.eq_data[model.eq_type == int(mujoco.mjtEq.mjEQ_WELD), :7] = [0, 0, 0, 0, 0, 0, 1]
    return model


@cache
def place() -> Place:
    """Move a robot to where every episode starts, as the environment does when it is made."""
    model = load_model()
    data = mujoco.MjData(model)
    for name, value in (("slide0", 0.4049), ("slide1", 0.48), ("slide2", 0.0)):
        data.joint(f"robot0:{name}").qpos[0] = value
    mujoco.mj_forward(model, data)
    site = model.site("robot0:grip").id
    data.mocap_pos[0] = np.array([-0.498, 0.005, -0.431 + 0.2]) + data.site_xpos[site]
    data.mocap_quat[0] = DOWNWARDS
    for _ in range(10):
        mujoco.mj_step(model, data, FRAME_SKIP)
    gripper = model.body("robot0:gripper_link").id
    jacobian = np.zeros((3, model.nv))
    mujoco.mj_jacSite(model, data, jacobian, None, site)
    moving = np.abs(jacobian).max(axis=0) > 0
    root = int(model.body_rootid[model.site_bodyid[site]])
    return Place(gripper, site, root, moving, data.qpos.copy(), data.qvel.copy(), data.site_xpos[site].copy())


def draw_reset(generator: np.random.Generator) -> Array:
    """Draw a goal [3] in m; all else starts the same."""
    return place().start + generator.uniform(-REACH, REACH, size=3)


def restart(data: Data, draws: Array) -> None:
    """Write the first state."""
    data.qpos[:], data.qvel[:] = place().qpos, place().qvel


def control(data: Data, action: NDArray[np.floating]) -> None:
    """Move the body that leads the gripper by actions [N, 4], from where the gripper is."""
    gripper = place().gripper
    data.mocap_pos[:, 0] = data.xpos[:, gripper] + action[:, :3].clip(-1.0, 1.0) * SHIFT
    data.mocap_quat[:, 0] = data.xquat[:, gripper] + DOWNWARDS


def settle(data: Data) -> None:
    """Hold both fingers at 0, after which the environment computes all positions anew."""
    data.qpos[:, -2:] = 0.0


def observe(data: Data, draws: Array, observation: Array, measured: Array) -> None:
    """Read the observation [N, 16] and the distance [N, 1] of gripper and goal."""
    grip = data.site_xpos[:, place().site]
    observation[:, 0:3] = observation[:, 6:9] = grip
    observation[:, 3:6] = draws
    observation[:, 9:11] = data.qpos[:, -2:]
    observation[:, 11:14] = site_velocity(data) * STEP_SECONDS
    observation[:, 14:16] = data.qvel[:, -2:] * STEP_SECONDS
    offset = grip - draws
    np.sqrt(np.vecdot(offset, offset), out=measured[:, 0])


def site_velocity(data: Data) -> Array:
    """Return the velocity [N, 3] of the gripper's site in m/s: its Jacobian, computed as MuJoCo does, times qvel."""
    fixed = place()
    offset = data.site_xpos[:, fixed.site] - data.subtree_com[:, fixed.root]
    axis, along = data.cdof[..., :3], data.cdof[..., 3:]
    (x, y, z), (px, py, pz) = np.moveaxis(axis, -1, 0), np.moveaxis(offset[:, None], -1, 0)
    around = np.stack([y * pz - z * py, z * px - x * pz, x * py - y * px], axis=1)
    jacobian = np.where(fixed.moving, np.moveaxis(along, -1, 1) + around, 0.0)
    # One product a lane, as the environment does it: a stack of them may sum in another order.
    return np.stack([lane @ speed for lane, speed in zip(jacobian, data.qvel, strict=True)])


def dense(
    measured: Array, control: NDArray[np.floating] | float, *, control_weight: float, success_radius: float
) -> Array:
    """Return r [...] = -||gripper - goal|| - w ||a||^2; the environment has w = 0."""
    reward: Array = -measured[..., 0] - control_weight * control
    return reward


def sparse(
    measured: Array, control: NDArray[np.floating] | float, *, control_weight: float, success_radius: float
) -> Array:
    """Return r [...] = 0 within the success radius of the goal and -1 elsewhere, less w ||a||^2."""
    reward: Array = -(measured[..., 0] > success_radius).astype(np.float64) - control_weight * control
    return reward


TASK = Task(
    gymnasium_id="FetchReach-v4",
    model=load_model,
    simulated_model=load_model,
    frame_skip=FRAME_SKIP,
    step_seconds=STEP_SECONDS,
    episode_steps=50,
    observation_size=16,
    action_size=4,
    measures=("distance",),
    fields=("qpos", "qvel", "mocap_pos", "mocap_quat", "xpos", "xquat", "site_xpos", "subtree_com", "cdof"),
    draw_reset=draw_reset,
    restart=restart,
    control=control,
    settle=settle,
    observe=observe,
    rewards={"dense": dense, "sparse": sparse},
    bounds=Bounds(distance=2.0, highest_return={"dense": 0.0, "sparse": 0.0}),  # the arm is 1.1 m long, and some
)
VIEW = View(
    lookat=(1.3, 0.75, 0.55),
    distance=1.6,
    azimuth=132,
    elevation=-14,
    positions=lambda moving, draw: moving,
    goal=lambda draw: draw,
    moved="gripper",
)
