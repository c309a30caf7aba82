"""Putting the parts of a run together, in the order in which they need each other."""

from __future__ import annotations

import torch

from labels_db.database import Database
from labels_db.records import fits_of
from labels_db.run_config import Asking, NoFeedback, RunConfig, StateEntropy
from labels_db.storage import ArtifactStore
from trainer.agents.registry import make_agent
from trainer.arithmetic import set_up_arithmetic
from trainer.collector import Collector
from trainer.environments import make_environment
from trainer.episodes import EpisodePool
from trainer.exploration import StateEntropyReward
from trainer.feedback import Feedback, RecordedFits
from trainer.journal import Journal, SilentJournal
from trainer.preferences import AnsweredQueries
from trainer.randomness import Randomness
from trainer.reward_source import ModelReward, make_reward_source
from trainer.threads import threads_of
from trainer.training import Training, Upkeep


class Foundation:
    """What training and its feedback both stand on: chance, the reward, and the episodes to ask about."""

    def __init__(self, config: RunConfig, device: torch.device) -> None:
        set_up_arithmetic(threads_of(config))
        self.config = config
        self.device = device
        self.randomness = Randomness(config.seed)
        self.reward = make_reward_source(config, self.randomness, device)
        self.model = self.reward.model if isinstance(self.reward, ModelReward) else None
        self.pool = (
            EpisodePool(config.feedback.pool_episodes) if isinstance(config.feedback, Asking) else None
        )

    def training(
        self, *, feedback: Feedback, answered: AnsweredQueries | None, journal: Journal, upkeep: Upkeep
    ) -> Training:
        """The run at its first step."""
        config, randomness = self.config, self.randomness
        environments = [make_environment(config.environment) for _ in range(config.environments)]
        agent = make_agent(config, randomness, self.device)
        explores = config.exploration if isinstance(config.exploration, StateEntropy) else None
        training = Training(
            config=config,
            randomness=randomness,
            collector=Collector(environments, config.seed, self.pool),
            agent=agent,
            reward=self.reward,
            model=self.model,
            intrinsic=StateEntropyReward(explores, agent.buffer, randomness) if explores else None,
            feedback=feedback,
            answered=answered,
            journal=journal,
            upkeep=upkeep,
        )
        training.collector.start()
        return training


def assemble(
    config: RunConfig,
    *,
    feedback: Feedback,
    answered: AnsweredQueries | None,
    journal: Journal,
    upkeep: Upkeep,
    device: torch.device,
) -> Training:
    """A run at its first step whose feedback needs nothing of it."""
    return Foundation(config, device).training(
        feedback=feedback, answered=answered, journal=journal, upkeep=upkeep
    )


def replayed_run(
    config: RunConfig, database: Database, store: ArtifactStore, run_id: str, upkeep: Upkeep
) -> Training:
    """The run again from its configuration, seed, answers and fits; it writes nothing."""
    with database.read() as session:
        fits = [(fit.step, fit.cursor) for fit in fits_of(session, run_id)]
    device = torch.device("cpu")
    asks = not isinstance(config.feedback, NoFeedback)
    return assemble(
        config,
        feedback=RecordedFits(fits),
        answered=AnsweredQueries(database, store, run_id, device) if asks else None,
        journal=SilentJournal(),
        upkeep=upkeep,
        device=device,
    )
