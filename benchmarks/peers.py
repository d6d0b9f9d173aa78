"""What the engine is measured against: Stable-Baselines3's PPO, and Gymnasium's vector environment."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

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


def environment(cell: Cell) -> gymnasium.Env:
    return gymnasium.make(TASK.gymnasium_id, reward_control_weight=cell.protocol.environment.control_weight)


def ppo_options(cell: Cell) -> dict[str, Any]:
    """The cell's settings by the names that Stable-Baselines3 gives them."""
    settings = cell.protocol.ppo
    return {
        "learning_rate": settings.learning_rate,
        "n_steps": settings.rollout_steps,
        "batch_size": settings.minibatch_size,
        "n_epochs": settings.epochs,
        "gamma": settings.discount,
        "gae_lambda": settings.gae_lambda,
        "clip_range": settings.clip_range,
        "ent_coef": settings.entropy_coefficient,
        "vf_coef": settings.value_coefficient,
        "max_grad_norm": settings.max_gradient_norm,
        "device": "cpu",
        "seed": 0,
    }


@as_installed()
def learned(model: Any, steps: int) -> tuple[float, float]:
    """Let a model of Stable-Baselines3's kind learn for so many steps: steps, and the mean return of its episodes."""
    model.learn(steps, reset_num_timesteps=False)
    return steps, float(np.mean([episode["r"] for episode in model.ep_info_buffer]))


def stable_baselines(cell: Cell, *, shared: bool) -> Callable[[], tuple[float, float]]:
    """Stable-Baselines3's PPO with the cell's settings, an iteration a call.

    Its own default has separate networks of 64-64 for policy and value; `shared` gives it the study's network, which
    is less work.
    """
    settings = cell.protocol.ppo
    network = {"net_arch": [], "features_extractor_class": Trunk} if shared else {"net_arch": [64, 64]}
    policy = {**network, "optimizer_kwargs": {"eps": settings.adam_epsilon}}
    model = stable_baselines3.PPO("MlpPolicy", environment(cell), policy_kwargs=policy, **ppo_options(cell))
    return lambda: learned(model, settings.rollout_steps)


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


def envpool(cell: Cell) -> Callable[[], tuple[float, float]]:
    """Stable-Baselines3's PPO on EnvPool's Reacher, as many environments in lock-step as a rollout has episodes."""
    import envpool as pool
    from stable_baselines3.common.vec_env import VecEnv, VecMonitor

    class Lanes(VecEnv):
        """EnvPool's environments as Stable-Baselines3 wants them."""

        def __init__(self, count):
            weight = cell.protocol.environment.control_weight
            self.pool = pool.make(TASK.gymnasium_id, env_type="gymnasium", num_envs=count, ctrl_cost_weight=weight)
            super().__init__(count, self.pool.observation_space, self.pool.action_space)

        def reset(self):
            return self.pool.reset()[0]

        def step_async(self, actions):
            self.actions = actions.astype(np.float64)

        def step_wait(self):
            observation, reward, terminated, truncated, _ = self.pool.step(self.actions)
            done = terminated | truncated
            infos = [{"TimeLimit.truncated": bool(cut)} for cut in truncated]
            if done.any():  # all at once: an episode has a fixed length
                for info, last in zip(infos, observation, strict=True):
                    info["terminal_observation"] = last
                observation = self.pool.reset()[0]
            return observation, reward, done, infos

        def close(self):
            self.pool.close()

        def get_attr(self, attr_name, indices=None):
            return [None] * self.num_envs

        def set_attr(self, attr_name, value, indices=None):
            raise NotImplementedError

        def env_method(self, method_name, *method_args, indices=None, **method_kwargs):
            raise NotImplementedError

        def env_is_wrapped(self, wrapper_class, indices=None):
            return [False] * self.num_envs

    settings = cell.protocol.ppo
    count = settings.rollout_steps // settings.minibatch_size  # 32: the rollout's size stays what it is
    network = {"net_arch": [64, 64], "optimizer_kwargs": {"eps": settings.adam_epsilon}}
    options = {**ppo_options(cell), "n_steps": settings.rollout_steps // count}
    model = stable_baselines3.PPO("MlpPolicy", VecMonitor(Lanes(count)), policy_kwargs=network, **options)
    return lambda: learned(model, settings.rollout_steps)


def sbx(cell: Cell) -> Callable[[], tuple[float, float]]:
    """The PPO of sbx, Stable-Baselines3's in JAX, on Gymnasium's environment."""
    from sbx import PPO

    model = PPO("MlpPolicy", environment(cell), policy_kwargs={"net_arch": [64, 64]}, **ppo_options(cell))
    return lambda: learned(model, cell.protocol.ppo.rollout_steps)
