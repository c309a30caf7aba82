"""Proximal policy optimisation (Schulman et al. 2017) by stable-baselines3, inside our own loop.

Its policy, its rollout buffer and its `train()` are used, never its `learn()`: our loop steps the environments
and hands it whatever reward it learns from. Rewards stay in a replay buffer until a rollout is complete, so
that a new reward model relabels them too; what a truncated episode would have gone on to earn is added last.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import stable_baselines3
import torch
from numpy.typing import NDArray

from labels_db.run_config import PPO, RunConfig, StateEntropy
from trainer.agents.interface import BatchReward
from trainer.agents.library_randomness import LibraryRandomness
from trainer.agents.normaliser import Normaliser
from trainer.agents.ppo_library import (
    PPOLosses,
    hand_over,
    keep_noise,
    keep_policy,
    new_library,
    noise_of,
)
from trainer.agents.rollout import Rollout
from trainer.collector import Transitions
from trainer.randomness import Randomness
from trainer.replay_buffer import ReplayBuffer, RewardFunction

Array = NDArray[np.float32]


class PPOAgent:
    """Learns from each rollout once it is complete, then forgets it."""

    def __init__(self, config: RunConfig, randomness: Randomness, device: torch.device) -> None:
        assert isinstance(config.agent, PPO)
        self.config = config.agent
        self.total_steps = config.total_steps
        self.environments = config.environments
        known = config.catalogue_entry
        self._sizes = (known.observation_size, known.action_size)
        self._luck = LibraryRandomness(randomness.seed, "ppo", device)
        self._device = device
        self._library = self._new_library()
        self.normaliser = Normaliser(known.observation_size, learns=self.config.normalise_observations)
        self.buffer = ReplayBuffer(config.agent.transitions_kept(config), *self._sizes, device)
        self.rollout = Rollout(self.config.rollout_steps, self.environments, *self._sizes)
        self.steps = 0
        explores = isinstance(config.exploration, StateEntropy)
        self.epochs = self.config.exploring_epochs if explores else self.config.epochs
        self._starts = np.ones(self.environments, np.float32)
        self._following = np.zeros((self.environments, known.observation_size), np.float32)
        self._chosen: dict[str, Array] = {}

    def _new_library(self) -> stable_baselines3.PPO:
        with self._luck():
            return new_library(self.config, self._sizes, self.environments, self._device)

    def begin_anew(self, updates: int, reward: BatchReward | None) -> None:
        """A new value network and a new optimiser; the policy stays. Exploration's many epochs are over.

        A complete rollout is learned from first. An unfinished one goes, since its values are those of the old
        network; without one there is nothing to update on.
        """
        del updates
        self.learn(reward, 0)
        old, self._library = self._library, self._new_library()
        keep_policy(self._library, old)
        self.rollout.filled = 0
        self.epochs = self.config.epochs

    # Acting and remembering ----------------------------------------------------------------------

    @torch.no_grad()
    def act(self, observations: Array, *, explore: bool) -> Array:
        """Actions [N, A] in [−1, 1] for observations [N, D]: sampled while exploring, the mean otherwise."""
        policy = self._library.policy
        if not explore:
            seen = torch.as_tensor(self.normaliser(observations), device=self._device)
            return _clipped(policy.get_distribution(seen).mode())
        self.normaliser.update(observations)
        normalised = self.normaliser(observations)
        with self._luck():
            if self.config.state_dependent_noise and self.rollout.filled % self.config.noise_steps == 0:
                policy.reset_noise(self.environments)
            actions, values, log_probs = policy(torch.as_tensor(normalised, device=self._device))
        self._chosen = {
            "observations": normalised,
            "actions": actions.cpu().numpy(),
            "values": values[:, 0].cpu().numpy(),
            "log_probs": log_probs.cpu().numpy(),
        }
        return _clipped(actions)

    def observe(self, transitions: Transitions, rewards: torch.Tensor) -> None:
        """Remember one step of N environments with its rewards [N]."""
        self.buffer.remember(transitions, rewards)
        cut_off = transitions.ended & ~transitions.terminated
        ahead = np.zeros(self.environments, np.float32)
        if cut_off.any():
            ahead = np.where(cut_off, self.config.discount * self._values(transitions.next_observations), 0)
        self.rollout.append(**self._chosen, starts=self._starts, bootstraps=ahead.astype(np.float32))
        self._starts = transitions.ended.astype(np.float32)
        self._following = transitions.next_observations
        self.steps += self.environments

    def relabel(self, reward: RewardFunction, between_parts: Callable[[], None]) -> None:
        self.buffer.relabel(reward, between_parts)

    @torch.no_grad()
    def _values(self, observations: Array) -> Array:
        """V of raw observations, [N, D] → [N]."""
        seen = torch.as_tensor(self.normaliser(observations), device=self._device)
        values: Array = self._library.policy.predict_values(seen)[:, 0].cpu().numpy()
        return values

    # Learning ------------------------------------------------------------------------------------

    def learn(self, reward: BatchReward | None, steps: int) -> PPOLosses | None:
        """Once a rollout is complete: all epochs over it."""
        if not self.rollout.full:
            return None
        batch = self.buffer.latest(self.config.rollout_steps * self.environments)
        rewards = (batch.reward if reward is None else reward(batch)).cpu().numpy()
        library = self._library
        rewards = rewards.reshape(self.config.rollout_steps, self.environments)
        hand_over(library, self.rollout, rewards, self._values(self._following), self._starts)
        library._current_progress_remaining = 1 - self.steps / self.total_steps
        library.n_epochs = self.epochs
        with self._luck():
            library.train()
        self.rollout.filled = 0
        return PPOLosses({**library.logger.name_to_value, "batch_reward": float(rewards.mean())})

    # Checkpoints ---------------------------------------------------------------------------------

    def state(self) -> dict[str, Any]:
        """Everything but the buffer's rows, which checkpoints keep in chunks."""
        return {
            "policy": self._library.policy.state_dict(),
            "optimizer": self._library.policy.optimizer.state_dict()["state"],
            "noise": noise_of(self._library),
            "luck": self._luck.state(),
            "normaliser": self.normaliser.state(),
            "rollout": self.rollout.state(),
            "steps": self.steps,
            "epochs": self.epochs,
            "updates": self._library._n_updates,
            "starts": self._starts,
            "following": self._following,
        }

    def load(self, state: dict[str, Any]) -> None:
        policy = self._library.policy
        policy.load_state_dict(state["policy"])
        groups = policy.optimizer.state_dict()["param_groups"]
        policy.optimizer.load_state_dict({"state": state["optimizer"], "param_groups": groups})
        keep_noise(self._library, state["noise"])
        self._luck.load(state["luck"])
        self.normaliser.load(state["normaliser"])
        self.rollout.load(state["rollout"])
        if len(self.buffer) < self.rollout.filled * self.environments:
            self.rollout.filled = 0  # a finished run that was extended has dropped the transitions
        self._library._n_updates = state["updates"]
        self.steps, self.epochs = state["steps"], state["epochs"]
        self._starts, self._following = state["starts"], state["following"]


def _clipped(actions: torch.Tensor) -> Array:
    clipped: Array = actions.clamp(-1, 1).cpu().numpy()
    return clipped
