"""S actor-critics as one stack of parameters: their layers, and the passes through them.

Each seed owns one row of a matrix [S, P]; the layers are views of that row. So one batched product
serves all seeds, and no number of one seed ever meets one of another.

A network has K towers: one trunk for policy and value together, or one each. A tower is a trunk with
a head for all outputs; of two towers the first owns the action means and the second the value, and
the outputs that a tower does not own are always zero, weights and gradients. So both kinds are one
stack of S K towers, computed alike.

The parameters are PyTorch's; the passes are NumPy's, on the same memory. PyTorch leaves products, tanh and exp to MKL,
which computes them otherwise on another processor (other last bits) and slowly on AMD's, and a call on arrays as small
as these costs it three times as much. NumPy's have the same bits on all processors that `processor` names.
"""

import math
from typing import Generic, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray
from torch import Tensor

from reacher_shaping.settings.cell import PPO
from reacher_shaping.tasks.base import Task

ALIGNMENT = 16
"""Rows are padded to whole vector registers, so a seed's arithmetic does not depend on its row."""

Array = NDArray[np.floating]
View = TypeVar("View", Tensor, Array)

silent = np.errstate(over="ignore", invalid="ignore")
"""For code that carries a diverged seed along: its numbers are no news at every operation."""


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


class Layers(NamedTuple, Generic[View]):
    """Views of parameters [S, P], or of their gradients; the towers of a seed follow each other.

    Inputs carry a constant 1 as their last feature, so `first` holds its bias as its last row. F numbers are observed,
    A are an action.
    """

    first: View  # [S K, F + 1, H]
    second: View  # [S K, H, H]
    second_bias: View  # [S K, 1, H]
    head: View  # [S K, A + 1, H]: action means, then value
    head_bias: View  # [S K, A + 1, 1]
    log_std: View  # [S, A, 1], independent of the state

    @property
    def towers(self) -> int:
        """K."""
        return len(self.first) // len(self.log_std)

    @property
    def actions(self) -> int:
        """A."""
        return int(self.log_std.shape[-2])


def _shapes(shape: Shape) -> list[tuple[int, int]]:
    """Return the shape of each field of `Layers`, without its seed axis."""
    outputs, hidden = shape.actions + 1, shape.hidden
    first, second, head = (shape.observations + 1, hidden), (hidden, hidden), (outputs, hidden)
    return [first, second, (1, hidden), head, (outputs, 1), (shape.actions, 1)]


def parameter_count(shape: Shape) -> int:
    """Return P: parameters of one network, each tower padded to whole vector registers."""
    used = sum(math.prod(sizes) for sizes in _shapes(shape))
    return shape.towers * math.ceil(used / ALIGNMENT) * ALIGNMENT


def layers(parameters: View, shape: Shape) -> Layers[View]:
    """Return the layers as views of `parameters` [S, P]."""
    stack = parameters.reshape(len(parameters) * shape.towers, -1)
    views, start = [], 0
    for sizes in _shapes(shape):
        size = math.prod(sizes)
        views.append(stack[:, start : start + size].reshape(-1, *sizes))
        start += size
    *trunk_and_head, log_std = views
    return Layers._make([*trunk_and_head, log_std[:: shape.towers]])


def owned(shape: Shape) -> NDArray[np.float32]:
    """Return the outputs that each tower owns, 1 or 0, [K, A + 1, 1]: action means, then value."""
    if shape.towers == 1:
        return np.ones((1, shape.actions + 1, 1), dtype=np.float32)
    return np.array([[1] * shape.actions + [0], [0] * shape.actions + [1]], dtype=np.float32)[..., None]


class Passes:
    """Forward and backward through a stack of networks, for as many samples a call as the last forward had.

    Attributes:
        layers: the parameters.
    """

    def __init__(self, parameters: Tensor, shape: Shape) -> None:
        """Read parameters [S, P] of networks of `shape`, now and whenever they change."""
        self.layers = layers(parameters.numpy(), shape)
        self._owned = owned(shape).astype(self.layers.head.dtype)
        self._features: Array = np.empty((0, 0, 0))
        self._reserve(0)

    def forward(self, features: Array) -> Array:
        """Return outputs [S, A + 1, N] (the action means, then the value) for inputs [S, N, F + 1]."""
        net, towers = self.layers, self.layers.towers
        if features.shape[1] != len(self._ones):
            self._reserve(features.shape[1])
        self._features = features if towers == 1 else features.repeat(towers, axis=0)
        hidden1 = np.matmul(self._features, net.first, out=self._hidden1)
        np.tanh(hidden1, out=hidden1)
        hidden2 = np.matmul(hidden1, net.second, out=self._hidden2)
        hidden2 += net.second_bias
        np.tanh(hidden2, out=hidden2)
        output: Array = np.matmul(net.head, hidden2.swapaxes(1, 2)) + net.head_bias
        if towers > 1:
            output = output.reshape(-1, towers, *output.shape[1:]).sum(1)
        return output

    def backward(self, output: Array, gradients: Layers[Array]) -> None:
        """Write dL/dlayers, given dL/doutput [S, A + 1, N] at the last forward pass, which this uses up.

        `delta` is dL/d(sum into a tanh). A bias is the weight of a constant 1; so is its gradient computed.
        """
        net, hidden1, hidden2, delta = self.layers, self._hidden1, self._hidden2, self._delta
        if net.towers > 1:
            output = (output[:, None] * self._owned).reshape(-1, *output.shape[1:])
        np.matmul(output, hidden2, out=gradients.head)
        np.matmul(output, self._ones, out=gradients.head_bias)

        np.matmul(output.swapaxes(1, 2), net.head, out=delta)
        _through_tanh(delta, hidden2)
        np.matmul(hidden1.swapaxes(1, 2), delta, out=gradients.second)
        np.matmul(self._ones.T, delta, out=gradients.second_bias)

        delta = np.matmul(delta, net.second.swapaxes(1, 2), out=hidden2)
        _through_tanh(delta, hidden1)
        np.matmul(self._features.swapaxes(1, 2), delta, out=gradients.first)

    def _reserve(self, samples: int) -> None:
        """Allocate what a pass of so many samples fills."""
        towers, _, hidden = self.layers.first.shape
        buffers: Array = np.empty((3, towers, samples, hidden), self.layers.first.dtype)
        self._hidden1, self._hidden2, self._delta = buffers
        self._ones: Array = np.ones((samples, 1), self.layers.first.dtype)


def _through_tanh(delta: Array, output: Array) -> None:
    """Multiply `delta` in place by the derivative 1 - tanh^2, given tanh's output, which is used up."""
    np.square(output, out=output)
    np.subtract(1, output, out=output)
    delta *= output
