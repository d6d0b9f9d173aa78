"""S actor-critics as one stack of parameters: an MLP trunk with a policy head and a value head.

Each seed owns one row of a matrix [S, P]; the layers are views of that row. So one batched product
serves all seeds, Adam and gradient clipping act on whole rows, and no number of one seed ever meets
one of another.
"""

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from reacher_shaping.reacher import ACTION_SIZE, OBSERVATION_SIZE
from reacher_shaping.streams import Purpose, stream

ALIGNMENT = 16
"""Rows are padded to whole vector registers, so a seed's arithmetic does not depend on its row."""


class Layers(NamedTuple):
    """Views of parameters [S, P], or of their gradients.

    Inputs carry a constant 1 as their last feature, so `first` holds its bias as its last row.
    """

    first: Tensor  # [S, 10 + 1, H]
    second: Tensor  # [S, H, H]
    second_bias: Tensor  # [S, 1, H]
    head: Tensor  # [S, 2 + 1, H]: action means, then value
    head_bias: Tensor  # [S, 2 + 1, 1]
    log_std: Tensor  # [S, 2, 1], independent of the state


def _shapes(hidden: int) -> list[tuple[int, int]]:
    """Return the shape of each field of `Layers`, without its seed axis."""
    outputs = ACTION_SIZE + 1
    first, second, head = (OBSERVATION_SIZE + 1, hidden), (hidden, hidden), (outputs, hidden)
    return [first, second, (1, hidden), head, (outputs, 1), (ACTION_SIZE, 1)]


def parameter_count(hidden: int) -> int:
    """Return P: parameters of one network of width `hidden`, padded to whole vector registers."""
    used = sum(math.prod(shape) for shape in _shapes(hidden))
    return math.ceil(used / ALIGNMENT) * ALIGNMENT


def layers(rows: Tensor, hidden: int) -> Layers:
    """Return the layers as views of `rows` [S, P]."""
    views, start = [], 0
    for shape in _shapes(hidden):
        size = math.prod(shape)
        views.append(rows[:, start : start + size].view(-1, *shape))
        start += size
    return Layers(*views)


def initialise(seeds: Sequence[int], root_seed: int, hidden: int) -> Tensor:
    """Return fresh parameters [S, P]: PyTorch's default for Linear layers, log-std 0.

    Weights and biases are uniform in +- 1 / sqrt(inputs) (torch.nn.Linear.reset_parameters), drawn
    from each seed's own stream.
    """
    rows = torch.zeros(len(seeds), parameter_count(hidden))
    views = layers(rows, hidden)
    for row, seed in enumerate(seeds):
        generator = stream(root_seed, Purpose.INITIALISATION, seed)
        bounds = [OBSERVATION_SIZE, hidden, hidden, hidden, hidden]
        for view, inputs in zip(views[:5], bounds, strict=True):
            bound = 1 / math.sqrt(inputs)
            draw = generator.uniform(-bound, bound, size=tuple(view.shape[1:]))
            view[row] = torch.from_numpy(draw.astype(np.float32))
    return rows


def inputs(observation: NDArray[np.float64]) -> Tensor:
    """Return network inputs [..., 11] float32: the observations [..., 10] and a constant 1."""
    features = torch.ones(*observation.shape[:-1], OBSERVATION_SIZE + 1)
    features.numpy()[..., :-1] = observation
    return features


def forward(network: Layers, features: Tensor) -> Tensor:
    """Return outputs [S, 3, N] (two action means, one value) for inputs [S, N, 11]."""
    hidden = torch.bmm(features, network.first).tanh_()
    hidden = torch.bmm(hidden, network.second).add_(network.second_bias).tanh_()
    return torch.bmm(network.head, hidden.transpose(1, 2)).add_(network.head_bias)


class Policy:
    """S trained actor-critics, for acting and for storing.

    Attributes:
        rows: [S, P] parameters.
        hidden: width of the two hidden layers.
    """

    def __init__(self, rows: Tensor, hidden: int) -> None:
        """Wrap parameters [S, P] of networks of width `hidden`."""
        self.rows = rows
        self.hidden = hidden
        self.layers = layers(rows, hidden)

    def __len__(self) -> int:
        """Return S."""
        return self.rows.shape[0]

    @torch.inference_mode()
    def act(self, observation: NDArray[np.float64], noise: NDArray[np.float32] | None) -> NDArray[np.float32]:
        """Return actions [S, L, 2] for observations [S, L, 10].

        `noise` [S, L, 2] are standard normal draws; None gives the mean action. Actions are not
        clipped.
        """
        mean = forward(self.layers, inputs(observation))[:, :ACTION_SIZE].transpose(1, 2)
        if noise is None:
            return mean.numpy()
        return (mean + self.layers.log_std.transpose(1, 2).exp() * torch.from_numpy(noise)).numpy()

    def weights(self) -> dict[str, Tensor]:
        """Return the stacked weights under the names of the released code's state dict, [S, ...].

        Linear weights are [S, out, in], as in torch.nn.Linear.
        """
        net = self.layers
        mean, value = net.head.split([ACTION_SIZE, 1], dim=1)
        mean_bias, value_bias = net.head_bias.squeeze(2).split([ACTION_SIZE, 1], dim=1)
        named = {
            "log_std": net.log_std.squeeze(2),
            "shared.0.weight": net.first[:, :-1].transpose(1, 2),
            "shared.0.bias": net.first[:, -1],
            "shared.2.weight": net.second.transpose(1, 2),
            "shared.2.bias": net.second_bias.squeeze(1),
            "policy_mean.weight": mean,
            "policy_mean.bias": mean_bias,
            "value.weight": value,
            "value.bias": value_bias,
        }
        return {name: tensor.clone(memory_format=torch.contiguous_format) for name, tensor in named.items()}

    @classmethod
    def from_weights(cls, weights: Mapping[str, Tensor]) -> "Policy":
        """Build a policy from stacked weights [S, ...] as `weights` gives them.

        Raises ValueError naming the first tensor that is missing, unknown or of a wrong shape.
        """
        first = weights.get("shared.0.weight")
        if not isinstance(first, Tensor) or first.ndim != 3:
            raise ValueError("shared.0.weight is missing or not a tensor [seeds, hidden, 10]")
        seeds, hidden = first.shape[:2]
        policy = cls(torch.zeros(seeds, parameter_count(hidden)), hidden)
        expected = policy.weights()
        _check_weights(weights, expected)
        net = policy.layers
        net.first[:, :-1] = weights["shared.0.weight"].transpose(1, 2)
        net.first[:, -1] = weights["shared.0.bias"]
        net.second[:] = weights["shared.2.weight"].transpose(1, 2)
        net.second_bias[:, 0] = weights["shared.2.bias"]
        net.head[:] = torch.cat([weights["policy_mean.weight"], weights["value.weight"]], dim=1)
        net.head_bias[..., 0] = torch.cat([weights["policy_mean.bias"], weights["value.bias"]], dim=1)
        net.log_std[..., 0] = weights["log_std"]
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
