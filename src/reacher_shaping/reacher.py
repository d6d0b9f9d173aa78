"""Many copies of Gymnasium's Reacher-v5 side by side: lanes, bit-equal to the original.

A lane is one MuJoCo simulation. All lanes share the model and step in lock-step; every number a
lane gives (observation, distance, control cost) is the one `gymnasium.make("Reacher-v5")` gives for
the same reset draws and actions. Source: gymnasium/envs/mujoco/reacher_v5.py and its reacher.xml.
"""

import ctypes
from collections.abc import Iterable
from importlib.util import find_spec
from pathlib import Path

import mujoco
import numpy as np
from numpy.typing import NDArray

EPISODE_STEPS = 50
"""Environment steps before truncation, Gymnasium's registration of Reacher-v5."""
STEP_SECONDS = 0.02
"""Simulated seconds of one environment step: two solver steps of 0.01 s."""
OBSERVATION_SIZE = 10
ACTION_SIZE = 2

_FRAME_SKIP = 2

Array = NDArray[np.float64]


def model_file() -> Path:
    """Return the path of the reacher.xml that the installed Gymnasium ships.

    Found without importing Gymnasium, which would load its renderers in every training job.
    Raises FileNotFoundError if Gymnasium is not installed.
    """
    package = find_spec("gymnasium")
    if package is None or package.origin is None:
        raise FileNotFoundError("gymnasium is not installed: its reacher.xml is the model")
    return Path(package.origin).parent / "envs" / "mujoco" / "assets" / "reacher.xml"


def load_model(*, contacts: bool = False) -> mujoco.MjModel:
    """Load Gymnasium's reacher model.

    No pair of its geometries can collide, so collision detection is left out unless `contacts`:
    the same bits for a tenth to a third less time.
    """
    model = mujoco.MjModel.from_xml_path(str(model_file()))
    if not contacts:
        model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
    return model


def profiling_clock() -> ctypes.c_void_p:
    """Return MuJoCo's own variable `mjcb_time`: the address of the function it reads the time from, None for no timing.

    The Python package installs a clock when it is imported, for the profile in `MjData.timer`, and cannot take it out
    again; reading it takes a third of `mj_step` at this model's size. It enters no number of a simulation. Where the
    library has not its usual name, a variable of ours stands in, and the clock goes on.
    """
    library = next(Path(mujoco.__file__).parent.glob("libmujoco*"), None)
    if library is None:
        return ctypes.c_void_p()
    return ctypes.c_void_p.in_dll(ctypes.CDLL(str(library)), "mjcb_time")


def draw_reset(generator: np.random.Generator) -> tuple[Array, Array]:
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
    return position, velocity


class Lanes:
    """N simulations in lock-step, with preallocated arrays for what is read after each step.

    Attributes, valid after `reset` and refreshed by `step` (views, overwritten in place):
        observation: [N, 10] float64, Gymnasium's observation.
        distance: [N] float64, fingertip to target in m (the negative of Gymnasium's reward_dist).
    """

    def __init__(self, count: int, *, contacts: bool = False) -> None:
        """Allocate `count` lanes; `contacts` keeps collision detection on (for measuring only).

        From now on no simulation of this process is timed, see `profiling_clock`.
        """
        profiling_clock().value = None
        self.model = load_model(contacts=contacts)
        self.count = count
        self.data = [mujoco.MjData(self.model) for _ in range(count)]
        self.observation = np.empty((count, OBSERVATION_SIZE))
        self.distance = np.empty(count)
        tip = self.model.body("fingertip").id
        target = self.model.body("target").id
        self._controls = [data.ctrl for data in self.data]
        self._angles = [data.qpos[:2] for data in self.data]
        self._velocities = [data.qvel[:2] for data in self.data]
        self._tips = [data.xpos[tip] for data in self.data]
        self._targets = [data.xpos[target] for data in self.data]
        self._angle = np.empty((count, 2))
        self._velocity = np.empty((count, 2))
        self._tip = np.empty((count, 3))
        self._target = np.empty((count, 3))

    def reset(self, draws: Iterable[tuple[Array, Array]]) -> None:
        """Start an episode in every lane from (positions [4], velocities [4]), one pair a lane.

        Raises ValueError if the number of pairs is not the number of lanes.
        """
        for data, (position, velocity) in zip(self.data, draws, strict=True):
            mujoco.mj_resetData(self.model, data)
            data.qpos[:] = position
            data.qvel[:] = velocity
            mujoco.mj_forward(self.model, data)
        np.stack(self._targets, out=self._target)
        np.stack([data.qpos[2:] for data in self.data], out=self.observation[:, 4:6])
        self._read()

    def step(self, action: NDArray[np.floating]) -> None:
        """Advance every lane by one environment step with torques `action` [N, 2].

        Torques outside [-1, 1] are clamped by the actuators, as in Gymnasium; a torque that is not
        finite counts as zero here (MuJoCo would do the same and warn at every step).
        """
        action = np.where(np.isfinite(action), action, 0.0)
        step, model = mujoco.mj_step, self.model
        for data, control, torque in zip(self.data, self._controls, action, strict=True):
            control[:] = torque
            step(model, data, _FRAME_SKIP)
        self._read()

    def _read(self) -> None:
        """Copy what moves from all lanes into the arrays; a target rests for its whole episode.

        Body positions are those left by the integrator's last stage, not those of the final joint
        angles: Gymnasium's observation and reward read the same.
        """
        np.concatenate(self._angles, out=self._angle.reshape(-1))
        np.concatenate(self._velocities, out=self._velocity.reshape(-1))
        np.concatenate(self._tips, out=self._tip.reshape(-1))
        offset = self._tip - self._target
        np.cos(self._angle, out=self.observation[:, 0:2])
        np.sin(self._angle, out=self.observation[:, 2:4])
        self.observation[:, 6:8] = self._velocity
        self.observation[:, 8:10] = offset[:, :2]
        np.sqrt(np.vecdot(offset, offset), out=self.distance)


def control_cost(action: NDArray[np.floating]) -> NDArray[np.floating]:
    """Return ||a||^2 of actions [..., 2], in the precision of the action as in Gymnasium's reward."""
    cost: NDArray[np.floating] = np.square(action).sum(axis=-1)
    return cost
