"""Training of one block of seeds: collect, shape, estimate advantages, update; once an iteration.

`train` is a generator of states, so that its caller decides what to do between iterations (show
progress, keep a checkpoint, stop), and a state is all it takes to go on.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pandas as pd
import torch
from numpy.typing import NDArray
from torch import Tensor

from reacher_shaping import advantage, ppo, shaping
from reacher_shaping.config import Cell
from reacher_shaping.policy import Policy, forward, initialise, inputs
from reacher_shaping.reacher import ACTION_SIZE, EPISODE_STEPS
from reacher_shaping.rollout import Collector, Plan, Rollout, environment_reward
from reacher_shaping.streams import Purpose, stream

Array = NDArray[np.float64]
Rows = dict[str, NDArray[Any]]


@dataclass
class TrainState:
    """All that a run is after `iteration` iterations; `progress` and `episodes` grow by one entry each.

    Attributes:
        seeds: run seeds of the block.
        rows: [S, P] parameters.
        adam: Adam's state.
        iteration: iterations done.
        progress: per iteration, the columns of `progress.parquet`, [S] each.
        episode_returns: per iteration, [S, E] unshaped returns of the episodes that reached the time limit.
    """

    seeds: tuple[int, ...]
    rows: Tensor
    adam: ppo.Adam
    iteration: int = 0
    progress: list[Rows] = field(default_factory=list)
    episode_returns: list[Array] = field(default_factory=list)

    def policy(self, cell: Cell) -> Policy:
        """Return the policy as trained so far."""
        return Policy(self.rows, cell.protocol.ppo.hidden_units)

    def diverged(self) -> list[int]:
        """Return the seeds whose parameters are no longer finite."""
        finite = torch.isfinite(self.rows).all(dim=1).tolist()
        return [seed for seed, ok in zip(self.seeds, finite, strict=True) if not ok]

    def progress_frame(self) -> pd.DataFrame:
        """Return `progress.parquet`: a row per seed and iteration, ordered by seed."""
        columns = {name: np.stack([row[name] for row in self.progress], axis=1).ravel() for name in self.progress[0]}
        return pd.DataFrame(columns)

    def episodes_frame(self) -> pd.DataFrame:
        """Return the training episodes, a row each: seed, iteration, episode_return, episode_length, env_steps.

        `env_steps` counts the environment steps of training done when the episode ended.
        """
        returns = np.stack(self.episode_returns, axis=1)
        seeds, iterations, episodes = returns.shape
        steps = np.stack([row["env_steps"] for row in self.progress], axis=1)
        start = np.concatenate([np.zeros_like(steps[:, :1]), steps[:, :-1]], axis=1)
        end = start[..., None] + EPISODE_STEPS * np.arange(1, episodes + 1)
        return pd.DataFrame(
            {
                "seed": np.repeat(self.seeds, iterations * episodes),
                "iteration": np.tile(np.repeat(np.arange(1, iterations + 1), episodes), seeds),
                "episode_return": returns.ravel(),
                "episode_length": EPISODE_STEPS,
                "env_steps": end.ravel(),
            }
        )


def train(cell: Cell, seeds: Sequence[int], *, radius: float, state: TrainState | None = None) -> Iterator[TrainState]:
    """Train the block and yield its state after every iteration (the same object, changed in place).

    Args:
        cell: what to train.
        seeds: run seeds of the block, in any number.
        radius: m, tip-target distance that counts as success in the progress rows.
        state: a state to go on from; without it training starts at iteration 0.

    A seed whose numbers stop being finite is carried on as such and touches no other.
    """
    torch.set_num_threads(1)
    torch.set_flush_denormal(True)
    settings = cell.protocol.ppo
    plan = Plan(settings.rollout_steps)
    if state is None:
        rows = initialise(seeds, cell.root_seed, settings.hidden_units)
        state = TrainState(tuple(seeds), rows, ppo.Adam.zeros_like(rows))
    learner = ppo.Learner(state.rows, settings, state.adam)
    collector = Collector(seeds, cell.root_seed, plan, clip_actions=cell.protocol.environment.clip_actions)
    policy = state.policy(cell)
    while state.iteration < cell.iterations:
        rollout = collector.collect(policy, state.iteration)
        records, summary = prepare(cell, policy, rollout, plan, state.iteration, radius)
        learner.update(records, _shuffles(cell, seeds, state.iteration))
        state.iteration += 1
        losses = ppo.diagnose(learner.network, records, settings.clip_range)
        state.episode_returns.append(summary.pop("episode_returns"))
        state.progress.append(
            {
                "seed": np.array(seeds),
                "iteration": np.full(len(seeds), state.iteration),
                "env_steps": np.full(len(seeds), state.iteration * settings.rollout_steps),
                **summary,
                "action_std": learner.network.log_std.exp().mean((1, 2)).double().numpy(),
                **{name: value.double().numpy() for name, value in losses._asdict().items()},
            }
        )
        yield state


def prepare(
    cell: Cell, policy: Policy, rollout: Rollout, plan: Plan, iteration: int, radius: float
) -> tuple[Tensor, Rows]:
    """Turn a rollout into sample records [S, N, 16] and the rollout's summary, [S] each.

    Samples stand in the order of the sequential rollout. The summary also holds `episode_returns`
    [S, E], unshaped.
    """
    settings = cell.protocol.ppo
    reward = environment_reward(rollout.distance, rollout.control, cell.protocol.environment.control_weight)
    extra = shaping.shaping_reward(
        rollout.distance,
        plan.order + iteration * plan.steps,
        plan.ends,
        variant=cell.variant,
        alpha0=cell.alpha0,
        discount=settings.discount,
        settings=cell.protocol.shaping,
    )
    features, log_prob, values = _outputs(policy, rollout)
    following = advantage.next_values(values, plan.ends, cell.protocol.shaping.episode_end)
    advantages = advantage.gae(
        reward + extra,
        values[..., :-1],
        following,
        plan.ends,
        discount=settings.discount,
        gae_lambda=settings.gae_lambda,
    )
    advantages, fitted = plan.sequence(advantages), plan.sequence(values[..., :-1])
    targets = advantages + fitted
    records = ppo.pack(
        plan.sequence(features),
        plan.sequence(torch.from_numpy(rollout.action)),
        plan.sequence(log_prob),
        torch.from_numpy(advantage.normalise(advantages)).float(),
        torch.from_numpy(targets).float(),
    )
    return records, {
        **_summary(reward, extra, rollout, plan, radius),
        "explained_variance": _explained(fitted, targets),
    }


@torch.inference_mode()
def _outputs(policy: Policy, rollout: Rollout) -> tuple[Tensor, Tensor, Array]:
    """Return inputs [S, L, T, 11], log-probabilities [S, L, T] and values [S, L, T+1] of a whole rollout."""
    seeds, lanes, times, _ = rollout.observation.shape
    features = inputs(rollout.observation)
    output = forward(policy.layers, features.view(seeds, lanes * times, -1)).view(seeds, -1, lanes, times)
    mean, values = output[:, :ACTION_SIZE, :, :-1], output[:, ACTION_SIZE]
    log_std = policy.layers.log_std
    action = torch.from_numpy(rollout.action).permute(0, 3, 1, 2)
    deviation = ((action - mean) * torch.exp(-log_std)[..., None]).reshape(seeds, ACTION_SIZE, -1)
    log_prob = ppo.log_probability(deviation, log_std).view(seeds, lanes, -1)
    return features[:, :, :-1], log_prob, values.double().numpy()


def _summary(reward: Array, extra: Array, rollout: Rollout, plan: Plan, radius: float) -> Rows:
    """Return the means [S] over a rollout's whole episodes, and `episode_returns` [S, E]."""
    whole = slice(0, plan.episodes)
    returns = reward[:, whole].sum(-1)
    distance = rollout.distance[:, whole, 1:]
    return {
        "episode_returns": returns,
        "episode_return": returns.mean(1),
        "shaped_return": (reward + extra)[:, whole].sum(-1).mean(1),
        "episode_length": np.full(len(returns), float(EPISODE_STEPS)),
        "success_rate": (distance.min(-1) <= radius).mean(1),
        "final_distance": distance[..., -1].mean(1),
    }


def _explained(values: Array, targets: Array) -> Array:
    """Return 1 - Var(R - V) / Var(R) [S] of values and targets [S, N]; NaN where the targets are constant."""
    variance = targets.var(axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(variance > 0, 1 - (targets - values).var(axis=1) / variance, np.nan)


def _shuffles(cell: Cell, seeds: Sequence[int], iteration: int) -> Tensor:
    """Return each seed's own sample orders [S, epochs, N] of one iteration."""
    settings = cell.protocol.ppo
    base = np.tile(np.arange(settings.rollout_steps), (settings.epochs, 1))
    generators = [stream(cell.root_seed, Purpose.SHUFFLES, seed, iteration) for seed in seeds]
    return torch.from_numpy(np.stack([generator.permuted(base, axis=1) for generator in generators]))
