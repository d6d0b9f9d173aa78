"""Search for the settings of a protocol: Optuna's tree-structured Parzen estimator, one trial at a time.

The trials' seeds, resets and noise come from a root of their own, so nothing of the runs that the study later reports
was seen here. The score is a measure of the environment's own reward, never of the shaped one.
"""

import math
from collections.abc import Callable, Iterator, Mapping
from typing import Any

import optuna
import pandas as pd

from reacher_shaping.evaluation.evaluate import evaluate
from reacher_shaping.settings.cell import Cell
from reacher_shaping.settings.search import VARIANT, Search
from reacher_shaping.training.train import train

Values = dict[str, Any]
MEASURES = {
    "mean_return": "episode_return",
    "success_rate": "success",
    "final_success_rate": "final_success",
    "final_distance": "final_distance",
}
STARTUP = 10
"""Trials at random before the estimator has enough to go on, Optuna's own number."""


def distributions(search: Search) -> dict[str, optuna.distributions.BaseDistribution]:
    """Return Optuna's distribution of every setting of the search space."""
    return {path: _distribution(space.model_dump()) for path, space in search.space.items()}


def _distribution(space: Mapping[str, Any]) -> optuna.distributions.BaseDistribution:
    if "choices" in space:
        return optuna.distributions.CategoricalDistribution(space["choices"])
    kind = optuna.distributions.IntDistribution
    whole = isinstance(space["low"], int) and isinstance(space["high"], int)
    return (kind if whole else optuna.distributions.FloatDistribution)(space["low"], space["high"], log=space["log"])


def score(cell: Cell, seeds: int, *, episodes: int, radius: float) -> dict[str, float]:
    """Train `seeds` runs of a cell and return the means of `MEASURES` over them, actions sampled."""
    names = list(range(seeds))
    for state in train(cell, names, radius=radius):
        trained = state
    rows = evaluate(
        trained.policy().act,
        names,
        mode="stochastic",
        episodes=episodes,
        radius=radius,
        environment=cell.protocol.environment,
        root_seed=cell.root_seed,
    )
    return {name: float(rows[column].mean()) for name, column in MEASURES.items()}


def trials(
    search: Search, measure: Callable[[Values], Values], done: pd.DataFrame | None = None
) -> Iterator[pd.DataFrame]:
    """Yield the table of trials after each one: `trial`, `variant`, the settings, and the measures.

    Args:
        search: what is searched, and how long.
        measure: the measures of a trial's settings; where the one to maximise is not finite the trial counts as the
            worst so far.
        done: trials of an earlier call to go on from. A trial depends on its number and those before it alone, so an
            interrupted search ends like another.
    """
    optuna.logging.set_verbosity(optuna.logging.WARNING)
    space, goal = distributions(search), search.maximise
    rows: list[Values] = (
        [] if done is None else [{str(k): v for k, v in row.items()} for row in done.to_dict("records")]
    )
    while len(rows) < search.trials:
        sampler = optuna.samplers.TPESampler(seed=search.root_seed + len(rows), n_startup_trials=STARTUP)
        optimiser = optuna.create_study(direction="maximize", sampler=sampler)
        worst = min((row[goal] for row in rows if math.isfinite(row[goal])), default=0.0)
        for row in rows:
            value = row[goal] if math.isfinite(row[goal]) else worst
            params = {path: _plain(row[path], space[path]) for path in space}
            optimiser.add_trial(optuna.trial.create_trial(params=params, distributions=space, value=value))
        values = optimiser.ask(space).params if rows or not search.start else dict(search.start)
        rows.append({"trial": len(rows), VARIANT: search.variant} | values | measure(values))
        yield pd.DataFrame(rows)


def _plain(value: Any, distribution: optuna.distributions.BaseDistribution) -> Any:
    """A table's number as the distribution has it: a choice must be of the choice's own type."""
    if isinstance(distribution, optuna.distributions.CategoricalDistribution):
        return next(choice for choice in distribution.choices if choice == value)
    return float(value)
