"""Evaluation agrees with stepping Gymnasium under Stable-Baselines3's Monitor, and is paired by episode."""

import gymnasium
import numpy as np
import pandas as pd
import pytest
from cells import fresh_policy
from stable_baselines3.common.monitor import Monitor

from reacher_shaping.evaluation.evaluate import LANES_PER_SEED, Conditions, evaluate
from reacher_shaping.random_streams import Purpose, stream
from reacher_shaping.settings.cell import Environment
from reacher_shaping.training.policy import Policy

pytestmark = pytest.mark.slow

ROOT, WEIGHT, RADIUS = 5, 0.1, 0.05
SETTINGS = {"success_radius": RADIUS, "environment": Environment(control_weight=WEIGHT), "root_seed": ROOT}


@pytest.fixture(scope="module")
def policy():
    policy = fresh_policy([0, 1], 3)
    policy.layers.log_std.fill_(-0.5)
    return policy


def monitored(policy, row, mode, episodes, *, clip=False):
    """The same episodes by Gymnasium and Monitor, one at a time."""
    env = Monitor(gymnasium.make("Reacher-v5", reward_control_weight=WEIGHT))
    resets, draws = stream(ROOT, Purpose.EVALUATION_RESETS), stream(ROOT, Purpose.EVALUATION_ACTIONS)
    env.unwrapped.np_random = resets
    alone = Policy(policy.parameters[row : row + 1].clone(), policy.shape)
    rows = []
    for _ in range(episodes):
        noise = draws.standard_normal((50, 2), dtype=np.float32)
        observation, _ = env.reset()
        distances, parts = [], []
        truncated = False
        while not truncated:
            step = noise[None, None, len(distances)] if mode == "stochastic" else None
            action = alone.act(observation[None, None], step)[0, 0]
            observation, _, _, truncated, info = env.step(action.clip(-1, 1) if clip else action)
            distances.append(np.linalg.norm(observation[8:]))
            parts.append((info["reward_dist"], info["reward_ctrl"]))
        hits = [t + 1 for t, distance in enumerate(distances) if distance <= RADIUS]
        rows.append(
            {
                "episode_return": info["episode"]["r"],
                "length": info["episode"]["l"],
                "reward_distance": sum(part[0] for part in parts),
                "reward_control": sum(part[1] for part in parts),
                "min_distance": min(distances),
                "final_distance": distances[-1],
                "first_hit_step": hits[0] if hits else pd.NA,
                "success": bool(hits),
                "final_success": distances[-1] <= RADIUS,
                "share_within_radius": len(hits) / 50,
            }
        )
    env.close()
    return pd.DataFrame(rows)


@pytest.mark.parametrize("mode", ["stochastic", "deterministic"])
@pytest.mark.parametrize("clip", [False, True], ids=["raw", "clipped"])
def test_episodes_are_those_of_gymnasium_under_monitor(policy, mode, clip):
    """Monitor rounds returns to six digits; actions of one lane and of fifty differ in the last digit of float32."""
    environment = Environment(control_weight=WEIGHT, clip_actions=clip)
    settings = SETTINGS | {"environment": environment}
    ours = evaluate(policy.act, [10, 11], Conditions(mode=mode, episodes=25, **settings))
    assert ours["seed"].tolist() == [10] * 25 + [11] * 25
    assert ours["episode"].tolist() == [*range(25)] * 2
    assert set(ours["mode"]) == {mode}
    for row, seed in enumerate((10, 11)):
        expected = monitored(policy, row, mode, 25, clip=clip)
        assert (expected.pop("length") == 50).all()
        found = ours[ours["seed"] == seed].reset_index(drop=True)
        for name in ("episode_return", "reward_distance", "reward_control", "min_distance", "final_distance"):
            np.testing.assert_allclose(found[name], expected[name], rtol=1e-4, atol=1e-5, err_msg=name)
        for name in ("success", "final_success", "share_within_radius"):
            assert found[name].tolist() == expected[name].tolist()
        assert found["first_hit_step"].fillna(0).tolist() == expected["first_hit_step"].fillna(0).tolist()
    assert 0 < ours["success"].sum() < len(ours)
    assert ours["first_hit_step"].isna().tolist() == (~ours["success"]).tolist()


def test_fewer_episodes_are_the_first_of_more(policy):
    """Whole and broken chunks of lanes alike."""
    long = evaluate(policy.act, [0, 1], Conditions(episodes=110, **SETTINGS))
    for episodes in (1, 50, 73):
        short = evaluate(policy.act, [0, 1], Conditions(episodes=episodes, **SETTINGS))
        expected = long[long["episode"] < episodes].reset_index(drop=True)
        pd.testing.assert_frame_equal(short, expected, check_exact=True)


def test_a_policys_episodes_do_not_depend_on_the_block(policy):
    both = evaluate(policy.act, [0, 1], Conditions(episodes=20, **SETTINGS))
    for row in (0, 1):
        single = Policy(policy.parameters[row : row + 1].clone(), policy.shape)
        alone = evaluate(single.act, [row], Conditions(episodes=20, **SETTINGS))
        pd.testing.assert_frame_equal(alone, both[both["seed"] == row].reset_index(drop=True), check_exact=True)


def test_all_policies_and_modes_meet_the_same_resets_and_the_same_noise():
    seen = []

    def spy(observation, noise):
        seen.append((observation.copy(), None if noise is None else noise.copy()))
        return np.zeros((*observation.shape[:2], 2))

    for mode in ("stochastic", "deterministic"):
        evaluate(spy, [4, 9], Conditions(mode=mode, episodes=2 * LANES_PER_SEED, **SETTINGS))
    stochastic, deterministic = seen[:100], seen[100:]
    assert all(noise is None for _, noise in deterministic)
    for t in (0, 50):
        assert np.array_equal(stochastic[t][0], deterministic[t][0])
        assert np.array_equal(stochastic[t][0][0], stochastic[t][0][1])
    assert not np.array_equal(stochastic[0][0], stochastic[50][0])
    assert all(np.array_equal(noise[0], noise[1]) for _, noise in stochastic)
    draws = np.concatenate([noise[0].ravel() for _, noise in stochastic])
    assert abs(draws.mean()) < 4 / np.sqrt(draws.size)
    assert draws.std() == pytest.approx(1, abs=4 / np.sqrt(2 * draws.size))


def test_radius_and_weight_change_only_what_they_should(policy):
    base = evaluate(policy.act, [0, 1], Conditions(episodes=20, **SETTINGS))
    wide = evaluate(policy.act, [0, 1], Conditions(episodes=20, **SETTINGS | {"success_radius": 10.0}))
    assert wide["success"].all()
    assert (wide["first_hit_step"] == 1).all()
    settings = SETTINGS | {"environment": Environment(control_weight=1.0)}
    dear = evaluate(policy.act, [0, 1], Conditions(episodes=20, **settings))
    np.testing.assert_allclose(dear["reward_control"], 10 * base["reward_control"], rtol=1e-6)
    for name in ("reward_distance", "min_distance", "final_distance"):
        assert base[name].equals(wide[name])
        assert base[name].equals(dear[name])


def test_longer_episodes_start_with_the_short_ones():
    def zero(observation, noise):
        return np.zeros((*observation.shape[:2], 2))

    short, long = (
        evaluate(zero, [0], Conditions(mode="deterministic", episodes=3, steps=steps, **SETTINGS))
        for steps in (50, 200)
    )
    assert (long["reward_distance"] < short["reward_distance"]).all()
    assert (long["min_distance"] <= short["min_distance"]).all()
    hits = short["first_hit_step"].notna()
    assert short["first_hit_step"][hits].tolist() == long["first_hit_step"][hits].tolist()


def test_a_policy_of_nans_gives_rows_and_leaves_the_others_alone(policy):
    clean = evaluate(policy.act, [0, 1], Conditions(episodes=20, **SETTINGS))
    parameters = policy.parameters.clone()
    parameters[0] = np.nan
    found = evaluate(Policy(parameters, policy.shape).act, [0, 1], Conditions(episodes=20, **SETTINGS))
    second = [frame[frame["seed"] == 1] for frame in (found, clean)]
    pd.testing.assert_frame_equal(*second, check_exact=True)
    assert found[found["seed"] == 0]["episode_return"].isna().all()
