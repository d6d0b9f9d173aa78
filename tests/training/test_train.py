"""Training many seeds on lanes is the plain loop, seed by seed, and learns."""

import copy
import math

import numpy as np
import pandas as pd
import plain_loop
import pytest
import torch
from cells import cell, small

from reacher_shaping.training.train import train

RADIUS = 0.02
SPARSE = {"reward": "sparse", "success_radius": 0.15, "control_weight": 0.1}


def trained(of, seeds, state=None, iterations=None):
    """The state after all, or the first `iterations`, iterations."""
    for found in train(of, seeds, radius=RADIUS, state=state):
        if found.iteration == iterations:
            break
    return found


def moved(network, of, seed):
    """The largest change of any weight since the start."""
    start = plain_loop.initial_network(of, seed).state_dict()
    return max((tensor - start[name]).abs().max().item() for name, tensor in network.state_dict().items())


def weight_error(state, of, seed, network):
    weights = state.policy().weights()
    row = state.seeds.index(seed)
    return max((weights[name][row] - tensor).abs().max().item() for name, tensor in network.state_dict().items())


@pytest.mark.parametrize(
    "of",
    [
        small("none"),
        small("l2", alpha0=0.5),
        small("l2sq"),
        small("decay", alpha0=50.0, rollout_steps=1536, minibatch_size=256, epochs=1),
        small("l2", alpha0=10.0, shaping={"form": "dynamic"}),
        small("decay", alpha0=50.0, shaping={"form": "dynamic"}),
        small("l2", alpha0=10.0, shaping={"terminal_potential": "zero"}),
        small("l2", alpha0=10.0, shaping={"episode_end": "bootstrap"}),
        small("none", environment={"clip_actions": True, "control_weight": 1.0}, entropy_coefficient=0.0),
        small("none", gae_lambda=0.5, discount=0.9, clip_range=0.01, max_gradient_norm=0.05, hidden_units=16),
        small("l2", environment={"control_weight": 1.0}, ratio_pairs="minibatch", gae_lambda=0.0),
        small("decay", alpha0=0.5, shaping={"decay_potential": "l2sq", "start_weight": "one"}),
        small("none", networks="separate", initial_log_std=-1.0, learning_rate_schedule="linear"),
        small("l2", networks="separate", initialisation="orthogonal", advantage_normalisation="minibatch"),
        small("none", initialisation="orthogonal", hidden_units=16),
        small("l2", alpha0=50.0, environment=SPARSE, shaping={"episode_end": "bootstrap"}, rollout_steps=1536),
        small("exponential", alpha0=50.0, environment=SPARSE, shaping={"terminal_potential": "zero"}),
        small("cosine", alpha0=50.0),
    ],
    ids=[
        "none",
        "l2",
        "l2sq",
        "decay",
        "dynamic",
        "dynamic_decay",
        "zero_potential",
        "bootstrap",
        "clip_actions",
        "ppo",
        "released",
        "released_decay",
        "separate",
        "standard",
        "orthogonal",
        "sparse",
        "exponential",
        "cosine",
    ],
)
def test_three_iterations_equal_the_plain_loop(of):
    """Float32 sums in another order, carried on by the arm and by Adam: far below what training changes.

    Two seeds in the engine, one of them by the plain loop.
    """
    radius = of.protocol.environment.radius(RADIUS)
    for state, (network, recording) in zip(train(of, [4, 1], radius=radius), plain_loop.train(of, 1), strict=True):
        error = weight_error(state, of, 1, network)
        assert error < 2e-5
        assert error < 0.01 * moved(network, of, 1)
        episodes = len(recording.reward) // 50
        expected = recording.reward[: 50 * episodes].reshape(episodes, 50).sum(axis=1)
        np.testing.assert_allclose(state.episode_returns[1, state.iteration - 1], expected, rtol=1e-4, atol=1e-4)


def test_an_iteration_of_the_papers_size_equals_the_plain_loop():
    """2048 steps, 320 minibatches: the 48-step episode and the value at its end included."""
    of = cell("l2", iterations=1)
    network, recording = next(plain_loop.train(of, 1))
    state = trained(of, [0, 1])
    assert weight_error(state, of, 1, network) < 5e-6
    assert moved(network, of, 1) > 0.05
    assert recording.end[2047]
    assert not recording.end[2046]
    progress = state.progress_frame().query("seed == 1").iloc[0]
    whole = recording.reward[:2000].reshape(40, 50).sum(axis=1)
    shaped = plain_loop.shaped_rewards(recording, of, 0)
    targets = plain_loop.advantages(recording, shaped, of) + recording.value
    distance = recording.next_distance[:2000].reshape(40, 50)
    expected = {
        "iteration": 1,
        "env_steps": 2048,
        "episode_return": whole.mean(),
        "shaped_return": shaped[:2000].reshape(40, 50).sum(axis=1).mean(),
        "episode_length": 50,
        "success_rate": (distance.min(axis=1) <= RADIUS).mean(),
        "final_distance": distance[:, -1].mean(),
        "action_std": network.log_std.exp().mean().item(),
        "entropy": torch.distributions.Normal(0, network.log_std.exp()).entropy().sum().item(),
        "explained_variance": 1 - np.var(targets - recording.value) / np.var(targets),
    }
    for name, value in expected.items():
        assert progress[name] == pytest.approx(value, rel=2e-4), name
    assert progress["shaped_return"] != pytest.approx(progress["episode_return"], rel=1e-3)


@pytest.mark.parametrize("steps", [192, 2048], ids=["first_episode_shown", "papers_size"])
def test_the_released_log_equals_a_running_sum_over_the_plain_loop(steps):
    """Of 3 episodes the first, with 42 steps left over from the rollout before, is among the last ten; of 40 not."""
    of = small("l2", alpha0=5.0, iterations=3, rollout_steps=steps, log={"episode_return": "released"}, epochs=1)
    recordings = []
    for state, (_, recording) in zip(train(of, [1], radius=RADIUS), plain_loop.train(of, 1), strict=True):
        recordings.append(recording)
        found = state.progress["logged_return"][0, state.iteration - 1]
        assert found == pytest.approx(plain_loop.released_log(of, recordings), rel=1e-5)
        shown = abs(found / state.progress["shaped_return"][0, state.iteration - 1] - 1)
        assert (shown > 0.05) == (steps == 192 and state.iteration > 1)


def test_the_log_of_the_paper_is_the_unshaped_return():
    progress = trained(small("l2"), [1]).progress
    np.testing.assert_array_equal(progress["logged_return"], progress["episode_return"])


@pytest.fixture(scope="module")
def alone():
    """Seed 3 trained by itself."""
    return trained(cell("decay", iterations=2, epochs=2), [3])


@pytest.mark.parametrize("block", [[9, 3, 4], [*range(10)]], ids=["block_of_3", "block_of_10"])
def test_a_seed_trains_the_same_bits_in_every_block(alone, block):
    of = cell("decay", iterations=2, epochs=2)
    state = trained(of, block)
    row = block.index(3)
    assert torch.equal(state.rows[row], alone.rows[0])
    assert torch.equal(state.adam.second[row], alone.adam.second[0])
    for ours, expected in (
        (state.progress_frame(), alone.progress_frame()),
        (state.episodes_frame(), alone.episodes_frame()),
    ):
        ours = ours[ours["seed"] == 3].reset_index(drop=True)
        pd.testing.assert_frame_equal(ours, expected, check_exact=True)


def test_the_same_training_twice_gives_the_same_bits(alone):
    again = trained(cell("decay", iterations=2, epochs=2), [3])
    assert torch.equal(again.rows, alone.rows)
    pd.testing.assert_frame_equal(again.progress_frame(), alone.progress_frame(), check_exact=True)


def test_going_on_from_a_state_equals_an_uninterrupted_run():
    of = small("decay", iterations=5)
    whole = trained(of, [0, 1])
    for stop in (1, 4):
        kept = copy.deepcopy(trained(of, [0, 1], iterations=stop))
        assert kept.iteration == stop
        resumed = trained(of, [0, 1], state=kept)
        assert resumed.iteration == 5
        assert torch.equal(resumed.rows, whole.rows)
        assert torch.equal(resumed.adam.first, whole.adam.first)
        assert resumed.adam.steps == whole.adam.steps
        pd.testing.assert_frame_equal(resumed.progress_frame(), whole.progress_frame(), check_exact=True)
        pd.testing.assert_frame_equal(resumed.episodes_frame(), whole.episodes_frame(), check_exact=True)


def test_a_longer_budget_starts_with_the_shorter_one():
    short, long = (trained(small("decay", iterations=n), [0], iterations=2) for n in (2, 4))
    assert torch.equal(short.rows, long.rows)


def test_seeds_and_roots_give_different_runs_and_variants_share_their_first_rollout():
    rows = [trained(small(root_seed=root), [seed], iterations=1).rows for root, seed in ((7, 0), (7, 1), (8, 0))]
    assert not torch.equal(rows[0], rows[1])
    assert not torch.equal(rows[0], rows[2])
    none, l2 = (trained(small(variant), [0], iterations=1) for variant in ("none", "l2"))
    np.testing.assert_array_equal(none.episode_returns[:, 0], l2.episode_returns[:, 0])
    assert not torch.equal(none.rows, l2.rows)


def test_a_diverged_seed_is_named_and_changes_nothing_in_the_others():
    of = small("l2", iterations=4)
    clean = trained(of, [5, 6, 7])
    assert clean.diverged() == []
    state = copy.deepcopy(trained(of, [5, 6, 7], iterations=1))
    state.rows[1, 17] = math.nan
    state = trained(of, [5, 6, 7], state=state)
    assert state.diverged() == [6]
    assert torch.equal(state.rows[[0, 2]], clean.rows[[0, 2]])
    others = [frame[frame["seed"] != 6] for frame in (state.progress_frame(), clean.progress_frame())]
    pd.testing.assert_frame_equal(*others, check_exact=True)
    assert np.isfinite(others[0].to_numpy()).all()


def test_frames_have_a_row_per_seed_and_iteration_and_per_training_episode():
    state = trained(small("none", iterations=3), [8, 2])
    progress, episodes = state.progress_frame(), state.episodes_frame()
    assert progress["seed"].tolist() == [8, 8, 8, 2, 2, 2]
    assert progress["iteration"].tolist() == [1, 2, 3] * 2
    assert progress["env_steps"].tolist() == [192, 384, 576] * 2
    assert np.isfinite(progress.to_numpy()).all()
    assert len(episodes) == 2 * 3 * 3
    assert episodes["env_steps"].tolist()[:5] == [50, 100, 150, 242, 292]
    means = episodes.groupby(["seed", "iteration"], sort=False)["episode_return"].mean()
    np.testing.assert_allclose(means.to_numpy(), progress["episode_return"].to_numpy(), rtol=1e-12)


def test_the_returns_of_every_seed_rise_far_beyond_their_noise():
    of = cell("none", iterations=20, rollout_steps=1024, minibatch_size=128, learning_rate=1e-3)
    state = trained(of, [0, 1])
    returns = state.episode_returns  # [S, iterations, episodes]
    first, last = returns[:, :3].reshape(2, -1), returns[:, -3:].reshape(2, -1)
    noise = np.sqrt((first.var(axis=1) + last.var(axis=1)) / first.shape[1])
    gain = last.mean(axis=1) - first.mean(axis=1)
    assert (gain > 3).all()
    assert (gain > 5 * noise).all()
