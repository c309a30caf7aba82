"""Agents by the type of their configuration."""

from __future__ import annotations

import torch

from labels_db.run_config import SAC, RunConfig
from trainer.agents.sac import SACAgent
from trainer.precision import product_precision
from trainer.randomness import Randomness

AGENTS = {SAC: SACAgent}


def make_agent(config: RunConfig, randomness: Randomness, device: torch.device) -> SACAgent:
    """The configured agent, shaped for the configured environment."""
    known = config.catalogue_entry
    capacity = config.agent.replay_capacity or config.total_steps
    precision = product_precision(config, device, rows=config.agent.batch_size, width=config.agent.width)
    return AGENTS[type(config.agent)](
        config.agent, known.observation_size, known.action_size, capacity, randomness, device, precision
    )
