"""Stable-Baselines3's PPO, SAC and TD3 on the same task: what other algorithms reach (claim C19).

Library defaults for SAC and TD3, the protocol's hyperparameters for PPO, no shaping. Their policies are evaluated
by this project's own lanes, on the resets that every other policy meets.
"""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import gymnasium
import numpy as np
import pandas as pd
from numpy.typing import NDArray

from reacher_shaping.evaluation.evaluate import Actor, Conditions, Mode, evaluate
from reacher_shaping.evaluation.metrics import evaluation_metrics
from reacher_shaping.jobs.progress import Meter
from reacher_shaping.settings.cell import Protocol
from reacher_shaping.settings.parts import Evaluation
from reacher_shaping.tasks.base import load_task

Report = Callable[[str], None]
MODES: tuple[Mode, ...] = ("stochastic", "deterministic")
STEPS_PER_LOOK = 1000
"""Environment steps between two looks at the clock, which decides whether there is something to report."""


def train(algorithm: str, seed: int, budget: int, protocol: Protocol, report: Report = print) -> Any:
    """Train one Stable-Baselines3 model ("ppo", "sac" or "td3") for `budget` environment steps and return it.

    `report` gets a line on speed and time left now and then.
    """
    import stable_baselines3  # here, since it is heavy and used by this optional target alone

    environment = gymnasium.make(
        load_task(protocol.environment.task).gymnasium_id, reward_control_weight=protocol.environment.control_weight
    )
    make = {"ppo": stable_baselines3.PPO, "sac": stable_baselines3.SAC, "td3": stable_baselines3.TD3}[algorithm]
    model = make("MlpPolicy", environment, seed=seed, device="cpu", **_settings(algorithm, protocol))
    meter = Meter(math.ceil(budget / STEPS_PER_LOOK), STEPS_PER_LOOK, unit="thousand steps")

    def look(given: dict[str, Any], _: dict[str, Any]) -> bool:
        done, rest = divmod(given["self"].num_timesteps, STEPS_PER_LOOK)
        for line in meter.lines(done) if not rest and done <= meter.total else ():  # PPO's last rollout overshoots
            report(line)
        return True

    return model.learn(budget, callback=look)


def _settings(algorithm: str, protocol: Protocol) -> dict[str, Any]:
    """Return the protocol's hyperparameters in Stable-Baselines3's names for PPO, nothing for the others."""
    if algorithm != "ppo":
        return {}
    ppo = protocol.ppo
    return {
        "learning_rate": ppo.learning_rate,
        "gamma": ppo.discount,
        "gae_lambda": ppo.gae_lambda,
        "clip_range": ppo.clip_range,
        "batch_size": ppo.minibatch_size,
        "n_steps": ppo.rollout_steps,
        "n_epochs": ppo.epochs,
        "vf_coef": ppo.value_coefficient,
        "ent_coef": ppo.entropy_coefficient,
        "max_grad_norm": ppo.max_gradient_norm,
    }


def actor(model: Any, mode: str) -> Actor:
    """Return the model as an actor of `evaluate`; "stochastic" samples from the model's own seeded stream."""

    def act(observation: NDArray[np.float64], _: NDArray[np.float32] | None) -> NDArray[np.floating]:
        rows = observation.reshape(-1, observation.shape[-1])
        action = np.asarray(model.predict(rows, deterministic=mode == "deterministic")[0])
        return action.reshape(*observation.shape[:-1], -1)

    return act


def peer_run(
    algorithm: str,
    seed: int,
    budget: int,
    protocol: Protocol,
    evaluation: Evaluation,
    root_seed: int,
    report: Report = print,
) -> pd.DataFrame:
    """Train and evaluate one peer; one row: algorithm, seed, budget, and the columns of `runs.parquet`'s evaluation."""
    model = train(algorithm, seed, budget, protocol, report)
    conditions = Conditions(
        environment=protocol.environment.model_copy(update={"clip_actions": False}),  # the peers clip themselves
        root_seed=root_seed,
        success_radius=evaluation.radius,
        episodes=evaluation.episodes,
    )
    row: dict[str, Any] = {"algorithm": algorithm, "seed": seed, "budget": budget}
    for mode, prefix in zip(MODES, ("", "deterministic_"), strict=True):
        episodes = evaluate(actor(model, mode), [seed], replace(conditions, mode=mode))
        measured = evaluation_metrics(episodes, mode).drop(columns="episodes").iloc[0]
        row |= {f"{prefix}{name}": value for name, value in measured.items()}
    return pd.DataFrame([row])
