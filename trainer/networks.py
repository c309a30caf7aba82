"""Networks: an ensemble of multilayer perceptrons evaluated as one, and the tanh-Gaussian policy.

What is here runs under autograd and is the reference; `trainer.passes` does the same by hand, faster.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence

import torch
import torch.nn.functional as F  # noqa: N812  (PyTorch's own convention)
from torch import Tensor, nn

Initialiser = Callable[[Tensor, Tensor, torch.Generator], None]
Layer = tuple[Tensor, Tensor]
"""Weight [E, in, out] and bias [E, 1, out]."""


def orthogonal(weight: Tensor, bias: Tensor, generator: torch.Generator) -> None:
    """Orthogonal weights [in, out], zero biases: the agent's networks."""
    nn.init.orthogonal_(weight, generator=generator)
    nn.init.zeros_(bias)


def linear_default(weight: Tensor, bias: Tensor, generator: torch.Generator) -> None:
    """What `torch.nn.Linear` starts from, U(±1/√in) for both: the reward models."""
    bound = 1 / math.sqrt(weight.shape[0])
    nn.init.uniform_(weight, -bound, bound, generator=generator)
    nn.init.uniform_(bias, -bound, bound, generator=generator)


class EnsembleMLP(nn.Module):
    """E independent perceptrons on the same input or on one each: [B, in] or [E, B, in] → [E, B, out].

    Between its linear layers x becomes max(x, slope·x); with `normalised`, x before that becomes
    (x − mean)/√(variance + ε) over a layer's units (Ba et al. 2016, without gain and bias, which the next linear
    layer makes up for). All weights lie in one parameter, `flat`, so that an optimiser's step, a Polyak average
    or a change of precision is one operation, however many layers there are.
    """

    EPSILON = 1e-5

    def __init__(
        self,
        members: int,
        sizes: Sequence[int],
        slope: float,
        init: Initialiser,
        generator: torch.Generator,
        *,
        normalised: bool = False,
    ) -> None:
        super().__init__()
        self.members = members
        self.sizes = tuple(sizes)
        self.slope = slope
        self.normalised = normalised
        count = sum((inputs + 1) * outputs for inputs, outputs in itertools.pairwise(sizes))
        self.flat = nn.Parameter(torch.empty(members * count))
        with torch.no_grad():
            for weight, bias in self.layers():
                for member in range(members):
                    init(weight[member], bias[member], generator)

    def layers(self, flat: Tensor | None = None) -> list[Layer]:
        """Each layer's weight [E, in, out] and bias [E, 1, out] as views of `flat`, or of a tensor like it."""
        flat = self.flat if flat is None else flat
        found, start = [], 0
        for inputs, outputs in itertools.pairwise(self.sizes):
            middle = start + self.members * inputs * outputs
            end = middle + self.members * outputs
            weight = flat[start:middle].view(self.members, inputs, outputs)
            found.append((weight, flat[middle:end].view(self.members, 1, outputs)))
            start = end
        return found

    def forward(self, x: Tensor) -> Tensor:
        if x.dim() == 2:
            x = x.expand(self.members, *x.shape)
        *hidden, (weight, bias) = self.layers()
        for hidden_weight, hidden_bias in hidden:
            x = torch.baddbmm(hidden_bias, x, hidden_weight)
            if self.normalised:
                x = F.layer_norm(x, x.shape[-1:], eps=self.EPSILON)
            x = F.leaky_relu(x, self.slope)
        return torch.baddbmm(bias, x, weight)


class Actor(nn.Module):
    """Tanh-squashed Gaussian policy, log σ in [−5, 2]."""

    LOG_STD_MIN, LOG_STD_MAX = -5.0, 2.0

    def __init__(
        self, observation_size: int, action_size: int, width: int, depth: int, generator: torch.Generator
    ) -> None:
        super().__init__()
        sizes = [observation_size, *[width] * depth, 2 * action_size]
        self.trunk = EnsembleMLP(1, sizes, 0.0, orthogonal, generator)

    def forward(self, observation: Tensor) -> tuple[Tensor, Tensor]:
        """Mean and log standard deviation before squashing, each [B, A]."""
        mean, raw = self.trunk(observation)[0].chunk(2, dim=-1)
        return mean, bounded_log_std(torch.tanh(raw))

    def best(self, observation: Tensor) -> Tensor:
        """tanh(μ): the action when evaluated, [B, A]."""
        return torch.tanh(self(observation)[0])

    def explore(self, observation: Tensor, noise: Tensor) -> Tensor:
        """The action [B, A] that standard normal noise [B, A] makes."""
        mean, log_std = self(observation)
        return torch.tanh(mean + log_std.exp() * noise)

    def sample(self, observation: Tensor, noise: Tensor) -> tuple[Tensor, Tensor]:
        """The action [B, A] that standard normal noise [B, A] makes, reparametrised, and its log-probability [B]."""
        mean, log_std = self(observation)
        before = mean + log_std.exp() * noise
        return torch.tanh(before), tanh_gaussian_log_prob(before, mean, log_std)


def bounded_log_std(tanh_of_raw: Tensor) -> Tensor:
    """log σ = −5 + 3.5·(tanh(raw) + 1)."""
    half_range = 0.5 * (Actor.LOG_STD_MAX - Actor.LOG_STD_MIN)
    return Actor.LOG_STD_MIN + half_range * (tanh_of_raw + 1)


def tanh_gaussian_log_prob(before: Tensor, mean: Tensor, log_std: Tensor) -> Tensor:
    """log π of tanh(`before`), summed over the action: [B, A] → [B].

    The squashing's log-determinant is 2·(log 2 − x − softplus(−2x)), stable for large |x|.
    """
    normalised = (before - mean) / log_std.exp()
    gaussian = -0.5 * (normalised**2 + math.log(2 * math.pi)) - log_std
    squashing = 2 * (math.log(2) - before - F.softplus(-2 * before))
    return (gaussian - squashing).sum(-1)


class Critic(nn.Module):
    """Two independent Q functions on (s, a)."""

    def __init__(
        self,
        observation_size: int,
        action_size: int,
        width: int,
        depth: int,
        generator: torch.Generator,
        *,
        normalised: bool = False,
    ) -> None:
        super().__init__()
        sizes = [observation_size + action_size, *[width] * depth, 1]
        self.twins = EnsembleMLP(2, sizes, 0.0, orthogonal, generator, normalised=normalised)

    def forward(self, observation: Tensor, action: Tensor) -> Tensor:
        """Both values, [2, B]."""
        values: Tensor = self.twins(torch.cat([observation, action], -1))
        return values[..., 0]
