"""The floor of the engine's time: its `mj_step` calls and matrix products at the best rate found for each."""

import time
from collections.abc import Callable
from typing import Any

import mujoco
import mujoco.rollout
import numpy as np
import torch
from side_by_side import Workload

from reacher_shaping.settings.cell import PPO, Cell
from reacher_shaping.tasks.reacher import TASK
from reacher_shaping.training.network import Array
from reacher_shaping.training.rollout import Collector, RolloutLayout
from reacher_shaping.training.train import TrainState

REPEATS = 10
"""Times that each product is done to tell its time."""


def matrix_products(settings: PPO, seeds: int) -> list[tuple[int, list[tuple[Array, Array]]]]:
    """Return (times an iteration, operands) of all matrix products of one iteration."""
    layout = RolloutLayout(settings.rollout_steps, TASK.episode_steps)
    hidden, batch, features, outputs = (
        settings.hidden_units, settings.minibatch_size, TASK.observation_size + 1, TASK.action_size + 1,
    )  # fmt: skip
    generator = np.random.default_rng(0)

    def product(rows, inner, columns, *, left=False, right=False):
        """Operands of [rows, inner] @ [inner, columns]; `left`, `right`: that operand lies transposed in memory."""
        a = generator.standard_normal((seeds, *((inner, rows) if left else (rows, inner))), np.float32)
        b = generator.standard_normal((seeds, *((columns, inner) if right else (inner, columns))), np.float32)
        return a.swapaxes(1, 2) if left else a, b.swapaxes(1, 2) if right else b

    def forward(count):
        return [
            product(count, features, hidden),
            product(count, hidden, hidden),
            product(outputs, hidden, count, right=True),
        ]

    backward = [
        product(outputs, batch, hidden),
        product(outputs, batch, 1),
        product(batch, outputs, hidden, left=True),
        product(hidden, batch, hidden, left=True),
        product(1, batch, hidden),
        product(batch, hidden, hidden, right=True),
        product(features, batch, hidden, left=True),
    ]
    minibatches = settings.epochs * settings.rollout_steps // batch
    return [
        (minibatches, forward(batch) + backward),
        (layout.episode_steps, forward(layout.lanes)),  # acting
        (1, forward(layout.lanes * (layout.episode_steps + 1))),  # values and log-probabilities of the rollout
        (1, forward(settings.rollout_steps)),  # the losses logged
    ]


class Floor:
    """An iteration's `mj_step` calls and matrix products and nothing else, each as fast as this processor does it."""

    def __init__(self, cell: Cell, seeds: int) -> None:
        self.cell = cell
        self.seeds = range(seeds)
        self.layout = RolloutLayout(cell.protocol.ppo.rollout_steps, TASK.episode_steps)
        model = TASK.simulated_model()
        self.simulation = model, mujoco.MjData(model)
        self.collector = Collector(TASK, self.seeds, cell.root_seed, self.layout)
        self.products = [
            (times, [(a, b, np.empty((seeds, a.shape[1], b.shape[2]), np.float32)) for a, b in operands])
            for times, operands in matrix_products(cell.protocol.ppo, seeds)
        ]

    def physics(self, state: TrainState) -> float:
        """CPU seconds of the `mj_step` calls of the iteration that the engine does next, in C, on one hot simulation.

        The torques are the policy's own: an arm at its joint limit costs more, so random ones would not do.
        """
        lanes, iteration = self.collector.lanes, state.iteration
        action = self.collector.collect(state.policy(), iteration).action
        action = action.reshape(lanes.count, self.layout.episode_steps, -1).astype(np.float64)
        lanes.reset(self.collector.resets(iteration))
        model, data = self.simulation
        start = lanes.batch.state[:, : mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS)]
        begun = time.process_time()
        mujoco.rollout.rollout(model, data, start, action.repeat(TASK.frame_skip, axis=1))
        seconds = time.process_time() - begun
        # The last lane of every seed is shorter than the time measured.
        return seconds * self.layout.steps / (self.layout.lanes * self.layout.episode_steps)

    def products_seconds(self) -> float:
        """CPU seconds of an iteration's matrix products, each shape by the faster of NumPy and PyTorch."""
        return sum(
            times * min(seconds(np.matmul, *operands), seconds(torch.bmm, *map(torch.from_numpy, operands)))
            for times, products in self.products
            for operands in products
        )

    def alone(self, share: Callable[[], float]) -> Workload:
        """Environment steps per second if the seconds of `share` were all that an iteration takes.

        A workload's time is measured around it, so what only prepares the share is kept out by its own clock: the
        steps are scaled to the whole call.
        """

        def one() -> float:
            begun = time.process_time()
            seconds = share()
            whole = time.process_time() - begun
            return len(self.seeds) * self.layout.steps * whole / seconds

        return one


def seconds(multiply: Callable, a: Any, b: Any, out: Any) -> float:
    """CPU seconds of one product, out of a few."""
    begun = time.process_time()
    for _ in range(REPEATS):
        multiply(a, b, out=out)
    return (time.process_time() - begun) / REPEATS


def fraction(engine: float, physics: float, products: float) -> float:
    """Return the floor's share of the engine's time, from environment steps per second of each alone."""
    return engine * (1 / physics + 1 / products)
