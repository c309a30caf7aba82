"""What happens around the loop of a recorded run: obeying people, evaluating, keeping checkpoints."""

from __future__ import annotations

import threading
import time

import structlog

from labels_db.catalogue import ENDS_EARLY
from labels_db.models import Desired, Phase, RunState
from labels_db.run_config import NoFeedback, RunConfig
from labels_db.storage import ArtifactError
from trainer.agents.interface import Losses
from trainer.checkpoints import Checkpoints
from trainer.collector import Transitions
from trainer.divergence import refuse_diverged_losses, refuse_diverged_networks
from trainer.environments.interface import Environment
from trainer.evaluation import EvaluatedEpisode, evaluate
from trainer.progress import Progress
from trainer.rendering import Renderer
from trainer.training import Training

log = structlog.get_logger()


class StopRequestedError(Exception):
    """Somebody wants the run stopped."""


class ShutdownRequestedError(Exception):
    """The process is told to go; the run is to go on later."""


class RecordedUpkeep:
    """Keeps one attempt in step with the record."""

    METRICS_EVERY = 100
    """Steps between two entries of each loss."""

    def __init__(
        self,
        config: RunConfig,
        progress: Progress,
        checkpoints: Checkpoints,
        environment: Environment,
        renderer: Renderer,
    ) -> None:
        self.config = config
        self.progress = progress
        self.checkpoints = checkpoints
        self.environment = environment
        self.renderer = renderer
        self.shutdown = threading.Event()
        self.evaluated = 0
        self.told = 0
        self._saved_at = time.monotonic()
        # Random actions need not have found an end when the environment was added to the catalogue.
        asks = not isinstance(config.feedback, NoFeedback)
        self._knows_early_ends = config.catalogue_entry.ends_early or not asks

    # Around every step ---------------------------------------------------------------------------

    def before_step(self, training: Training) -> None:
        status = self.progress.status
        status.step, status.next_session_step = training.step, training.feedback.next_session_step()
        self.phase(self._doing(training))
        self.obey()
        if training.step // self.config.evaluation.every > self.evaluated // self.config.evaluation.every:
            self.evaluate(training)
        if time.monotonic() - self._saved_at > 60 * self.config.checkpoints.minutes:
            self.save(training)

    def after_step(self, training: Training, transitions: Transitions, losses: Losses | None) -> None:
        if losses is not None and training.step // self.METRICS_EVERY > self.told // self.METRICS_EVERY:
            read = losses.read()
            refuse_diverged_losses(training.step, read)
            self.progress.metrics(training.step, read)
            self.told = training.step
        for true_return in transitions.episode_returns:
            self.progress.metrics(training.step, {"episode_return": true_return})
        if transitions.terminated.any() and not self._knows_early_ends:
            self._knows_early_ends = True
            training.journal.note(ENDS_EARLY.format(name=self.config.environment.name))

    def phase(self, phase: Phase) -> None:
        self.progress.phase(phase)

    def _doing(self, training: Training) -> Phase:
        if training.step < self.config.exploration.seed_steps:
            return Phase.SEEDING
        return Phase.EXPLORING if training.exploring else Phase.TRAINING

    # Control -------------------------------------------------------------------------------------

    def obey(self) -> None:
        """Stand still while paused; raise to end the attempt."""
        status = self.progress.status
        doing = status.phase, status.state
        while self._obey_once() is Desired.PAUSE:
            self.progress.phase(Phase.PAUSED, RunState.PAUSED)
            time.sleep(0.05)
        status.phase, status.state = doing

    def _obey_once(self) -> Desired:
        desired = self.progress.check().desired
        if self.shutdown.is_set():
            raise ShutdownRequestedError
        if desired is Desired.STOP:
            raise StopRequestedError
        return desired

    # Evaluation ----------------------------------------------------------------------------------

    def evaluate(self, training: Training) -> list[EvaluatedEpisode]:
        """Record how the policy does now, and have its first episode rendered if that is wished."""
        self.phase(Phase.EVALUATING)
        episodes = evaluate(
            lambda observations: training.agent.act(observations, explore=False),
            self.environment,
            seed=self.config.seed,
            episodes=self.config.evaluation.episodes,
            between_steps=self.obey,
        )
        training.journal.evaluation(training.step, episodes)
        self.evaluated = training.step
        if self._wants_video(training):
            first = episodes[0]
            video = self.renderer.video(first.seed, first.states, self.environment.control_step)
            training.journal.video(training.step, video)
        return episodes

    def _wants_video(self, training: Training) -> bool:
        last = training.step >= self.config.total_steps
        wanted = {"each": True, "last": last, "none": False}[self.config.evaluation.video]
        return wanted and self.config.catalogue_entry.can_be_drawn

    # Checkpoints ---------------------------------------------------------------------------------

    def save(self, training: Training, *, rows: bool = True) -> None:
        """Write a checkpoint; without `rows`, of the networks and counters only (a finished run)."""
        doing = self.progress.status.phase
        refuse_diverged_networks(training)
        self.phase(Phase.CHECKPOINTING)
        self.progress.flush()  # what lies before a checkpoint is not measured again
        state = {**training.state(), "evaluated": self.evaluated, "told": self.told}
        pool = training.collector.pool if rows else None
        self.checkpoints.save(training.step, state, training.agent.buffer if rows else None, pool)
        self._saved_at = time.monotonic()
        self.phase(doing)

    def load(self, training: Training) -> bool:
        """Go on from the newest checkpoint that can be read; False when the run has none."""
        for manifest in self.checkpoints.manifests():
            try:
                self.checkpoints.restore(manifest, training.agent.buffer, training.collector.pool)
                state = self.checkpoints.state(manifest)
            except ArtifactError as error:
                log.error("a checkpoint is damaged", step=manifest["step"], reason=str(error))
                continue
            self.evaluated = state.pop("evaluated")
            self.told = state.pop("told")
            training.load(state)
            return True
        return False
