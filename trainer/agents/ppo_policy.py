"""The deterministic policy of PPO, as layers of plain arrays."""

from __future__ import annotations

from typing import Any

from labels_db.run_config import PPO, RunConfig
from trainer.agents.normaliser import Normaliser
from trainer.policy_layers import PolicyLayer


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
