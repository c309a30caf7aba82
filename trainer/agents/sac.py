"""Soft actor-critic (Haarnoja et al. 2018) with two critics and a learned temperature."""

from __future__ import annotations

import copy
import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, cast

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from trainer.adam import FlatAdam
from trainer.agents.interface import BatchReward
from trainer.agents.on_gpu import ActorBeside, CapturedUpdate
from trainer.agents.sac_by_hand import UpdateByHand
from trainer.agents.sac_update import SACLosses, Update
from trainer.devices import on_device
from trainer.networks import Actor, Critic
from trainer.policy_layers import PolicyLayer
from trainer.randomness import Randomness
from trainer.replay_buffer import ReplayBuffer, RewardFunction

if TYPE_CHECKING:
    from labels_db.run_config import SAC, RunConfig
    from trainer.collector import Transitions


class ActorItself:
    """Acts by what it has learned up to now: there is nothing to wait for on a CPU."""

    def __init__(self, actor: Actor) -> None:
        self._actor = actor

    def follow(self) -> None:
        """It learns and acts in one."""

    def explore(self, observations: NDArray[np.float32], generator: torch.Generator) -> NDArray[np.float32]:
        """Actions [N, A] drawn for observations [N, D]."""
        noise = torch.randn(len(observations), self._actor.trunk.sizes[-1] // 2, generator=generator)
        actions: NDArray[np.float32] = self._actor.explore(torch.from_numpy(observations), noise).numpy()
        return actions


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
        precision: torch.dtype = torch.float32,
    ) -> None:
        self.config = config
        self.precision = precision
        self.sizes = (observation_size, action_size)
        self.device = device
        self._weights = randomness.torch("agent weights")
        self._acting = randomness.torch("agent acting", device)
        self._sampling = randomness.torch("agent sampling", device)
        self.buffer = ReplayBuffer(capacity, observation_size, action_size, device)
        self.actor = Actor(*self.sizes, config.width, config.depth, self._weights).to(device)
        self._explorer = ActorBeside(self.actor) if device.type == "cuda" else ActorItself(self.actor)
        log_temperature = torch.tensor(math.log(config.initial_temperature), device=device)
        self.log_temperature = log_temperature.requires_grad_()
        self.actor_optimizer = FlatAdam(
            (self.actor.trunk.flat, config.learning_rate),
            (self.log_temperature, config.temperature_learning_rate),
        )
        self.target_entropy = -float(action_size)
        self.updates = 0
        self.reset_critic()

    def reset_critic(self) -> None:
        """New critics, targets and optimiser; actor and temperature stay (after exploration, §1)."""
        size = (self.config.width, self.config.depth)
        critic = Critic(*self.sizes, *size, self._weights, normalised=self.config.layer_norm)
        self.critic = critic.to(self.device)
        self.target_critic = copy.deepcopy(self.critic).requires_grad_(False)
        self.critic_optimizer = FlatAdam((self.critic.twins.flat, self.config.learning_rate))
        by_hand = UpdateByHand(self, self.precision)
        self._update: Update = CapturedUpdate(by_hand) if self.device.type == "cuda" else by_hand

    def begin_anew(self, updates: int, reward: BatchReward | None) -> None:
        """New critics, and so many updates of them; the actor stays."""
        del reward  # every transition stays: there is nothing to finish first
        self.reset_critic()
        for _ in range(updates):
            self.update()
        self._explorer.follow()

    # Acting and remembering ----------------------------------------------------------------------

    @torch.no_grad()
    def act(self, observations: NDArray[np.float32], *, explore: bool) -> NDArray[np.float32]:
        """Actions [N, A] in [−1, 1] for observations [N, D]: sampled while exploring, tanh(μ) otherwise."""
        if explore:
            return self._explorer.explore(observations, self._acting)
        actions: NDArray[np.float32] = self.actor.best(on_device(observations, self.device)).cpu().numpy()
        return actions

    def observe(self, transitions: Transitions, rewards: Tensor) -> None:
        """Remember one step of N environments with its rewards [N]."""
        self.buffer.remember(transitions, rewards)

    def relabel(self, reward: RewardFunction, between_parts: Callable[[], None]) -> None:
        self.buffer.relabel(reward, between_parts)

    # Learning ------------------------------------------------------------------------------------

    def learn(self, reward: BatchReward | None, steps: int) -> SACLosses:
        """The configured number of updates for each of so many steps; returns the last one's losses."""
        self._explorer.follow()
        for _ in range(self.config.updates_per_step * steps):
            losses = self.update(reward)
        return losses

    def update(self, reward: BatchReward | None = None) -> SACLosses:
        """One gradient step of critics, actor and temperature; returns the losses."""
        batch = self.buffer.sample(self.config.batch_size, self._sampling)
        size = (2, self.config.batch_size, self.sizes[1])
        noise = torch.randn(size, generator=self._sampling, device=self.device)
        losses = self._update(batch, batch.reward if reward is None else reward(batch), noise)
        self.updates += 1
        if self.updates % self.config.target_every == 0:
            self._update_target()
        return losses

    @property
    def temperature(self) -> Tensor:
        return self.log_temperature.detach().exp()

    @torch.no_grad()
    def _update_target(self) -> None:
        self.target_critic.twins.flat.lerp_(self.critic.twins.flat, self.config.target_rate)
        self._update.target_moved()

    # Checkpoints ---------------------------------------------------------------------------------

    def state(self) -> dict[str, Any]:
        """Everything but the buffer's rows, which checkpoints keep in chunks."""
        return {
            "actor": self.actor.state_dict(),
            "critic": self.critic.state_dict(),
            "target_critic": self.target_critic.state_dict(),
            "log_temperature": self.log_temperature.detach(),
            "updates": self.updates,
            "actor_optimizer": self.actor_optimizer.state(),
            "critic_optimizer": self.critic_optimizer.state(),
        }

    def load(self, state: dict[str, Any]) -> None:
        self.actor.load_state_dict(state["actor"])
        self.critic.load_state_dict(state["critic"])
        self.target_critic.load_state_dict(state["target_critic"])
        with torch.no_grad():
            self.log_temperature.copy_(state["log_temperature"])
        self.updates = state["updates"]
        self.actor_optimizer.load(state["actor_optimizer"])
        self.critic_optimizer.load(state["critic_optimizer"])
        self._update.refresh()
        self._explorer.follow()


def policy_layers(config: RunConfig, state: dict[str, Any]) -> list[PolicyLayer]:
    """tanh(μ) of a saved state: the last layer's columns for log σ are left out."""
    agent, known = cast("SAC", config.agent), config.catalogue_entry
    sizes = (known.observation_size, known.action_size, agent.width, agent.depth)
    actor = Actor(*sizes, torch.Generator())
    actor.load_state_dict(state["actor"])
    layers = [(w[0].numpy(), b[0, 0].numpy()) for w, b in actor.trunk.layers(actor.trunk.flat.detach())]
    *hidden, (weight, bias) = layers
    mean = weight[:, : known.action_size], bias[: known.action_size]
    return [*(PolicyLayer(*layer, "relu") for layer in hidden), PolicyLayer(*mean, "tanh")]
