"""A stack of networks computes what torch.nn computes, seed by seed."""

import math

import gymnasium
import numpy as np
import pytest
import stable_baselines3
import torch
from cells import fresh_policy
from plain_loop import Network

from reacher_shaping.settings.cell import PPO
from reacher_shaping.tasks.reacher import TASK
from reacher_shaping.training.network import ALIGNMENT, parameter_count
from reacher_shaping.training.policy import Policy, inputs

SEEDS = [0, 1, 5]


@pytest.fixture
def policy():
    policy = fresh_policy(SEEDS, 3)
    policy.layers.log_std.uniform_(-1, 0, generator=torch.Generator().manual_seed(0))
    return policy


def networks(policy):
    weights = policy.weights()
    for seed in range(len(policy)):
        network = Network(policy.shape.hidden)
        network.load_state_dict({name: tensor[seed] for name, tensor in weights.items()})
        yield network


def test_actions_and_values_are_those_of_torch_linear_layers_with_the_same_weights(policy):
    rng = np.random.default_rng(0)
    observation = rng.normal(size=(3, 41, 10))
    noise = rng.standard_normal((3, 41, 2), dtype=np.float32)
    mean, sampled = policy.act(observation, None), policy.act(observation, noise)
    value = policy.passes().forward(inputs(observation))[:, 2]
    for seed, network in enumerate(networks(policy)):
        distribution, expected_value = network(torch.from_numpy(observation[seed]).float())
        expected = distribution.mean.detach().numpy()
        # The same sums in another order, in float32.
        np.testing.assert_allclose(mean[seed], expected, atol=1e-6)
        std = distribution.stddev.detach().numpy()
        np.testing.assert_allclose(sampled[seed], expected + std * noise[seed], atol=1e-6)
        np.testing.assert_allclose(value[seed], expected_value.detach().numpy(), atol=1e-6)
    assert sampled.dtype == np.float32


@pytest.mark.parametrize("lanes", [1, 20, 41])
def test_actions_of_a_seed_do_not_depend_on_the_others(policy, lanes):
    rng = np.random.default_rng(1)
    observation, noise = rng.normal(size=(3, lanes, 10)), rng.standard_normal((3, lanes, 2), dtype=np.float32)
    together = policy.act(observation, noise)
    for seed in range(3):
        alone = Policy(policy.parameters[seed : seed + 1].clone(), policy.shape)
        np.testing.assert_array_equal(alone.act(observation[[seed]], noise[[seed]])[0], together[seed])


def test_initial_weights_are_uniform_in_the_range_of_torch_linear_and_log_std_is_zero():
    weights = fresh_policy(range(20)).weights()
    for name, tensor in weights.items():
        if name == "log_std":
            assert not tensor.any()
            continue
        bound = 1 / math.sqrt(10 if name.startswith("shared.0") else 64)
        assert tensor.abs().max() <= bound
        assert tensor.abs().max() > 0.9 * bound
        deviation = bound / math.sqrt(3)
        assert tensor.std() == pytest.approx(deviation, rel=0.15)
        assert abs(tensor.mean()) < 6 * deviation / math.sqrt(tensor.numel())
    # torch.nn.Linear draws from the same ranges
    torch_weights = dict(Network().named_parameters())
    assert {name: tensor.shape[1:] for name, tensor in weights.items()} == {
        name: tensor.shape for name, tensor in torch_weights.items()
    }


def test_initial_weights_depend_on_seed_and_root_alone():
    parameters = fresh_policy(SEEDS, 3).parameters
    assert torch.equal(fresh_policy([5, 0], 3).parameters, parameters[[2, 0]])
    assert not torch.equal(fresh_policy([5], 4).parameters[0], parameters[2])
    assert not torch.equal(parameters[0], parameters[1])


@pytest.mark.parametrize("networks", ["shared", "separate"])
@pytest.mark.parametrize("hidden", [64, 7])
def test_weights_round_trip_bit_for_bit(hidden, networks):
    settings = PPO(hidden_units=hidden, networks=networks, initial_log_std=-0.25)
    policy = fresh_policy(SEEDS, 3, settings)
    assert torch.equal(policy.layers.log_std, torch.full((len(SEEDS), 2, 1), -0.25))
    copy = Policy.from_weights(policy.weights(), TASK)
    assert torch.equal(copy.parameters, policy.parameters)
    assert copy.shape == policy.shape == (10, 2, hidden, settings.towers)
    assert policy.parameters.shape[1] == parameter_count(policy.shape)
    assert parameter_count(policy.shape) % ALIGNMENT == 0


def test_a_network_of_two_trunks_is_that_of_torch():
    settings = PPO(hidden_units=16, networks="separate", initial_log_std=-0.5)
    policy = fresh_policy(SEEDS, 3, settings)
    observation = np.random.default_rng(3).normal(size=(3, 9, 10))
    outputs = torch.from_numpy(policy.passes().forward(inputs(observation)))
    for seed in range(3):
        network = Network(16, separate=True)
        network.load_state_dict({name: tensor[seed] for name, tensor in policy.weights().items()})
        distribution, value = network(torch.from_numpy(observation[seed]).float())
        torch.testing.assert_close(outputs[seed, :2].T, distribution.mean.detach())
        torch.testing.assert_close(outputs[seed, 2], value.detach())
        assert torch.equal(distribution.stddev, torch.full((9, 2), math.exp(-0.5)))


def test_orthogonal_weights_are_orthogonal_with_stable_baselines3s_gains():
    model = stable_baselines3.PPO("MlpPolicy", gymnasium.make("Reacher-v5"), seed=1, device="cpu").policy
    theirs = {
        "policy_trunk.0": model.mlp_extractor.policy_net[0], "policy_trunk.2": model.mlp_extractor.policy_net[2],
        "value_trunk.0": model.mlp_extractor.value_net[0], "value_trunk.2": model.mlp_extractor.value_net[2],
        "policy_mean": model.action_net, "value": model.value_net,
    }  # fmt: skip
    settings = PPO(networks="separate", initialisation="orthogonal")
    weights = fresh_policy([1], 3, settings).weights()
    for name, layer in theirs.items():
        ours, expected = weights[f"{name}.weight"][0], layer.weight.detach()
        for matrix in (ours, expected):  # of the smaller side's size: the gain squared times the identity
            product = matrix @ matrix.T if len(matrix) <= matrix.shape[1] else matrix.T @ matrix
            gain = float(expected.norm() ** 2 / min(expected.shape))
            torch.testing.assert_close(product, gain * torch.eye(len(product)), atol=1e-5, rtol=1e-4)
        assert not weights[f"{name}.bias"].any()


def test_weights_are_copies(policy):
    weights = policy.weights()
    before = policy.parameters.clone()
    for tensor in weights.values():
        tensor.fill_(9.0)
    assert torch.equal(policy.parameters, before)


def test_a_state_dict_in_the_layout_of_the_release_becomes_a_policy_of_one_seed():
    network = Network(32)
    policy = Policy.from_weights({name: tensor.detach()[None] for name, tensor in network.state_dict().items()}, TASK)
    observation = np.random.default_rng(2).normal(size=(1, 6, 10))
    expected = network(torch.from_numpy(observation[0]).float())[0].mean.detach().numpy()
    np.testing.assert_allclose(policy.act(observation, None)[0], expected, atol=1e-6)


def without(name):
    return lambda weights: weights.pop(name)


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (without("value.bias"), "value.bias is missing"),
        (without("shared.0.weight"), "shared.0.weight is missing"),
        (lambda w: w.update({"extra": torch.zeros(3)}), "extra is no tensor"),
        (lambda w: w.update({"log_std": torch.zeros(3, 3)}), r"log_std has shape \[3, 3\]"),
        (lambda w: w.update({"log_std": torch.zeros(3, 2, dtype=torch.int64)}), "int64"),
        (lambda w: w.update({"shared.0.weight": torch.zeros(3, 64, 11)}), "shared.0.weight has shape"),
    ],
)
def test_foreign_weights_are_refused_naming_the_tensor(policy, spoil, message):
    weights = policy.weights()
    spoil(weights)
    with pytest.raises(ValueError, match=message):
        Policy.from_weights(weights, TASK)


def test_padding_of_the_rows_is_never_read(policy):
    observation = np.random.default_rng(3).normal(size=(3, 4, 10))
    before = policy.act(observation, None)
    used = sum(math.prod(layer.shape[1:]) for layer in policy.layers)
    assert used < policy.parameters.shape[1]
    policy.parameters[:, used:] = math.nan
    np.testing.assert_array_equal(policy.act(observation, None), before)
