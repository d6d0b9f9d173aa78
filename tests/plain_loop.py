"""The training of the study in its plainest form: the readable reference that the engine is held against.

One Gymnasium environment stepped 2048 times, one seed, one torch.nn network, autograd, torch.optim.Adam. Nothing of the
engine is used but its settings and its random streams, so that both meet the same resets, noise and shuffles. Slow.
"""

from dataclasses import dataclass

import gymnasium
import numpy as np
import torch
from torch import nn
from torch.distributions import Normal

from reacher_shaping.streams import Purpose, stream


class Network(nn.Module):
    """Policy and value on one trunk; parameter names are those of the released code."""

    def __init__(self, hidden=64):
        super().__init__()
        self.log_std = nn.Parameter(torch.zeros(2))
        self.shared = nn.Sequential(nn.Linear(10, hidden), nn.Tanh(), nn.Linear(hidden, hidden), nn.Tanh())
        self.policy_mean = nn.Linear(hidden, 2)
        self.value = nn.Linear(hidden, 1)

    def forward(self, observation):
        """Return the action distribution [N, 2] and the values [N] of observations [N, 10]."""
        trunk = self.shared(observation)
        return Normal(self.policy_mean(trunk), self.log_std.exp()), self.value(trunk).squeeze(-1)


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
    """PyTorch's default initialisation, uniform in +- 1 / sqrt(inputs), from the seed's stream."""
    hidden = cell.protocol.ppo.hidden_units
    generator = stream(cell.root_seed, Purpose.INITIALISATION, seed)

    def uniform(inputs, *shape):
        return torch.from_numpy(generator.uniform(-(inputs**-0.5), inputs**-0.5, size=shape)).float()

    network = Network(hidden)
    first = uniform(10, 11, hidden)  # ten rows of weights, one of biases
    second, second_bias = uniform(hidden, hidden, hidden), uniform(hidden, hidden)
    heads, head_biases = uniform(hidden, 3, hidden), uniform(hidden, 3)
    network.load_state_dict(
        {
            "log_std": torch.zeros(2),
            "shared.0.weight": first[:10].T,
            "shared.0.bias": first[10],
            "shared.2.weight": second.T,
            "shared.2.bias": second_bias,
            "policy_mean.weight": heads[:2],
            "policy_mean.bias": head_biases[:2],
            "value.weight": heads[2:],
            "value.bias": head_biases[2:],
        }
    )
    return network


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
    potential = {"none": lambda d: 0.0, "l2": lambda d: -d, "l2sq": lambda d: -d * d}[variant.potential]
    discount = cell.protocol.ppo.discount

    def alpha(t):
        return cell.alpha0 if variant.horizon is None else cell.alpha0 * max(0.0, 1 - t / variant.horizon)

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
    for _ in range(settings.epochs):
        order = torch.from_numpy(shuffles.permuted(np.arange(settings.rollout_steps)))
        for minibatch in order.split(settings.minibatch_size):
            optimizer.zero_grad()
            loss(network, settings, *(sample[minibatch] for sample in samples)).backward()
            nn.utils.clip_grad_norm_(network.parameters(), settings.max_gradient_norm)
            optimizer.step()


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
