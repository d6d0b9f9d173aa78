"""The map of the targets: each episode's own target, and every episode counted once."""

import gymnasium
import numpy as np
import pandas as pd
import pytest

from reacher_shaping.analysis.target_maps import SQUARE, reacher_targets, target_map
from reacher_shaping.evaluation.evaluate import Conditions, evaluate
from reacher_shaping.random_streams import Purpose, stream
from reacher_shaping.settings.cell import Environment
from reacher_shaping.tasks import reacher

KEY = {"protocol": "p", "variant": "l2", "budget": 500, "alpha0": 50.0}


def test_targets_are_those_that_evaluation_episodes_start_with():
    seen = []

    def still(observation, noise):
        seen.append(observation[0, :, 4:6].copy())
        return np.zeros((1, observation.shape[1], 2))

    conditions = Conditions(
        environment=Environment(), root_seed=11, success_radius=0.02, episodes=60, mode="deterministic"
    )
    evaluate(still, [0], conditions)
    met = np.concatenate([seen[0], seen[50]])  # two chunks of lanes, at their first steps
    np.testing.assert_allclose(reacher_targets(11, 60), met[:60], atol=1e-12)


def test_targets_are_gymnasiums():
    environment = gymnasium.make("Reacher-v5").unwrapped
    environment.reset(seed=0)
    environment.np_random = stream(3, Purpose.EVALUATION_RESETS)
    theirs = []
    for _ in range(20):
        environment.reset_model()
        theirs.append(environment.get_body_com("target")[:2].copy())
    np.testing.assert_allclose(reacher_targets(3, 20), theirs, atol=1e-12)
    assert reacher.TASK.gymnasium_id == "Reacher-v5"


def test_every_stochastic_episode_is_counted_in_the_square_of_its_target():
    targets = np.array([[0.01, 0.01], [0.03, 0.039], [-0.01, 0.01], [0.01, -0.19]])
    rows = [
        {"seed": seed, "mode": mode, "episode": episode, "final_success": episode == 1 and seed == 0, **KEY}
        for seed in (0, 1)
        for mode in ("stochastic", "deterministic")
        for episode in range(4)
    ]
    table = target_map(pd.DataFrame(rows), targets).set_index(["target_x", "target_y"])
    half = SQUARE / 2
    assert table.loc[(half, half), "episodes"] == 4
    assert table.loc[(half, half), "final_success_rate"] == pytest.approx(0.25)
    assert table.loc[(-half, half), ["episodes", "final_success_rate"]].tolist() == [2, 0]
    assert table["episodes"].sum() == 8
