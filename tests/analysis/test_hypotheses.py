"""Verdicts on our own hypotheses follow the rules of the ledger."""

import math
from itertools import combinations
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import yaml

from reacher_shaping.analysis.hypotheses import permutation_p, take_off_curves, take_off_frame, take_off_steps, verdicts
from reacher_shaping.labels import KEY
from reacher_shaping.settings.outputs import tables_of
from reacher_shaping.settings.study import load_study, read_settings
from reacher_shaping.stats import holm
from reacher_shaping.storage import schemas
from reacher_shaping.storage.files import read_table

ROOT = Path(__file__).parents[2]
LEDGERS = yaml.safe_load((ROOT / "report/hypotheses.yaml").read_text())


def runs_of(cells):
    """A row per run of cells {(protocol, variant, alpha0): final success rates}."""
    rows = [
        {"protocol": protocol, "variant": variant, "budget": 500, "alpha0": float(alpha0), "seed": seed}
        | {"diverged": not np.isfinite(rate), "final_success_rate": rate}
        for (protocol, variant, alpha0), rates in cells.items()
        for seed, rate in enumerate(rates)
    ]
    return pd.DataFrame(rows)


def judged(of_a, of_b, predicts="positive", **more):
    cells = {"a": ["p", "l2", 50], "b": ["p", "none", 1]}
    hypothesis = {"id": "H", "claim": "c", "predicts": predicts, **cells, **more}
    ledger = {"measure": "final_success_rate", "error": 0.05, "hypotheses": [hypothesis]}
    runs = runs_of({("p", "l2", 50): of_a, ("p", "none", 1): of_b})
    take_off = runs[["protocol", "variant", "budget", "alpha0", "seed"]].assign(
        take_off=[100.0] * len(of_a) + [np.nan] * len(of_b)
    )
    return verdicts(runs, take_off, ledger).iloc[0]


HIGH, LOW = [0.5, 0.55, 0.6, 0.52, 0.58, 0.57], [0.01, 0.02, 0.0, 0.03, 0.01, 0.02]


def test_the_permutation_test_counts_every_way_of_dealing_the_runs():
    a, b = np.array([3.0, 5.0, 4.5]), np.array([1.0, 2.5, 4.0, 0.5])
    pooled = np.concatenate([a, b])
    seen = abs(a.mean() - b.mean())
    deals = [
        pooled[list(chosen)].mean() - np.delete(pooled, list(chosen)).mean() for chosen in combinations(range(7), 3)
    ]
    upper = np.mean([deal >= seen - 1e-12 for deal in deals])
    lower = np.mean([deal <= seen + 1e-12 for deal in deals])
    assert permutation_p(a, b) == pytest.approx(2 * min(upper, lower))


def test_runs_that_are_apart_support_or_contradict_by_the_sign_predicted():
    row = judged(HIGH, LOW)
    assert row["verdict"] == "supported"
    assert row["p"] == pytest.approx(2 / math.comb(12, 6))
    assert (row["solved_a"], row["solved_b"]) == (1, 0)
    assert (row["least_a"], row["greatest_a"], row["least_b"], row["greatest_b"]) == (0.5, 0.6, 0.0, 0.03)
    assert (row["taken_off_a"], row["taken_off_b"], row["take_off_a"]) == (1, 0, 100)
    assert row["difference"] == pytest.approx(np.mean(HIGH) - np.mean(LOW))
    assert row["ci_low"] < row["difference"] < row["ci_high"]
    assert judged(LOW, HIGH)["verdict"] == "contradicted"
    assert judged(HIGH, HIGH[::-1])["verdict"] == "open"


def test_no_difference_is_supported_by_an_interval_within_the_margin_alone():
    assert judged(LOW, LOW[::-1], "none", margin=0.1)["verdict"] == "supported"
    assert judged(HIGH, LOW, "none", margin=0.1)["verdict"] == "contradicted"
    wide = [0.0, 0.9, 0.1, 0.8, 0.5, 0.4]
    assert judged(wide, wide[::-1], "none", margin=0.1)["verdict"] == "open"


def test_a_diverged_run_counts_as_no_success():
    row = judged([np.nan, *HIGH[1:]], LOW)
    assert row["mean_a"] == pytest.approx(sum(HIGH[1:]) / 6)
    assert row["solved_a"] == pytest.approx(5 / 6)


def test_a_cell_without_runs_is_named():
    with pytest.raises(ValueError, match="p l2 7, of which there are no runs"):
        judged(HIGH, LOW, b=["p", "l2", 7])


def test_a_run_has_taken_off_where_five_iterations_average_one_half():
    steps = np.arange(1, 11) * 2048
    success = np.array([0, 0, 0.9, 0.1, 0.1, 0.5, 0.5, 0.8, 0.6, 0.6])
    assert take_off_steps(success, steps) == 8 * 2048 if success[3:8].mean() >= 0.5 else 9 * 2048
    assert np.isnan(take_off_steps(success / 2, steps))
    frame = pd.DataFrame(
        {"protocol": "p", "variant": "v", "budget": 1, "alpha0": 1.0, "seed": 3, "iteration": range(10)}
    )
    found = take_off_frame(frame.assign(success_rate=success, env_steps=steps)[::-1])
    assert found["take_off"].tolist() == [take_off_steps(success, steps)]


@pytest.mark.parametrize("ledger", LEDGERS, ids=[ledger["study"] for ledger in LEDGERS])
def test_the_ledger_names_cells_of_its_study_and_its_family_whole(ledger):
    study = load_study(read_settings(ROOT / "config.yaml"))
    cells = {(cell.protocol.name, cell.variant.name, cell.alpha0) for cell in study.cells_of[ledger["study"]]}
    assert ledger["family"] == [hypothesis["id"] for hypothesis in ledger["hypotheses"]]
    for hypothesis in ledger["hypotheses"]:
        for protocol, variant, alpha0 in (hypothesis["a"], hypothesis["b"], *hypothesis.get("beside", [])):
            assert (protocol, variant, float(alpha0)) in cells
        assert hypothesis["predicts"] in ("positive", "negative", "none")
        assert ("margin" in hypothesis) == (hypothesis["predicts"] == "none")


def test_p_is_corrected_over_the_family():
    names = {"a": ["p", "l2", 50], "b": ["p", "none", 1], "predicts": "positive", "claim": "c"}
    ledger = {
        "measure": "final_success_rate", "error": 0.05,
        "hypotheses": [{"id": "1", **names}, {"id": "2", **names, "a": ["p", "l2", 10]}],
    }  # fmt: skip
    runs = runs_of({("p", "l2", 50): HIGH, ("p", "l2", 10): LOW[::-1], ("p", "none", 1): LOW})
    take_off = runs[[*KEY, "seed"]].assign(take_off=1.0)
    table = verdicts(runs, take_off, ledger)
    np.testing.assert_allclose(table["p_holm"], holm(table["p"]))
    assert table["verdict"].tolist() == ["supported", "open"]


def test_take_off_curves_are_means_over_windows_that_do_not_overlap():
    key = {"protocol": "p", "variant": "l2", "budget": 500, "alpha0": 50.0}
    success = np.arange(12) / 20
    progress = pd.DataFrame({"iteration": range(1, 13), "env_steps": range(100, 1300, 100), "success_rate": success})
    table = take_off_curves(
        pd.concat([progress.assign(seed=seed, **key) for seed in (0, 1)]).sample(frac=1, random_state=1)
    )
    assert list(table["seed"]) == [0, 0, 1, 1]
    assert list(table["iteration"]) == [5, 10, 5, 10]
    assert list(table["env_steps"]) == [500, 1000, 500, 1000]
    np.testing.assert_allclose(table["success_rate"][:2], [0.1, 0.35])


def test_a_run_shorter_than_the_window_never_takes_off_and_has_no_curve():
    key = {"protocol": "p", "variant": "l2", "budget": 500, "alpha0": 50.0, "seed": 0}
    progress = pd.DataFrame({"iteration": [1, 2], "env_steps": [100, 200], "success_rate": [1.0, 1.0]}).assign(**key)
    assert math.isnan(take_off_steps(np.ones(2), np.array([100, 200])))
    assert take_off_curves(progress).empty


def test_the_kept_sparse_run_is_complete_and_its_verdicts_are_those_of_its_runs():
    folder = ROOT / "report/sparse_run"
    study = load_study(read_settings(ROOT / "config.yaml"))
    assert {path.name for path in folder.iterdir()} == {*tables_of(study, "sparse", {"sparse"}).values(), "README.md"}
    runs = read_table(folder / "runs.parquet", schemas.RUNS)
    kept = read_table(folder / "hypotheses.csv", schemas.HYPOTHESES)
    (ledger,) = (ledger for ledger in LEDGERS if ledger["study"] == "sparse")
    unknown = runs[[*KEY, "seed"]].assign(take_off=np.nan)
    first = ledger | {"hypotheses": ledger["hypotheses"][:2]}
    again = verdicts(runs, unknown, first)
    shown = ["id", "claim", "difference", "ci_low", "ci_high", "p", "solved_a", "least_a", "greatest_b"]
    pd.testing.assert_frame_equal(again[shown], kept[shown].head(2), check_dtype=False)
    assert set(kept["verdict"]) == {"open"}
