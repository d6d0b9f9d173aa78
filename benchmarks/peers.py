"""What the engine is measured against: Stable-Baselines3's PPO, and the floor of its own arithmetic."""

import time
from collections.abc import Iterator
from contextlib import contextmanager

import gymnasium
import mujoco
import numpy as np
import stable_baselines3
import torch
from plain_loop import Network
from side_by_side import Workload
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor

from reacher_shaping.cell import PPO, Cell
from reacher_shaping.policy import Policy
from reacher_shaping.reacher import (
    ACTION_SIZE,
    EPISODE_STEPS,
    OBSERVATION_SIZE,
    profiling_clock,
)
from reacher_shaping.rollout import Collector, Plan
from reacher_shaping.train import TrainState

CLOCK = profiling_clock()
STOCK_CLOCK = CLOCK.value  # read at import, before any lanes switch it off


@contextmanager
def as_installed() -> Iterator[None]:
    """Run MuJoCo as the package comes, with its profiling clock on: all that is compared with the engine does."""
    CLOCK.value = STOCK_CLOCK
    try:
        yield
    finally:
        CLOCK.value = None


class Trunk(BaseFeaturesExtractor):
    """The one trunk that the paper's policy and value share."""

    def __init__(self, space):
        super().__init__(space, 64)
        self.layers = Network().shared

    def forward(self, observation):
        return self.layers(observation)


def stable_baselines(cell: Cell, *, shared: bool) -> Workload:
    """Stable-Baselines3's PPO with the cell's settings, an iteration a call.

    Its own default has separate networks of 64-64 for policy and value; `shared` gives it the study's network, which
    is less work.
    """
    settings = cell.protocol.ppo
    network = {"net_arch": [], "features_extractor_class": Trunk} if shared else {"net_arch": [64, 64]}
    model = stable_baselines3.PPO(
        "MlpPolicy",
        gymnasium.make("Reacher-v5", reward_control_weight=cell.protocol.environment.control_weight),
        learning_rate=settings.learning_rate,
        n_steps=settings.rollout_steps,
        batch_size=settings.minibatch_size,
        n_epochs=settings.epochs,
        gamma=settings.discount,
        gae_lambda=settings.gae_lambda,
        clip_range=settings.clip_range,
        ent_coef=settings.entropy_coefficient,
        vf_coef=settings.value_coefficient,
        max_grad_norm=settings.max_gradient_norm,
        policy_kwargs={**network, "optimizer_kwargs": {"eps": settings.adam_epsilon}},
        device="cpu",
        seed=0,
    )

    @as_installed()
    def iteration() -> float:
        model.learn(settings.rollout_steps, reset_num_timesteps=False)
        return settings.rollout_steps

    return iteration


def matrix_products(settings: PPO, seeds: int) -> list[tuple[int, list[tuple[torch.Tensor, torch.Tensor]]]]:
    """Return (times an iteration, operands) of all matrix products of one iteration."""
    plan = Plan(settings.rollout_steps)
    hidden, batch, features, outputs = (
        settings.hidden_units, settings.minibatch_size, OBSERVATION_SIZE + 1, ACTION_SIZE + 1,
    )  # fmt: skip
    generator = torch.Generator().manual_seed(0)

    def product(rows, inner, columns, *, left=False, right=False):
        """Operands of [rows, inner] @ [inner, columns]; `left`, `right`: that operand lies transposed in memory."""
        a = torch.randn(seeds, *((inner, rows) if left else (rows, inner)), generator=generator)
        b = torch.randn(seeds, *((columns, inner) if right else (inner, columns)), generator=generator)
        return a.transpose(1, 2) if left else a, b.transpose(1, 2) if right else b

    def forward(count):
        return [
            product(count, features, hidden),
            product(count, hidden, hidden),
            product(outputs, hidden, count, right=True),
        ]

    backward = [
        product(outputs, batch, hidden),
        product(batch, outputs, hidden, left=True),
        product(hidden, batch, hidden, left=True),
        product(batch, hidden, hidden, right=True),
        product(features, batch, hidden, left=True),
    ]
    minibatches = settings.epochs * settings.rollout_steps // batch
    return [
        (minibatches, forward(batch) + backward),
        (EPISODE_STEPS, forward(plan.lanes)),  # acting
        (1, forward(plan.lanes * (EPISODE_STEPS + 1))),  # values and log-probabilities of the rollout
        (1, forward(settings.rollout_steps)),  # the losses logged
    ]


class Floor:
    """An iteration's `mj_step` calls and matrix products and nothing else."""

    def __init__(self, cell: Cell, seeds: int) -> None:
        self.cell = cell
        self.seeds = range(seeds)
        self.plan = Plan(cell.protocol.ppo.rollout_steps)
        self.collector = Collector(self.seeds, cell.root_seed, self.plan)
        self.products = [
            (times, [(a, b, torch.empty(seeds, a.shape[1], b.shape[2])) for a, b in operands])
            for times, operands in matrix_products(cell.protocol.ppo, seeds)
        ]

    def physics(self, state: TrainState) -> float:
        """CPU seconds of the `mj_step` calls of the iteration that the engine does next.

        The torques are the policy's own: an arm at its joint limit costs more, so random ones would not do.
        """
        lanes, iteration = self.collector.lanes, state.iteration
        action = self.collector.collect(state.policy(self.cell), iteration).action.reshape(
            lanes.count, EPISODE_STEPS, -1
        )
        lanes.reset(self.collector.resets(iteration))
        step, model, data = mujoco.mj_step, lanes.model, lanes.data
        seconds = 0.0
        for t in range(EPISODE_STEPS):
            for lane, torque in zip(data, action[:, t], strict=True):
                lane.ctrl[:] = torque
            begun = time.process_time()
            for lane in data:
                step(model, lane, 2)
            seconds += time.process_time() - begun
        # The last lane of every seed is shorter than the time measured.
        return seconds * self.plan.steps / (self.plan.lanes * EPISODE_STEPS)

    @torch.inference_mode()
    def products_seconds(self) -> float:
        """CPU seconds of an iteration's matrix products."""
        begun = time.process_time()
        for times, operands in self.products:
            for _ in range(times):
                for a, b, out in operands:
                    torch.bmm(a, b, out=out)
        return time.process_time() - begun


def make_vec_evaluation(policy: Policy, control_weight: float, lanes: int, chunks: int) -> Workload:
    """Evaluation as one would write it with Gymnasium's vector environment: one policy, `lanes` environments."""
    env = gymnasium.make_vec(
        "Reacher-v5", num_envs=lanes, vectorization_mode="sync", reward_control_weight=control_weight
    )
    rng = np.random.default_rng(0)

    @as_installed()
    def episodes() -> float:
        for _ in range(chunks):
            observation, _ = env.reset()
            nearest, returns = np.full(lanes, np.inf), np.zeros(lanes)
            for _ in range(EPISODE_STEPS):
                noise = rng.standard_normal((1, lanes, ACTION_SIZE), dtype=np.float32)
                observation, reward, _, _, _ = env.step(policy.act(observation[None], noise)[0])
                returns += reward
                nearest = np.minimum(nearest, np.linalg.norm(observation[:, 8:], axis=1))
        return chunks * lanes * EPISODE_STEPS

    return episodes
