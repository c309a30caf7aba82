"""One update of soft actor-critic under autograd: plain, on any device, and the reference of the fast one."""

from __future__ import annotations

from typing import TYPE_CHECKING

import torch
import torch.nn.functional as F  # noqa: N812  (PyTorch's own convention)
from torch import Tensor

from trainer.adam import FlatAdam
from trainer.agents.sac_update import SACLosses
from trainer.replay_buffer import Batch

if TYPE_CHECKING:
    from trainer.agents.sac import SACAgent


class AutogradUpdate:
    """Steps an agent's critics, then its actor and temperature."""

    def __init__(self, agent: SACAgent) -> None:
        self.agent = agent

    def __call__(self, batch: Batch, rewards: Tensor, noise: Tensor) -> SACLosses:
        agent = self.agent
        target = self.target(batch, rewards, noise[0])
        values = agent.critic(batch.observation, batch.action)
        _step(agent.critic_optimizer, F.mse_loss(values[0], target) + F.mse_loss(values[1], target))
        action, log_prob = agent.actor.sample(batch.observation, noise[1])
        agent.critic.requires_grad_(False)
        chosen = agent.critic(batch.observation, action)
        actor_loss = (agent.temperature * log_prob - chosen.amin(0)).mean()
        surplus = -log_prob.detach().mean() - agent.target_entropy
        _step(agent.actor_optimizer, actor_loss + agent.log_temperature.exp() * surplus)
        agent.critic.requires_grad_(True)
        error = values.detach() - target
        return SACLosses(error, chosen.detach(), log_prob.detach(), agent.temperature, rewards)

    def refresh(self) -> None:
        """Autograd reads the networks as they are."""

    target_moved = refresh

    @torch.no_grad()
    def target(self, batch: Batch, rewards: Tensor, noise: Tensor) -> Tensor:
        """y = r + γ·not_terminated·(min Q̄(s', a') − α·log π(a'|s')): truncated episodes bootstrap."""
        agent = self.agent
        action, log_prob = agent.actor.sample(batch.next_observation, noise)
        values = agent.target_critic(batch.next_observation, action).amin(0)
        future: Tensor = batch.not_terminated * (values - agent.temperature * log_prob)
        return rewards + agent.config.discount * future


def _step(optimizer: FlatAdam, loss: Tensor) -> None:
    optimizer.clear()
    loss.backward()  # type: ignore[no-untyped-call]
    optimizer.step()
