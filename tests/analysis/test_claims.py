import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import yaml

from reacher_shaping.analysis import claim_estimates, claims
from reacher_shaping.analysis.runs import RUNS
from reacher_shaping.report import paper_tables

REPORT = Path(__file__).parents[2] / "report"
LEDGER = yaml.safe_load((REPORT / "claims.yaml").read_text())
CELLS = claim_estimates.TABLE_2 + claim_estimates.TABLE_3


def make_runs(rate=lambda cell: 0.2, seeds=10, noise=0.05, random=None, cells=CELLS, **columns):
    """Made-up `runs`: success around `rate(cell)`, a shared seed effect, other metrics pure noise."""
    random = random or np.random.default_rng(0)
    shared = random.normal(0, noise, seeds)
    parts = []
    for variant, budget, alpha0 in cells:
        frame = pd.DataFrame(
            {"protocol": "paper", "variant": variant, "budget": budget, "alpha0": alpha0, "seed": range(seeds)}
        )
        frame["success_rate"] = rate((variant, budget, alpha0)) + (shared + random.normal(0, noise, seeds)) / np.sqrt(2)
        frame["mean_return"] = random.normal(-12, 1, seeds)
        frame["peak_return"] = random.normal(-10, 0.3, seeds)
        frame["peak_iteration"] = random.integers(20, 240, seeds).astype(float)
        frame["drop_from_peak"] = random.exponential(0.5, seeds)
        frame["final_return"] = frame["peak_return"] - frame["drop_from_peak"]
        frame["roughness"] = random.lognormal(-3, 0.3, seeds)
        frame["steps_to_threshold"] = random.uniform(5e4, 2e5, seeds)
        parts.append(frame.assign(**columns))
    return pd.concat(parts, ignore_index=True)


def verdicts(runs, resamples=500, **tables_):
    measured = claims.measure(runs, 1, resamples=resamples, **tables_)
    parts = claims.assess(LEDGER, measured, {})
    return claims.claims_frame(LEDGER, parts).set_index("id")["verdict"]


def published():
    return paper_tables.published_cells(
        pd.read_csv(REPORT / "published" / "table2.csv"),
        pd.read_csv(REPORT / "published" / "table3.csv").assign(alpha=0.5),
    )


# The ledger


def test_ledger_holds_the_nineteen_claims_with_a_rule_per_estimate():
    assert [entry["id"] for entry in LEDGER] == [f"C{i}" for i in range(1, 20)]
    assert set(claims.FORMULAS) | {claims.PEERS} == {entry["id"] for entry in LEDGER}
    measured = everything_measured()
    for entry in LEDGER:
        assert set(entry) == {"id", "claim", "evidence", "test", "rules", "shown_in"}
        assert set(entry["rules"]) == set(measured[entry["id"]])
        for rule in entry["rules"].values():
            claims.describe(rule)


def everything_measured():
    peers = pd.DataFrame({"algorithm": np.repeat(["PPO", "SAC", "TD3"], 3), "seed": [0, 1, 2] * 3})
    peers["success_rate"] = [0.2, 0.3, 0.25, 0.9, 0.92, 0.95, 0.8, 0.9, 0.85]
    return claims.measure(make_runs(), 1, peers=peers, long_episodes=make_long_episodes(), resamples=50)


def make_long_episodes(growth=2.0):
    runs = make_runs(cells=claim_estimates.TABLE_2)[["protocol", "variant", "budget", "alpha0", "seed"]]
    distance = np.random.default_rng(3).uniform(0.04, 0.06, len(runs))
    short = runs.assign(steps=50, final_distance=distance)
    return pd.concat([short, runs.assign(steps=500, final_distance=distance * growth)])


def test_published_values_come_from_the_published_tables():
    value = {
        claim: {n: x.value for n, x in found.items()}
        for claim, found in claims.published_estimates(published()).items()
    }
    assert value["C1"]["share"] == pytest.approx(13 / 15)
    assert value["C2"]["margin"] == pytest.approx(0.258 - 0.253)
    assert value["C3"]["difference"] < 0  # the published table itself says otherwise
    assert value["C5"]["short"] == 0.112
    assert value["C8"]["largest"] == pytest.approx(0.258 - 0.159)
    assert value["C8"]["smallest"] == pytest.approx(0.188 - 0.225)
    assert value["C9"]["loss"] == pytest.approx((0.14 + 0.017 + 0.04 - 0.011 + 0.017) / 5)
    assert [round(r, 3) for r in value["C10"].values()] == [0.910, 0.369, 0.305]
    assert value["C11"]["ratio"] == pytest.approx(809.02 / 158.01)
    assert value["C13"]["ratio"] == pytest.approx(0.258 / 0.107)
    assert value["C16"]["fifth"] == 0.208
    assert value["C4"] == value["C6"] == value["C14"] == {}


# The rules


@pytest.mark.parametrize(
    ("low", "high", "verdict"),
    [
        (0.01, 0.20, "reproduced"),
        (-0.01, 0.20, "inconclusive"),
        (-0.10, 0.02, "not reproduced"),
        (0.01, 0.02, "not reproduced"),  # right sign, but smaller than worth the name
        (-0.30, -0.20, "not reproduced"),
        (np.nan, np.nan, "inconclusive"),
    ],
)
def test_above_with_a_smallest_effect(low, high, verdict):
    assert claims.judge(low, high, {"above": 0, "refuted_below": 0.03}) == verdict
    assert claims.judge(-high, -low, {"below": 0, "refuted_above": -0.03}) == verdict


@pytest.mark.parametrize(
    ("low", "high", "verdict"),
    [(0.5, 0.6, "reproduced"), (0.3, 0.5, "inconclusive"), (0.1, 0.2, "not reproduced"), (0.9, 1.0, "not reproduced")],
)
def test_within(low, high, verdict):
    assert claims.judge(low, high, {"within": [0.4, 0.7]}) == verdict


def test_all_parts_must_hold():
    yes, no, maybe, none = claims.REPRODUCED, claims.NOT_REPRODUCED, claims.INCONCLUSIVE, claims.UNTESTABLE
    assert claims.combine([yes, yes]) == yes
    assert claims.combine([yes, maybe]) == maybe
    assert claims.combine([maybe, no, yes]) == no
    assert claims.combine([no, none]) == none


# Whole studies, made up


def test_a_study_that_agrees_with_the_paper_reproduces_it():
    """Success as published, with little noise, and curves as in the paper's Fig. 1."""
    cells = published().set_index(["variant", "budget", "alpha0"])
    random = np.random.default_rng(0)
    runs = make_runs(lambda cell: cells.loc[cell, "success_rate"], noise=0.003)
    key = pd.MultiIndex.from_frame(runs[["variant", "budget", "alpha0"]])
    runs["mean_return"] = cells["mean_return"].loc[key].to_numpy() * random.uniform(0.95, 1.05, len(runs))
    runs["peak_iteration"] = random.uniform(26, 49, len(runs))
    runs["final_return"] = 3 * runs["peak_return"]
    runs["drop_from_peak"] = runs["peak_return"] - runs["final_return"]
    runs["roughness"] = 1 - runs["success_rate"]
    runs["steps_to_threshold"] = np.where(runs["variant"] == "none", 2e5, 1e5)
    peers = pd.DataFrame(
        {"algorithm": np.repeat(["PPO", "SAC", "TD3"], 3), "success_rate": [0.2, 0.3, 0.25, *[0.9, 0.95, 0.92] * 2]}
    )
    found = verdicts(runs, peers=peers, long_episodes=make_long_episodes())
    # The published Table 2 itself contradicts C3.
    assert found.drop("C3").eq("reproduced").all(), found
    assert found["C3"] == "not reproduced"


def test_a_precise_study_without_any_effect_contradicts_the_paper():
    found = verdicts(make_runs(lambda cell: 0.2, noise=0.004))
    for claim in ("C1", "C3", "C9", "C12", "C13"):
        assert found[claim] == "not reproduced", claim
    assert found["C2"] != "reproduced"
    assert found["C14"] == found["C19"] == "untestable"


def test_a_noisy_study_is_inconclusive():
    found = verdicts(make_runs(lambda cell: 0.2, noise=0.2))
    assert (found[["C1", "C3", "C5", "C7", "C9", "C12"]] == "inconclusive").all()


def test_noise_alone_rarely_reproduces_an_effect():
    """Forty studies in which no cell differs: claims of an effect are reproduced in about one of forty, or less."""
    random = np.random.default_rng(11)
    effects = ["C1", "C2", "C3", "C4", "C8", "C9", "C11", "C12", "C13", "C17"]
    found = pd.DataFrame([verdicts(make_runs(random=random), resamples=300)[effects] for _ in range(40)])
    share = found.eq("reproduced").mean()
    assert (share <= 0.075).all(), share
    assert share.mean() <= 0.025


@pytest.mark.parametrize(("seeds", "verdict"), [(1, "inconclusive"), (4, "inconclusive")])
def test_few_seeds_give_no_verdict(seeds, verdict):
    found = verdicts(make_runs(seeds=seeds), long_episodes=None)
    assert (found.drop(["C14", "C19"]) == verdict).all()


def test_missing_cells_make_only_their_claims_untestable():
    none = [cell for cell in CELLS if cell[0] == "none"]
    found = verdicts(make_runs(cells=none))
    assert found["C18"] == "reproduced"
    assert found["C5"] != "untestable"
    assert set(found.drop(["C5", "C18"])) == {"untestable"}


def test_other_protocols_do_not_count():
    runs = make_runs()
    assert set(verdicts(runs.assign(protocol="standard"))) == {"untestable"}
    mixed = pd.concat([runs, make_runs(lambda cell: 0.9).assign(protocol="standard")])
    pd.testing.assert_series_equal(verdicts(mixed), verdicts(runs))


def test_diverged_runs_count_as_missing_seeds():
    runs = make_runs(seeds=6)
    spoiled = runs.copy()
    spoiled.loc[(spoiled["variant"] == "none") & (spoiled["seed"] < 2), "success_rate"] = np.nan
    assert verdicts(runs)["C18"] == "reproduced"
    assert verdicts(spoiled)["C18"] == "inconclusive"


def test_claims_frame_has_the_contract_columns():
    runs = make_runs()
    parts = claims.assess(LEDGER, claims.measure(runs, 1, resamples=50), claims.published_estimates(published()))
    frame = claims.claims_frame(LEDGER, parts)
    assert list(frame.columns) == ["id", "claim", "published", "measured", "ci_low", "ci_high", "test", "verdict"]
    assert len(frame) == 19
    row = frame.set_index("id").loc["C18"]
    none = runs[(runs["variant"] == "none") & (runs["budget"] == 1_000_000)]
    assert row["measured"] == pytest.approx(none["success_rate"].mean())
    assert row["ci_low"] < row["measured"] < row["ci_high"]
    assert row["published"] == 0.107


def test_verdicts_do_not_depend_on_the_order_of_rows():
    runs = make_runs()
    shuffled = runs.sample(frac=1, random_state=0)
    first, second = (claims.assess(LEDGER, claims.measure(r, 1, resamples=50), {}) for r in (runs, shuffled))
    pd.testing.assert_frame_equal(first, second)


def test_real_runs_frame_feeds_every_claim():
    """The metrics the estimates name are columns of `runs.parquet`."""
    source = Path(claim_estimates.__file__).read_text()
    named = set(re.findall(r"s\.(?:mean|means|runs)\(\"(\w+)\"", source)) | {"final_return", "peak_return"}
    assert named - {"timed"} <= set(RUNS)
