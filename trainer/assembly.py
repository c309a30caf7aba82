"""Putting the parts of a run together, in the order in which they need each other."""

from __future__ import annotations

from dataclasses import dataclass

import torch

from labels_db.claims import Claim
from labels_db.data_folder import DataFolder
from labels_db.database import Database
from labels_db.records import fits_of, rewind
from labels_db.run_config import Asking, Human, NoFeedback, RunConfig, StateEntropy
from labels_db.storage import ArtifactStore
from trainer.agents.registry import make_agent
from trainer.arithmetic import set_up_arithmetic
from trainer.asking import Asker
from trainer.checkpoints import Checkpoints
from trainer.collector import Collector
from trainer.devices import choose_device
from trainer.environments import make_environment
from trainer.episodes import EpisodePool
from trainer.event_files import EventFiles
from trainer.exploration import StateEntropyReward
from trainer.feedback import Feedback, RecordedFits, make_feedback
from trainer.journal import Journal, RecordJournal, SilentJournal
from trainer.posting import Desk, PeoplesDesk, ScriptedDesk
from trainer.preferences import AnsweredQueries
from trainer.progress import Progress
from trainer.randomness import Randomness
from trainer.rendering import Renderer
from trainer.reward_model import RewardModel
from trainer.reward_source import ModelReward, make_reward_source
from trainer.segments import PairSampler
from trainer.shelf import Shelf
from trainer.teachers import ScriptedTeacher
from trainer.training import Training, Upkeep
from trainer.upkeep import RecordedUpkeep


def assemble(
    config: RunConfig,
    *,
    feedback: Feedback,
    answered: AnsweredQueries | None,
    journal: Journal,
    upkeep: Upkeep,
    device: torch.device,
) -> Training:
    """A run at its first step."""
    set_up_arithmetic(config.threads)
    randomness = Randomness(config.seed)
    environments = [make_environment(config.environment) for _ in range(config.environments)]
    pool = EpisodePool(config.feedback.pool_episodes) if isinstance(config.feedback, Asking) else None
    agent = make_agent(config, randomness, device)
    reward = make_reward_source(config, randomness, device)
    explores = config.exploration if isinstance(config.exploration, StateEntropy) else None
    training = Training(
        config=config,
        randomness=randomness,
        collector=Collector(environments, config.seed, pool),
        agent=agent,
        reward=reward,
        model=reward.model if isinstance(reward, ModelReward) else None,
        intrinsic=StateEntropyReward(explores, agent.buffer, randomness) if explores else None,
        feedback=feedback,
        answered=answered,
        journal=journal,
        upkeep=upkeep,
    )
    training.collector.start()
    return training


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
    renderer = Renderer(config.environment, config.clips)
    if config.asks_people:
        renderer.warm()  # the first pair is to be on screen soon after its session opens
    checkpoints = Checkpoints(database, store, claim, stride=config.environments)
    upkeep = RecordedUpkeep(config, progress, checkpoints, make_environment(config.environment), renderer)
    journal = RecordJournal(database, store, claim)
    training = assemble(
        config,
        feedback=RecordedFits(),
        answered=AnsweredQueries(database, store, claim.run_id, device),
        journal=journal,
        upkeep=upkeep,
        device=device,
    )
    if isinstance(config.feedback, Asking):
        desk = _desk(config, config.feedback, database, Shelf(store, claim), renderer)
        training.feedback = _feedback(config.feedback, training, database, claim, progress, upkeep, desk)
    run = RecordedRun(training, upkeep, progress, renderer, journal)
    _go_on(run, database, claim)
    return run


def _desk(config: RunConfig, feedback: Asking, database: Database, shelf: Shelf, renderer: Renderer) -> Desk:
    teacher = feedback.teacher
    if isinstance(teacher, Human):
        return PeoplesDesk(database, shelf, renderer, config.step_seconds, teacher.answers_needed)
    return ScriptedDesk(database, shelf, teacher.kind, ScriptedTeacher(teacher, shelf.store, config.seed))


def _feedback(
    config: Asking,
    training: Training,
    database: Database,
    claim: Claim,
    progress: Progress,
    upkeep: RecordedUpkeep,
    desk: Desk,
) -> Feedback:
    pool, model, answered = training.collector.pool, training.model, training.answered
    assert isinstance(pool, EpisodePool)
    assert isinstance(model, RewardModel)
    assert isinstance(answered, AnsweredQueries)
    sampler = PairSampler(pool, training.config.segment_steps, training.randomness.numpy("queries"))
    asker = Asker(
        config=config,
        database=database,
        claim=claim,
        progress=progress,
        sampler=sampler,
        model=model,
        desk=desk,
        checkpoint=lambda: upkeep.save(training),
        obey=upkeep.obey,
        fitted=lambda: training.fits > 0,
        asked=lambda: answered.observations(training.config.catalogue_entry.observation_size),
    )
    return make_feedback(asker, training.config)


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
