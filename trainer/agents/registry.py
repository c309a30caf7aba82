"""Agents by the type of their configuration."""

from __future__ import annotations

from collections.abc import Callable
from types import MappingProxyType
from typing import Any

import torch

from labels_db.run_config import PPO, SAC, RunConfig
from trainer.agents import ppo_policy, sac
from trainer.agents.interface import Agent
from trainer.policy_layers import PolicyLayer
from trainer.precision import product_precision
from trainer.randomness import Randomness


def make_agent(config: RunConfig, randomness: Randomness, device: torch.device) -> Agent:
    """The configured agent, shaped for the configured environment."""
    return AGENTS[type(config.agent)](config, randomness, device)


def policy_layers(config: RunConfig, state: dict[str, Any]) -> list[PolicyLayer]:
    """The deterministic policy of an agent's saved state."""
    return POLICIES[type(config.agent)](config, state)


def _sac(config: RunConfig, randomness: Randomness, device: torch.device) -> Agent:
    assert isinstance(config.agent, SAC)
    agent, rows = config.agent, config.agent.batch_size
    known, capacity = config.catalogue_entry, agent.transitions_kept(config)
    precision = product_precision(config, device, rows=rows, width=agent.width, depth=agent.depth)
    sizes = (known.observation_size, known.action_size)
    return sac.SACAgent(agent, *sizes, capacity, randomness, device, precision)


def _ppo(config: RunConfig, randomness: Randomness, device: torch.device) -> Agent:
    from trainer.agents.ppo import PPOAgent  # stable-baselines3 takes a second to import

    return PPOAgent(config, randomness, device)


AGENTS: MappingProxyType[type, Callable[[RunConfig, Randomness, torch.device], Agent]] = MappingProxyType(
    {SAC: _sac, PPO: _ppo}
)
POLICIES: MappingProxyType[type, Callable[[RunConfig, dict[str, Any]], list[PolicyLayer]]] = MappingProxyType(
    {SAC: sac.policy_layers, PPO: ppo_policy.policy_layers}
)
