"""Policies: parameters of S actor-critics, how they are drawn, how they act, and the names they are stored under."""

import math
from collections.abc import Mapping, Sequence

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from reacher_shaping.random_streams import Purpose, stream
from reacher_shaping.settings.cell import PPO
from reacher_shaping.tasks.base import Task
from reacher_shaping.training.network import Layers, Passes, Shape, layers, owned, parameter_count, silent

TRUNKS = {1: ("shared",), 2: ("policy_trunk", "value_trunk")}
"""Names of a network's trunks, by their number."""


def initialise(seeds: Sequence[int], root_seed: int, settings: PPO, shape: Shape) -> Tensor:
    """Return fresh parameters [S, P] of networks of `shape`, drawn from each seed's own stream.

    "default": weights and biases uniform in +- 1 / sqrt(inputs) (torch.nn.Linear.reset_parameters).
    "orthogonal": orthogonal weights of gain sqrt(2), 0.01 for the means and 1 for the value, biases 0
    (Andrychowicz et al. 2021; Stable-Baselines3).
    """
    towers = shape.towers
    parameters = torch.zeros(len(seeds), parameter_count(shape))
    network = layers(parameters, shape)
    draw = _draw_orthogonal if settings.initialisation == "orthogonal" else _draw_default
    for row, seed in enumerate(seeds):
        generator = stream(root_seed, Purpose.INITIALISATION, seed)
        for tower in range(towers):
            draw(Layers._make([*(view[row * towers + tower] for view in network[:5]), network.log_std[row]]), generator)
    for part in (network.head, network.head_bias):
        part.view(len(seeds), towers, *part.shape[1:]).mul_(torch.from_numpy(owned(shape)))
    network.log_std.fill_(settings.initial_log_std)
    return parameters


def _draw_default(tower: Layers[Tensor], generator: np.random.Generator) -> None:
    """Draw the weights of one tower, its layers without their first axis, in place."""
    for view, inputs in zip(tower[:5], [len(tower.first) - 1, *[len(tower.second)] * 4], strict=True):
        bound = 1 / math.sqrt(inputs)
        view.copy_(torch.from_numpy(generator.uniform(-bound, bound, size=tuple(view.shape)).astype(np.float32)))


def _draw_orthogonal(tower: Layers[Tensor], generator: np.random.Generator) -> None:
    """Draw the weights of one tower, its layers without their first axis, in place; its biases stay as they are."""
    gains = [math.sqrt(2), math.sqrt(2), 0.01, 1.0]
    weights = [tower.first[:-1].T, tower.second.T, tower.head[: tower.actions], tower.head[tower.actions :]]
    for weight, gain in zip(weights, gains, strict=True):
        weight.copy_(torch.from_numpy(gain * _orthogonal(generator, *weight.shape)))


def _orthogonal(generator: np.random.Generator, rows: int, columns: int) -> NDArray[np.float64]:
    """Return a random matrix [rows, columns], orthonormal along its shorter side (Saxe et al. 2014).

    As torch.nn.init.orthogonal_, signs included, which make it uniform (Mezzadri 2007); but that one decomposes by MKL.
    """
    q, r = np.linalg.qr(generator.standard_normal((max(rows, columns), min(rows, columns))))
    q *= np.sign(np.diag(r))
    return q if rows >= columns else q.T


def inputs(observation: NDArray[np.float64]) -> NDArray[np.float32]:
    """Return network inputs [..., F + 1] float32: the observations [..., F] and a constant 1."""
    features = np.ones((*observation.shape[:-1], observation.shape[-1] + 1), dtype=np.float32)
    features[..., :-1] = observation
    return features


class Policy:
    """S trained actor-critics, for acting and for storing.

    Attributes:
        parameters: [S, P] parameters.
        shape: sizes of a network.
    """

    def __init__(self, parameters: Tensor, shape: Shape) -> None:
        """Wrap parameters [S, P] of networks of `shape`."""
        self.parameters = parameters
        self.shape = shape
        self.layers = layers(parameters, shape)
        self._acting = self.passes()

    def __len__(self) -> int:
        """Return S."""
        return self.parameters.shape[0]

    def passes(self) -> Passes:
        """Return new passes through these networks, with buffers of their own."""
        return Passes(self.parameters, self.shape)

    @silent
    def act(self, observation: NDArray[np.float64], noise: NDArray[np.float32] | None) -> NDArray[np.float32]:
        """Return actions [S, L, A] for observations [S, L, F].

        `noise` [S, L, A] are standard normal draws; None gives the mean action. Actions are not
        clipped.
        """
        mean = self._acting.forward(inputs(observation))[:, :-1].swapaxes(1, 2)
        if noise is None:
            return mean.astype(np.float32, copy=False)
        action = mean + np.exp(self._acting.layers.log_std).swapaxes(1, 2) * noise
        return action.astype(np.float32, copy=False)

    def only(self, row: int) -> "Policy":
        """Return the policy of one row."""
        return Policy(self.parameters[row : row + 1], self.shape)

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
