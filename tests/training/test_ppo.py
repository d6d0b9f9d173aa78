"""The written-out gradient and its update are those of autograd, torch and Stable-Baselines3."""

import math

import gymnasium
import numpy as np
import pytest
import stable_baselines3
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from plain_loop import Network, loss
from stable_baselines3.common.distributions import DiagGaussianDistribution
from stable_baselines3.common.logger import Logger
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor

from reacher_shaping.settings.cell import PPO
from reacher_shaping.tasks.reacher import TASK
from reacher_shaping.training import ppo
from reacher_shaping.training.network import Shape, parameter_count
from reacher_shaping.training.policy import Policy, initialise

HIDDEN = 8


def network_of(parameters, seed, hidden):
    """One seed of a stack as a torch.nn.Module of the same precision."""
    towers = parameters.shape[1] // parameter_count(Shape(10, 2, hidden))
    network, policy = (
        Network(hidden, separate=towers == 2).to(parameters.dtype),
        Policy(parameters, Shape(10, 2, hidden, towers)),
    )
    network.load_state_dict({name: tensor[seed] for name, tensor in policy.weights().items()})
    return network


def random_problem(key, *, seeds=3, count=64, hidden=HIDDEN, dtype=torch.float64, spread=0.3, networks="shared"):
    """Parameters [S, P] and records [S, N, 16]; `spread` moves the ratios out of the clip range."""
    generator = torch.Generator().manual_seed(key)

    def normal(*shape):
        return torch.randn(*shape, generator=generator, dtype=torch.float64)

    options = PPO(hidden_units=hidden, networks=networks)
    shape = Shape(10, 2, hidden, options.towers)
    parameters = initialise(range(seeds), key, options, shape).double()
    policy = Policy(parameters, shape)
    policy.layers.log_std[:] = 0.5 * normal(seeds, 2, 1) - 0.5
    features = torch.cat([normal(seeds, count, 10), torch.ones(seeds, count, 1, dtype=torch.float64)], dim=-1)
    action, log_prob = normal(seeds, count, 2), torch.empty(seeds, count, dtype=torch.float64)
    for seed in range(seeds):
        with torch.no_grad():
            distribution, _ = network_of(parameters, seed, hidden)(features[seed, :, :10])
            log_prob[seed] = distribution.log_prob(action[seed]).sum(-1)
    log_prob += spread * normal(seeds, count)
    fields = (features, action, log_prob, normal(seeds, count), 3 * normal(seeds, count))
    return parameters.to(dtype), ppo.pack(*(field.to(dtype).numpy() for field in fields))


def minibatch(samples, seed):
    """The arguments of the plain loss: observation, action, log_prob, advantage, target."""
    fields = samples.features[seed, :, :10], samples.action[seed].T, *(field[seed] for field in samples[2:])
    return tuple(torch.from_numpy(np.ascontiguousarray(field)) for field in fields)


@settings(max_examples=40)
@given(
    key=st.integers(0, 2**31),
    spread=st.sampled_from([0.0, 0.1, 0.5, 3.0]),
    clip=st.floats(0.01, 0.9),
    value=st.floats(0, 2),
    bonus=st.floats(0, 0.5),
    pairs=st.sampled_from(["sample", "minibatch"]),
    networks=st.sampled_from(["shared", "separate"]),
)
def test_gradient_agrees_with_autograd_to_one_in_a_billion(key, spread, clip, value, bonus, pairs, networks):
    options = PPO(
        hidden_units=HIDDEN,
        clip_range=clip,
        ratio_pairs=pairs,
        value_coefficient=value,
        entropy_coefficient=bonus,
        networks=networks,
    )
    parameters, records = random_problem(key, spread=spread, networks=networks)
    samples = ppo.unpack(records, 2)
    learner = ppo.Learner(parameters, options, Shape.of(TASK, options))
    learner.differentiate(samples)
    ours = Policy(learner.gradient, Shape.of(TASK, options)).weights()
    owned = Policy.from_weights(ours, TASK).parameters  # what the weights do not name is zero in it
    assert torch.equal(learner.gradient.float(), owned)
    for seed in range(len(parameters)):
        network = network_of(parameters, seed, HIDDEN)
        loss(network, options, *minibatch(samples, seed)).backward()
        for name, parameter in network.named_parameters():
            scale = max(parameter.grad.abs().max().item(), 1e-12)
            torch.testing.assert_close(ours[name][seed], parameter.grad, rtol=1e-9, atol=1e-9 * scale)


class Trunk(BaseFeaturesExtractor):
    """The trunk that policy and value share, in Stable-Baselines3's terms."""

    def __init__(self, space):
        super().__init__(space, 64)
        self.layers = Network().shared

    def forward(self, observation):
        return self.layers(observation)


def stable_ppo(samples, seed, network, options):
    """Stable-Baselines3's PPO holding one minibatch and the same weights; a step of SGD at rate 1 is its gradient."""
    model = stable_baselines3.PPO(
        "MlpPolicy",
        gymnasium.make("Reacher-v5"),
        learning_rate=1.0,
        n_steps=options.minibatch_size,
        batch_size=options.minibatch_size,
        n_epochs=1,
        clip_range=options.clip_range,
        ent_coef=options.entropy_coefficient,
        vf_coef=options.value_coefficient,
        max_grad_norm=1e9,
        normalize_advantage=False,
        device="cpu",
        policy_kwargs={
            "net_arch": [], "features_extractor_class": Trunk, "ortho_init": False,
            "optimizer_class": torch.optim.SGD, "optimizer_kwargs": {},
        },
    )  # fmt: skip
    model.set_logger(Logger(None, []))
    policy = model.policy
    policy.features_extractor.layers.load_state_dict(network.shared.state_dict())
    policy.action_net.load_state_dict(network.policy_mean.state_dict())
    policy.value_net.load_state_dict(network.value.state_dict())
    policy.log_std.data[:] = network.log_std
    buffer = model.rollout_buffer
    observation, action, log_prob, advantage, target = (field.numpy() for field in minibatch(samples, seed))
    buffer.observations[:, 0], buffer.actions[:, 0], buffer.log_probs[:, 0] = observation, action, log_prob
    buffer.advantages[:, 0], buffer.returns[:, 0], buffer.full = advantage, target, True
    return model


def test_gradient_agrees_with_stable_baselines3s_ppo_on_the_same_minibatch():
    options = PPO()
    parameters, records = random_problem(11, hidden=64, seeds=2, dtype=torch.float32)
    samples = ppo.unpack(records, 2)
    learner = ppo.Learner(parameters, options, Shape.of(TASK, options))
    learner.differentiate(samples)
    ours = Policy(learner.gradient, Shape.of(TASK, options)).weights()
    for seed in range(2):
        network = network_of(parameters, seed, 64)
        model = stable_ppo(samples, seed, network, options)
        model.train()
        after = model.policy
        moved = {
            "shared.0.weight": after.features_extractor.layers[0].weight,
            "shared.0.bias": after.features_extractor.layers[0].bias,
            "shared.2.weight": after.features_extractor.layers[2].weight,
            "shared.2.bias": after.features_extractor.layers[2].bias,
            "policy_mean.weight": after.action_net.weight,
            "policy_mean.bias": after.action_net.bias,
            "value.weight": after.value_net.weight,
            "value.bias": after.value_net.bias,
            "log_std": after.log_std,
        }
        for name, before in network.named_parameters():
            gradient = (before - moved[name]).detach()
            # float32, and the difference of two weights of size one loses its last digits.
            torch.testing.assert_close(ours[name][seed], gradient, rtol=1e-4, atol=1e-6)
        assert model.logger.name_to_value["train/clip_fraction"] > 0.1, "the clip must bind somewhere"


def test_log_probability_and_entropy_are_stable_baselines3s():
    generator = torch.Generator().manual_seed(0)
    mean, action = torch.randn(2, 3, 50, 2, generator=generator, dtype=torch.float64)
    log_std = torch.randn(3, 2, generator=generator, dtype=torch.float64)
    deviation = ((action - mean) / log_std.exp()[:, None]).transpose(1, 2)
    ours = torch.from_numpy(ppo.log_probability(deviation.numpy(), log_std[..., None].numpy()))
    for seed in range(3):
        distribution = DiagGaussianDistribution(2).proba_distribution(mean[seed], log_std[seed])
        torch.testing.assert_close(ours[seed], distribution.log_prob(action[seed]), rtol=1e-12, atol=1e-12)
        expected = distribution.entropy()[0]
        assert ppo.entropy(log_std[..., None].numpy())[seed] == pytest.approx(expected.item(), rel=1e-12)


def test_adam_is_torchs():
    generator = torch.Generator().manual_seed(1)
    start = torch.randn(3, 16, generator=generator, dtype=torch.float64)
    ours, theirs = start.clone(), torch.nn.Parameter(start.clone())
    adam = ppo.Adam.zeros_like(ours)
    optimizer = torch.optim.Adam([theirs], lr=0.01, eps=1e-5)
    for step in range(300):
        gradient = torch.randn(3, 16, generator=generator, dtype=torch.float64) * 10.0 ** (step % 7 - 5)
        adam.step(ours, gradient, 0.01, 1e-5)
        theirs.grad = gradient.clone()
        optimizer.step()
    assert (ours - start).abs().max() > 0.1
    torch.testing.assert_close(ours, theirs.data, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_gradients_are_clipped_per_seed_as_torch_clips_one_network(scale):
    options = PPO(hidden_units=HIDDEN)
    parameters, records = random_problem(2)
    learner = ppo.Learner(parameters, options, Shape.of(TASK, options))
    learner.differentiate(ppo.unpack(records, 2))
    learner.gradient *= scale * torch.tensor([[1.0], [10.0], [100.0]])
    before = Policy(learner.gradient.clone(), Shape.of(TASK, options)).weights()
    learner._clip()
    after = Policy(learner.gradient, Shape.of(TASK, options)).weights()
    for seed in range(3):
        network = Network(HIDDEN).double()
        for name, parameter in network.named_parameters():
            parameter.grad = before[name][seed].clone()
        torch.nn.utils.clip_grad_norm_(network.parameters(), options.max_gradient_norm)
        for name, parameter in network.named_parameters():
            torch.testing.assert_close(after[name][seed], parameter.grad, rtol=1e-12, atol=1e-15)


def test_update_is_epochs_of_minibatches_of_torchs_own_steps_in_the_shuffled_order():
    options = PPO(hidden_units=HIDDEN, rollout_steps=96, minibatch_size=32, learning_rate=0.01)
    parameters, records = random_problem(3, count=96)
    shuffles = np.stack([[np.random.default_rng(10 * s + e).permutation(96) for e in range(3)] for s in range(3)])
    networks = [network_of(parameters, seed, HIDDEN) for seed in range(3)]
    learner = ppo.Learner(parameters, options, Shape.of(TASK, options))
    learner.update(records, shuffles, options.learning_rate)
    assert learner.adam.steps == 9
    ours = Policy(parameters, Shape.of(TASK, options)).weights()
    for seed, network in enumerate(networks):
        optimizer = torch.optim.Adam(network.parameters(), lr=0.01, eps=options.adam_epsilon)
        fields = minibatch(ppo.unpack(records, 2), seed)
        for epoch in range(3):
            for chosen in torch.from_numpy(shuffles[seed, epoch]).split(32):
                optimizer.zero_grad()
                loss(network, options, *(field[chosen] for field in fields)).backward()
                torch.nn.utils.clip_grad_norm_(network.parameters(), options.max_gradient_norm)
                optimizer.step()
        for name, parameter in network.named_parameters():
            torch.testing.assert_close(ours[name][seed], parameter.data, rtol=1e-8, atol=1e-10)


@pytest.mark.parametrize("poison", ["weights", "records"])
def test_a_seed_of_nans_changes_nothing_in_the_others(poison):
    options = PPO()
    parameters, records = random_problem(4, hidden=64, count=128, dtype=torch.float32)
    shuffles = np.random.default_rng(4).permuted(np.tile(np.arange(128), (3, 2, 1)), axis=2)
    clean = ppo.Learner(parameters.clone(), options, Shape.of(TASK, options))
    clean.update(records, shuffles, options.learning_rate)
    parameters, records = parameters.clone(), records.copy()
    (parameters if poison == "weights" else records)[1] = math.nan
    learner = ppo.Learner(parameters, options, Shape.of(TASK, options))
    learner.update(records, shuffles, options.learning_rate)
    assert torch.equal(learner.parameters[[0, 2]], clean.parameters[[0, 2]])
    assert not torch.isfinite(learner.parameters[1]).any()


def test_padding_of_the_rows_stays_zero():
    options = PPO()
    parameters, records = random_problem(5, hidden=64, dtype=torch.float32)
    learner = ppo.Learner(parameters, options, Shape.of(TASK, options))
    learner.update(records, np.tile(np.arange(64), (3, 5, 1)), options.learning_rate)
    used = sum(math.prod(layer.shape[1:]) for layer in learner.passes.layers)
    assert used < parameters.shape[1]
    assert not parameters[:, used:].any()


def test_diagnostics_are_those_stable_baselines3_logs():
    options = PPO()
    parameters, records = random_problem(6, hidden=64, seeds=2, dtype=torch.float32)
    samples = ppo.unpack(records, 2)
    found = ppo.diagnose(Policy(parameters, Shape.of(TASK, options)).passes(), records, options.clip_range)
    for seed in range(2):
        model = stable_ppo(samples, seed, network_of(parameters, seed, 64), options)
        model.train()
        logged = model.logger.name_to_value
        expected = {
            "policy_loss": logged["train/policy_gradient_loss"],
            "value_loss": logged["train/value_loss"],
            "approx_kl": logged["train/approx_kl"],
            "clip_fraction": logged["train/clip_fraction"],
            "entropy": -logged["train/entropy_loss"],
        }
        for name, value in expected.items():
            assert getattr(found, name)[seed].item() == pytest.approx(value, rel=1e-4, abs=1e-6), name


def test_records_keep_every_field():
    rng = np.random.default_rng(0)
    fields = [rng.standard_normal(shape, np.float32) for shape in ((2, 5, 11), (2, 5, 2), (2, 5), (2, 5), (2, 5))]
    samples = ppo.unpack(ppo.pack(*fields), 2)
    np.testing.assert_array_equal(samples.action, fields[1].swapaxes(1, 2))
    for ours, given_ in zip((samples.features, *samples[2:]), (fields[0], *fields[2:]), strict=True):
        np.testing.assert_array_equal(ours, given_)


def test_minibatches_are_normalised_as_stable_baselines3_does():
    advantage = np.array([[1.0, 2.0, 3.0], [5.0, -1.0, 8.0]])
    # stable_baselines3/ppo/ppo.py: (advantages - advantages.mean()) / (advantages.std() + 1e-8), with torch's std
    expected = [[-1.0, 0.0, 1.0], [1 / math.sqrt(21), -5 / math.sqrt(21), 4 / math.sqrt(21)]]
    np.testing.assert_allclose(ppo.normalise(advantage), expected, rtol=1e-7)
