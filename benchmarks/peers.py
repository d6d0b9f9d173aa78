"""What the engine is measured against: Stable-Baselines3's PPO, and Gymnasium's vector environment."""

from collections.abc import Iterator
from contextlib import contextmanager

import gymnasium
import numpy as np
import stable_baselines3
from plain_loop import Network
from side_by_side import Workload
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor

from reacher_shaping.settings.cell import Cell
from reacher_shaping.tasks.base import profiling_clock
from reacher_shaping.tasks.reacher import TASK
from reacher_shaping.training.policy import Policy

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
            for _ in range(TASK.episode_steps):
                noise = rng.standard_normal((1, lanes, TASK.action_size), dtype=np.float32)
                observation, reward, _, _, _ = env.step(policy.act(observation[None], noise)[0])
                returns += reward
                nearest = np.minimum(nearest, np.linalg.norm(observation[:, 8:], axis=1))
        return chunks * lanes * TASK.episode_steps

    return episodes
