"""One PPO update of S seeds at once (Schulman et al. 2017), with the gradient written out.

The loss of a minibatch of B samples, for each seed on its own:

    L = -mean(min(rho A, clip(rho, 1 - eps, 1 + eps) A)) + c_v mean((V - R)^2) - c_e H
    rho = pi(a|s) / pi_old(a|s),  H = entropy of the Gaussian

With `ratio_pairs: minibatch` every sample's new probability is divided by every sample's old one, and
the surrogate is averaged over the B x B ratios rho_ij = pi(a_j|s_j) / pi_old(a_i|s_i) with A_j: what an
old log-probability with one axis too many broadcasts to, as in the paper's released code.

The network has three layers, so its gradient is a dozen lines; writing them out saves autograd's
bookkeeping, which costs as much as the arithmetic at this size. Tests hold it against autograd and
against Stable-Baselines3.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import torch
from torch import Tensor

from reacher_shaping.settings.cell import PPO
from reacher_shaping.training.policy import Layers, Shape, forward, from_towers, layers, owned, to_towers

LOG_2PI = math.log(2 * math.pi)
BETAS = (0.9, 0.999)
"""Decay rates of Adam's two moments (Kingma & Ba 2015), PyTorch's defaults."""


class Samples(NamedTuple):
    """All that the loss needs of N steps; sample axis last where the arithmetic runs along samples."""

    features: Tensor  # [..., N, F + 1] network inputs
    action: Tensor  # [..., A, N]
    log_prob: Tensor  # [..., N] under the policy that acted
    advantage: Tensor  # [..., N], normalised
    target: Tensor  # [..., N] return that the value is fitted to


def pack(features: Tensor, action: Tensor, log_prob: Tensor, advantage: Tensor, target: Tensor) -> Tensor:
    """Return records [S, N, F + A + 4], a row per sample: features [S, N, F + 1], action [S, N, A], others [S, N]."""
    return torch.cat([features, action, log_prob[..., None], advantage[..., None], target[..., None]], dim=-1)


def unpack(records: Tensor, actions: int) -> Samples:
    """Return the fields of records [..., N, F + A + 4] with A = `actions`."""
    features, rest = records.split([records.shape[-1] - actions - 3, actions + 3], dim=-1)
    rest = rest.transpose(-1, -2).contiguous()
    return Samples(features, rest[..., :actions, :], *rest[..., actions:, :].unbind(-2))


def log_probability(deviation: Tensor, log_std: Tensor) -> Tensor:
    """Return log pi(a|s) [S, N] of independent Gaussians.

    Args:
        deviation: [S, A, N], (a - mean) / std.
        log_std: [S, A, 1].
    """
    constant = log_std.sum(1).add_(0.5 * log_std.shape[1] * LOG_2PI)
    return deviation.square().sum(1).mul_(-0.5).sub_(constant)


def entropy(log_std: Tensor) -> Tensor:
    """Return the entropy [S] of independent Gaussians with log_std [S, A, 1]."""
    return log_std.sum((-1, -2)) + 0.5 * log_std.shape[-2] * (1 + LOG_2PI)


@dataclass
class Adam:
    """Adam's state (Kingma & Ba 2015): moments [S, P] and the number of steps taken."""

    first: Tensor
    second: Tensor
    steps: int = 0

    @classmethod
    def zeros_like(cls, rows: Tensor) -> "Adam":
        """Return the state before the first step for parameters [S, P]."""
        return cls(torch.zeros_like(rows), torch.zeros_like(rows))

    def step(self, rows: Tensor, gradient: Tensor, learning_rate: float, epsilon: float) -> None:
        """Change `rows` [S, P] in place; both bias corrections are folded into scalars."""
        self.steps += 1
        beta1, beta2 = BETAS
        root = math.sqrt(1 - beta2**self.steps)
        self.first.lerp_(gradient, 1 - beta1)
        self.second.mul_(beta2).addcmul_(gradient, gradient, value=1 - beta2)
        scale = self.second.sqrt().add_(epsilon * root)
        rows.addcdiv_(self.first, scale, value=-learning_rate * root / (1 - beta1**self.steps))


class Learner:
    """The parameters, Adam's state, and the buffers of the gradient, allocated once.

    Attributes:
        rows: [S, P] parameters, changed in place.
        adam: Adam's state.
    """

    def __init__(self, rows: Tensor, settings: PPO, shape: Shape, adam: Adam | None = None) -> None:
        """Take over parameters [S, P] of networks of `shape`; `adam` continues an earlier run."""
        self.rows = rows
        self.settings = settings
        self.adam = adam or Adam.zeros_like(rows)
        self.network = layers(rows, shape)
        self.gradient = torch.zeros_like(rows)
        self._gradients = layers(self.gradient, shape)
        self._owned = owned(shape).to(rows.dtype)
        buffer = (rows.shape[0] * shape.towers, settings.minibatch_size, shape.hidden)
        self._hidden = rows.new_empty(buffer), rows.new_empty(buffer)
        self._delta = rows.new_empty(buffer)

    @torch.inference_mode()
    def update(self, records: Tensor, shuffles: Tensor, learning_rate: float) -> None:
        """Run all epochs over the samples of a rollout.

        Args:
            records: [S, N, F + A + 4], see `pack`.
            shuffles: [S, epochs, N] int64, each seed's own orders of its samples.
            learning_rate: Adam's, for this rollout.
        """
        seeds, count, width = records.shape
        batch = self.settings.minibatch_size
        offset = torch.arange(seeds)[:, None] * count
        for epoch in range(shuffles.shape[1]):
            index = (shuffles[:, epoch] + offset).view(seeds, -1, batch).transpose(0, 1)
            shuffled = records.view(-1, width).index_select(0, index.reshape(-1))
            epoch_samples = unpack(shuffled.view(-1, seeds, batch, width), self.network.actions)
            if self.settings.advantage_normalisation == "minibatch":
                epoch_samples = epoch_samples._replace(advantage=_normalise(epoch_samples.advantage))
            for minibatch in zip(*epoch_samples, strict=True):
                self.differentiate(Samples(*minibatch))
                self._clip()
                self.adam.step(self.rows, self.gradient, learning_rate, self.settings.adam_epsilon)

    def differentiate(self, samples: Samples) -> None:
        """Write dL/dparameters of one minibatch [S, B] into `gradient`."""
        net, (hidden1, hidden2), towers = self.network, self._hidden, self.network.towers
        features = to_towers(samples.features, towers)
        torch.bmm(features, net.first, out=hidden1).tanh_()
        torch.bmm(hidden1, net.second, out=hidden2).add_(net.second_bias).tanh_()
        output = torch.bmm(net.head, hidden2.transpose(1, 2)).add_(net.head_bias)
        gradient = self._loss_gradient(samples, from_towers(output, towers))
        if towers > 1:
            gradient = (gradient[:, None] * self._owned).flatten(0, 1)
        self._backward(features, gradient)

    def _loss_gradient(self, samples: Samples, output: Tensor) -> Tensor:
        """Write dL/dlog_std; return dL/doutput [S, A + 1, B], the action means and the value."""
        settings, log_std = self.settings, self.network.log_std
        mean, value = output[:, :-1], output[:, -1]
        inverse_std = torch.exp(-log_std)
        deviation = (samples.action - mean).mul_(inverse_std)
        log_prob = log_probability(deviation, log_std)
        d_log_prob = self._surrogate_gradient(log_prob, samples).mul_(-1 / value.shape[1])[:, None]

        gradient = torch.empty_like(output)
        torch.mul(deviation, d_log_prob, out=gradient[:, :-1]).mul_(inverse_std)
        torch.sub(value, samples.target, out=gradient[:, -1])
        gradient[:, -1].mul_(2 * settings.value_coefficient / value.shape[1])
        d_log_std = deviation.square_().sub_(1).mul_(d_log_prob).sum(-1, keepdim=True)
        torch.sub(d_log_std, settings.entropy_coefficient, out=self._gradients.log_std)
        return gradient

    def _surrogate_gradient(self, log_prob: Tensor, samples: Samples) -> Tensor:
        """Return B dL_clip/dlog pi(a|s) [S, B] of the clipped surrogate, given log pi(a|s) [S, B]."""
        clip, advantage = self.settings.clip_range, samples.advantage
        if self.settings.ratio_pairs == "minibatch":
            log_ratio, advantage = log_prob[:, None] - samples.log_prob[:, :, None], advantage[:, None]
        else:
            log_ratio = log_prob.sub_(samples.log_prob)
        ratio = log_ratio.exp_()
        # Where clipping binds, the minimum is the clipped term, which does not depend on the policy.
        surrogate = ratio * advantage
        clipped = ratio.clamp_(1 - clip, 1 + clip).mul_(advantage)
        gradient = torch.le(surrogate, clipped).mul(surrogate)
        return gradient if gradient.ndim == 2 else gradient.mean(1)

    def _backward(self, features: Tensor, output: Tensor) -> None:
        """Propagate dL/doutput [S K, A + 1, B] to the layers; `delta` is dL/d(sum into a tanh)."""
        net, gradients, (hidden1, hidden2), delta = self.network, self._gradients, self._hidden, self._delta
        torch.bmm(output, hidden2, out=gradients.head)
        torch.sum(output, -1, keepdim=True, out=gradients.head_bias)

        torch.bmm(output.transpose(1, 2), net.head, out=delta)
        _tanh_backward(delta, hidden2)
        torch.bmm(hidden1.transpose(1, 2), delta, out=gradients.second)
        torch.sum(delta, 1, keepdim=True, out=gradients.second_bias)

        delta = torch.bmm(delta, net.second.transpose(1, 2), out=hidden2)  # which nothing reads from here on
        _tanh_backward(delta, hidden1)
        torch.bmm(features.transpose(1, 2), delta, out=gradients.first)

    def _clip(self) -> None:
        """Scale each seed's gradient to a norm of at most `max_gradient_norm` over all parameters."""
        norm = torch.linalg.vector_norm(self.gradient, dim=1, keepdim=True)
        self.gradient.mul_((self.settings.max_gradient_norm / (norm + 1e-6)).clamp_(max=1.0))


def _normalise(advantage: Tensor) -> Tensor:
    """Return advantages [..., B] with mean 0 and unbiased deviation 1 in every minibatch."""
    centred = advantage - advantage.mean(-1, keepdim=True)
    return centred / (advantage.std(-1, keepdim=True) + 1e-8)


def _tanh_backward(delta: Tensor, output: Tensor) -> None:
    """Multiply `delta` in place by the derivative 1 - tanh^2, given tanh's output."""
    torch.ops.aten.tanh_backward.grad_input(delta, output, grad_input=delta)


class Diagnostics(NamedTuple):
    """Loss terms over a whole rollout, [S] each, under the policy after the update."""

    policy_loss: Tensor
    value_loss: Tensor
    approx_kl: Tensor
    clip_fraction: Tensor
    entropy: Tensor


@torch.inference_mode()
def diagnose(network: Layers, records: Tensor, clip_range: float) -> Diagnostics:
    """Measure the loss terms on records [S, N, F + A + 4].

    approx_kl is mean(rho - 1 - log rho), the low-variance estimator of KL(old, new) (Schulman 2020).
    """
    samples = unpack(records, network.actions)
    output = forward(network, samples.features)
    deviation = (samples.action - output[:, :-1]) * torch.exp(-network.log_std)
    log_ratio = log_probability(deviation, network.log_std) - samples.log_prob
    ratio = log_ratio.exp()
    clipped = ratio.clamp(1 - clip_range, 1 + clip_range)
    surrogate = torch.minimum(ratio * samples.advantage, clipped * samples.advantage)
    return Diagnostics(
        policy_loss=-surrogate.mean(1),
        value_loss=(output[:, -1] - samples.target).square().mean(1),
        approx_kl=(ratio - 1 - log_ratio).mean(1),
        clip_fraction=((ratio - 1).abs() > clip_range).float().mean(1),
        entropy=entropy(network.log_std),
    )
