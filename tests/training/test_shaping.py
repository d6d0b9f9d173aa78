"""Shaping rewards telescope, follow their schedule and treat an episode's end as told."""

import numpy as np
import pytest
from cells import VARIANTS
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from reacher_shaping.settings.cell import PPO, Cell, Protocol, Shaping, Variant
from reacher_shaping.training.advantage import gae, next_values
from reacher_shaping.training.potentials import learned
from reacher_shaping.training.records import Transitions
from reacher_shaping.training.shaping import Rule

STEPS = 50
DISTANCES = arrays(np.float64, STEPS + 1, elements=st.floats(0, 0.5))
ALPHAS = st.floats(0.01, 10)
DISCOUNTS = st.floats(0.5, 1)
POTENTIALS = st.sampled_from(["l2", "l2sq"])


def rule(variant, *, alpha0=1.0, discount=0.99, **settings):
    protocol = Protocol(name="p", ppo=PPO(discount=discount), shaping=Shaping(**settings))
    return Rule.of(Cell(protocol=protocol, variant=variant, budget=2048, alpha0=alpha0))


def alpha(variant, alpha0, env_steps):
    return rule(variant, alpha0=alpha0).alpha({}, env_steps)


def shaping_terms(distance, variant, *, alpha0=1.0, discount=0.99, start=0, **settings):
    """F [T] of one lane of T steps."""
    steps = len(distance) - 1
    episode_ends = (np.arange(steps) == steps - 1)[None]
    shaping = rule(variant, alpha0=alpha0, discount=discount, **settings)
    return shaping.reward(np.asarray(distance)[None, None], (start + np.arange(steps))[None], episode_ends, {})[0, 0]


def discounted_sum(terms, discount):
    return float(np.sum(discount ** np.arange(len(terms)) * terms))


def phi(name, distance):
    return -distance if name == "l2" else -(distance**2)


@given(DISTANCES, POTENTIALS, ALPHAS, DISCOUNTS)
def test_constant_shaping_telescopes(distance, name, alpha0, discount):
    terms = shaping_terms(distance, VARIANTS[name], alpha0=alpha0, discount=discount)
    expected = alpha0 * (discount**STEPS * phi(name, distance[-1]) - phi(name, distance[0]))
    assert discounted_sum(terms, discount) == pytest.approx(expected, abs=1e-12 * alpha0)


@given(DISTANCES, st.integers(1, 200), st.integers(0, 200), ALPHAS, DISCOUNTS)
def test_dynamic_form_telescopes_for_a_weight_that_changes(distance, horizon, start, alpha0, discount):
    decay = Variant(name="d", potential="l2", schedule="linear", horizon=horizon)
    terms = shaping_terms(distance, decay, alpha0=alpha0, discount=discount, start=start, form="dynamic")

    def weight(t):
        return alpha0 * max(0, 1 - t / horizon)

    expected = -weight(start + STEPS) * discount**STEPS * distance[-1] + weight(start) * distance[0]
    assert discounted_sum(terms, discount) == pytest.approx(expected, abs=1e-12 * alpha0)


@given(DISTANCES, ALPHAS, st.integers(0, 3000))
def test_the_forms_differ_by_the_change_of_the_weight(distance, alpha0, start):
    decay = Variant(name="d", potential="l2", schedule="linear", horizon=2000)
    paper, dynamic = (
        shaping_terms(distance, decay, alpha0=alpha0, start=start, form=form) for form in ("paper", "dynamic")
    )
    drop = alpha(decay, alpha0, start + np.arange(STEPS)) - alpha(decay, alpha0, start + 1 + np.arange(STEPS))
    np.testing.assert_allclose(dynamic - paper, 0.99 * drop * distance[1:], atol=1e-13 * alpha0)


def test_the_forms_differ_by_five_in_a_hundred_thousand_an_episode_at_200k():
    decay = Variant(name="decay200k", potential="l2", schedule="linear", horizon=200_000)
    distance = np.full(STEPS + 1, 0.2)
    paper, dynamic = (shaping_terms(distance, decay, form=form) for form in ("paper", "dynamic"))
    assert (dynamic - paper).sum() == pytest.approx(0.99 * 50 * 0.2 / 200_000)


@given(DISTANCES, POTENTIALS, ALPHAS)
def test_paper_form_is_weight_times_discounted_potential_difference_at_every_step(distance, name, alpha0):
    terms = shaping_terms(distance, VARIANTS[name], alpha0=alpha0, discount=0.9)
    for t in range(STEPS):
        expected = alpha0 * (0.9 * phi(name, distance[t + 1]) - phi(name, distance[t]))
        assert terms[t] == pytest.approx(expected, abs=1e-14)


@pytest.mark.parametrize(
    ("settings", "last"),
    [
        ({"episode_end": "terminal", "terminal_potential": "keep"}, 0.9 * -0.1 + 0.2),
        ({"episode_end": "terminal", "terminal_potential": "zero"}, 0.2),
        ({"episode_end": "bootstrap", "terminal_potential": "keep"}, 0.9 * -0.1 + 0.2),
        ({"episode_end": "bootstrap", "terminal_potential": "zero"}, 0.9 * -0.1 + 0.2),
    ],
)
def test_the_last_step_keeps_or_drops_the_potential_reached(settings, last):
    terms = shaping_terms([0.4, 0.2, 0.1], VARIANTS["l2"], discount=0.9, **settings)
    np.testing.assert_allclose(terms, [0.9 * -0.2 + 0.4, last])


@given(DISTANCES, POTENTIALS, ALPHAS)
def test_zero_terminal_potential_leaves_only_the_first_potential(distance, name, alpha0):
    """The condition of policy invariance without bootstrapping (Grzes 2017)."""
    terms = shaping_terms(distance, VARIANTS[name], alpha0=alpha0, terminal_potential="zero")
    assert discounted_sum(terms, 0.99) == pytest.approx(-alpha0 * phi(name, distance[0]), abs=1e-12 * alpha0)


def test_only_a_lanes_own_last_step_is_an_end():
    """Two lanes, the second cut after two of three steps."""
    distance = np.array([[[0.4, 0.3, 0.2, 0.1], [0.4, 0.3, 0.2, 9.0]]])
    episode_ends = np.array([[False, False, True], [False, True, False]])
    shaping = rule(VARIANTS["l2"], discount=1.0, terminal_potential="zero")
    terms = shaping.reward(distance, np.arange(6).reshape(2, 3), episode_ends, {})
    np.testing.assert_allclose(terms[0, 0], [0.1, 0.1, 0.2])
    np.testing.assert_allclose(terms[0, 1, :2], [0.1, 0.3])


def test_none_adds_exactly_nothing():
    assert not shaping_terms(np.linspace(0, 1, 51), VARIANTS["none"], alpha0=1.0).any()


@given(st.integers(1, 10**6), ALPHAS)
def test_linear_schedule_starts_at_alpha0_halves_halfway_and_ends_at_zero_for_good(horizon, alpha0):
    decay = Variant(name="d", potential="l2", schedule="linear", horizon=horizon)
    weights = alpha(decay, alpha0, [0, horizon / 2, horizon, horizon + 1, 10 * horizon])
    np.testing.assert_allclose(weights, [alpha0, alpha0 / 2, 0, 0, 0], atol=1e-15)
    line = alpha(decay, alpha0, np.linspace(0, 2 * horizon, 50))
    assert (np.diff(line) <= 0).all()
    assert (line >= 0).all()


@given(ALPHAS)
def test_constant_schedule_is_alpha0_for_ever(alpha0):
    assert alpha(VARIANTS["l2"], alpha0, [0, 1, 10**9]).tolist() == [alpha0] * 3


def advantages_two_ways(*, gae_lambda, episode_end, terminal_potential, alpha0=50.0, discount=0.97):
    """GAE of the shaped reward with V, and of the plain reward with V + alpha Phi: [S, L, T] each."""
    rng = np.random.default_rng(0)
    distance, values = rng.uniform(0, 0.4, (2, 3, 11)), rng.normal(0, 20, (2, 3, 11))
    reward = rng.normal(size=(2, 3, 10))
    episode_ends = np.array([[False] * 9 + [True]] * 2 + [[False] * 6 + [True] + [False] * 3])
    shaping = rule(
        VARIANTS["l2"], alpha0=alpha0, discount=discount, episode_end=episode_end, terminal_potential=terminal_potential
    )
    shaped = reward + shaping.reward(distance, np.arange(30).reshape(3, 10), episode_ends, {})
    settings = {"episode_ends": episode_ends, "discount": discount, "gae_lambda": gae_lambda}
    offset = values - alpha0 * distance
    ways = (
        gae(rewards, worth[..., :-1], next_values(worth, episode_ends, episode_end), **settings)
        for rewards, worth in ((shaped, values), (reward, offset))
    )
    taken = np.array([[True] * 10] * 2 + [[True] * 7 + [False] * 3])
    return [advantage[:, taken] for advantage in ways]


@pytest.mark.parametrize("gae_lambda", [0.0, 0.95, 1.0])
@pytest.mark.parametrize(("episode_end", "terminal_potential"), [("bootstrap", "keep"), ("terminal", "zero")])
def test_shaping_is_an_offset_of_the_critic(gae_lambda, episode_end, terminal_potential):
    """GAE(r + alpha (gamma Phi' - Phi), V) = GAE(r, V + alpha Phi) (Wiewiora 2003, for an actor-critic).

    So a potential acts until the critic has learned -alpha Phi.
    """
    shaped, offset = advantages_two_ways(
        gae_lambda=gae_lambda, episode_end=episode_end, terminal_potential=terminal_potential
    )
    np.testing.assert_allclose(shaped, offset, rtol=0, atol=1e-12)


def test_a_potential_kept_at_a_terminal_end_is_more_than_an_offset_of_the_critic():
    """Its last value is a reward by itself: what the settings refuse with a sparse reward."""
    shaped, offset = advantages_two_ways(gae_lambda=0.95, episode_end="terminal", terminal_potential="keep")
    assert np.abs(shaped - offset).max() > 1


def test_with_lambda_1_and_no_potential_at_the_end_shaping_is_a_baseline_of_the_state_alone():
    """The advantage of a step moves by -alpha Phi(s), whatever was done after it."""
    settings = {"gae_lambda": 1.0, "episode_end": "terminal", "terminal_potential": "zero"}
    shaped, _ = advantages_two_ways(**settings)
    plain, _ = advantages_two_ways(**settings, alpha0=1e-6)
    taken = np.array([[True] * 10] * 2 + [[True] * 7 + [False] * 3])
    distance = np.random.default_rng(0).uniform(0, 0.4, (2, 3, 11))[..., :-1][:, taken]
    np.testing.assert_allclose(shaped - plain, 50 * distance, atol=1e-5)


def test_heuristic_guided_learning_adds_a_guess_of_the_next_value_and_shortens_the_horizon():
    """r + (1 - l) gamma h(s') with the discount l gamma (Cheng et al. 2021, eq. 4): by hand at half of the decay."""
    decay = Variant(name="d", potential="l2", schedule="linear", horizon=100)
    shaping = rule(decay, alpha0=10.0, discount=0.9, form="hurl", mixing=0.2, episode_end="bootstrap")
    distance = np.array([[[0.4, 0.3, 0.1]]])
    terms = shaping.reward(distance, np.array([[50, 51]]), np.array([[False, True]]), {})
    np.testing.assert_allclose(terms[0, 0], [0.1 * 0.9 * 10 * -0.3, 0.1 * 0.9 * 10 * -0.1])
    assert [shaping.discount_at({}, steps) for steps in (0, 50, 100)] == pytest.approx([0.9 * 0.8, 0.9 * 0.9, 0.9])
    assert rule(decay, alpha0=10.0, discount=0.9).discount_at({}, 0) == 0.9
    assert not shaping.reward(distance, np.array([[100, 101]]), np.array([[False, True]]), {}).any()


def test_heuristic_guided_learning_is_temporal_difference_towards_the_guess_where_nothing_else_counts():
    """With l = 0 a step is judged by its reward and the guess of the state it leads to, and by nothing after it."""
    shaping = rule(VARIANTS["l2"], alpha0=5.0, discount=0.9, form="hurl", mixing=1.0, episode_end="bootstrap")
    distance, values = np.random.default_rng(0).uniform(0, 1, (2, 1, 1, 4))
    reward, episode_ends = np.zeros((1, 1, 3)), np.array([[False, False, True]])
    shaped = reward + shaping.reward(distance, np.arange(3)[None], episode_ends, {})
    advantages = gae(
        shaped, values[..., :-1], values[..., 1:], episode_ends, discount=shaping.discount_at({}, 0), gae_lambda=0.95
    )
    np.testing.assert_allclose(advantages, 0.9 * 5 * -distance[..., 1:] - values[..., :-1])


def test_one_discount_for_all_runs_is_refused_with_a_weight_for_each():
    with pytest.raises(ValueError, match=r"form = 'hurl'.*schedule = 'success'"):
        rule(VARIANTS["success"], form="hurl")


KNOTS = [0.0, 0.01, 0.02, 0.04, 0.08, 0.16, 0.32, 0.64]


@given(arrays(np.float64, 8, elements=st.floats(-10, 10)), arrays(np.float64, 20, elements=st.floats(0, 1)))
def test_a_learned_potential_is_a_line_between_its_knots_and_constant_beyond(values, distance):
    phi = learned.value({"knots": values[None]}, distance[None])[0]
    np.testing.assert_allclose(phi, np.interp(distance, KNOTS, values), atol=1e-12)


def test_a_learned_potential_moves_by_the_mean_temporal_difference_near_each_knot():
    """A loop over two steps of one seed by hand; the other seed, whose numbers are no numbers, changes nothing."""
    before, after, reward = [0.01, 0.06], [0.06, 0.0], [1.0, 2.0]
    phi = dict(zip(KNOTS, range(8), strict=True)) | {0.06: 3.5}
    first, second = (r + 0.9 * phi[b] - phi[a] for a, b, r in zip(before, after, reward, strict=True))
    expected = np.arange(8.0)
    expected[1] += 0.3 * first
    expected[3] += 0.3 * second
    expected[4] += 0.3 * second
    steps = Transitions(
        *(np.array([row, [np.nan, 0.1]]) for row in (before, after, reward)),
        discount=0.9,
    )
    state = learned.update(VARIANTS["learned"], {"knots": np.tile(np.arange(8.0), (2, 1))}, steps)
    np.testing.assert_allclose(state["knots"][0], expected, rtol=1e-14)


def test_a_learned_potential_becomes_the_value_of_a_task_that_the_distance_tells_whole():
    """A walk over the knots towards the goal, where a reward of 1 is had for ever: gamma^k / (1 - gamma) at k steps."""
    knots = np.array(KNOTS)
    steps = Transitions(knots[None], np.array([[KNOTS[0], *KNOTS[:-1]]]), (knots == 0)[None].astype(float), 0.9)
    state = learned.start(1)
    assert not state["knots"].any()
    for _ in range(1000):
        state = learned.update(VARIANTS["learned"], state, steps)
    np.testing.assert_allclose(state["knots"][0], 0.9 ** np.arange(8) * 10, rtol=1e-6)


def test_a_learned_potential_shapes_as_one_that_is_given():
    """With the knots on a line through 0 it is a multiple of the distance."""
    distance = np.random.default_rng(0).uniform(0, 0.6, (1, 2, 5))
    episode_ends = np.array([[False] * 3 + [True]] * 2)
    given_one, learned_one = (rule(VARIANTS[name], alpha0=5.0, terminal_potential="zero") for name in ("l2", "learned"))
    steps = np.arange(8).reshape(2, 4)
    terms = learned_one.reward(distance, steps, episode_ends, {"knots": -np.array([KNOTS])})
    np.testing.assert_allclose(terms, given_one.reward(distance, steps, episode_ends, {}), atol=1e-14)
    assert learned_one.learns
    assert not given_one.learns
