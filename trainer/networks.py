"""Networks: an ensemble of multilayer perceptrons evaluated as one, and the tanh-Gaussian policy."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence

import torch
import torch.nn.functional as F  # noqa: N812  (PyTorch's own convention)
from torch import Tensor, nn

Initialiser = Callable[[Tensor, Tensor, torch.Generator], None]


def orthogonal(weight: Tensor, bias: Tensor, generator: torch.Generator) -> None:
    """Orthogonal weights [in, out], zero biases: the agent's networks."""
    nn.init.orthogonal_(weight, generator=generator)
    nn.init.zeros_(bias)


def linear_default(weight: Tensor, bias: Tensor, generator: torch.Generator) -> None:
    """What `torch.nn.Linear` starts from, U(±1/√in) for both: the reward models."""
    bound = 1 / math.sqrt(weight.shape[0])
    nn.init.uniform_(weight, -bound, bound, generator=generator)
    nn.init.uniform_(bias, -bound, bound, generator=generator)


class EnsembleLinear(nn.Module):
    """E independent linear maps: [E, B, in] → [E, B, out]."""

    def __init__(
        self, members: int, inputs: int, outputs: int, init: Initialiser, generator: torch.Generator
    ) -> None:
        super().__init__()
        self.weight = nn.Parameter(torch.empty(members, inputs, outputs))
        self.bias = nn.Parameter(torch.empty(members, 1, outputs))
        with torch.no_grad():
            for member in range(members):
                init(self.weight[member], self.bias[member], generator)

    def forward(self, x: Tensor) -> Tensor:
        return torch.baddbmm(self.bias, x, self.weight)


class EnsembleMLP(nn.Module):
    """E independent perceptrons on the same input or on one each: [B, in] or [E, B, in] → [E, B, out]."""

    def __init__(
        self,
        members: int,
        sizes: Sequence[int],
        activation: Callable[[Tensor], Tensor],
        init: Initialiser,
        generator: torch.Generator,
    ) -> None:
        super().__init__()
        self.members = members
        self.activation = activation
        self.layers = nn.ModuleList(
            EnsembleLinear(members, inputs, outputs, init, generator)
            for inputs, outputs in itertools.pairwise(sizes)
        )

    def forward(self, x: Tensor) -> Tensor:
        if x.dim() == 2:
            x = x.expand(self.members, *x.shape)
        for layer in self.layers[:-1]:
            x = self.activation(layer(x))
        last: Tensor = self.layers[-1](x)
        return last


class Actor(nn.Module):
    """Tanh-squashed Gaussian policy, log σ in [−5, 2]."""

    LOG_STD_MIN, LOG_STD_MAX = -5.0, 2.0

    def __init__(
        self, observation_size: int, action_size: int, width: int, depth: int, generator: torch.Generator
    ) -> None:
        super().__init__()
        sizes = [observation_size, *[width] * depth, 2 * action_size]
        self.trunk = EnsembleMLP(1, sizes, F.relu, orthogonal, generator)

    def forward(self, observation: Tensor) -> tuple[Tensor, Tensor]:
        """Mean and log standard deviation before squashing, each [B, A]."""
        mean, raw = self.trunk(observation)[0].chunk(2, dim=-1)
        half_range = 0.5 * (self.LOG_STD_MAX - self.LOG_STD_MIN)
        return mean, self.LOG_STD_MIN + half_range * (torch.tanh(raw) + 1)

    def best(self, observation: Tensor) -> Tensor:
        """tanh(μ): the action when evaluated, [B, A]."""
        return torch.tanh(self(observation)[0])

    def sample(self, observation: Tensor, generator: torch.Generator) -> tuple[Tensor, Tensor]:
        """A reparametrised action [B, A] and its log-probability [B]."""
        mean, log_std = self(observation)
        noise = torch.randn(mean.shape, generator=generator, device=mean.device)
        before = mean + log_std.exp() * noise
        return torch.tanh(before), tanh_gaussian_log_prob(before, mean, log_std)


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
        self, observation_size: int, action_size: int, width: int, depth: int, generator: torch.Generator
    ) -> None:
        super().__init__()
        sizes = [observation_size + action_size, *[width] * depth, 1]
        self.twins = EnsembleMLP(2, sizes, F.relu, orthogonal, generator)

    def forward(self, observation: Tensor, action: Tensor) -> Tensor:
        """Both values, [2, B]."""
        values: Tensor = self.twins(torch.cat([observation, action], -1))
        return values[..., 0]
