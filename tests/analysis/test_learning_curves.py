import numpy as np
import pytest
import synthetic
from hypothesis import given, settings
from hypothesis import strategies as st

from reacher_shaping.analysis import learning_curves
from reacher_shaping.labels import KEY


def test_moving_average_trails():
    np.testing.assert_allclose(learning_curves.smooth(np.arange(30.0), 5)[0][:2], [2, 3])
    assert learning_curves.smooth(np.arange(30.0), 5).shape == (1, 26)


def test_short_curves_are_smoothed_less():
    assert learning_curves.smooth(np.arange(10.0)).shape == (1, 9)
    np.testing.assert_array_equal(learning_curves.smooth([[3.0, 4.0]]), [[3.0, 4.0]])


def test_peak_is_reported_at_the_end_of_its_window():
    """A plateau of exactly one window, iterations 31 to 50: full at iteration 50, as in the paper's figure."""
    curve = np.full(200, -20.0)
    curve[30:50] = -5.0
    top, iteration = learning_curves.peak(curve)
    assert (top[0], iteration[0]) == (-5.0, 50)


def test_measures_by_hand():
    """Rises to -10 at once, holds for 100 iterations, then stays at -30."""
    curve = np.r_[np.full(100, -10.0), np.full(100, -30.0)]
    found = {name: values[0] for name, values in learning_curves.measures(curve).items()}
    assert found["peak_return"] == -10
    assert found["peak_iteration"] == 20
    assert found["final_return"] == -30
    assert found["drop_from_peak"] == 20
    assert found["area_under_curve"] == -20
    differences = np.r_[np.zeros(59), -20, np.zeros(99)]  # past the first 40
    assert found["roughness"] == pytest.approx(np.std(differences, ddof=1) / (60 / 160 * 10 + 100 / 160 * 30))


@settings(max_examples=30)
@given(st.integers(0, 2**32 - 1), st.integers(1, 260), st.floats(0.1, 100))
def test_drop_is_never_negative_and_roughness_has_no_scale(seed, iterations, scale):
    curves = -20 + np.random.default_rng(seed).normal(size=(3, iterations)).cumsum(axis=1)
    found = learning_curves.measures(curves)
    assert (found["drop_from_peak"] >= -1e-9).all()
    np.testing.assert_allclose(learning_curves.roughness(scale * curves), found["roughness"], rtol=1e-9)


def test_a_shaking_curve_is_rougher_than_a_smooth_one_at_any_level():
    time = np.linspace(0, 1, 245)
    noise = np.random.default_rng(0).normal(size=245)
    smooth, shaking = -10 + 2 * time, -10 + 2 * time + noise
    low_but_smooth = -800 + 200 * time + 5 * noise
    rough = learning_curves.roughness([smooth, shaking, low_but_smooth])
    assert rough[0] < 1e-9
    assert rough[1] > rough[2] > rough[0]


def test_shaking_is_in_units_of_return_and_does_not_move_with_its_level():
    """The settled part of a sawtooth of step 2: first differences +2, -2, ..."""
    curve = np.tile([0.0, 2.0], 50)
    found, lower = learning_curves.shaking([curve, curve - 100])
    assert found == lower == pytest.approx(2, rel=0.01)


def test_the_first_rise_is_not_roughness():
    flat = np.full(245, -10.0)
    rising = flat.copy()
    rising[:45] = np.linspace(-60, -10, 45)
    np.testing.assert_array_equal(learning_curves.roughness([flat, rising]), [0, 0])


def test_order_of_roughness_survives_the_window():
    random = np.random.default_rng(0)
    curves = -20 + random.normal(size=(10, 245)) * np.linspace(0.2, 3, 10)[:, None]
    table = learning_curves.roughness_by_window(curves)
    assert table.shape == (10, len(learning_curves.WINDOWS))
    for column in table.T:
        assert np.corrcoef(np.argsort(np.argsort(column)), np.arange(10))[0, 1] > 0.9


def test_steps_to_threshold_is_the_first_time_and_nan_if_never():
    curve = np.linspace(-50, -1, 50)[None]  # one up per iteration; window of 10: mean of i-9..i
    steps = 2048 * np.arange(1, 51)
    found = learning_curves.steps_to_threshold(np.concatenate([curve, curve - 100]), steps, -20.5)
    assert found[0] == 2048 * 35  # iterations 26 to 35 average -20.5
    assert np.isnan(found[1])


def test_single_seeds_have_the_mean_that_is_drawn_and_no_value_where_a_run_is_lost():
    progress = synthetic.progress([("paper", variant, 50_000, 1.0) for variant in ("none", "l2")], 3)
    lost = progress.index[(progress["seed"] == 1) & (progress["iteration"] == 1)]
    progress.loc[lost, "episode_return"] = np.inf
    seeds, means = learning_curves.seed_curves(progress), learning_curves.curve_table(progress)
    key = [*KEY, "iteration"]
    ours = seeds.groupby(key)["episode_return"].mean()
    drawn = means.set_index(key)["episode_return"].loc[ours.index]
    assert len(seeds) == 3 * len(ours)
    assert seeds["episode_return"].isna().sum() == len(lost)
    np.testing.assert_allclose(ours, drawn, atol=0.005)


def test_diverged_curve_has_no_measures_and_leaves_the_others_alone():
    curves = -10 + np.random.default_rng(0).normal(size=(2, 100))
    alone = learning_curves.measures(curves[:1])
    curves[1, 60:] = np.inf
    both = learning_curves.measures(curves)
    for name, values in both.items():
        assert values[0] == alone[name][0]
        assert np.isnan(values[1]), name
