"""The rungs from the plain loop to the engine, each adding one idea to the one before."""

from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from dataclasses import replace
from unittest.mock import patch

import numpy as np
import plain_loop
import torch
from peers import as_installed
from torch.distributions import Normal

from reacher_shaping.settings.cell import Cell
from reacher_shaping.tasks.reacher import TASK
from reacher_shaping.training import ppo
from reacher_shaping.training import train as training
from reacher_shaping.training.network import layers

RADIUS = 0.02
WHOLE = replace(TASK, simulated_model=TASK.model)
"""Reacher with the geometries and the target that no number depends on."""


class AutogradLearner(ppo.Learner):
    """The stack of networks as a reader would first write it: autograd, and torch's own Adam on the parameters."""

    def __init__(self, parameters, settings, shape, adam=None):
        super().__init__(parameters, settings, shape, adam)
        self.shape = shape
        self.parameter = torch.nn.Parameter(parameters)
        self.optimizer = torch.optim.Adam([self.parameter], eps=settings.adam_epsilon)

    def update(self, records, shuffles, learning_rate):
        self.optimizer.param_groups[0]["lr"] = learning_rate
        for epoch in range(shuffles.shape[1]):
            for chosen in np.split(shuffles[:, epoch], shuffles.shape[2] // self.settings.minibatch_size, axis=1):
                self.optimizer.zero_grad()
                minibatch = ppo.unpack(np.take_along_axis(records, chosen[..., None], 1), self.shape.actions)
                self.loss(ppo.Samples(*map(torch.from_numpy, minibatch))).backward()
                norm = self.parameter.grad.norm(dim=1, keepdim=True)
                self.parameter.grad.mul_((self.settings.max_gradient_norm / (norm + 1e-6)).clamp(max=1))
                self.optimizer.step()

    def loss(self, samples):
        """The sum of the seeds' losses: their gradients do not meet."""
        settings, network = self.settings, layers(self.parameter, self.shape)
        hidden = torch.tanh(samples.features @ network.first)
        hidden = torch.tanh(hidden @ network.second + network.second_bias)
        output = network.head @ hidden.mT + network.head_bias
        mean, value = output[:, :-1], output[:, -1]
        deviation = (samples.action - mean) * torch.exp(-network.log_std)
        log_prob = Normal(0, 1).log_prob(deviation).sum(1) - network.log_std.sum(1)
        ratio = torch.exp(log_prob - samples.log_prob)
        clipped = ratio.clamp(1 - settings.clip_range, 1 + settings.clip_range)
        surrogate = torch.min(ratio * samples.advantage, clipped * samples.advantage).mean(1)
        value_loss = (value - samples.target).square().mean(1)
        entropy = settings.entropy_coefficient * network.log_std.sum((1, 2))  # but for a constant
        return (settings.value_coefficient * value_loss - surrogate - entropy).sum()


def plain(cell: Cell, seeds: Sequence[int]) -> Iterator[object]:
    """The plain loop; it knows one seed."""
    return plain_loop.train(cell, seeds[0])


def engine(
    cell: Cell, seeds: Sequence[int], *, autograd: bool = False, whole: bool = False
) -> Iterator[training.TrainState]:
    """The engine, with the ideas taken out that are named."""
    with ExitStack() as parts:
        # Both are made in the first iteration; what is made stays as it is.
        if autograd:
            parts.enter_context(patch.object(ppo, "Learner", AutogradLearner))
        if whole:
            parts.enter_context(patch.object(training, "load_task", lambda name: WHOLE))
        iterator = training.train(cell, seeds, success_radius=RADIUS)
        first = next(iterator)
    yield first
    yield from iterator


def timed(iterator: Iterator[object]) -> Iterator[object]:
    """The same iterations with MuJoCo's profiling clock on."""
    while True:
        with as_installed():
            made = next(iterator, None)
        if made is None:
            return
        yield made


def rungs(cell: Cell, seeds: Sequence[int]) -> dict[str, tuple[int, Iterator[object]]]:
    """Return the rungs in order: name -> (seeds, iterations of training)."""
    one = seeds[:1]
    return {
        "plain loop": (1, timed(plain(cell, one))),
        "+ lanes": (1, timed(engine(cell, one, autograd=True, whole=True))),
        "+ stack of seeds": (len(seeds), timed(engine(cell, seeds, autograd=True, whole=True))),
        "+ written-out gradient": (len(seeds), timed(engine(cell, seeds, whole=True))),
        "+ lean model": (len(seeds), timed(engine(cell, seeds))),
        "+ profiling clock off": (len(seeds), engine(cell, seeds)),
    }
