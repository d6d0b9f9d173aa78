import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy import stats as scipy_stats

from reacher_shaping import stats

SAMPLES = arrays(float, st.integers(2, 12), elements=st.floats(-1e3, 1e3, allow_subnormal=False))


def rng(seed=0):
    return np.random.default_rng(seed)


# Means and intervals


def test_iqm_leaves_out_the_outer_quarters():
    assert stats.iqm([100, 1, 2, 3, 4, -50, 5, 6]) == pytest.approx((2 + 3 + 4 + 5) / 4)
    assert stats.iqm([1, 2, 9]) == 4


def test_diverged_values_are_left_out():
    sample = [1.0, np.nan, 3.0, np.inf]
    assert stats.mean(sample) == 2
    assert stats.iqm(sample) == 2
    assert stats.bootstrap_interval(sample, rng()) == stats.bootstrap_interval([1.0, 3.0], rng())


@pytest.mark.parametrize("sample", [[], [np.nan], [4.0], [4.0, np.nan]])
def test_no_interval_from_less_than_two_values(sample):
    assert np.isnan(stats.bootstrap_interval(sample, rng())).all()


def test_nothing_to_average_is_nan_without_a_warning():
    assert np.isnan([stats.mean([]), stats.iqm([np.nan]), stats.sign_flip_p([], rng())]).all()


def test_constant_sample_gives_a_point():
    assert stats.bootstrap_interval([0.1] * 10, rng()) == (0.1, 0.1)


@settings(max_examples=40, deadline=None)
@given(SAMPLES)
def test_interval_holds_the_mean_and_stays_within_the_sample(sample):
    low, high = stats.bootstrap_interval(sample, rng(), resamples=500)
    slack = 1e-9 * (1 + np.abs(sample).max())
    assert sample.min() - slack <= low <= sample.mean() + slack
    assert sample.mean() - slack <= high <= sample.max() + slack


def test_interval_moves_and_scales_with_the_sample():
    sample = rng(3).normal(size=10)
    low, high = stats.bootstrap_interval(sample, rng())
    np.testing.assert_allclose(stats.bootstrap_interval(5 + 2 * sample, rng()), (5 + 2 * low, 5 + 2 * high))


def test_same_generator_gives_the_same_interval_and_another_does_not():
    sample = rng(3).normal(size=10)
    assert stats.bootstrap_interval(sample, rng(1)) == stats.bootstrap_interval(sample, rng(1))
    assert stats.bootstrap_interval(sample, rng(1)) != stats.bootstrap_interval(sample, rng(2))


def test_interval_covers_the_truth_where_the_plain_percentile_does_not():
    """Ten normal seeds: nominal 95 %. Plain percentile limits cover about 90 %."""
    random, trials = rng(0), 600
    samples = random.normal(size=(trials, 10))
    limits = np.array([stats.bootstrap_interval(sample, random, resamples=1000) for sample in samples])
    covered = np.mean((limits[:, 0] <= 0) & (limits[:, 1] >= 0))
    means = samples[np.arange(trials)[:, None, None], stats.resample(10, 1000, random)].mean(axis=2)
    low, high = np.quantile(means, [0.025, 0.975], axis=1)
    plain = np.mean((low <= 0) & (high >= 0))
    assert covered == pytest.approx(0.95, abs=0.02)
    assert plain < 0.93 < covered


def test_interval_approaches_the_t_interval():
    sample = rng(5).normal(size=40)
    t = scipy_stats.ttest_1samp(sample, 0).confidence_interval()
    np.testing.assert_allclose(stats.bootstrap_interval(sample, rng(), 20_000), t, atol=0.02)


def test_wilson_interval_by_hand():
    """8 of 10: Wilson (1927) with z = 1.96 gives 0.4902 and 0.9433."""
    np.testing.assert_allclose(stats.wilson_interval(8, 10), (0.4902, 0.9433), atol=1e-4)
    assert stats.wilson_interval(0, 10).low == 0
    assert np.isnan(stats.wilson_interval(0, 0)).all()


def test_welch_interval_by_hand():
    """Means 2 and 5, variances 1 and 1, n = 3: standard error sqrt(2/3), 4 degrees of freedom, t = 2.776."""
    half = 2.7764 * np.sqrt(2 / 3)
    np.testing.assert_allclose(stats.welch_interval([1, 2, 3], [4, 5, 6]), (-3 - half, -3 + half), atol=1e-3)
    assert stats.welch_interval([2, 2], [1, 1]) == (1, 1)
    assert np.isnan(stats.welch_interval([2], [1, 3])).all()


# Correlations


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(3, 30))
def test_correlations_agree_with_scipy(seed, size):
    x, y = rng(seed).normal(size=(2, size))
    y = np.round(x + y, 1)  # ties
    if np.ptp(y) == 0:
        return
    assert stats.pearson(x, y) == pytest.approx(scipy_stats.pearsonr(x, y).statistic, abs=1e-9)
    assert stats.spearman(x, y) == pytest.approx(scipy_stats.spearmanr(x, y).statistic, abs=1e-9)


def test_correlations_skip_incomplete_pairs():
    x = np.array([1.0, 2, 3, 4, np.nan, 60])
    y = np.array([2.0, 1, 4, 3, 50, np.nan])
    assert stats.pearson(x, y) == pytest.approx(0.6)
    assert stats.spearman(x, y) == pytest.approx(0.6)


def test_correlation_with_a_constant_is_nan():
    assert np.isnan(stats.pearson(np.full(17, 0.1), rng().normal(size=17)))
    value, interval, n = stats.correlation(np.full(17, 0.1), rng().normal(size=17), rng())
    assert np.isnan([value, *interval]).all()
    assert n == 17


@pytest.mark.parametrize("strata", [None, np.repeat(range(5), 8)])
def test_correlation_interval_holds_the_estimate(strata):
    x, e = rng(2).normal(size=(2, 40))
    value, (low, high), n = stats.correlation(x, x + e, rng(), "pearson", strata)
    assert low < value < high
    assert n == 40


def test_resampling_inside_cells_keeps_the_grid():
    """Without noise inside cells, stratified resampling gives the same r each time; resampling cells does not."""
    cell = np.repeat(range(5), 8)
    x, y = np.arange(5.0)[cell], np.array([0.0, 2, 1, 5, 3])[cell]
    value, inside, _ = stats.correlation(x, y, rng(), strata=cell)
    np.testing.assert_allclose(inside, value)
    _, across, _ = stats.correlation(x[::8], y[::8], rng())
    assert across.high - across.low > 0.1


# Comparisons


def test_sign_flip_p_counts_by_hand():
    """Differences 1, 2, 3: of 8 sign patterns only +++ and --- reach |6|; with 1, 1, -3 five of the sums do reach 1."""
    assert stats.sign_flip_p([1, 2, 3], rng()) == 2 / 8
    assert stats.sign_flip_p([1, 1, -3], rng()) == 8 / 8
    assert stats.sign_flip_p([0, 0, 0], rng()) == 1


@pytest.mark.parametrize("size", [6, 10, 16])
def test_sign_flip_p_agrees_with_scipy(size):
    values = rng(size).normal(0.4, 1, size)
    oracle = scipy_stats.permutation_test(
        (values, np.zeros(size)), lambda a, b: np.mean(a - b), permutation_type="samples", n_resamples=70_000, rng=rng()
    )
    assert stats.sign_flip_p(values, rng()) == pytest.approx(oracle.pvalue, abs=0 if size <= 14 else 0.02)


def test_paired_comparison_uses_pairs_in_which_both_finished():
    a, b = [1.0, 2.0, np.nan, 5.0], [0.0, 1.0, 3.0, 2.0]
    found = stats.paired_comparison(a, b, rng())
    assert found.difference == pytest.approx(5 / 3)
    assert found.seeds == 3
    assert found.p == 2 / 8
    assert found.low <= found.difference <= found.high


def test_pairing_removes_what_the_seeds_share():
    shared = rng(1).normal(0, 10, 10)
    found = stats.paired_comparison(shared + 1, shared, rng())
    assert (found.low, found.high) == pytest.approx((1, 1))


def test_holm_by_hand():
    """0.01 x 3, 0.02 x 2, 0.03 x 1 made monotone; NaN is not in the family."""
    np.testing.assert_allclose(stats.holm([0.03, 0.01, np.nan, 0.02]), [0.04, 0.03, np.nan, 0.04])
    np.testing.assert_allclose(stats.holm([0.9, 0.8]), [1.0, 1.0])
    assert stats.holm([]).size == 0


@settings(max_examples=40, deadline=None)
@given(st.lists(st.floats(0, 1), min_size=1, max_size=8))
def test_holm_lies_between_raw_and_bonferroni(p):
    adjusted = stats.holm(p)
    assert (adjusted >= np.array(p)).all()
    assert (adjusted <= np.minimum(1, len(p) * np.array(p)) + 1e-12).all()
    assert (np.diff(adjusted[np.argsort(p, kind="stable")]) >= 0).all()


def test_probability_of_improvement_by_hand_and_by_mann_whitney():
    assert stats.probability_of_improvement([2, 3], [1, 2], rng())[0] == 3.5 / 4
    a, b = rng(1).normal(size=(2, 9))
    value, (low, high) = stats.probability_of_improvement(a, b, rng())
    assert value == pytest.approx(scipy_stats.mannwhitneyu(a, b).statistic / 81)
    assert low <= value <= high
    assert np.isnan(stats.probability_of_improvement([], b, rng())[0])


# Variance and power


def test_variance_split_recovers_its_parts():
    random, episodes = rng(0), 200
    truth = random.normal(0.3, 0.05, 4000)
    rates = random.binomial(episodes, truth) / episodes
    seed, evaluation = stats.variance_split(rates, episodes)
    assert seed == pytest.approx(0.05**2, rel=0.1)
    assert evaluation == pytest.approx(0.3 * 0.7 / episodes, rel=0.05)


def test_variance_of_seeds_is_never_negative():
    assert stats.variance_split([0.5, 0.5, 0.5], 10)[0] == 0
    assert np.isnan(stats.variance_split([0.5], 10)).all()


def test_power_agrees_with_simulation():
    random = rng(0)
    found = scipy_stats.ttest_1samp(random.normal(1, 1, (4000, 8)), 0, axis=1).pvalue < 0.05
    assert stats.power(1, 1, 8) == pytest.approx(found.mean(), abs=0.025)
    assert stats.power(0, 1, 8) == pytest.approx(0.05)
    assert np.isnan(stats.power(1, 1, 1))


def test_seeds_needed_is_the_smallest_number_with_the_power():
    n = stats.seeds_needed(0.5, 1)
    assert n == 34  # the textbook number for a paired t test, d = 0.5, 80 %
    assert stats.power(0.5, 1, n - 1) < 0.8 <= stats.power(0.5, 1, n)
    assert stats.seeds_needed(10, 1) == 3
    assert np.isnan(stats.seeds_needed(0, 1))
    assert np.isnan(stats.seeds_needed(1, np.nan))
