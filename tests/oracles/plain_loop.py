"""The training of the study in its plainest form: the readable reference that the engine is held against.

One Gymnasium environment stepped 2048 times, one seed, one torch.nn network, autograd, torch.optim.Adam. Nothing of the
engine is used but its settings and its random streams, so that both meet the same resets, noise and shuffles. Slow.
"""

import math
from dataclasses import dataclass

import gymnasium
import numpy as np
import torch
from torch import nn
from torch.distributions import Normal

from reacher_shaping.random_streams import Purpose, stream


def trunk(hidden):
    """Two Tanh layers."""
    return nn.Sequential(nn.Linear(10, hidden), nn.Tanh(), nn.Linear(hidden, hidden), nn.Tanh())


class Network(nn.Module):
    """Policy and value on one trunk, or on one each; with one, parameter names are those of the released code."""

    def __init__(self, hidden=64, *, separate=False):
        super().__init__()
        self.log_std = nn.Parameter(torch.zeros(2))
        self.trunks = ["policy_trunk", "value_trunk"] if separate else ["shared"]
        for name in self.trunks:
            setattr(self, name, trunk(hidden))
        self.policy_mean = nn.Linear(hidden, 2)
        self.value = nn.Linear(hidden, 1)

    def forward(self, observation):
        """Return the action distribution [N, 2] and the values [N] of observations [N, 10]."""
        policy, value = getattr(self, self.trunks[0])(observation), getattr(self, self.trunks[-1])(observation)
        return Normal(self.policy_mean(policy), self.log_std.exp()), self.value(value).squeeze(-1)


@dataclass
class Recording:
    """A sequential rollout of N steps, T of them the last of an episode or of the rollout."""

    observation: np.ndarray  # [N, 10] before each step
    action: np.ndarray  # [N, 2]
    reward: np.ndarray  # [N] the environment's own
    distance: np.ndarray  # [N] before each step
    next_distance: np.ndarray  # [N] after each step
    value: np.ndarray  # [N]
    next_value: np.ndarray  # [N] value of the state after each step
    log_prob: np.ndarray  # [N]
    end: np.ndarray  # [N] bool


def make_environment(cell):
    """Gymnasium's own environment with the cell's control weight."""
    return gymnasium.make("Reacher-v5", reward_control_weight=cell.protocol.environment.control_weight)


def initial_network(cell, seed):
    """The first weights of a run, from the seed's stream, trunk by trunk with the heads on top of each."""
    settings = cell.protocol.ppo
    generator = stream(cell.root_seed, Purpose.INITIALISATION, seed)
    network = Network(settings.hidden_units, separate=settings.networks == "separate")
    draw = orthogonal if settings.initialisation == "orthogonal" else uniform
    heads = {"policy_mean": slice(2), "value": slice(2, 3)}
    for name in network.trunks:
        first, second, means_and_value = draw(generator, settings.hidden_units)
        for layer, (weight, bias) in ((getattr(network, name)[0], first), (getattr(network, name)[2], second)):
            layer.weight.data, layer.bias.data = weight, bias
        for head in {"policy_trunk": ["policy_mean"], "value_trunk": ["value"]}.get(name, heads):
            layer, (weight, bias) = getattr(network, head), means_and_value
            layer.weight.data, layer.bias.data = weight[heads[head]], bias[heads[head]]
    network.log_std.data.fill_(settings.initial_log_std)
    return network


def uniform(generator, hidden):
    """Weights and biases of three layers, uniform in +- 1 / sqrt(inputs): PyTorch's default."""

    def draw(inputs, *shape):
        return torch.from_numpy(generator.uniform(-(inputs**-0.5), inputs**-0.5, size=shape)).float()

    first = draw(10, 11, hidden)  # ten rows of weights, one of biases
    second, second_bias = draw(hidden, hidden, hidden), draw(hidden, hidden)
    heads, head_biases = draw(hidden, 3, hidden), draw(hidden, 3)
    return (first[:10].T, first[10]), (second.T, second_bias), (heads, head_biases)


def orthogonal(generator, hidden):
    """Orthogonal weights of three layers as Stable-Baselines3 scales them, biases 0."""

    def draw(outputs, inputs, gain):
        longer, shorter = max(outputs, inputs), min(outputs, inputs)
        q, r = torch.linalg.qr(torch.from_numpy(generator.standard_normal((longer, shorter))))
        q = gain * (q * r.diagonal().sign()).float()
        return q if outputs == longer else q.T

    first, second = draw(hidden, 10, 2**0.5), draw(hidden, hidden, 2**0.5)
    heads = torch.cat([draw(2, hidden, 0.01), draw(1, hidden, 1.0)])
    return (first, torch.zeros(hidden)), (second, torch.zeros(hidden)), (heads, torch.zeros(3))


@torch.no_grad()
def collect(env, network, cell, seed, iteration):
    """Step one environment, from a fresh reset, for one rollout."""
    steps = cell.protocol.ppo.rollout_steps
    env.unwrapped.np_random = stream(cell.root_seed, Purpose.RESETS, seed, iteration)
    noise = stream(cell.root_seed, Purpose.ACTIONS, seed, iteration)
    rows = []
    state, _ = env.reset()
    for step in range(steps):
        distribution, value = network(torch.from_numpy(state).float()[None])
        action = distribution.mean + distribution.stddev * torch.from_numpy(noise.standard_normal(2, dtype=np.float32))
        applied = action.clamp(-1, 1) if cell.protocol.environment.clip_actions else action
        distance = np.linalg.norm(state[8:])
        following, reward, _, truncated, _ = env.step(applied[0].numpy())
        if cell.protocol.environment.reward == "sparse":
            near = np.linalg.norm(following[8:]) <= cell.protocol.environment.success_radius
            reward = near - cell.protocol.environment.control_weight * np.square(applied[0].numpy()).sum()
        end = truncated or step == steps - 1
        next_value = network(torch.from_numpy(following).float()[None])[1]
        rows.append(
            (state, action[0].numpy(), reward, distance, np.linalg.norm(following[8:]), value.item(),
             next_value.item(), distribution.log_prob(action).sum().item(), end)
        )  # fmt: skip
        state = env.reset()[0] if truncated and step != steps - 1 else following
    return Recording(*(np.array(column) for column in zip(*rows, strict=True)))


def shaped_rewards(recording, cell, iteration):
    """The reward of the environment plus the shaping term, step by step."""
    settings, variant = cell.protocol.shaping, cell.variant
    name = "l2sq" if variant.horizon and settings.decay_potential == "l2sq" else variant.potential
    potential = {"none": lambda d: 0.0, "l2": lambda d: -d, "l2sq": lambda d: -d * d}[name]
    discount = cell.protocol.ppo.discount
    start = 1.0 if settings.start_weight == "one" else cell.alpha0

    def alpha(t):
        if variant.schedule == "exponential":
            return start * math.exp(-t / variant.horizon)
        if variant.schedule == "cosine":
            return start * (1 + math.cos(math.pi * min(1.0, t / variant.horizon))) / 2
        return start if variant.schedule == "constant" else start * max(0.0, 1 - t / variant.horizon)

    rewards = []
    for n, reward in enumerate(recording.reward):
        t = iteration * len(recording.reward) + n
        after = potential(recording.next_distance[n])
        if recording.end[n] and settings.episode_end == "terminal" and settings.terminal_potential == "zero":
            after = 0.0
        later = alpha(t + 1) if settings.form == "dynamic" else alpha(t)
        rewards.append(reward + later * discount * after - alpha(t) * potential(recording.distance[n]))
    return np.array(rewards)


def advantages(recording, rewards, cell):
    """Generalised advantage estimation, backwards through the rollout."""
    settings = cell.protocol.ppo
    result = np.empty(len(rewards))
    carry = 0.0
    for n in reversed(range(len(rewards))):
        bootstrap = not recording.end[n] or cell.protocol.shaping.episode_end == "bootstrap"
        following = recording.next_value[n] if bootstrap else 0.0
        if recording.end[n]:
            carry = 0.0
        delta = rewards[n] + settings.discount * following - recording.value[n]
        carry = delta + settings.discount * settings.gae_lambda * carry
        result[n] = carry
    return result


def loss(network, settings, observation, action, log_prob, advantage, target):
    """The PPO loss of one minibatch (Schulman et al. 2017, eq. 9)."""
    distribution, value = network(observation)
    if settings.ratio_pairs == "minibatch":
        log_prob = log_prob[:, None]  # the released code's axis too many: a matrix of all pairs
    ratio = torch.exp(distribution.log_prob(action).sum(-1) - log_prob)
    clipped = ratio.clamp(1 - settings.clip_range, 1 + settings.clip_range)
    surrogate = torch.min(ratio * advantage, clipped * advantage).mean()
    entropy = distribution.entropy().sum(-1).mean()
    value_loss = (value - target).square().mean()
    return -surrogate + settings.value_coefficient * value_loss - settings.entropy_coefficient * entropy


def update(network, optimizer, cell, seed, iteration, recording, advantage):
    """All epochs over one rollout."""
    settings = cell.protocol.ppo
    normalised = (advantage - advantage.mean()) / (advantage.std(ddof=1) + 1e-8)
    arrays = (recording.observation, recording.action, recording.log_prob, normalised, advantage + recording.value)
    samples = [torch.from_numpy(array).float() for array in arrays]
    shuffles = stream(cell.root_seed, Purpose.SHUFFLES, seed, iteration)
    done = iteration / cell.iterations
    for group in optimizer.param_groups:
        group["lr"] = settings.learning_rate * ((1 - done) if settings.learning_rate_schedule == "linear" else 1)
    for _ in range(settings.epochs):
        order = torch.from_numpy(shuffles.permuted(np.arange(settings.rollout_steps)))
        for minibatch in order.split(settings.minibatch_size):
            optimizer.zero_grad()
            chosen = [sample[minibatch] for sample in samples]
            if settings.advantage_normalisation == "minibatch":
                chosen[3] = (chosen[3] - chosen[3].mean()) / (chosen[3].std() + 1e-8)
            loss(network, settings, *chosen).backward()
            nn.utils.clip_grad_norm_(network.parameters(), settings.max_gradient_norm)
            optimizer.step()


def released_log(cell, recordings):
    """The figure that the released code logs for the last of a run's rollouts, from all of them.

    One running sum of shaped rewards, put on a list and cleared where an episode is truncated but not where a rollout
    starts; the mean of the last ten entries that the rollout put there.
    """
    running, entries = 0.0, []
    for iteration, recording in enumerate(recordings):
        entries = []
        for n, reward in enumerate(shaped_rewards(recording, cell, iteration)):
            running += reward
            if (n + 1) % 50 == 0:
                entries.append(running)
                running = 0.0
    return np.mean(entries[-10:])


def train(cell, seed, iterations=None):
    """Train one seed and yield (network, recording) after each iteration."""
    settings = cell.protocol.ppo
    env = make_environment(cell)
    network = initial_network(cell, seed)
    optimizer = torch.optim.Adam(network.parameters(), lr=settings.learning_rate, eps=settings.adam_epsilon)
    for iteration in range(iterations or cell.iterations):
        recording = collect(env, network, cell, seed, iteration)
        rewards = shaped_rewards(recording, cell, iteration)
        update(network, optimizer, cell, seed, iteration, recording, advantages(recording, rewards, cell))
        yield network, recording
    env.close()
