"""The training loop of a preset, one step at a time, without a record."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import torch
from torch import Tensor

from benchmarks.speed.model_tasks import PlainRewardModel
from benchmarks.speed.work import as_pytorch_comes
from labels_db.overrides import with_settings
from labels_db.presets import preset_named
from trainer.agents.interface import Losses
from trainer.agents.sac import SACAgent
from trainer.agents.sac_autograd import AutogradUpdate
from trainer.assembly import assemble
from trainer.collector import Transitions
from trainer.exploration import StateEntropyReward
from trainer.feedback import RecordedFits
from trainer.journal import SilentJournal
from trainer.neighbours import plain_neighbour_distance
from trainer.replay_buffer import Batch
from trainer.training import NoUpkeep, Training

CPU = torch.device("cpu")
EXPLORED, TRAINED = 5000, 1000
"""Steps in the buffer when timing begins: the intrinsic reward searches them, an update draws from them."""


class OneStepDone(Exception):  # noqa: N818  (it is no error)
    """The loop has come round."""


class Interrupting(NoUpkeep):
    """Upkeep that leaves the loop after each step."""

    def after_step(self, training: Training, transitions: Transitions, losses: Losses | None) -> None:
        raise OneStepDone


class Stepper:
    """Each call is one step of the loop, in the profile's own precision unless another is named."""

    def __init__(
        self,
        preset: str,
        *,
        exploring: bool,
        precision: str | None = None,
        plain: bool = False,
        profile: str | None = None,
        device: torch.device = CPU,
    ) -> None:
        config, lived = preset_named(preset).config(profile), EXPLORED if exploring else TRAINED
        changes = {"precision": precision or config.precision, "exploration.seed_steps": str(lived)}
        config = with_settings(config, changes)
        config = config.model_copy(update={"threads": torch.get_num_threads()})
        self.training = assemble(
            config,
            feedback=RecordedFits([]),
            answered=None,
            journal=SilentJournal(),
            upkeep=Interrupting(),
            device=device,
        )
        for _ in range(lived):
            self()
        self.training.exploring = exploring
        if exploring:
            self._explored(plain)
        if plain:
            as_pytorch_comes()
            agent = self.training.agent
            assert isinstance(agent, SACAgent)
            agent._update = AutogradUpdate(agent)
            if self.training.model is not None:
                self.training.model.__class__ = PlainRewardModel

    def _explored(self, plain: bool) -> None:
        """As after as many steps of exploration: every state has been drawn and compared before."""
        intrinsic = self.training.intrinsic
        assert intrinsic is not None
        if plain:
            vars(intrinsic)["_distance"] = partial(searched_plainly, intrinsic)
        else:
            intrinsic._distance(intrinsic.buffer.latest(len(intrinsic.buffer)))

    def __call__(self) -> None:
        try:
            self.training.train()
        except OneStepDone:
            return


def searched_plainly(reward: StateEntropyReward, batch: Batch) -> Tensor:
    """Distances to the k-th neighbours, [B]."""
    states, own = reward._compared(batch)
    return plain_neighbour_distance(batch.observation, own, states, reward.config.neighbours)


def stepping_alone(stepper: Stepper) -> Callable[[], object]:
    """The same environment under random actions: what the loop cannot be faster than."""
    training = stepper.training
    return lambda: training.collector.step(training.random_actions(), training.step)
