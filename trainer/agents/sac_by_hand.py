"""One update of soft actor-critic with every gradient worked out by hand: the fast path on a CPU.

With u = μ + σ·ε and a = tanh(u), the derivative of log π(a|s) by u at fixed noise ε is 2a, by log σ it is −1;
the rest is the chain rule through the networks. `AutogradUpdate` is the same, and the reference. Small tensors
dominate here, so constants are tensors (a number costs a conversion each time) and operations are fused ones.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import torch
import torch.nn.functional as F  # noqa: N812  (PyTorch's own convention)
from torch import Tensor

from trainer.agents.sac_update import SACLosses
from trainer.networks import Actor
from trainer.passes import Passes, Room
from trainer.replay_buffer import Batch

if TYPE_CHECKING:
    from trainer.agents.sac import SACAgent

HALF_RANGE = 0.5 * (Actor.LOG_STD_MAX - Actor.LOG_STD_MIN)


@dataclass(frozen=True)
class Sampled:
    """Actions [n, A] drawn from the policy, their log-probabilities [n], and what gradients need of their making."""

    action: Tensor
    log_prob: Tensor
    spread: Tensor
    """σ·ε."""
    squashed: Tensor
    """tanh of the network's raw second output, which log σ is made of."""

    def __getitem__(self, rows: slice) -> Sampled:
        return Sampled(self.action[rows], self.log_prob[rows], self.spread[rows], self.squashed[rows])


class UpdateByHand:
    """Steps an agent's critics, then its actor and temperature."""

    def __init__(self, agent: SACAgent, precision: torch.dtype) -> None:
        self.agent = agent
        # The actor's pass waits for its gradient while the critic's run, which never wait for one another.
        policy, values = Room(agent.device), Room(agent.device)
        self.actor = Passes(agent.actor.trunk, precision, policy)
        self.critic = Passes(agent.critic.twins, precision, values)
        self.target_critic = Passes(agent.target_critic.twins, precision, values)
        self._constant = {
            value: torch.tensor(value, device=agent.device)
            for value in (1.0, 2.0, HALF_RANGE, Actor.LOG_STD_MIN + HALF_RANGE)
        }

    @torch.no_grad()
    def __call__(self, batch: Batch, rewards: Tensor, noise: Tensor) -> SACLosses:
        count = len(rewards)
        observations = torch.cat([batch.next_observation, batch.observation])
        sampled = self.sample(observations, noise.flatten(0, 1))
        error = self._learn_values(batch, self.target(batch, rewards, sampled[:count]))
        values = self._learn_policy(batch, sampled[count:])
        log_prob, temperature = sampled.log_prob[count:], self.agent.temperature
        return SACLosses(error, values, log_prob, temperature, rewards)

    def refresh(self) -> None:
        for passes in (self.actor, self.critic, self.target_critic):
            passes.refresh()

    def target_moved(self) -> None:
        self.target_critic.refresh()

    def sample(self, observations: Tensor, noise: Tensor) -> Sampled:
        """Actions for observations [n, D] from noise [n, A]."""
        outputs = self.actor.forward(observations)[0].view(len(noise), 2, -1)
        mean, raw = outputs.transpose(0, 1).contiguous()
        squashed = torch.tanh(raw)
        log_std = torch.add(self._constant[Actor.LOG_STD_MIN + HALF_RANGE], squashed, alpha=HALF_RANGE)
        spread = log_std.exp() * noise
        before = mean + spread
        # Half the squashing's log-determinant but for its constant, then minus the log-density of the whole.
        squashing = before + F.softplus(before * -2)
        surprise = torch.addcmul(log_std, noise, noise, value=0.5).sub_(squashing, alpha=2).sum(1)
        constant = noise.shape[1] * (0.5 * math.log(2 * math.pi) + 2 * math.log(2))
        return Sampled(torch.tanh(before), -constant - surprise, spread, squashed)

    def target(self, batch: Batch, rewards: Tensor, following: Sampled) -> Tensor:
        """y = r + γ·not_terminated·(min Q̄(s', a') − α·log π(a'|s')): truncated episodes bootstrap."""
        inputs = torch.cat([batch.next_observation, following.action], -1)
        first, second = self.target_critic.forward(inputs)[..., 0]
        soft = torch.minimum(first, second).addcmul_(self.agent.temperature, following.log_prob, value=-1)
        return torch.addcmul(rewards, batch.not_terminated, soft, value=self.agent.config.discount)

    def _learn_values(self, batch: Batch, target: Tensor) -> Tensor:
        """Returns Q − y, [2, B]."""
        error = self.critic.forward(batch.inputs)[..., 0].sub_(target)
        self.critic.backward((error * (2 / len(target)))[..., None])
        self.agent.critic_optimizer.step()
        self.critic.refresh()
        return error

    def _learn_policy(self, batch: Batch, sampled: Sampled) -> Tensor:
        """Returns both values of the sampled actions, [2, B]."""
        agent, one = self.agent, self._constant[1.0]
        values = self.critic.forward(torch.cat([batch.observation, sampled.action], -1))[..., 0]
        by_action = self._descent_of_the_lesser(values, batch.observation.shape[1])
        weight = agent.temperature / len(sampled.action)
        slope = torch.addcmul(one, sampled.action, sampled.action, value=-1)
        by_before = torch.addcmul(sampled.action * (2 * weight), slope, by_action)
        slope = torch.addcmul(one, sampled.squashed, sampled.squashed, value=-1)
        by_raw = by_before * sampled.spread
        by_raw.sub_(weight).mul_(slope).mul_(self._constant[HALF_RANGE])
        self.actor.backward(torch.cat([by_before, by_raw], -1)[None])
        agent.log_temperature.grad = agent.temperature * (-sampled.log_prob.mean() - agent.target_entropy)
        agent.actor_optimizer.step()
        self.actor.refresh()
        return values

    def _descent_of_the_lesser(self, values: Tensor, observation_size: int) -> Tensor:
        """The gradient of −mean(min Q) by the actions [B, A]: each row's lesser critic is the one that counts."""
        share = -1 / values.shape[1]
        gradient = torch.empty(*values.shape, 1, device=values.device)
        torch.mul(values[0] <= values[1], share, out=gradient[0, :, 0])
        torch.add(gradient[0], -share, out=gradient[1]).neg_()
        delta = self.critic.backward(gradient, learn=False)
        both = self.critic.input_gradient(delta, slice(observation_size, None))
        return both[0] + both[1]
