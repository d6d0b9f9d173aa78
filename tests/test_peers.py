"""Other algorithms on the same task: settings handed over, and evaluation against stepping Gymnasium itself."""

import gymnasium
import numpy as np
import pytest
from cells import cell

from reacher_shaping import artifacts, peers
from reacher_shaping.config import Evaluation
from reacher_shaping.streams import Purpose, stream

EVALUATION = Evaluation(episodes=4, radius=0.05)


def test_ppo_gets_the_protocols_hyperparameters():
    protocol = cell("none", learning_rate=1e-3, minibatch_size=32, rollout_steps=192).protocol
    model = peers.train("ppo", 3, 192, protocol)
    assert (model.learning_rate, model.batch_size, model.n_steps, model.n_epochs) == (
        1e-3,
        32,
        192,
        protocol.ppo.epochs,
    )
    assert (model.gamma, model.gae_lambda, model.ent_coef, model.vf_coef) == (0.99, 0.95, 0.01, 0.5)
    assert model.clip_range(1.0) == 0.2
    assert model.num_timesteps == 192


def test_deterministic_evaluation_equals_stepping_gymnasium():
    protocol = cell("none").protocol
    run = peers.peer_run("td3", 5, 120, protocol, EVALUATION, root_seed=11).iloc[0]
    model = peers.train("td3", 5, 120, protocol)
    env = gymnasium.make("Reacher-v5", reward_control_weight=protocol.environment.control_weight)
    env.reset()
    env.unwrapped.np_random = stream(11, Purpose.EVALUATION_RESETS)
    returns, hits = [], []
    for _ in range(EVALUATION.episodes):
        state, truncated = env.reset()[0], False
        rewards, distances = [], []
        while not truncated:
            state, reward, _, truncated, info = env.step(model.predict(state, deterministic=True)[0])
            rewards.append(reward)
            distances.append(-info["reward_dist"])
        returns.append(sum(rewards))
        hits.append(min(distances) <= EVALUATION.radius)
    assert run["deterministic_mean_return"] == pytest.approx(np.mean(returns), rel=1e-5)
    assert run["deterministic_success_rate"] == np.mean(hits)
    assert (run["algorithm"], run["seed"], run["budget"]) == ("td3", 5, 120)


def test_runs_fit_their_table(tmp_path):
    run = peers.peer_run("sac", 0, 110, cell("none").protocol, EVALUATION, root_seed=0)
    artifacts.write_table(tmp_path / "peers.parquet", run, artifacts.PEERS)
    assert artifacts.read_table(tmp_path / "peers.parquet", artifacts.PEERS).equals(run)
