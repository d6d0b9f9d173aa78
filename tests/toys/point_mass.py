"""A toy task: a point mass on a line is pushed to a goal. All that another task takes: one file like this one."""

import mujoco
import numpy as np

from reacher_shaping.tasks.base import Bounds, Task, finite_controls

MODEL = """
<mujoco>
  <option timestep="0.05" gravity="0 0 0"/>
  <worldbody>
    <body>
      <joint name="slide" type="slide" axis="1 0 0" damping="1"/>
      <geom type="sphere" size="0.1" mass="0.2"/>
    </body>
  </worldbody>
  <actuator><motor joint="slide" ctrllimited="true" ctrlrange="-1 1"/></actuator>
</mujoco>
"""


def load_model():
    return mujoco.MjModel.from_xml_string(MODEL)


def draw_reset(generator):
    """The place of the mass and the goal."""
    return generator.uniform(-1.0, 1.0, size=2)


def restart(data, draws):
    data.qpos[:, 0] = draws[:, 0]


def control(data, action):
    data.ctrl[:] = finite_controls(action)


def observe(data, draws, observation, measured):
    observation[:] = np.column_stack([data.qpos[:, 0], data.qvel[:, 0], draws[:, 1]])
    measured[:, 0] = np.abs(data.qpos[:, 0] - draws[:, 1])


def dense(measured, control, *, control_weight, success_radius):
    return -measured[..., 0] - control_weight * control


TASK = Task(
    gymnasium_id="PointMass-v0",
    model=load_model,
    simulated_model=load_model,
    frame_skip=2,
    step_seconds=0.1,
    episode_steps=30,
    observation_size=3,
    action_size=1,
    measures=("distance",),
    fields=("qpos", "qvel", "ctrl"),
    draw_reset=draw_reset,
    restart=restart,
    control=control,
    observe=observe,
    rewards={"dense": dense},
    bounds=Bounds(distance=np.inf, highest_return={"dense": 0.0}),
)
