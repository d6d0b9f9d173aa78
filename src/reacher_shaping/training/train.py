"""Training of one block of seeds: collect, shape, estimate advantages, update; once an iteration.

`train` is a generator of states, so that its caller decides what to do between iterations (show
progress, keep a checkpoint, stop), and a state is all it takes to go on.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
import torch
from numpy.typing import NDArray
from torch import Tensor

from reacher_shaping.random_streams import Purpose, stream
from reacher_shaping.settings.cell import PPO, Cell
from reacher_shaping.storage.block_schemas import MEASURES
from reacher_shaping.tasks.base import Task, load_task
from reacher_shaping.training import advantage, ppo
from reacher_shaping.training.alignment import alignment
from reacher_shaping.training.network import Shape, silent
from reacher_shaping.training.policy import Policy, initialise, inputs
from reacher_shaping.training.records import State, Transitions
from reacher_shaping.training.rollout import Collector, Rollout, RolloutLayout
from reacher_shaping.training.shaping import Rule

Array = NDArray[np.float64]
Columns = dict[str, NDArray[Any]]
RELEASED_LOG_EPISODES = 10
"""Episodes of a rollout, the last ones, that the released code's logged return is the mean of."""


@dataclass
class TrainState:
    """All that a run is after `iteration` of its I iterations.

    The logs have their full size from the start: arrays kept from each iteration would lie between those that are
    freed and fragment the memory.

    Attributes:
        seeds: run seeds of the block.
        shape: sizes of a network.
        parameters: [S, P] parameters.
        adam: Adam's state.
        progress: [S, I] of each of `MEASURES`, NaN from `iteration` on.
        episode_returns: [S, I, E] unshaped returns of the episodes that reached the time limit.
        layout: how an iteration's environment steps lie in episodes.
        shaping: the state of the shaping's weight and potential.
        unlogged: [S] shaped return of the last rollout's steps after its last whole episode.
        iteration: iterations done.
    """

    seeds: tuple[int, ...]
    shape: Shape
    parameters: Tensor
    adam: ppo.Adam
    progress: Columns
    episode_returns: Array
    layout: RolloutLayout
    shaping: State
    unlogged: Array
    iteration: int = 0

    @classmethod
    def start(cls, cell: Cell, seeds: Sequence[int]) -> "TrainState":
        """Return the state before the first iteration."""
        settings, task = cell.protocol.ppo, load_task(cell.protocol.environment.task)
        shape, layout = Shape.of(task, settings), RolloutLayout(settings.rollout_steps, task.episode_steps)
        parameters = initialise(seeds, cell.root_seed, settings, shape)
        logged = (len(seeds), cell.iterations)
        return cls(
            seeds=tuple(seeds),
            shape=shape,
            parameters=parameters,
            adam=ppo.Adam.zeros_like(parameters),
            progress={name: np.full(logged, np.nan) for name in MEASURES},
            episode_returns=np.full((*logged, layout.episodes), np.nan),
            layout=layout,
            shaping=Rule.of(cell).start(len(seeds)),
            unlogged=np.zeros(len(seeds)),
        )

    def policy(self) -> Policy:
        """Return the policy as trained so far."""
        return Policy(self.parameters, self.shape)

    def diverged(self) -> list[int]:
        """Return the seeds whose parameters are no longer finite."""
        finite = torch.isfinite(self.parameters).all(dim=1).tolist()
        return [seed for seed, ok in zip(self.seeds, finite, strict=True) if not ok]

    def progress_frame(self) -> pd.DataFrame:
        """Return `progress.parquet`: a row per seed and iteration, ordered by seed."""
        iterations = np.tile(np.arange(1, self.iteration + 1), len(self.seeds))
        return pd.DataFrame(
            {
                "seed": np.repeat(self.seeds, self.iteration),
                "iteration": iterations,
                "env_steps": iterations * self.layout.steps,
                **{name: values[:, : self.iteration].ravel() for name, values in self.progress.items()},
            }
        )

    def episodes_frame(self) -> pd.DataFrame:
        """Return the training episodes, a row each: seed, iteration, episode_return, episode_length, env_steps.

        `env_steps` counts the environment steps of training done when the episode ended.
        """
        returns = self.episode_returns[:, : self.iteration]
        seeds, iterations, episodes = returns.shape
        iteration = np.tile(np.repeat(np.arange(iterations), episodes), seeds)
        within = np.tile(self.layout.episode_steps * np.arange(1, episodes + 1), seeds * iterations)
        return pd.DataFrame(
            {
                "seed": np.repeat(self.seeds, iterations * episodes),
                "iteration": iteration + 1,
                "episode_return": returns.ravel(),
                "episode_length": self.layout.episode_steps,
                "env_steps": iteration * self.layout.steps + within,
            }
        )


def train(
    cell: Cell, seeds: Sequence[int], *, success_radius: float, state: TrainState | None = None
) -> Iterator[TrainState]:
    """Train the block and yield its state after every iteration (the same object, changed in place).

    Args:
        cell: what to train.
        seeds: run seeds of the block, in any number.
        success_radius: m, tip-target distance that counts as success in the progress rows.
        state: a state to go on from; without it training starts at iteration 0.

    A seed whose numbers stop being finite is carried on as such and touches no other.
    """
    settings = cell.protocol.ppo
    task, rule = load_task(cell.protocol.environment.task), Rule.of(cell)
    state = state or TrainState.start(cell, seeds)
    learner = ppo.Learner(state.parameters, settings, state.shape, state.adam)
    clip = cell.protocol.environment.clip_actions
    collector = Collector(task, seeds, cell.root_seed, state.layout, clip_actions=clip)
    policy = state.policy()
    while state.iteration < cell.iterations:
        rollout = collector.collect(policy, state.iteration)
        records, summary = prepare(cell, task, rule, state, rollout, success_radius)
        rate = learning_rate(settings, state.iteration / cell.iterations)
        learner.update(records, _shuffles(cell, seeds, state.iteration), rate)
        losses = ppo.diagnose(policy.passes(), records, settings.clip_range)
        measured = {
            **summary,
            "action_std": np.exp(policy.layers.log_std.numpy()).mean((1, 2)),
            **losses._asdict(),
            "alpha": rule.alpha(state.shaping, state.iteration * state.layout.steps),
        }
        shaped, rest = measured.pop("shaped_returns"), measured.pop("rest")
        state.episode_returns[:, state.iteration] = measured.pop("episode_returns")
        if cell.protocol.log.episode_return == "released":
            measured["logged_return"] = released_log(shaped, state.unlogged)
        else:
            measured["logged_return"] = measured["episode_return"]
        state.unlogged = rest
        state.shaping = rule.update(state.shaping, measured)
        for name, values in state.progress.items():
            values[:, state.iteration] = measured[name]
        state.iteration += 1
        yield state


def learning_rate(settings: PPO, done: float) -> float:
    """Return Adam's learning rate when the share `done` of all iterations is over; "linear" falls to 0 at the end."""
    return (
        settings.learning_rate * (1 - done) if settings.learning_rate_schedule == "linear" else settings.learning_rate
    )


def released_log(shaped: Array, unlogged: Array) -> Array:
    """Return what the code released with the paper logs for an iteration, [S].

    Args:
        shaped: [S, E] shaped returns of the rollout's whole episodes.
        unlogged: [S] shaped return of the rollout before, after its last whole episode. The running sum of an
            episode is not cleared where a rollout starts, so the first episode's contains it. With the paper's 40
            episodes a rollout the first is not among the last ten, so it never shows there.

    Without a whole episode there is nothing to log: NaN.
    """
    if not shaped.shape[1]:
        return np.full(len(shaped), np.nan)
    logged = shaped.copy()
    logged[:, 0] += unlogged
    figure: Array = logged[:, -RELEASED_LOG_EPISODES:].mean(1)
    return figure


def prepare(
    cell: Cell, task: Task, rule: Rule, state: TrainState, rollout: Rollout, success_radius: float
) -> tuple[NDArray[np.float32], dict[str, Any]]:
    """Turn a rollout into sample records [S, N, F + A + 4] and the rollout's summary, [S] each.

    Samples stand in the order of the sequential rollout. The summary also holds `episode_returns`
    [S, E], unshaped, `shaped_returns` [S, E], and `rest` [S], the shaped return of the steps after the last
    whole episode; `alignment` [S] where the schedule asks for it, and `transitions` where the potential learns.
    """
    settings, layout, environment = cell.protocol.ppo, state.layout, cell.protocol.environment
    reward = task.rewards[environment.reward](
        rollout.measured[..., 1:, :],
        rollout.control,
        control_weight=environment.control_weight,
        success_radius=success_radius,
    )
    extra = rule.reward(
        rollout.distance, layout.order + state.iteration * layout.steps, layout.episode_ends, state.shaping
    )
    features, log_prob, values = _outputs(state.policy(), rollout)
    following = advantage.next_values(values, layout.episode_ends, cell.protocol.shaping.episode_end)
    advantages = advantage.gae(
        reward + extra,
        values[..., :-1],
        following,
        layout.episode_ends,
        discount=rule.discount_at(state.shaping, state.iteration * layout.steps),
        gae_lambda=settings.gae_lambda,
    )
    advantages, fitted = layout.sequence(advantages), layout.sequence(values[..., :-1])
    targets = advantages + fitted
    records = ppo.pack(
        layout.sequence(features),
        layout.sequence(rollout.action),
        layout.sequence(log_prob),
        advantage.normalise(advantages),
        targets,
    )
    summary: dict[str, Any] = _summary(reward, extra, rollout, layout, success_radius) | {
        "explained_variance": _explained(fitted, targets)
    }
    if rule.schedule.aligned:
        acted = (features, rollout.action, log_prob)
        summary["alignment"] = alignment(state.policy(), *acted, reward, extra, layout, settings)
    if rule.learns:
        before, after = layout.sequence(rollout.distance[..., :-1]), layout.sequence(rollout.distance[..., 1:])
        summary["transitions"] = Transitions(before, after, layout.sequence(reward), settings.discount)
    return records, summary


@silent
def _outputs(policy: Policy, rollout: Rollout) -> tuple[NDArray[np.float32], NDArray[np.float32], Array]:
    """Return inputs [S, L, T, F + 1], log-probabilities [S, L, T] and values [S, L, T+1] of a whole rollout."""
    seeds, lanes, times, _ = rollout.observation.shape
    features = inputs(rollout.observation)
    output = policy.passes().forward(features.reshape(seeds, lanes * times, -1)).reshape(seeds, -1, lanes, times)
    mean, values = output[:, :-1, :, :-1], output[:, -1]
    log_std = policy.layers.log_std.numpy()
    action = rollout.action.transpose(0, 3, 1, 2)
    deviation = ((action - mean) * np.exp(-log_std)[..., None]).reshape(*log_std.shape[:2], -1)
    log_prob = ppo.log_probability(deviation, log_std).reshape(seeds, lanes, -1)
    return features[:, :, :-1], log_prob, values.astype(np.float64)


def _summary(reward: Array, extra: Array, rollout: Rollout, layout: RolloutLayout, success_radius: float) -> Columns:
    """Return the means [S] over a rollout's whole episodes, their returns [S, E], and the return of the rest [S]."""
    whole = slice(0, layout.episodes)
    returns = reward[:, whole].sum(-1)
    shaped = np.where(layout.episode_ends.cumsum(1) - layout.episode_ends, 0.0, reward + extra).sum(-1)
    distance = rollout.distance[:, whole, 1:]
    return {
        "episode_returns": returns,
        "episode_return": returns.mean(1),
        "shaped_returns": shaped[:, whole],
        "rest": shaped[:, layout.episodes :].sum(1),
        "shaped_return": shaped[:, whole].mean(1),
        "episode_length": np.full(len(returns), float(layout.episode_steps)),
        "success_rate": (distance.min(-1) <= success_radius).mean(1),
        "final_distance": distance[..., -1].mean(1),
    }


def _explained(values: Array, targets: Array) -> Array:
    """Return 1 - Var(R - V) / Var(R) [S] of values and targets [S, N]; NaN where the targets are constant."""
    variance = targets.var(axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(variance > 0, 1 - (targets - values).var(axis=1) / variance, np.nan)


def _shuffles(cell: Cell, seeds: Sequence[int], iteration: int) -> NDArray[np.int64]:
    """Return each seed's own sample orders [S, epochs, N] of one iteration."""
    settings = cell.protocol.ppo
    base = np.tile(np.arange(settings.rollout_steps), (settings.epochs, 1))
    generators = [stream(cell.root_seed, Purpose.SHUFFLES, seed, iteration) for seed in seeds]
    return np.stack([generator.permuted(base, axis=1) for generator in generators])
