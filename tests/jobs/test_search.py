"""The search proposes what its space allows, follows its score, and goes on as if it had not been interrupted."""

import math
from pathlib import Path

import optuna
import pandas as pd
import pytest

from reacher_shaping.jobs import search
from reacher_shaping.settings.base import ConfigError
from reacher_shaping.settings.cell import PPO, Environment, Protocol, Variant
from reacher_shaping.settings.search import Search
from reacher_shaping.settings.study import load_study, read_settings

ROOT = Path(__file__).parents[2]
L2, SQRT = (Variant(name=name, potential=name) for name in ("l2", "sqrt"))
VARIANTS = {"l2": L2, "sqrt": SQRT}
SPEC = Search.model_validate(
    {
        "protocol": "standard", "variant": "l2", "budget": 4096, "seeds": 2, "root_seed": 5, "trials": 25,
        "fixed": {"ppo.learning_rate_schedule": "linear"},
        "space": {
            "ppo.learning_rate": {"low": 1e-4, "high": 1e-2, "log": True},
            "ppo.epochs": {"low": 1, "high": 9},
            "ppo.minibatch_size": {"choices": (32, 64)},
            "alpha0": {"low": 0.5, "high": 8.0},
        },
    }
)  # fmt: skip
PROTOCOL = Protocol(name="standard")


def score(values):
    """Best at a learning rate of 1e-3 and nine epochs."""
    return {"mean_return": -abs(math.log10(values["ppo.learning_rate"]) + 3) - 0.1 * (9 - values["ppo.epochs"])}


def finished(spec=SPEC, measure=score, done=None):
    return list(search.trials(spec, measure, done))[-1]


@pytest.fixture(scope="module")
def table():
    return finished()


def test_trials_stay_in_the_space_and_whole_numbers_stay_whole(table):
    assert len(table) == 25
    assert table["ppo.learning_rate"].between(1e-4, 1e-2).all()
    assert set(table["ppo.minibatch_size"]) == {32, 64}
    assert set(table["ppo.epochs"]) <= set(range(1, 10))
    assert table["alpha0"].between(0.5, 8).all()


def test_search_finds_better_settings_than_its_random_start(table):
    late, early = table["mean_return"].iloc[15:], table["mean_return"].iloc[: search.STARTUP]
    assert late.mean() > early.mean() + 0.2
    assert table["mean_return"].max() > early.max()


def test_interrupted_search_ends_like_another(table, tmp_path):
    path = tmp_path / "trials.csv"
    table.head(13).astype({"ppo.epochs": float, "ppo.minibatch_size": float}).to_csv(path, index=False)
    measured = []

    def measure(values):
        measured.append(values)
        return score(values)

    ended = finished(done=pd.read_csv(path), measure=measure)
    pd.testing.assert_frame_equal(ended, table, check_dtype=False)
    assert len(measured) == 25 - 13, "no trial is done twice"


def test_a_space_may_be_logarithmic():
    found = search.distributions(SPEC)
    assert found["ppo.learning_rate"].log
    assert not found["alpha0"].log


def test_a_search_may_begin_with_given_settings_and_choose_among_variants():
    start = {"ppo.learning_rate": 0.002, "variant": "sqrt"}
    space = {"ppo.learning_rate": {"low": 1e-4, "high": 1e-2, "log": True}, "variant": {"choices": ("l2", "sqrt")}}
    spec = Search.model_validate(SPEC.model_dump() | {"space": space, "start": start, "trials": 12})
    measured = []

    def measure(values):
        measured.append(values)
        return {"mean_return": 0.0, "success_rate": float(values["variant"] == "sqrt") - values["ppo.learning_rate"]}

    table = finished(spec.model_copy(update={"maximise": "success_rate"}), measure)
    assert measured[0] == start
    assert table.loc[0, ["ppo.learning_rate", "variant"]].to_dict() == start
    assert set(table["variant"]) == {"l2", "sqrt"}
    assert (table["variant"].iloc[-2:] == "sqrt").all(), "it follows the measure that it is told to maximise"
    assert spec.variants() == ("l2", "sqrt")
    assert spec.cell(PROTOCOL, VARIANTS, measured[0]).variant == SQRT


@pytest.mark.parametrize(
    ("start", "message"),
    [
        ({"alpha0": 1.0}, "start has 'alpha0'; allowed: none, or what the space has"),
        ({"ppo.learning_rate": 1.0}, r"start\.ppo\.learning_rate = 1\.0 is not in the space"),
        ({"ppo.learning_rate": "high"}, r"start\.ppo\.learning_rate = 'high' is not in the space"),
    ],
)
def test_a_start_outside_the_space_is_refused(start, message):
    space = {"ppo.learning_rate": {"low": 1e-4, "high": 1e-2, "log": True}}
    with pytest.raises(ValueError, match=message):
        Search.model_validate(SPEC.model_dump() | {"space": space, "start": start})


def test_more_trials_begin_with_the_fewer(table):
    fewer = finished(SPEC.model_copy(update={"trials": 12}))
    pd.testing.assert_frame_equal(fewer, table.head(12))


def test_diverged_trial_counts_as_the_worst_and_does_not_stop_the_search(monkeypatch):
    measured = []

    def measure(values):
        measured.append(values)
        return {"mean_return": float("nan") if len(measured) in (1, 4) else score(values)["mean_return"]}

    told = []
    create = optuna.trial.create_trial
    monkeypatch.setattr(optuna.trial, "create_trial", lambda **given: told.append(given["value"]) or create(**given))
    table = finished(SPEC.model_copy(update={"trials": 12}), measure)
    assert table["mean_return"].isna().sum() == 2
    assert len(table) == 12
    finite = table["mean_return"].head(11).fillna(table["mean_return"].head(11).min())
    assert told[-11:] == finite.tolist()


def test_a_trial_trains_the_protocol_with_its_own_settings_under_its_own_root():
    values = {"ppo.learning_rate": 0.002, "ppo.epochs": 3, "ppo.minibatch_size": 32, "alpha0": 2.0}
    cell = SPEC.cell(PROTOCOL, VARIANTS, values)
    expected = PPO(learning_rate=0.002, epochs=3, minibatch_size=32, learning_rate_schedule="linear")
    assert cell.protocol.ppo == expected
    assert (cell.alpha0, cell.budget, cell.root_seed, cell.variant) == (2.0, 4096, 5, L2)


def test_impossible_trial_is_one_line():
    with pytest.raises(ConfigError, match=r"minibatch_size = 30 must divide rollout_steps = 2048") as caught:
        SPEC.cell(PROTOCOL, VARIANTS, {"ppo.minibatch_size": 30})
    assert "\n" not in str(caught.value)


def test_score_is_the_mean_over_what_the_evaluation_found(monkeypatch):
    asked = {}

    def evaluate(act, seeds, conditions):
        asked.update(vars(conditions), seeds=seeds)
        columns = search.MEASURES.values()
        return pd.DataFrame({name: [1.0 * place, 3.0 * place] for place, name in enumerate(columns)})

    monkeypatch.setattr(search, "evaluate", evaluate)
    settings = PPO(rollout_steps=192, epochs=1, minibatch_size=32)
    protocol = Protocol(name="standard", ppo=settings, environment=Environment(control_weight=0.5, clip_actions=True))
    cell = SPEC.cell(protocol, VARIANTS, {}).model_copy(update={"budget": 192})
    found = search.score(cell, 3, episodes=7, success_radius=0.03)
    assert found == {name: 2.0 * place for place, name in enumerate(search.MEASURES)}
    expected = {"mode": "stochastic", "environment": protocol.environment, "episodes": 7, "steps": None}
    assert asked == expected | {"success_radius": 0.03, "seeds": [0, 1, 2], "root_seed": 5}


def test_score_is_that_of_real_runs():
    settings = PPO(rollout_steps=192, epochs=1, minibatch_size=32)
    cell = SPEC.cell(Protocol(name="standard", ppo=settings), VARIANTS, {}).model_copy(update={"budget": 384})
    found = search.score(cell, 2, episodes=50, success_radius=0.05)
    assert found == search.score(cell, 2, episodes=50, success_radius=0.05)
    assert set(found) == set(search.MEASURES)
    assert -200 < found["mean_return"] < -5
    assert 0 <= found["final_success_rate"] <= found["success_rate"] <= 1


def test_the_same_search_can_be_made_without_shaping():
    config = read_settings(ROOT / "config.yaml")
    shaped = config["experiments"]["tuned"]["search"]
    config["experiments"]["tuned"]["search"] = shaped | {
        "variant": "none",
        "space": {name: own for name, own in shaped["space"].items() if name != "alpha0"},
    }
    study = load_study(config)
    spec, first = (own.experiments["tuned"].search for own in (study, load_study(ROOT / "config.yaml")))
    assert (spec.trials, spec.seeds, spec.budget) == (first.trials, first.seeds, first.budget)
    assert spec.space.keys() == first.space.keys() - {"alpha0"}
    assert spec.cell(study.protocols["standard"], study.variants, spec.corners()[0]).alpha0 == 1


def test_study_of_the_searched_settings_says_that_none_had_no_search_of_its_own():
    study = load_study(ROOT / "config.yaml")
    assert study.experiments["tuned"].search.variants() == ("l2",)
    assert "the comparison of the two is tilted towards shaping" in study.experiments["tuned"].question


def test_the_tuned_protocol_is_the_best_trial_of_the_kept_search():
    """To the two or three digits that config.yaml writes."""
    kept = ROOT / "report/reference/experiments/tuned/search/trials.csv"
    if not kept.exists():
        pytest.skip("no search is kept")
    study = load_study(ROOT / "config.yaml")
    search, trials = study.experiments["tuned"].search, pd.read_csv(kept)
    assert len(trials) == search.trials
    best = trials.loc[trials["mean_return"].idxmax()]
    protocol = study.protocols["tuned"].model_dump()
    (shaped,) = [cell for cell in study.cells_of["tuned"] if cell.variant.name == best["variant"]]
    for path in search.space:
        part, _, key = path.partition(".")
        value = protocol[part][key] if key else shaped.alpha0
        assert value == pytest.approx(best[path], rel=0.01), path
    for path, value in search.fixed.items():
        part, _, key = path.partition(".")
        assert protocol[part][key] == value
