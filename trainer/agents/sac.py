"""Soft actor-critic (Haarnoja et al. 2018) with two critics and a learned temperature."""

from __future__ import annotations

import copy
from collections.abc import Callable, Iterable
from typing import Any

import numpy as np
import torch
import torch.nn.functional as F  # noqa: N812  (PyTorch's own convention)
from numpy.typing import NDArray
from torch import Tensor

from labels_db.run_config import SAC
from trainer.networks import Actor, Critic
from trainer.randomness import Randomness
from trainer.replay_buffer import Batch, ReplayBuffer, RewardFunction

BatchReward = Callable[[Batch], Tensor]
"""The reward an update learns from: stored, or computed for the batch of the moment."""


def stored_reward(batch: Batch) -> Tensor:
    return batch.reward


class SACAgent:
    """Learns from whatever reward it is handed; it cannot tell a learned one from a true one."""

    def __init__(
        self,
        config: SAC,
        observation_size: int,
        action_size: int,
        capacity: int,
        randomness: Randomness,
        device: torch.device,
    ) -> None:
        self.config = config
        self.sizes = (observation_size, action_size)
        self.device = device
        self._weights = randomness.torch("agent weights")
        self._acting = randomness.torch("agent acting", device)
        self._sampling = randomness.torch("agent sampling", device)
        self.buffer = ReplayBuffer(capacity, observation_size, action_size, device)
        self.actor = Actor(*self.sizes, config.width, config.depth, self._weights).to(device)
        self.log_temperature = torch.tensor(
            np.log(config.initial_temperature), dtype=torch.float32, device=device
        )
        self.log_temperature.requires_grad_()
        self.actor_optimizer = _adam(self.actor.parameters(), config.learning_rate)
        self.temperature_optimizer = _adam([self.log_temperature], config.temperature_learning_rate)
        self.target_entropy = -float(action_size)
        self.updates = 0
        self.reset_critic()

    def reset_critic(self) -> None:
        """New critics, targets and optimiser; actor and temperature stay (after exploration, §1)."""
        self.critic = Critic(*self.sizes, self.config.width, self.config.depth, self._weights).to(self.device)
        self.target_critic = copy.deepcopy(self.critic).requires_grad_(False)
        self.critic_optimizer = _adam(self.critic.parameters(), self.config.learning_rate)

    # Acting and remembering ----------------------------------------------------------------------

    @torch.no_grad()
    def act(self, observations: NDArray[np.float32], *, explore: bool) -> NDArray[np.float32]:
        """Actions [N, A] in [−1, 1] for observations [N, D]: sampled while exploring, tanh(μ) otherwise."""
        observed = torch.as_tensor(observations, device=self.device)
        chosen = self.actor.sample(observed, self._acting)[0] if explore else self.actor.best(observed)
        actions: NDArray[np.float32] = chosen.cpu().numpy()
        return actions

    def observe(
        self,
        observations: NDArray[np.float32],
        actions: NDArray[np.float32],
        rewards: NDArray[np.float32],
        next_observations: NDArray[np.float32],
        terminated: NDArray[np.bool_],
    ) -> None:
        """Remember N transitions."""
        columns = (observations, actions, rewards, next_observations, terminated)
        self.buffer.add(*(torch.as_tensor(column, device=self.device) for column in columns))

    def relabel(self, reward: RewardFunction) -> None:
        self.buffer.relabel(reward)

    # Learning ------------------------------------------------------------------------------------

    def update(self, reward: BatchReward = stored_reward) -> dict[str, float]:
        """One gradient step of critics, actor and temperature; returns the losses."""
        batch = self.buffer.sample(self.config.batch_size, self._sampling)
        rewards = reward(batch)
        critic_loss = self._update_critic(batch, rewards)
        actor_loss, entropy = self._update_actor(batch)
        self.updates += 1
        if self.updates % self.config.target_every == 0:
            self._update_target()
        return {
            "critic_loss": critic_loss,
            "actor_loss": actor_loss,
            "entropy": entropy,
            "temperature": float(self.temperature),
            "batch_reward": float(rewards.mean()),
        }

    @property
    def temperature(self) -> Tensor:
        return self.log_temperature.detach().exp()

    @torch.no_grad()
    def target(self, batch: Batch, rewards: Tensor) -> Tensor:
        """y = r + γ·not_terminated·(min Q̄(s', a') − α·log π(a'|s')): truncated episodes bootstrap."""
        action, log_prob = self.actor.sample(batch.next_observation, self._sampling)
        values = self.target_critic(batch.next_observation, action).amin(0) - self.temperature * log_prob
        future: Tensor = batch.not_terminated * values
        return rewards + self.config.discount * future

    def _update_critic(self, batch: Batch, rewards: Tensor) -> float:
        target = self.target(batch, rewards)
        values = self.critic(batch.observation, batch.action)
        loss = F.mse_loss(values[0], target) + F.mse_loss(values[1], target)
        _step(self.critic_optimizer, loss)
        return float(loss.detach())

    def _update_actor(self, batch: Batch) -> tuple[float, float]:
        action, log_prob = self.actor.sample(batch.observation, self._sampling)
        self.critic.requires_grad_(False)
        values = self.critic(batch.observation, action).amin(0)
        loss = (self.temperature * log_prob - values).mean()
        _step(self.actor_optimizer, loss)
        self.critic.requires_grad_(True)
        self._update_temperature(log_prob.detach())
        return float(loss.detach()), -float(log_prob.detach().mean())

    def _update_temperature(self, log_prob: Tensor) -> None:
        loss = (self.log_temperature.exp() * (-log_prob - self.target_entropy)).mean()
        _step(self.temperature_optimizer, loss)

    @torch.no_grad()
    def _update_target(self) -> None:
        for target, source in zip(self.target_critic.parameters(), self.critic.parameters(), strict=True):
            target.lerp_(source, self.config.target_rate)

    # Checkpoints ---------------------------------------------------------------------------------

    def state(self) -> dict[str, Any]:
        """Everything but the buffer's rows, which checkpoints keep in chunks."""
        return {
            "actor": self.actor.state_dict(),
            "critic": self.critic.state_dict(),
            "target_critic": self.target_critic.state_dict(),
            "log_temperature": self.log_temperature.detach(),
            "updates": self.updates,
            "actor_optimizer": self.actor_optimizer.state_dict(),
            "critic_optimizer": self.critic_optimizer.state_dict(),
            "temperature_optimizer": self.temperature_optimizer.state_dict(),
        }

    def load(self, state: dict[str, Any]) -> None:
        self.actor.load_state_dict(state["actor"])
        self.critic.load_state_dict(state["critic"])
        self.target_critic.load_state_dict(state["target_critic"])
        with torch.no_grad():
            self.log_temperature.copy_(state["log_temperature"])
        self.updates = state["updates"]
        self.actor_optimizer.load_state_dict(state["actor_optimizer"])
        self.critic_optimizer.load_state_dict(state["critic_optimizer"])
        self.temperature_optimizer.load_state_dict(state["temperature_optimizer"])


def _adam(parameters: Iterable[Tensor], learning_rate: float) -> torch.optim.Adam:
    """Adam as one fused operation: on small networks a third of an update's time otherwise."""
    return torch.optim.Adam(parameters, lr=learning_rate, fused=True)


def _step(optimizer: torch.optim.Optimizer, loss: Tensor) -> None:
    optimizer.zero_grad(set_to_none=True)
    loss.backward()  # type: ignore[no-untyped-call]
    optimizer.step()
