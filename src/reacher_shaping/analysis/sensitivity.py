"""Which verdicts hang on a choice of the analysis: the ledger again under each of several others."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import pandas as pd

from reacher_shaping.analysis import claims
from reacher_shaping.analysis.claim_formulas import Study
from reacher_shaping.evaluation.metrics import EVALUATION
from reacher_shaping.labels import KEY

LARGER_RADIUS = 0.03
FEW_SEEDS = 5

AS_TESTED = "as tested"
FAMILY = "limits for all estimates at once"
FIRST = "the tests fixed before any run"


def variations(study: Study, radii: pd.DataFrame | None) -> dict[str, Study]:
    """The study under other choices by name. `radii`: success of the same runs by radius (`run_radii.parquet`)."""
    runs = study.runs
    mean_action = runs.assign(**{name: runs[f"deterministic_{name}"] for name in EVALUATION})
    found = {"mean action instead of samples": replace(study, runs=mean_action, untrained=None)}
    if radii is not None and len(radii):
        found[f"radius {1000 * LARGER_RADIUS:g} mm instead of 20"] = replace(
            study, runs=_at(runs, radii), untrained=None
        )
    seeds = sorted(runs["seed"].unique())
    if len(seeds) > FEW_SEEDS:
        for name, chosen in (("first", seeds[:FEW_SEEDS]), ("last", seeds[-FEW_SEEDS:])):
            long = study.long_episodes
            kept = None if long is None else long[long["seed"].isin(chosen)]
            own = replace(study, runs=runs[runs["seed"].isin(chosen)], long_episodes=kept)
            found[f"the {name} {FEW_SEEDS} seeds alone"] = own
    return found


def _at(runs: pd.DataFrame, radii: pd.DataFrame) -> pd.DataFrame:
    """The runs with the success rates of the larger radius."""
    key, rates = [*KEY, "seed"], ["success_rate", "final_success_rate"]
    chosen = radii[(radii["mode"] == "stochastic") & (radii["radius"] == LARGER_RADIUS)]
    return runs.drop(columns=rates).merge(chosen[[*key, *rates]], on=key)


def sensitivity_frame(
    ledger: Sequence[Mapping[str, Any]], study: Study, published: pd.DataFrame, radii: pd.DataFrame | None = None
) -> pd.DataFrame:
    """`sensitivity.csv`: a row per claim and choice: id, choice, measured, ci_low, ci_high, verdict of the intervals.

    The published values are those of the paper in every row: where the choice changes what is measured (the radius,
    the policy's action) a rule with a published level asks for what the paper reached its own way.
    """
    main = claims.claims_frame(ledger, claims.judged(ledger, study, published))
    columns = ["id", "measured", "ci_low", "ci_high"]
    parts = [main[columns].assign(choice=AS_TESTED, verdict=main["interval_verdict"])]
    parts += [main[["id"]].assign(choice=FAMILY, verdict=main["family_verdict"])]
    parts += [main[["id"]].assign(choice=FIRST, verdict=main["first_verdict"])]
    for choice, other in variations(study, radii).items():
        found = claims.claims_frame(ledger, claims.judged(ledger, other, published))
        parts.append(found[columns].assign(choice=choice, verdict=found["interval_verdict"]))
    return pd.concat(parts, ignore_index=True)[["id", "choice", "measured", "ci_low", "ci_high", "verdict"]]
