"""Many copies of Gymnasium's Reacher-v5 side by side: lanes, bit-equal to the original.

A lane is one MuJoCo simulation. All lanes share the model and step in lock-step; every number a
lane gives (observation, distance, control cost) is the one `gymnasium.make("Reacher-v5")` gives for
the same reset draws and actions. Source: gymnasium/envs/mujoco/reacher_v5.py and its reacher.xml.
"""

import ctypes
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path

import mujoco
import numpy as np
from numpy.lib.stride_tricks import as_strided
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


class Fields:
    """The same fields of many simulations as one array, read and written at once.

    MuJoCo allocates every simulation by itself, so their fields lie scattered in this process's memory, always at the
    same addresses. One array that spans them all, indexed by these addresses, saves touching each of them from Python.
    What lies between the fields is not ours and never touched.
    """

    def __init__(self, views: Sequence[Sequence[NDArray[np.float64]]]) -> None:
        """Bind one row of views per simulation; all rows hold as many numbers.

        Raises ValueError for a view that is not a vector of float64, whole in memory: nothing else can be addressed so.
        """
        self._views = views  # keeps the simulations alive
        addresses = np.array([np.concatenate([_addresses(view) for view in row]) for row in views])
        first = min((view for row in views for view in row), key=lambda view: view.ctypes.data)
        self._index, rest = np.divmod(addresses - first.ctypes.data, first.itemsize)
        if rest.any():
            raise ValueError("the views are not aligned to each other")
        self._memory = as_strided(first, shape=(int(self._index.max()) + 1,))

    def read(self) -> Array:
        """Return a copy of the fields, a row per simulation."""
        values: Array = self._memory[self._index]
        return values

    def write(self, values: NDArray[np.floating]) -> None:
        """Overwrite the fields with `values`, a row per simulation; raises ValueError for another shape than theirs."""
        if values.shape != self._index.shape:
            raise ValueError(f"values of shape {values.shape} for fields of shape {self._index.shape}")
        self._memory[self._index] = values


def _addresses(view: NDArray[np.float64]) -> NDArray[np.int64]:
    if view.ndim != 1 or view.dtype != np.float64 or not view.flags.c_contiguous:
        raise ValueError(f"no whole vector of float64: shape {view.shape}, {view.dtype}, strides {view.strides}")
    return view.ctypes.data + np.arange(len(view)) * view.itemsize


class Lanes:
    """N simulations in lock-step, with preallocated arrays for what is read after each step.

    Attributes, valid after `reset` and refreshed by `step` (overwritten in place):
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
        self._controls = Fields([[data.ctrl] for data in self.data])
        self._state = Fields([[data.qpos, data.qvel, data.qacc_warmstart, data.ctrl] for data in self.data])
        self._resting = Fields([[data.qpos[2:], data.xpos[target]] for data in self.data])
        self._moving = Fields([[data.qpos[:2], data.qvel[:2], data.xpos[tip]] for data in self.data])
        self._target = np.empty((count, 3))

    def reset(self, draws: Sequence[tuple[Array, Array]]) -> None:
        """Start an episode in every lane from (positions [4], velocities [4]), one pair a lane.

        The solver's last accelerations and the torques are cleared with it, as `mj_resetData` does; all else that it
        clears is computed anew or never set here, but for the time, which runs on and enters nothing. Raises
        ValueError if the number of pairs is not the number of lanes.
        """
        start = np.reshape(draws, (len(draws), -1))
        self._state.write(np.pad(start, [(0, 0), (0, self.model.nv + self.model.nu)]))
        for data in self.data:
            mujoco.mj_forward(self.model, data)
        self.observation[:, 4:6], self._target[:] = np.split(self._resting.read(), [2], axis=1)
        self._read()

    def step(self, action: NDArray[np.floating]) -> None:
        """Advance every lane by one environment step with torques `action` [N, 2].

        Torques outside [-1, 1] are clamped by the actuators, as in Gymnasium; a torque that is not
        finite counts as zero here (MuJoCo would do the same and warn at every step). Raises ValueError
        for another shape.
        """
        self._controls.write(np.where(np.isfinite(action), action, 0.0))
        step, model = mujoco.mj_step, self.model
        for data in self.data:
            step(model, data, _FRAME_SKIP)
        self._read()

    def _read(self) -> None:
        """Copy what moves from all lanes into the arrays; a target rests for its whole episode.

        Body positions are those left by the integrator's last stage, not those of the final joint
        angles: Gymnasium's observation and reward read the same.
        """
        angle, velocity, tip = np.split(self._moving.read(), [2, 4], axis=1)
        offset = tip - self._target
        np.cos(angle, out=self.observation[:, 0:2])
        np.sin(angle, out=self.observation[:, 2:4])
        self.observation[:, 6:8] = velocity
        self.observation[:, 8:10] = offset[:, :2]
        np.sqrt(np.vecdot(offset, offset), out=self.distance)


def control_cost(action: NDArray[np.floating]) -> NDArray[np.floating]:
    """Return ||a||^2 of actions [..., 2], in the precision of the action as in Gymnasium's reward."""
    cost: NDArray[np.floating] = np.square(action).sum(axis=-1)
    return cost
