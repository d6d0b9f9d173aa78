"""One PPO update of S seeds at once (Schulman et al. 2017), with the gradient written out.

The loss of a minibatch of B samples, for each seed on its own:

    L = -mean(min(rho A, clip(rho, 1 - eps, 1 + eps) A)) + c_v mean((V - R)^2) - c_e H
    rho = pi(a|s) / pi_old(a|s),  H = entropy of the Gaussian

With `ratio_pairs: minibatch` every sample's new probability is divided by every sample's old one, and
the surrogate is averaged over the B x B ratios rho_ij = pi(a_j|s_j) / pi_old(a_i|s_i) with A_j: what an
old log-probability with one axis too many broadcasts to, as in the paper's released code.

The network has three layers, so its gradient is a dozen lines; writing them out saves autograd's
bookkeeping, which costs as much as the arithmetic at this size. Tests hold it against autograd and
against Stable-Baselines3. Parameters, gradient and Adam are PyTorch's; NumPy works on the same memory
where it is faster and has the same bits on every processor (see `network`).
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from reacher_shaping.settings.cell import PPO
from reacher_shaping.training.network import Array, Passes, Shape, layers, silent

LOG_2PI = math.log(2 * math.pi)
BETAS = (0.9, 0.999)
"""Decay rates of Adam's two moments (Kingma & Ba 2015), PyTorch's defaults."""


class Samples(NamedTuple):
    """All that the loss needs of N steps; sample axis last where the arithmetic runs along samples."""

    features: Array  # [..., N, F + 1] network inputs
    action: Array  # [..., A, N]
    log_prob: Array  # [..., N] under the policy that acted
    advantage: Array  # [..., N], normalised
    target: Array  # [..., N] return that the value is fitted to


def pack(features: Array, action: Array, log_prob: Array, advantage: Array, target: Array) -> Array:
    """Return records [S, N, F + A + 4], a row per sample: features [S, N, F + 1], action [S, N, A], others [S, N]."""
    columns = [log_prob[..., None], advantage[..., None], target[..., None]]
    return np.concatenate([features, action, *columns], axis=-1, dtype=features.dtype, casting="same_kind")


def unpack(records: Array, actions: int) -> Samples:
    """Return the fields of records [..., N, F + A + 4] with A = `actions`."""
    features, rest = np.split(records, [records.shape[-1] - actions - 3], axis=-1)
    rest = np.ascontiguousarray(np.moveaxis(rest, -1, -2))
    return Samples(features, rest[..., :actions, :], *np.moveaxis(rest[..., actions:, :], -2, 0))


def log_probability(deviation: Array, log_std: Array) -> Array:
    """Return log pi(a|s) [S, N] of independent Gaussians.

    Args:
        deviation: [S, A, N], (a - mean) / std.
        log_std: [S, A, 1].
    """
    density: Array = -0.5 * (deviation**2).sum(1) - (log_std.sum(1) + 0.5 * log_std.shape[1] * LOG_2PI)
    return density


def entropy(log_std: Array) -> Array:
    """Return the entropy [S] of independent Gaussians with log_std [S, A, 1]."""
    total: Array = log_std.sum((-1, -2)) + 0.5 * log_std.shape[-2] * (1 + LOG_2PI)
    return total


@dataclass
class Adam:
    """Adam's state (Kingma & Ba 2015): moments [S, P] and the number of steps taken."""

    first: Tensor
    second: Tensor
    steps: int = 0

    @classmethod
    def zeros_like(cls, parameters: Tensor) -> "Adam":
        """Return the state before the first step for parameters [S, P]."""
        return cls(torch.zeros_like(parameters), torch.zeros_like(parameters))

    def step(self, parameters: Tensor, gradient: Tensor, learning_rate: float, epsilon: float) -> None:
        """Change `parameters` [S, P] in place, by the kernel that torch.optim.Adam(fused=True) calls."""
        self.steps += 1
        beta1, beta2 = BETAS
        torch._fused_adam_(
            [parameters], [gradient], [self.first], [self.second], [], [torch.tensor(float(self.steps))],
            lr=learning_rate, beta1=beta1, beta2=beta2, weight_decay=0.0, eps=epsilon, amsgrad=False, maximize=False,
        )  # fmt: skip


class Learner:
    """The parameters, Adam's state, and the buffers of the gradient, allocated once.

    Attributes:
        parameters: [S, P] parameters, changed in place.
        gradient: [S, P] of the last minibatch.
        adam: Adam's state.
    """

    def __init__(self, parameters: Tensor, settings: PPO, shape: Shape, adam: Adam | None = None) -> None:
        """Take over parameters [S, P] of networks of `shape`; `adam` continues an earlier run."""
        self.parameters = parameters
        self.settings = settings
        self.adam = adam or Adam.zeros_like(parameters)
        self.passes = Passes(parameters, shape)
        self.gradient = torch.zeros_like(parameters)
        self._gradients = layers(self.gradient.numpy(), shape)

    @silent
    def update(self, records: Array, shuffles: NDArray[np.int64], learning_rate: float) -> None:
        """Run all epochs over the samples of a rollout.

        Args:
            records: [S, N, F + A + 4], see `pack`.
            shuffles: [S, epochs, N], each seed's own orders of its samples.
            learning_rate: Adam's, for this rollout.
        """
        seeds, count, width = records.shape
        batch = self.settings.minibatch_size
        offset = np.arange(seeds)[:, None] * count
        for epoch in range(shuffles.shape[1]):
            index = (shuffles[:, epoch] + offset).reshape(seeds, -1, batch).swapaxes(0, 1)
            samples = unpack(records.reshape(-1, width)[index], self.passes.layers.actions)
            if self.settings.advantage_normalisation == "minibatch":
                samples = samples._replace(advantage=normalise(samples.advantage))
            for minibatch in zip(*samples, strict=True):
                self.differentiate(Samples(*minibatch))
                self._clip()
                self.adam.step(self.parameters, self.gradient, learning_rate, self.settings.adam_epsilon)

    def differentiate(self, samples: Samples) -> None:
        """Write dL/dparameters of one minibatch [S, B] into `gradient`."""
        output = self.passes.forward(samples.features)
        self.passes.backward(self._loss_gradient(samples, output), self._gradients)

    def _loss_gradient(self, samples: Samples, output: Array) -> Array:
        """Write dL/dlog_std; return dL/doutput [S, A + 1, B], the action means and the value."""
        settings, log_std = self.settings, self.passes.layers.log_std
        mean, value = output[:, :-1], output[:, -1]
        inverse_std = np.exp(-log_std)
        deviation = (samples.action - mean) * inverse_std
        log_prob = log_probability(deviation, log_std)
        d_log_prob = self._surrogate_gradient(log_prob, samples)[:, None] / -value.shape[1]

        gradient = np.empty_like(output)
        gradient[:, :-1] = deviation * d_log_prob * inverse_std
        gradient[:, -1] = (value - samples.target) * (2 * settings.value_coefficient / value.shape[1])
        d_log_std = ((deviation**2 - 1) * d_log_prob).sum(-1, keepdims=True)
        np.subtract(d_log_std, settings.entropy_coefficient, out=self._gradients.log_std)
        return gradient

    def _surrogate_gradient(self, log_prob: Array, samples: Samples) -> Array:
        """Return B dL_clip/dlog pi(a|s) [S, B] of the clipped surrogate, given log pi(a|s) [S, B]."""
        clip, advantage = self.settings.clip_range, samples.advantage
        pairs = self.settings.ratio_pairs == "minibatch"
        if pairs:
            ratio = np.exp(log_prob[:, None] - samples.log_prob[:, :, None])
            advantage = advantage[:, None]
        else:
            ratio = np.exp(log_prob - samples.log_prob)
        # Where clipping binds, the minimum is the clipped term, which does not depend on the policy.
        surrogate = ratio * advantage
        clipped = np.minimum(np.maximum(ratio, 1 - clip), 1 + clip) * advantage
        gradient = surrogate * (surrogate <= clipped)
        return gradient.mean(1) if pairs else gradient

    def _clip(self) -> None:
        """Scale each seed's gradient to a norm of at most `max_gradient_norm` over all parameters."""
        gradient = self.gradient.numpy()
        norm = np.sqrt(np.vecdot(gradient, gradient))[:, None]
        gradient *= np.minimum(self.settings.max_gradient_norm / (norm + 1e-6), 1)


def normalise(advantage: Array) -> Array:
    """Return advantages [..., B] with mean 0 and unbiased deviation 1 in every minibatch."""
    centred = advantage - advantage.mean(-1, keepdims=True)
    normalised: Array = centred / (advantage.std(-1, ddof=1, keepdims=True) + 1e-8)
    return normalised


class Diagnostics(NamedTuple):
    """Loss terms over a whole rollout, [S] each, under the policy after the update."""

    policy_loss: Array
    value_loss: Array
    approx_kl: Array
    clip_fraction: Array
    entropy: Array


@silent
def diagnose(passes: Passes, records: Array, clip_range: float) -> Diagnostics:
    """Measure the loss terms on records [S, N, F + A + 4].

    approx_kl is mean(rho - 1 - log rho), the low-variance estimator of KL(old, new) (Schulman 2020).
    """
    samples, log_std = unpack(records, passes.layers.actions), passes.layers.log_std
    output = passes.forward(samples.features)
    deviation = (samples.action - output[:, :-1]) * np.exp(-log_std)
    log_ratio = log_probability(deviation, log_std) - samples.log_prob
    ratio = np.exp(log_ratio)
    clipped = ratio.clip(1 - clip_range, 1 + clip_range)
    surrogate = np.minimum(ratio * samples.advantage, clipped * samples.advantage)
    return Diagnostics(
        policy_loss=-surrogate.mean(1),
        value_loss=((output[:, -1] - samples.target) ** 2).mean(1),
        approx_kl=(ratio - 1 - log_ratio).mean(1),
        clip_fraction=(np.abs(ratio - 1) > clip_range).mean(1),
        entropy=entropy(log_std),
    )
