"""How far shaping pulls a policy where the task's own reward does: the cosine of their policy gradients."""

import numpy as np
from numpy.typing import NDArray

from reacher_shaping.settings.cell import PPO
from reacher_shaping.training import ppo
from reacher_shaping.training.advantage import gae
from reacher_shaping.training.policy import Policy
from reacher_shaping.training.rollout import RolloutLayout

Array = NDArray[np.float64]


def alignment(
    policy: Policy,
    features: NDArray[np.float32],
    action: NDArray[np.float32],
    log_prob: NDArray[np.float32],
    reward: Array,
    shaping: Array,
    layout: RolloutLayout,
    settings: PPO,
) -> Array:
    """Return the cosine [S] of the gradients of the unshaped return and of the shaping (Du et al. 2018, eq. 3).

    Both are policy gradients at the policy that acted: of the discounted rewards to come, and of the shaping terms to
    come as the advantages count them, with lambda. From each the mean over the episodes at the same step is taken,
    which changes no expectation. 0 where a gradient is zero.

    Args:
        policy: the S networks that acted.
        features: [S, L, T, F + 1] network inputs.
        action: [S, L, T, A].
        log_prob: [S, L, T].
        reward: [S, L, T] unshaped.
        shaping: [S, L, T], the terms added to it; their scale does not count.
        layout: how the rollout lies in lanes.
        settings: discount and lambda.
    """
    plain = settings.model_copy(update={"value_coefficient": 0.0, "entropy_coefficient": 0.0, "ratio_pairs": "sample"})
    learner = ppo.Learner(policy.parameters, plain, policy.shape)
    gradients = []
    for rewards, gae_lambda in ((reward, 1.0), (shaping, settings.gae_lambda)):
        zeros = np.zeros_like(rewards)
        to_come = gae(rewards, zeros, zeros, layout.episode_ends, discount=settings.discount, gae_lambda=gae_lambda)
        to_come -= to_come[:, : max(layout.episodes, 1)].mean(1, keepdims=True)
        wanted = layout.sequence(to_come)
        records = ppo.pack(
            layout.sequence(features), layout.sequence(action), layout.sequence(log_prob), wanted, np.zeros_like(wanted)
        )
        learner.differentiate(ppo.unpack(records, policy.shape.actions))
        gradients.append(learner.gradient.numpy().astype(np.float64))
    first, second = gradients
    length = np.sqrt(np.vecdot(first, first) * np.vecdot(second, second))
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(length > 0, np.vecdot(first, second) / length, 0.0)
