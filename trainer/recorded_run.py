"""A run that is kept: its training with what ties it to the record, gone on from where it was left."""

from __future__ import annotations

from dataclasses import dataclass

from labels_db.claims import Claim
from labels_db.data_folder import DataFolder
from labels_db.database import Database
from labels_db.records import fits_of, rewind
from labels_db.run_config import Asking, Human, RunConfig
from labels_db.storage import ArtifactStore
from trainer.asking import Asker
from trainer.asking_rules import rule_and_pace
from trainer.asking_state import AskingState
from trainer.assembly import Foundation
from trainer.checkpoints import Checkpoints
from trainer.devices import choose_device
from trainer.environments import make_environment
from trainer.event_files import EventFiles
from trainer.feedback import Feedback, FromTeacher, RecordedFits
from trainer.journal import RecordJournal
from trainer.posting import Desk, PeoplesDesk, ScriptedDesk
from trainer.preferences import AnsweredQueries
from trainer.progress import Progress
from trainer.rendering import Renderer
from trainer.segments import PairSampler
from trainer.session_record import SessionRecord
from trainer.shelf import Shelf
from trainer.teachers import ScriptedTeacher
from trainer.threads import rest_between_clips
from trainer.training import Training
from trainer.upkeep import RecordedUpkeep


@dataclass
class RecordedRun:
    """A training and what ties it to the record; `close` ends its threads and processes."""

    training: Training
    upkeep: RecordedUpkeep
    progress: Progress
    renderer: Renderer
    journal: RecordJournal

    def close(self) -> None:
        self.training.feedback.close()
        self.renderer.close()
        self.progress.close()


def recorded_run(
    config: RunConfig, data: DataFolder, database: Database, store: ArtifactStore, claim: Claim
) -> RecordedRun:
    """The claimed run, gone on from its last checkpoint if it has one."""
    progress = Progress(database, claim, EventFiles(data.events_path(claim.run_id)))
    device = choose_device(config)
    renderer = Renderer(config.environment, config.clips, rest=rest_between_clips(config))
    if config.asks_people:
        renderer.warm()  # the first pair is to be on screen soon after its session opens
    checkpoints = Checkpoints(database, store, claim, config)
    upkeep = RecordedUpkeep(config, progress, checkpoints, make_environment(config.environment), renderer)
    journal = RecordJournal(database, store, claim)
    answered = AnsweredQueries(database, store, claim.run_id, device)
    foundation = Foundation(config, device)
    feedback = _feedback(foundation, answered, database, Shelf(store, claim), progress, renderer)
    training = foundation.training(feedback=feedback, answered=answered, journal=journal, upkeep=upkeep)
    run = RecordedRun(training, upkeep, progress, renderer, journal)
    _go_on(run, database, claim)
    return run


def _feedback(
    foundation: Foundation,
    answered: AnsweredQueries,
    database: Database,
    shelf: Shelf,
    progress: Progress,
    renderer: Renderer,
) -> Feedback:
    """From the configured teacher; none where the reward is not learned."""
    config, pool, model = foundation.config, foundation.pool, foundation.model
    if not isinstance(config.feedback, Asking) or pool is None or model is None:
        return RecordedFits()
    asker = Asker(
        config=config.feedback,
        record=SessionRecord(database, shelf.claim),
        progress=progress,
        sampler=PairSampler(pool, config.segment_steps, foundation.randomness.numpy("queries")),
        model=model,
        answered=answered,
        desk=_desk(config, config.feedback, database, shelf, renderer),
        so_far=AskingState.at_first(config.exploration.ends_at),
    )
    return FromTeacher(asker, *rule_and_pace(config.feedback, config.total_steps), config.total_steps)


def _desk(config: RunConfig, feedback: Asking, database: Database, shelf: Shelf, renderer: Renderer) -> Desk:
    teacher = feedback.teacher
    if isinstance(teacher, Human):
        return PeoplesDesk(database, shelf, renderer, config.step_seconds, teacher.answers_needed)
    return ScriptedDesk(database, shelf, teacher.kind, ScriptedTeacher(teacher, shelf.store, config.seed))


def _go_on(run: RecordedRun, database: Database, claim: Claim) -> None:
    if not run.upkeep.load(run.training):
        with database.write() as session:
            rewind(session, claim, step=-1, fits=0)
        return
    training = run.training
    with database.write() as session:
        rewind(session, claim, step=training.step, fits=training.fits)
        learned = fits_of(session, claim.run_id)
    if training.answered is not None and learned:
        training.answered.up_to(learned[-1].cursor)  # what was learned before is not fresh
