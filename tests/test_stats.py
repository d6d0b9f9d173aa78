import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats as scipy_stats

from reacher_shaping import stats


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
    assert stats.t_interval(sample) == stats.t_interval([1.0, 3.0])


@pytest.mark.parametrize("sample", [[], [np.nan], [4.0], [4.0, np.nan]])
def test_no_interval_from_less_than_two_values(sample):
    assert np.isnan(stats.t_interval(sample)).all()
    assert np.isnan(stats.iqm_interval(sample)).all()


def test_nothing_to_average_is_nan_without_a_warning():
    assert np.isnan([stats.mean([]), stats.iqm([np.nan]), stats.paired_comparison([], []).p]).all()


def test_constant_sample_gives_a_point():
    assert stats.t_interval([0.1] * 10) == (0.1, 0.1)


@pytest.mark.parametrize("level", [0.95, 0.999])
def test_interval_of_a_mean_is_students(level):
    sample = rng(5).normal(size=12)
    oracle = scipy_stats.ttest_1samp(sample, 0).confidence_interval(level)
    np.testing.assert_allclose(stats.t_interval(sample, level), oracle)


def jackknife(sample, statistic):
    weights = stats.jackknife_weights(len(sample)).astype(bool)
    return np.array([statistic(sample[row]) for row in weights])


def test_jackknife_error_of_a_mean_is_its_standard_error():
    sample = rng(3).normal(size=9)
    assert stats.jackknife_error(jackknife(sample, np.mean)) == pytest.approx(scipy_stats.sem(sample))


def test_jackknife_error_of_a_ratio_is_that_of_the_delta_method():
    """sd of mean(x) / mean(y) by Taylor's first order, an error of second order in the noise."""
    x, y = 5 + rng(1).normal(0, 0.2, 40), 3 + rng(2).normal(0, 0.1, 40)
    found = stats.jackknife_error(jackknife(np.stack([x, y], axis=1), lambda rows: np.divide(*rows.mean(axis=0))))
    linear = (x - x.mean()) / y.mean() - x.mean() * (y - y.mean()) / y.mean() ** 2
    assert found == pytest.approx(scipy_stats.sem(linear), rel=0.01)


def test_a_missing_seed_changes_neither_error_nor_mean():
    """A seed without a value: leaving it out changes nothing, and the error is that of the others."""
    sample = rng(4).normal(size=8)
    values = np.append(jackknife(sample, np.mean), sample.mean())
    assert stats.jackknife_error(values, seeds=8) == pytest.approx(scipy_stats.sem(sample))


def test_intervals_of_means_cover_the_truth():
    """Ten normal seeds: nominal 95 %."""
    samples = rng(0).normal(size=(4000, 10))
    limits = np.array([stats.t_interval(sample) for sample in samples])
    assert np.mean((limits[:, 0] <= 0) & (limits[:, 1] >= 0)) == pytest.approx(0.95, abs=0.012)


def ranked(samples, rank):
    values, errors = samples.mean(axis=0), samples.std(axis=0, ddof=1) / np.sqrt(len(samples))
    return stats.ranked_interval(values, errors, rank, len(samples))


@pytest.mark.parametrize("rank", [1, 3, 6])
@pytest.mark.parametrize("truth", [np.zeros(6), np.array([0, 0.2, 0.4, 1.0, 3.0, 6.0])])
def test_limits_of_the_picked_one_hold_whichever_it_is(rank, truth):
    """The pick flatters itself; the limits cover the true rank-th largest in at least 95 %."""
    random, true = rng(1), np.sort(truth)[-rank]
    limits = np.array([ranked(truth + random.normal(size=(10, 6)), rank) for _ in range(1500)])
    assert np.mean((limits[:, 0] <= true) & (true <= limits[:, 1])) > 0.94
    assert np.mean(limits[:, 0] > true) < 0.033
    assert np.mean(limits[:, 1] < true) < 0.033


def test_limits_of_one_alone_are_students():
    sample = rng(2).normal(size=(10, 1))
    np.testing.assert_allclose(ranked(sample, 1), stats.t_interval(sample))


def test_iqm_interval_holds_the_iqm():
    sample = rng(8).normal(size=20)
    low, high = stats.iqm_interval(sample)
    assert low < stats.iqm(sample) < high
    wide = stats.t_interval(sample)
    assert 0.5 < (high - low) / (wide.high - wide.low) < 2


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


@settings(max_examples=40)
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


def test_interval_of_a_correlation_is_made_on_fishers_scale():
    """Of independent normal pairs the error of Fisher's z is about 1 / sqrt(n - 3)."""
    random, rows = rng(2), np.arange(60)
    x = random.normal(size=60)
    pairs = np.stack([x, x + random.normal(size=60)])
    values = np.array([stats.pearson(*pairs), *(stats.pearson(*pairs[:, rows != row]) for row in rows)])
    low, high = stats.fisher_interval(values, 60)
    assert low < values[0] < high <= 1
    assert np.diff(np.arctanh([low, high])) == pytest.approx(2 * 2.0 / np.sqrt(57), rel=0.25)
    assert np.isnan(stats.fisher_interval(values[:2], 1)).all()


# Comparisons


def test_paired_comparison_is_students_on_the_pairs_in_which_both_finished():
    a, b = [1.0, 2.0, np.nan, 5.0], [0.0, 1.5, 3.0, 2.0]
    found = stats.paired_comparison(a, b)
    oracle = scipy_stats.ttest_rel([1.0, 2.0, 5.0], [0.0, 1.5, 2.0])
    assert found.difference == pytest.approx(1.5)
    assert found.seeds == 3
    assert found.p == pytest.approx(oracle.pvalue)
    np.testing.assert_allclose((found.low, found.high), oracle.confidence_interval())


@settings(max_examples=40)
@given(st.integers(0, 2**32 - 1))
def test_p_is_below_five_per_cent_exactly_where_the_interval_excludes_zero(seed):
    found = stats.paired_comparison(rng(seed).normal(0.5, 1, 8), np.zeros(8))
    assert (found.p < 0.05) == (found.low > 0 or found.high < 0)


def test_pairing_removes_what_the_seeds_share():
    shared = rng(1).normal(0, 10, 10)
    found = stats.paired_comparison(shared + 1, shared)
    assert (found.low, found.high) == pytest.approx((1, 1))


def test_holm_by_hand():
    """0.01 x 3, 0.02 x 2, 0.03 x 1 made monotone; NaN is not in the family."""
    np.testing.assert_allclose(stats.holm([0.03, 0.01, np.nan, 0.02]), [0.04, 0.03, np.nan, 0.04])
    np.testing.assert_allclose(stats.holm([0.9, 0.8]), [1.0, 1.0])
    assert stats.holm([]).size == 0


@settings(max_examples=40)
@given(st.lists(st.floats(0, 1), min_size=1, max_size=8))
def test_holm_lies_between_raw_and_bonferroni(p):
    adjusted = stats.holm(p)
    assert (adjusted >= np.array(p)).all()
    assert (adjusted <= np.minimum(1, len(p) * np.array(p)) + 1e-12).all()
    assert (np.diff(adjusted[np.argsort(p, kind="stable")]) >= 0).all()


def test_probability_of_improvement_by_hand_and_by_mann_whitney():
    assert stats.probability_of_improvement([2, 3], [1, 2])[0] == 3.5 / 4
    a, b = rng(1).normal(size=(2, 9))
    value, (low, high) = stats.probability_of_improvement(a, b)
    assert value == pytest.approx(scipy_stats.mannwhitneyu(a, b).statistic / 81)
    assert 0 <= low <= value <= high <= 1
    assert np.isnan(stats.probability_of_improvement([], [])[0])


def test_probability_of_improvement_covers_the_truth():
    """Equal rules: one half."""
    pairs = rng(5).normal(size=(800, 2, 12))
    limits = np.array([stats.probability_of_improvement(*pair)[1] for pair in pairs])
    assert np.mean((limits[:, 0] <= 0.5) & (limits[:, 1] >= 0.5)) == pytest.approx(0.95, abs=0.03)


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
