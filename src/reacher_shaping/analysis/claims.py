"""The claims ledger: from estimates and rules fixed beforehand to verdicts.

The ledger (`report/claims.yaml`, which explains its fields) holds for each claim a rule per estimate. The
rules are about intervals: a claim is reproduced when every value the data leave open agrees with it, not
reproduced when none does, and inconclusive in between. So noise around no effect is called a reproduction
in at most one case of forty per estimate, and a weak study ends inconclusive, not negative.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from reacher_shaping import stats
from reacher_shaping.analysis import claim_estimates as e
from reacher_shaping.labels import CELL
from reacher_shaping.random_streams import generator

REPRODUCED = "reproduced"
NOT_REPRODUCED = "not reproduced"
INCONCLUSIVE = "inconclusive"
UNTESTABLE = "untestable"
# Below five seeds a bootstrap over seeds covers too little; Welch's t interval holds from three.
FEWEST_SEEDS = 5
FEWEST_PEERS = 3
FORMULAS: dict[str, Callable[[e.Sample], e.Estimates]] = {
    "C1": e.shaping_improves,
    "C2": e.decay300k_is_best,
    "C3": e.decay_beats_constant,
    "C4": e.smoothness_goes_with_success,
    "C5": e.none_stays_low,
    "C6": e.returns_peak_early,
    "C7": e.decay300k_levels,
    "C8": e.longer_helps_some,
    "C9": e.half_alpha_hurts,
    "C10": e.correlations,
    "C11": e.success_despite_return,
    "C12": e.l2_gains_l2sq_does_not,
    "C13": e.best_doubles_baseline,
    "C14": e.longer_episodes_deteriorate,
    "C15": e.squared_decay_plunges,
    "C16": e.top_five_above,
    "C17": e.shaping_is_faster,
    "C18": e.ppo_often_fails,
}
PEERS = "C19"
LONG_EPISODES = "C14"
Rule = Mapping[str, Any]


def judge(low: float, high: float, rule: Rule) -> str:
    """Verdict on one estimate from its interval; without an interval inconclusive.

    Where an interval is both above `above` and below `refuted_below` the effect has the right sign but is
    smaller than worth the name: not reproduced.
    """
    if "below" in rule:
        mirrored = {"above": -rule["below"]}
        if "refuted_above" in rule:
            mirrored["refuted_below"] = -rule["refuted_above"]
        return judge(-high, -low, mirrored)
    if "within" in rule:
        first, last = rule["within"]
        inside, outside = low >= first and high <= last, high < first or low > last
    else:
        inside, outside = low > rule["above"], high < rule.get("refuted_below", rule["above"])
    if outside:
        return NOT_REPRODUCED
    return REPRODUCED if inside else INCONCLUSIVE


def combine(verdicts: Sequence[str]) -> str:
    """Verdict on a claim whose parts must all hold."""
    for verdict in (UNTESTABLE, NOT_REPRODUCED, INCONCLUSIVE):
        if verdict in verdicts:
            return verdict
    return REPRODUCED


def estimate(claim: str, sample: e.Sample | None) -> e.Estimates:
    """Estimates of one claim; none where the study lacks what it takes."""
    if sample is None:
        return {}
    sample.start()
    try:
        return FORMULAS[claim](sample)
    except e.MissingError:
        return {}


def widen(long_episodes: pd.DataFrame) -> pd.DataFrame:
    """Runs x episode lengths (`steps`, `final_distance`) -> a row per run with `final_distance_<steps>`."""
    key = [*CELL, "seed"]
    wide = long_episodes.pivot_table(index=key, columns="steps", values="final_distance")
    return wide.add_prefix("final_distance_").reset_index()


def measure(
    runs: pd.DataFrame,
    root_seed: int,
    protocol: str = "paper",
    peers: pd.DataFrame | None = None,
    long_episodes: pd.DataFrame | None = None,
    resamples: int = stats.RESAMPLES,
) -> dict[str, e.Estimates]:
    """Estimates of all claims, by claim and name; an untestable claim has none.

    `runs`: rows of `runs.parquet`. `long_episodes` (C14): the cell's key, `seed`, `steps` (episode length)
    and `final_distance` in metres, stochastic policy. `peers` (C19): `algorithm`, `seed`, `success_rate`.
    """

    def sample_of(rows: pd.DataFrame) -> e.Sample | None:
        return e.Sample(rows, generator(root_seed, "claims"), resamples) if len(rows) else None

    study = sample_of(e.derive(runs[runs["protocol"] == protocol]))
    long = None if long_episodes is None else sample_of(widen(long_episodes[long_episodes["protocol"] == protocol]))
    found = {claim: estimate(claim, long if claim == LONG_EPISODES else study) for claim in FORMULAS}
    try:
        found[PEERS] = e.off_policy_is_better(peers) if peers is not None else {}
    except e.MissingError:
        found[PEERS] = {}
    return found


def assess(
    ledger: Sequence[Mapping[str, Any]], measured: Mapping[str, e.Estimates], published: Mapping[str, e.Estimates]
) -> pd.DataFrame:
    """A row per estimate: id, part, published, measured, ci_low, ci_high, seeds, rule, verdict."""
    rows = []
    for entry in ledger:
        claim = entry["id"]
        fewest = FEWEST_PEERS if claim == PEERS else FEWEST_SEEDS
        for part, rule in entry["rules"].items():
            value = measured.get(claim, {}).get(part)
            theirs = published.get(claim, {}).get(part)
            row = {"id": claim, "part": part, "published": theirs.value if theirs else np.nan}
            row |= dict(
                zip(("measured", "ci_low", "ci_high", "seeds"), value or (np.nan, np.nan, np.nan, 0), strict=True)
            )
            row["rule"] = describe(rule)
            if value is None:
                row["verdict"] = UNTESTABLE
            elif value.seeds < fewest:
                row["verdict"] = INCONCLUSIVE
            else:
                row["verdict"] = judge(value.low, value.high, rule)
            rows.append(row)
    return pd.DataFrame(rows)


def describe(rule: Rule) -> str:
    """A rule in words, for tables."""
    if "within" in rule:
        return f"within {rule['within'][0]:g} and {rule['within'][1]:g}"
    side, other, opposite = (
        ("above", "refuted_below", "below") if "above" in rule else ("below", "refuted_above", "above")
    )
    words = f"{side} {rule[side]:g}"
    return words + (f", refuted if {opposite} {rule[other]:g}" if other in rule else "")


def claims_frame(ledger: Sequence[Mapping[str, Any]], parts: pd.DataFrame) -> pd.DataFrame:
    """`claims.csv`: id, claim, published, measured, ci_low, ci_high, test, verdict.

    The numbers are those of the claim's first estimate; the verdict is over all of them.
    """
    rows = []
    for entry in ledger:
        own = parts[parts["id"] == entry["id"]]
        numbers = own[["published", "measured", "ci_low", "ci_high"]].iloc[0].to_dict()
        texts = {"id": entry["id"], "claim": entry["claim"], "test": entry["test"]}
        rows.append(texts | numbers | {"verdict": combine(own["verdict"].to_list())})
    return pd.DataFrame(rows)[["id", "claim", "published", "measured", "ci_low", "ci_high", "test", "verdict"]]


def published_estimates(cells: pd.DataFrame) -> dict[str, e.Estimates]:
    """The claims' estimates on the published cells (`variant, budget, alpha0, success_rate, mean_return`)."""
    return measure(cells.assign(protocol="published", seed=0), 0, "published", resamples=1)
