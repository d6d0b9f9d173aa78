"""A task as a record of functions, and many copies of one side by side: lanes, bit-equal to Gymnasium's environment.

A task is one module of this folder that defines `TASK`. Whatever training, evaluation, pictures and checks know of an
environment they read from its record, so another environment is one more module and its name in the configuration.
"""

import ctypes
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from types import SimpleNamespace
from typing import NamedTuple, Protocol

import mujoco
import numpy as np
from mujoco.batch import Batch
from numpy.typing import NDArray

Array = NDArray[np.float64]
Data = SimpleNamespace
"""Fields of `mujoco.MjData` by their names, each with the lanes as a first axis; state fields may be written."""


class Reward(Protocol):
    """The reward of a task's steps."""

    def __call__(
        self, measured: Array, control: NDArray[np.floating] | float, *, control_weight: float, success_radius: float
    ) -> Array:
        """Return r [...] of what was measured after each step [..., M] and ||a||^2 of the actions applied [...]."""


class Simulations(Protocol):
    """N copies of one simulation side by side, as `mujoco.batch.Batch` has them; `state` [N, ...] may be written."""

    state: Array

    def bind(self, name: str) -> Array:
        """Return a field of `mujoco.MjData` [N, ...] that follows the simulations; state fields may be written."""

    def forward(self) -> None:
        """Compute all positions anew from the state."""

    def step(self, nstep: int) -> None:
        """Take so many solver steps."""


class Bounds(NamedTuple):
    """What any results of a task must keep to, whatever was learned."""

    distance: float
    """m; no goal can be farther away."""
    highest_return: Mapping[str, float]
    """No episode's return is above it, by reward."""


class View(NamedTuple):
    """How pictures of a task are taken; a task without one has none. Training knows nothing of it.

    Attributes:
        lookat: m, the point in the middle of the picture.
        distance: m, from there to the camera.
        azimuth: degrees around the vertical.
        elevation: degrees, -90 straight down.
        positions: (positions of the simulated model [..., Q], reset [D]) -> those of the whole model [..., Q'].
        goal: reset [D] -> m, the goal's place [3], around which the success radius is drawn.
        moved: what is to come to the goal, in a word.
    """

    lookat: tuple[float, float, float]
    distance: float
    azimuth: float
    elevation: float
    positions: Callable[[Array, Array], Array]
    goal: Callable[[Array], Array]
    moved: str


@dataclass(frozen=True)
class Task:
    """An environment with its rewards; N lanes, F numbers observed, A of an action, D drawn for a reset, M measured.

    Attributes:
        gymnasium_id: the environment that the lanes equal: bit for bit, unless `batch` says otherwise.
        model: the whole model, for pictures.
        simulated_model: the model that MuJoCo steps; it may lack what no number depends on.
        frame_skip: solver steps of an environment step.
        step_seconds: simulated seconds of an environment step.
        episode_steps: environment steps of an episode; every episode has as many.
        observation_size: F.
        action_size: A.
        action_limit: greatest size of an action's numbers that has an effect; where actions are clipped, here.
        measures: names of what is measured after each step [M]; the first is the distance to the goal in m, which
            success and the potentials read.
        fields: the fields of `Data` that the functions below use.
        draw_reset: draws a reset [D] as the environment does, number for number.
        restart: writes the state after resets [N, D] into data that are as MuJoCo's own reset leaves them.
        control: writes actions [N, A] into the data.
        observe: reads the data after a step or reset into an observation [N, F] and measures [N, M], given the
            episode's resets [N, D].
        rewards: the rewards that can be chosen, by name.
        bounds: what results must keep to.
        settle: changes the state after an environment step, before all positions are computed anew; None where the
            environment leaves them as the last solver step did.
        batch: makes N simulations that are not MuJoCo's, and equal to rounding; None where MuJoCo steps.
    """

    gymnasium_id: str
    model: Callable[[], mujoco.MjModel]
    simulated_model: Callable[[], mujoco.MjModel]
    frame_skip: int
    step_seconds: float
    episode_steps: int
    observation_size: int
    action_size: int
    measures: tuple[str, ...]
    fields: tuple[str, ...]
    draw_reset: Callable[[np.random.Generator], Array]
    restart: Callable[[Data, Array], None]
    control: Callable[[Data, NDArray[np.floating]], None]
    observe: Callable[[Data, Array, Array, Array], None]
    rewards: Mapping[str, Reward]
    bounds: Bounds
    settle: Callable[[Data], None] | None = None
    batch: Callable[[int], Simulations] | None = None
    action_limit: float = 1.0


def load_task(name: str) -> Task:
    """Return the record of a task by the name of its module in this folder.

    Found by name so that the code behind a result holds the task that it uses and no other, see `Cell.chosen_code`.
    """
    task: Task = import_module(f"reacher_shaping.tasks.{name}").TASK
    return task


class Lanes:
    """N simulations of a task in lock-step, with preallocated arrays for what is read after each step.

    Attributes, valid after `reset` and refreshed by `step` (overwritten in place):
        observation: [N, F] float64, Gymnasium's observation.
        measured: [N, M] float64, what the task measures.
        distance: [N] float64, to the goal in m: the first of them.
    """

    def __init__(self, task: Task, count: int) -> None:
        """Allocate `count` lanes. From now on no simulation of this process is timed, see `profiling_clock`."""
        profiling_clock().value = None
        self.task = task
        self.count = count
        self.batch: Simulations = task.batch(count) if task.batch else Batch(task.simulated_model(), count, nthread=1)
        self.data = Data(**{name: self.batch.bind(name) for name in task.fields})
        self.observation = np.empty((count, task.observation_size))
        self.measured = np.empty((count, len(task.measures)))
        self.distance = self.measured[:, 0]
        self._start = self.batch.state.copy()

    def reset(self, draws: Sequence[Array] | Array) -> None:
        """Start an episode in every lane from resets [N, D]. Raises ValueError for another number of them."""
        self._draws = np.asarray(draws)
        if len(self._draws) != self.count:
            raise ValueError(f"{len(self._draws)} resets for {self.count} lanes")
        self.batch.state[:] = self._start
        self.task.restart(self.data, self._draws)
        self.batch.forward()
        self.task.observe(self.data, self._draws, self.observation, self.measured)

    def step(self, action: NDArray[np.floating]) -> None:
        """Advance every lane by one environment step with actions [N, A]; raises ValueError for another shape."""
        if action.shape != (self.count, self.task.action_size):
            raise ValueError(f"actions of shape {action.shape} for {self.count} lanes of {self.task.action_size}")
        self.task.control(self.data, action)
        self.batch.step(nstep=self.task.frame_skip)
        if self.task.settle:
            self.task.settle(self.data)
            self.batch.forward()
        self.task.observe(self.data, self._draws, self.observation, self.measured)


def gymnasium_asset(name: str) -> Path:
    """Return the path of a model that the installed Gymnasium ships.

    Found without importing Gymnasium, which would load its renderers in every training job.
    Raises FileNotFoundError if Gymnasium is not installed.
    """
    package = find_spec("gymnasium")
    if package is None or package.origin is None:
        raise FileNotFoundError(f"gymnasium is not installed: its {name} is the model")
    return Path(package.origin).parent / "envs" / "mujoco" / "assets" / name


def finite_controls(action: NDArray[np.floating]) -> NDArray[np.floating]:
    """Return the controls [N, A] that MuJoCo applies: none at all in a lane where one is not a number.

    MuJoCo does the same and warns at every step; infinite ones it clamps to the actuators' range.
    """
    return np.where(np.isnan(action).any(axis=-1, keepdims=True), 0.0, action)


def control_cost(action: NDArray[np.floating]) -> NDArray[np.floating]:
    """Return ||a||^2 of actions [..., A], in the precision of the action as in Gymnasium's rewards."""
    cost: NDArray[np.floating] = np.square(action).sum(axis=-1)
    return cost


def profiling_clock() -> ctypes.c_void_p:
    """Return MuJoCo's own variable `mjcb_time`: the address of the function it reads the time from, None for no timing.

    The Python package installs a clock when it is imported, for the profile in `MjData.timer`, and cannot take it out
    again; reading it takes a third of `mj_step` at a small model's size. It enters no number of a simulation. Where the
    library has not its usual name, a variable of ours stands in, and the clock goes on.
    """
    library = next(Path(mujoco.__file__).parent.glob("libmujoco*"), None)
    if library is None:
        return ctypes.c_void_p()
    return ctypes.c_void_p.in_dll(ctypes.CDLL(str(library)), "mjcb_time")
