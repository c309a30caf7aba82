"""The training loop: PEBBLE's Algorithm 2; baselines and ablations put other parts in the same places."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from labels_db.models import Phase
from labels_db.run_config import RunConfig, StateEntropy
from trainer.agents.interface import Agent, Losses
from trainer.collector import Collector, Transitions
from trainer.exploration import StateEntropyReward
from trainer.feedback import Feedback
from trainer.journal import Journal
from trainer.preferences import AnsweredQueries
from trainer.randomness import Randomness
from trainer.reward_model import RewardModel
from trainer.reward_source import RewardSource


class Upkeep(Protocol):
    """What happens around the loop without changing what is learned."""

    def before_step(self, training: Training) -> None:
        """Obey people and say where training is; raises to end the attempt."""

    def after_step(self, training: Training, transitions: Transitions, losses: Losses | None) -> None:
        """Record, evaluate and checkpoint what is due."""

    def obey(self) -> None:
        """In the middle of something long: wait while people pause, raise when they stop the run."""

    def phase(self, phase: Phase) -> None:
        """Say what is being done."""

    def save(self, training: Training) -> None:
        """Keep how far training has come."""


class NoUpkeep:
    """For trainings without a record: nobody is obeyed, nobody told, nothing kept."""

    def before_step(self, training: Training) -> None: ...

    def after_step(self, training: Training, transitions: Transitions, losses: Losses | None) -> None: ...

    def obey(self) -> None: ...

    def phase(self, phase: Phase) -> None: ...

    def save(self, training: Training) -> None: ...


@dataclass
class Training:
    """The parts of one run and how far it has come."""

    config: RunConfig
    randomness: Randomness
    collector: Collector
    agent: Agent
    reward: RewardSource
    model: RewardModel | None
    intrinsic: StateEntropyReward | None
    feedback: Feedback
    answered: AnsweredQueries | None
    journal: Journal
    upkeep: Upkeep
    step: int = 0
    fits: int = 0
    relabelled: bool = True
    exploring: bool = True
    began_at: int = -1

    def train(self) -> None:
        """Explore, then learn from the reward until the steps are used up (Algorithm 2)."""
        while self.step < self.config.total_steps:
            self.upkeep.before_step(self)
            self.relabel_when_due()  # only if a stop broke it off
            while (cursor := self.feedback.before_step(self)) is not None:  # lines 9–14: ask
                self.learn_reward(cursor)  # lines 15–17: fit the reward, relabel
            self.end_exploration_when_due()
            losses = self.update() if self.can_learn() and self.step != self.began_at else None  # lines 19–21
            transitions = self.collector.step(self.choose_actions(), self.step)  # line 22
            self.agent.observe(transitions, self.reward.of(transitions))
            self.step += len(transitions.actions)
            self.upkeep.after_step(self, transitions, losses)

    # The reward ----------------------------------------------------------------------------------

    def learn_reward(self, cursor: int) -> None:
        """Fit r̂ to every answer up to the cursor, then relabel the whole buffer."""
        assert self.model is not None
        assert self.answered is not None
        labels, fresh = self.answered.up_to(cursor)
        self.feedback.learned(cursor)
        if not labels:
            self.journal.note("No preferences yet: every answer so far was 'cannot tell'.")
            return
        self.upkeep.phase(Phase.FITTING)
        preferences = self.answered.preferences(labels)
        report = self.model.fit(preferences, self.answered.preferences(fresh) if fresh else None)
        scores = self.model.probabilities(preferences.first, preferences.second).mean(0)
        self.journal.fit(
            index=self.fits,
            step=self.step,
            cursor=cursor,
            report=report,
            probabilities=dict(zip(labels, scores.tolist(), strict=True)),
        )
        self.fits += 1
        self.relabelled = False
        self.relabel_when_due()

    def relabel_when_due(self) -> None:
        """Give every stored transition the reward that r̂ says now; a stop in the middle begins it anew."""
        if self.relabelled:
            return
        assert self.model is not None
        if self.model.config.relabel:
            self.upkeep.phase(Phase.RELABELLING)
            self.agent.relabel(self.model, self.upkeep.obey)
        self.relabelled = True
        self.end_exploration_when_due()
        self.upkeep.save(self)

    # Exploration ---------------------------------------------------------------------------------

    def end_exploration_when_due(self) -> None:
        """A learned reward ends exploration with its first fit, a true one at its step (section 1)."""
        over = self.fits > 0 if self.model is not None else self.step >= self.config.exploration.ends_at
        if self.exploring and over:
            self.exploring = False
            self.begin_with_reward()

    def begin_with_reward(self) -> None:
        """What the critics learned was the intrinsic reward: begin anew; the actor stays."""
        if isinstance(self.config.exploration, StateEntropy):
            updates = self.config.exploration.reset_updates if self.can_learn() else 0
            self.agent.begin_anew(updates, self.intrinsic)
            self.began_at = self.step  # these were this step's updates

    # The agent -----------------------------------------------------------------------------------

    def can_learn(self) -> bool:
        """After the random steps; an extended run without its buffer first gathers as many again."""
        buffer = self.agent.buffer
        return len(buffer) >= max(min(self.config.exploration.seed_steps, buffer.capacity), 2)

    def update(self) -> Losses | None:
        """On the intrinsic reward while there is no other; else on the stored one."""
        reward = self.intrinsic if self.exploring else None
        return self.agent.learn(reward, len(self.collector.environments))

    def choose_actions(self) -> NDArray[np.float32]:
        if self.step < self.config.exploration.seed_steps:
            return self.random_actions()
        return self.agent.act(self.collector.observations, explore=True)

    def random_actions(self) -> NDArray[np.float32]:
        shape = (len(self.collector.environments), self.config.catalogue_entry.action_size)
        return self.randomness.numpy("random actions").uniform(-1, 1, shape).astype(np.float32)

    # Checkpoints ---------------------------------------------------------------------------------

    def state(self) -> dict[str, Any]:
        """Everything but the rows of the buffer and the episodes of the pool."""
        return {
            "step": self.step,
            "fits": self.fits,
            "relabelled": self.relabelled,
            "exploring": self.exploring,
            "began_at": self.began_at,
            "randomness": self.randomness.state(),
            "collector": self.collector.state(),
            "agent": self.agent.state(),
            "reward": self.reward.state(),
            "intrinsic": self.intrinsic.deviation.state() if self.intrinsic else {},
            "feedback": self.feedback.state(),
        }

    def load(self, state: dict[str, Any]) -> None:
        """Go on from a state; buffer and pool are restored before."""
        for name in ("step", "fits", "relabelled", "exploring", "began_at"):
            setattr(self, name, state[name])
        self.collector.load(state["collector"])
        self.agent.load(state["agent"])
        self.reward.load(state["reward"])
        if self.intrinsic:
            self.intrinsic.deviation.load(state["intrinsic"])
        self.feedback.load(state["feedback"])
        self.randomness.load(state["randomness"])
