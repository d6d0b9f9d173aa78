"""How often a verdict would come out again, and how many seeds would decide.

A verdict hangs on a limit clearing a mark. Another study of as many seeds has limits shifted by its own noise, and
this study's estimate has the same noise: the two differ with the standard error times the root of two. So a limit that
is m standard errors clear of its mark clears it again with probability Phi(m / sqrt(2)) (the predictive probability of
replication; Goodman 1992, doi:10.1002/sim.4780110705), and with 0.9 where it is clear by 1.81. Estimates of one claim
are taken as independent. Where the true values are taken as known, as for the power, only the other study's noise
counts. No simulation: nothing here depends on a generator.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy import stats as distributions

from reacher_shaping import stats
from reacher_shaping.analysis.claim_estimates import Estimate

ENOUGH = 0.9
MOST_SEEDS = 10_000
PREDICTED, KNOWN = np.sqrt(2), 1.0
"""Noise between two studies, and around a truth taken as known, in standard errors."""

Rule = Mapping[str, Any]


class Band(NamedTuple):
    """Where an interval has to lie for a claim to hold (inside), and beyond which marks it is refuted."""

    holds_above: float
    holds_below: float
    refuted_below: float
    refuted_above: float


def band(rule: Rule) -> Band:
    """The marks of a rule of the ledger; infinite where it sets none."""
    endless = float("inf")
    if "within" in rule:
        first, last = rule["within"]
        return Band(first, last, first, last)
    if "above" in rule:
        return Band(rule["above"], endless, rule.get("refuted_below", rule["above"]), endless)
    return Band(-endless, rule["below"], -endless, rule.get("refuted_above", rule["below"]))


class Chances(NamedTuple):
    """Probability that a study finds an estimate in its band, and that it finds it refuted."""

    holds: float
    refuted: float


UNKNOWN = Chances(float("nan"), float("nan"))


def chances(estimate: Estimate, rule: Rule, noise: float = PREDICTED, seeds: int | None = None) -> Chances:
    """Chances of an estimate in a study of `seeds` (as many as this one if None); NaN without a standard error."""
    if not np.isfinite([estimate.low, estimate.high, estimate.error]).all():
        return UNKNOWN
    scale: Callable[..., Any] = stats.fisher if estimate.fisher else np.asarray
    low, value, high = (float(scale(number)) for number in (estimate.low, estimate.value, estimate.high))
    marks = [float(scale(mark)) if np.isfinite(mark) else mark for mark in band(rule)]
    shrunk, error = 1.0, estimate.error
    if seeds is not None:
        narrower = np.sqrt(estimate.seeds / seeds)
        shrunk = narrower * stats.t_quantile(seeds) / stats.t_quantile(estimate.seeds)
        error *= narrower
    low, high = value - shrunk * (value - low), value + shrunk * (high - value)
    clear = [low - marks[0], marks[1] - high, marks[2] - high, low - marks[3]]
    above, below, under, over = (_chance(margin, noise * error) for margin in clear)
    return Chances(max(0.0, above + below - 1), min(1.0, under + over))


def _chance(margin: float, deviation: float) -> float:
    """Probability that a normal deviation leaves the margin positive."""
    if deviation == 0 or np.isinf(margin):
        return float(margin > 0)
    return float(distributions.norm.cdf(margin / deviation))


def together(parts: Sequence[Chances]) -> Chances:
    """Chances of a claim: it holds if all its estimates do, it is refuted if any is."""
    holds = float(np.prod([part.holds for part in parts]))
    return Chances(holds, 1 - float(np.prod([1 - part.refuted for part in parts])))


def seeds_to_decide(estimates: Sequence[Estimate], rules: Sequence[Rule]) -> float:
    """Fewest seeds whose study would give one verdict with a probability of `ENOUGH`, were the estimates the truth.

    NaN where more than `MOST_SEEDS` are needed or an estimate has no interval.
    """

    def decided(seeds: int) -> bool:
        found = together([chances(e, rule, PREDICTED, seeds) for e, rule in zip(estimates, rules, strict=True)])
        return max(found) >= ENOUGH

    low, high = 1, 2
    while not decided(high):
        low, high = high, high * 2
        if high > MOST_SEEDS:
            return float("nan")
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if decided(middle) else (middle, high)
    return float(high)
