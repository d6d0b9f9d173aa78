"""S actor-critics as one stack of parameters: MLP trunks with a policy head and a value head.

Each seed owns one row of a matrix [S, P]; the layers are views of that row. So one batched product
serves all seeds, Adam and gradient clipping act on whole rows, and no number of one seed ever meets
one of another.

A network has K towers: one trunk for policy and value together, or one each. A tower is a trunk with
a head of three outputs; of two towers the first owns the action means and the second the value, and
the outputs that a tower does not own are always zero, weights and gradients. So both kinds are one
stack of S K towers, computed alike.
"""

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from reacher_shaping.random_streams import Purpose, stream
from reacher_shaping.settings.cell import PPO
from reacher_shaping.tasks.base import Task

ALIGNMENT = 16
"""Rows are padded to whole vector registers, so a seed's arithmetic does not depend on its row."""
TRUNKS = {1: ("shared",), 2: ("policy_trunk", "value_trunk")}
"""Names of a network's trunks, by their number."""


class Shape(NamedTuple):
    """Sizes of one network: numbers of an observation and of an action, width of its two layers, trunks K."""

    observations: int
    actions: int
    hidden: int
    towers: int = 1

    @classmethod
    def of(cls, task: Task, settings: PPO) -> "Shape":
        """Return the sizes of a network for a task."""
        return cls(task.observation_size, task.action_size, settings.hidden_units, settings.towers)


class Layers(NamedTuple):
    """Views of parameters [S, P], or of their gradients; the towers of a seed follow each other.

    Inputs carry a constant 1 as their last feature, so `first` holds its bias as its last row. F numbers are observed,
    A are an action.
    """

    first: Tensor  # [S K, F + 1, H]
    second: Tensor  # [S K, H, H]
    second_bias: Tensor  # [S K, 1, H]
    head: Tensor  # [S K, A + 1, H]: action means, then value
    head_bias: Tensor  # [S K, A + 1, 1]
    log_std: Tensor  # [S, A, 1], independent of the state

    @property
    def towers(self) -> int:
        """K."""
        return len(self.first) // len(self.log_std)

    @property
    def actions(self) -> int:
        """A."""
        return self.log_std.shape[-2]


def _shapes(shape: Shape) -> list[tuple[int, int]]:
    """Return the shape of each field of `Layers`, without its seed axis."""
    outputs, hidden = shape.actions + 1, shape.hidden
    first, second, head = (shape.observations + 1, hidden), (hidden, hidden), (outputs, hidden)
    return [first, second, (1, hidden), head, (outputs, 1), (shape.actions, 1)]


def parameter_count(shape: Shape) -> int:
    """Return P: parameters of one network, each tower padded to whole vector registers."""
    used = sum(math.prod(sizes) for sizes in _shapes(shape))
    return shape.towers * math.ceil(used / ALIGNMENT) * ALIGNMENT


def layers(rows: Tensor, shape: Shape) -> Layers:
    """Return the layers as views of `rows` [S, P]."""
    stack = rows.view(len(rows) * shape.towers, -1)
    views, start = [], 0
    for sizes in _shapes(shape):
        size = math.prod(sizes)
        views.append(stack[:, start : start + size].view(-1, *sizes))
        start += size
    *trunk_and_head, log_std = views
    return Layers._make([*trunk_and_head, log_std[:: shape.towers]])


def owned(shape: Shape) -> Tensor:
    """Return the outputs that each tower owns, 1 or 0, [K, A + 1, 1]: action means, then value."""
    if shape.towers == 1:
        return torch.ones(1, shape.actions + 1, 1)
    return torch.tensor([[1.0] * shape.actions + [0.0], [0.0] * shape.actions + [1.0]])[..., None]


def initialise(seeds: Sequence[int], root_seed: int, settings: PPO, shape: Shape) -> Tensor:
    """Return fresh parameters [S, P] of networks of `shape`, drawn from each seed's own stream.

    "default": weights and biases uniform in +- 1 / sqrt(inputs) (torch.nn.Linear.reset_parameters).
    "orthogonal": orthogonal weights of gain sqrt(2), 0.01 for the means and 1 for the value, biases 0
    (Andrychowicz et al. 2021; Stable-Baselines3).
    """
    towers = shape.towers
    rows = torch.zeros(len(seeds), parameter_count(shape))
    network = layers(rows, shape)
    draw = _draw_orthogonal if settings.initialisation == "orthogonal" else _draw_default
    for row, seed in enumerate(seeds):
        generator = stream(root_seed, Purpose.INITIALISATION, seed)
        for tower in range(towers):
            draw(Layers._make([*(view[row * towers + tower] for view in network[:5]), network.log_std[row]]), generator)
    for part in (network.head, network.head_bias):
        part.view(len(seeds), towers, *part.shape[1:]).mul_(owned(shape))
    network.log_std.fill_(settings.initial_log_std)
    return rows


def _draw_default(tower: Layers, generator: np.random.Generator) -> None:
    """Draw the weights of one tower, its layers without their first axis, in place."""
    for view, inputs in zip(tower[:5], [len(tower.first) - 1, *[len(tower.second)] * 4], strict=True):
        bound = 1 / math.sqrt(inputs)
        view.copy_(torch.from_numpy(generator.uniform(-bound, bound, size=tuple(view.shape)).astype(np.float32)))


def _draw_orthogonal(tower: Layers, generator: np.random.Generator) -> None:
    """Draw the weights of one tower, its layers without their first axis, in place; its biases stay as they are."""
    random = torch.Generator().manual_seed(int(generator.integers(2**63)))
    gains = [math.sqrt(2), math.sqrt(2), 0.01, 1.0]
    weights = [tower.first[:-1].T, tower.second.T, tower.head[: tower.actions], tower.head[tower.actions :]]
    for weight, gain in zip(weights, gains, strict=True):
        weight.copy_(torch.nn.init.orthogonal_(torch.empty(weight.shape), gain, random))


def inputs(observation: NDArray[np.float64]) -> Tensor:
    """Return network inputs [..., F + 1] float32: the observations [..., F] and a constant 1."""
    features = torch.ones(*observation.shape[:-1], observation.shape[-1] + 1)
    features.numpy()[..., :-1] = observation
    return features


def to_towers(features: Tensor, towers: int) -> Tensor:
    """Return what each tower reads, [S K, N, F + 1], of inputs [S, N, F + 1]."""
    return features if towers == 1 else features.repeat_interleave(towers, dim=0)


def from_towers(output: Tensor, towers: int) -> Tensor:
    """Return the network's outputs [S, A + 1, N] of its towers' [S K, A + 1, N]; what a tower does not own is zero."""
    return output if towers == 1 else output.view(-1, towers, *output.shape[1:]).sum(1)


def forward(network: Layers, features: Tensor) -> Tensor:
    """Return outputs [S, A + 1, N] (the action means, then the value) for inputs [S, N, F + 1]."""
    hidden = torch.bmm(to_towers(features, network.towers), network.first).tanh_()
    hidden = torch.bmm(hidden, network.second).add_(network.second_bias).tanh_()
    output = torch.bmm(network.head, hidden.transpose(1, 2)).add_(network.head_bias)
    return from_towers(output, network.towers)


class Policy:
    """S trained actor-critics, for acting and for storing.

    Attributes:
        rows: [S, P] parameters.
        shape: sizes of a network.
    """

    def __init__(self, rows: Tensor, shape: Shape) -> None:
        """Wrap parameters [S, P] of networks of `shape`."""
        self.rows = rows
        self.shape = shape
        self.layers = layers(rows, shape)

    def __len__(self) -> int:
        """Return S."""
        return self.rows.shape[0]

    @torch.inference_mode()
    def act(self, observation: NDArray[np.float64], noise: NDArray[np.float32] | None) -> NDArray[np.float32]:
        """Return actions [S, L, A] for observations [S, L, F].

        `noise` [S, L, A] are standard normal draws; None gives the mean action. Actions are not
        clipped.
        """
        mean = forward(self.layers, inputs(observation))[:, :-1].transpose(1, 2)
        if noise is None:
            return mean.numpy()
        return (mean + self.layers.log_std.transpose(1, 2).exp() * torch.from_numpy(noise)).numpy()

    def only(self, row: int) -> "Policy":
        """Return the policy of one row."""
        return Policy(self.rows[row : row + 1], self.shape)

    def weights(self) -> dict[str, Tensor]:
        """Return the stacked weights under the names of the released code's state dict, [S, ...].

        Linear weights are [S, out, in], as in torch.nn.Linear. Where policy and value have a trunk each,
        their names begin with `policy_trunk` and `value_trunk` instead of `shared`.
        """
        net, towers = self.layers, self.shape.towers
        named = {
            "log_std": net.log_std.squeeze(2),
            "policy_mean.weight": net.head[::towers, :-1],
            "policy_mean.bias": net.head_bias[::towers, :-1, 0],
            "value.weight": net.head[towers - 1 :: towers, -1:],
            "value.bias": net.head_bias[towers - 1 :: towers, -1:, 0],
        }
        for tower, trunk in enumerate(TRUNKS[towers]):
            named |= {
                f"{trunk}.0.weight": net.first[tower::towers, :-1].transpose(1, 2),
                f"{trunk}.0.bias": net.first[tower::towers, -1],
                f"{trunk}.2.weight": net.second[tower::towers].transpose(1, 2),
                f"{trunk}.2.bias": net.second_bias[tower::towers, 0],
            }
        return {name: tensor.clone(memory_format=torch.contiguous_format) for name, tensor in named.items()}

    @classmethod
    def from_weights(cls, weights: Mapping[str, Tensor], task: Task) -> "Policy":
        """Build a policy for a task from stacked weights [S, ...] as `weights` gives them.

        Raises ValueError naming the first tensor that is missing, unknown or of a wrong shape.
        """
        towers = 2 if f"{TRUNKS[2][0]}.0.weight" in weights else 1
        name = f"{TRUNKS[towers][0]}.0.weight"
        first = weights.get(name)
        if not isinstance(first, Tensor) or first.ndim != 3:
            raise ValueError(f"{name} is missing or not a tensor [seeds, hidden, {task.observation_size}]")
        seeds, hidden = first.shape[:2]
        shape = Shape(task.observation_size, task.action_size, hidden, towers)
        policy = cls(torch.zeros(seeds, parameter_count(shape)), shape)
        _check_weights(weights, policy.weights())
        net = policy.layers
        net.log_std[..., 0] = weights["log_std"]
        net.head[::towers, :-1] = weights["policy_mean.weight"]
        net.head_bias[::towers, :-1, 0] = weights["policy_mean.bias"]
        net.head[towers - 1 :: towers, -1:] = weights["value.weight"]
        net.head_bias[towers - 1 :: towers, -1:, 0] = weights["value.bias"]
        for tower, trunk in enumerate(TRUNKS[towers]):
            net.first[tower::towers, :-1] = weights[f"{trunk}.0.weight"].transpose(1, 2)
            net.first[tower::towers, -1] = weights[f"{trunk}.0.bias"]
            net.second[tower::towers] = weights[f"{trunk}.2.weight"].transpose(1, 2)
            net.second_bias[tower::towers, 0] = weights[f"{trunk}.2.bias"]
        return policy


def _check_weights(weights: Mapping[str, Tensor], expected: Mapping[str, Tensor]) -> None:
    unknown = sorted(set(weights) - set(expected))
    if unknown:
        raise ValueError(f"{unknown[0]} is no tensor of this network; allowed: {', '.join(sorted(expected))}")
    for name, tensor in expected.items():
        given = weights.get(name)
        if not isinstance(given, Tensor):
            raise ValueError(f"{name} is missing or not a tensor")
        if given.shape != tensor.shape or not given.is_floating_point():
            raise ValueError(
                f"{name} has shape {list(given.shape)} and type {given.dtype}; "
                f"allowed: {list(tensor.shape)}, floating point"
            )
