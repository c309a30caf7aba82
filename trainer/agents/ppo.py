"""Proximal policy optimisation (Schulman et al. 2017) by stable-baselines3, inside our own loop.

Its policy, its rollout buffer and its `train()` are used, never its `learn()`: our loop steps the environments
and hands it whatever reward it learns from. Rewards stay in a replay buffer until a rollout is complete, so
that a new reward model relabels them too; what a truncated episode would have gone on to earn is added last.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import stable_baselines3
import torch
from gymnasium import spaces
from numpy.typing import NDArray
from stable_baselines3.common.logger import Logger

from labels_db.run_config import PPO, RunConfig
from trainer.agents.interface import BatchReward
from trainer.agents.library_randomness import LibraryRandomness
from trainer.agents.normaliser import Normaliser
from trainer.agents.rollout import Rollout
from trainer.collector import Transitions
from trainer.policy_layers import PolicyLayer
from trainer.randomness import Randomness
from trainer.replay_buffer import ReplayBuffer, RewardFunction

Array = NDArray[np.float32]


@dataclass(frozen=True)
class PPOLosses:
    """What stable-baselines3 logged of one update."""

    logged: dict[str, float]

    def read(self) -> dict[str, float]:
        """The losses by name; the explained variance only where returns vary, for else it is none."""
        named = {name.removeprefix("train/"): float(value) for name, value in self.logged.items()}
        explained = named.pop("explained_variance", math.nan)
        return named if math.isnan(explained) else {**named, "explained_variance": explained}


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
        self._library = self._new_library(device)
        self.normaliser = Normaliser(known.observation_size, learns=self.config.normalise_observations)
        self.buffer = ReplayBuffer(config.agent.transitions_kept(config), *self._sizes, device)
        self.rollout = Rollout(self.config.rollout_steps, self.environments, *self._sizes)
        self.steps = 0
        self._starts = np.ones(self.environments, np.float32)
        self._following = np.zeros((self.environments, known.observation_size), np.float32)
        self._chosen: dict[str, Array] = {}

    def _new_library(self, device: torch.device) -> stable_baselines3.PPO:
        """Networks, optimiser and rollout buffer, without an environment of its own."""
        config = self.config
        library = stable_baselines3.PPO(
            "MlpPolicy",
            None,  # its spaces are set below
            learning_rate=config.learning_rate,
            n_steps=config.rollout_steps,
            batch_size=config.batch_size,
            gamma=config.discount,
            gae_lambda=config.gae_lambda,
            clip_range=self._clip_range,
            ent_coef=config.entropy_bonus,
            use_sde=config.state_dependent_noise,
            sde_sample_freq=config.noise_steps,
            policy_kwargs={"net_arch": [config.width] * config.depth},
            device=device,
            _init_setup_model=False,
        )
        observation_size, action_size = self._sizes
        library.observation_space = spaces.Box(-np.inf, np.inf, (observation_size,), np.float32)
        library.action_space = spaces.Box(-1.0, 1.0, (action_size,), np.float32)
        library.n_envs = self.environments
        with self._luck():
            library._setup_model()
        library.set_logger(Logger(folder=None, output_formats=[]))
        return library

    def _clip_range(self, remaining: float) -> float:
        return self.config.clip_range * (remaining if self.config.clip_schedule == "linear" else 1.0)

    def begin_anew(self, updates: int, reward: BatchReward | None) -> None:
        """A new value network and a new optimiser; the policy stays.

        A complete rollout is learned from first. An unfinished one goes, since its values are those of the old
        network; without one there is nothing to update on.
        """
        del updates
        self.learn(reward, 0)
        old = self._library
        self._library = self._new_library(old.device)
        kept = {name: weights for name, weights in old.policy.state_dict().items() if _of_the_policy(name)}
        self._library.policy.load_state_dict({**self._library.policy.state_dict(), **kept})
        self.rollout.filled = 0

    # Acting and remembering ----------------------------------------------------------------------

    @torch.no_grad()
    def act(self, observations: Array, *, explore: bool) -> Array:
        """Actions [N, A] in [−1, 1] for observations [N, D]: sampled while exploring, the mean otherwise."""
        policy = self._library.policy
        if not explore:
            seen = torch.as_tensor(self.normaliser(observations), device=self._library.device)
            return _clipped(policy.get_distribution(seen).mode())
        self.normaliser.update(observations)
        normalised = self.normaliser(observations)
        with self._luck():
            if self.config.state_dependent_noise and self.rollout.filled % self.config.noise_steps == 0:
                policy.reset_noise(self.environments)
            actions, values, log_probs = policy(torch.as_tensor(normalised, device=self._library.device))
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
        seen = torch.as_tensor(self.normaliser(observations), device=self._library.device)
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
        self._hand_over(rewards.reshape(self.config.rollout_steps, self.environments))
        library._current_progress_remaining = 1 - self.steps / self.total_steps
        library.n_epochs = self.config.epochs if reward is None else self.config.exploring_epochs
        with self._luck():
            library.train()
        self.rollout.filled = 0
        return PPOLosses({**library.logger.name_to_value, "batch_reward": float(rewards.mean())})

    def _hand_over(self, rewards: Array) -> None:
        """Fill the library's rollout buffer: rewards [T, N] with what cut-off episodes would go on to earn."""
        buffer, columns = self._library.rollout_buffer, self.rollout.columns
        buffer.reset()
        for step, reward in enumerate(rewards + columns["bootstraps"]):
            buffer.add(
                columns["observations"][step],
                columns["actions"][step],
                reward,
                columns["starts"][step],
                torch.from_numpy(columns["values"][step]),
                torch.from_numpy(columns["log_probs"][step]),
            )
        last_values = torch.from_numpy(self._values(self._following))
        buffer.compute_returns_and_advantage(last_values=last_values, dones=self._starts)

    # Checkpoints ---------------------------------------------------------------------------------

    def state(self) -> dict[str, Any]:
        """Everything but the buffer's rows, which checkpoints keep in chunks."""
        return {
            "policy": self._library.policy.state_dict(),
            "optimizer": self._library.policy.optimizer.state_dict()["state"],
            "noise": self._noise(self._library),
            "luck": self._luck.state(),
            "normaliser": self.normaliser.state(),
            "rollout": self.rollout.state(),
            "steps": self.steps,
            "updates": self._library._n_updates,
            "starts": self._starts,
            "following": self._following,
        }

    def load(self, state: dict[str, Any]) -> None:
        policy = self._library.policy
        policy.load_state_dict(state["policy"])
        groups = policy.optimizer.state_dict()["param_groups"]
        policy.optimizer.load_state_dict({"state": state["optimizer"], "param_groups": groups})
        self._keep_noise(state["noise"])
        self._luck.load(state["luck"])
        self.normaliser.load(state["normaliser"])
        self.rollout.load(state["rollout"])
        if len(self.buffer) < self.rollout.filled * self.environments:
            self.rollout.filled = 0  # a finished run that was extended has dropped the transitions
        self._library._n_updates = state["updates"]
        self.steps, self._starts, self._following = state["steps"], state["starts"], state["following"]

    def _noise(self, library: stable_baselines3.PPO) -> dict[str, torch.Tensor]:
        """The functions of the state that actions stray by until they are drawn anew."""
        drawn = library.policy.action_dist
        return {name: getattr(drawn, name) for name in NOISE if self.config.state_dependent_noise}

    def _keep_noise(self, noise: dict[str, torch.Tensor]) -> None:
        for name, value in noise.items():
            setattr(self._library.policy.action_dist, name, value.to(self._library.device))


NOISE = ("exploration_mat", "exploration_matrices")
"""What `reset_noise` draws."""


def _of_the_policy(name: str) -> bool:
    return not name.startswith(("value_net", "mlp_extractor.value_net"))


def _clipped(actions: torch.Tensor) -> Array:
    clipped: Array = actions.clamp(-1, 1).cpu().numpy()
    return clipped


def policy_layers(config: RunConfig, state: dict[str, Any]) -> list[PolicyLayer]:
    """The mean action of a saved state, the normaliser first."""
    assert isinstance(config.agent, PPO)
    normaliser = Normaliser(
        config.catalogue_entry.observation_size, learns=config.agent.normalise_observations
    )
    normaliser.load(state["normaliser"])
    weights = {name: value.numpy() for name, value in state["policy"].items()}
    names = [f"mlp_extractor.policy_net.{2 * index}" for index in range(config.agent.depth)]
    hidden = [PolicyLayer(weights[f"{n}.weight"].T, weights[f"{n}.bias"], "tanh") for n in names]
    last = PolicyLayer(weights["action_net.weight"].T, weights["action_net.bias"], "clip_1")
    return [*([normaliser.layer()] if normaliser.learns else []), *hidden, last]
