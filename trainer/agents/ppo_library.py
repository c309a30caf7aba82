"""stable-baselines3's PPO as we use it: its policy, optimiser, rollout buffer and `train()`, without an environment."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial

import numpy as np
import stable_baselines3
import torch
from gymnasium import spaces
from numpy.typing import NDArray
from stable_baselines3.common.logger import Logger

from labels_db.run_config import PPO
from trainer.agents.rollout import Rollout

Array = NDArray[np.float32]

NOISE = ("exploration_mat", "exploration_matrices")
"""What `reset_noise` draws."""


@dataclass(frozen=True)
class PPOLosses:
    """What stable-baselines3 logged of one update."""

    logged: dict[str, float]

    def read(self) -> dict[str, float]:
        """The losses by name; the explained variance only where returns vary, for else it is none."""
        named = {name.removeprefix("train/"): float(value) for name, value in self.logged.items()}
        explained = named.pop("explained_variance", math.nan)
        return named if math.isnan(explained) else {**named, "explained_variance": explained}


def new_library(
    config: PPO, sizes: tuple[int, int], environments: int, device: torch.device
) -> stable_baselines3.PPO:
    """New networks for observations and actions of those sizes; it draws from the global generators."""
    library = stable_baselines3.PPO(
        "MlpPolicy",
        None,  # its spaces are set below
        learning_rate=config.learning_rate,
        n_steps=config.rollout_steps,
        batch_size=config.batch_size,
        gamma=config.discount,
        gae_lambda=config.gae_lambda,
        clip_range=partial(_clip_range, config),
        ent_coef=config.entropy_bonus,
        use_sde=config.state_dependent_noise,
        sde_sample_freq=config.noise_steps,
        policy_kwargs={"net_arch": [config.width] * config.depth},
        device=device,
        _init_setup_model=False,
    )
    observation_size, action_size = sizes
    library.observation_space = spaces.Box(-np.inf, np.inf, (observation_size,), np.float32)
    library.action_space = spaces.Box(-1.0, 1.0, (action_size,), np.float32)
    library.n_envs = environments
    library._setup_model()
    library.set_logger(Logger(folder=None, output_formats=[]))
    return library


def _clip_range(config: PPO, remaining: float) -> float:
    return config.clip_range * (remaining if config.clip_schedule == "linear" else 1.0)


def keep_policy(library: stable_baselines3.PPO, old: stable_baselines3.PPO) -> None:
    """Act as the old one; what it expected of rewards is forgotten."""
    kept = {name: weights for name, weights in old.policy.state_dict().items() if _of_the_policy(name)}
    library.policy.load_state_dict({**library.policy.state_dict(), **kept})


def _of_the_policy(name: str) -> bool:
    return not name.startswith(("value_net", "mlp_extractor.value_net"))


def hand_over(
    library: stable_baselines3.PPO, rollout: Rollout, rewards: Array, last_values: Array, ended: Array
) -> None:
    """Fill its rollout buffer: rewards [T, N] with what cut-off episodes would go on to earn; V and ends [N] after."""
    buffer, columns = library.rollout_buffer, rollout.columns
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
    buffer.compute_returns_and_advantage(last_values=torch.from_numpy(last_values), dones=ended)


def noise_of(library: stable_baselines3.PPO) -> dict[str, torch.Tensor]:
    """The functions of the state that actions stray by until they are drawn anew."""
    drawn = library.policy.action_dist
    return {name: getattr(drawn, name) for name in NOISE if library.use_sde}


def keep_noise(library: stable_baselines3.PPO, noise: dict[str, torch.Tensor]) -> None:
    """Go on straying by those."""
    for name, value in noise.items():
        setattr(library.policy.action_dist, name, value.to(library.device))
