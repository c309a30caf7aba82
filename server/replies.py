"""From the record's rows to the API's replies."""

from __future__ import annotations

from datetime import datetime

from labels_db.config_fields import fields_of
from labels_db.estimate import estimate_bytes
from labels_db.history import AnswerRecord
from labels_db.models import EvaluationResult
from labels_db.overview import RunOverview
from labels_db.presets import Preset
from server.api_replies import (
    AnswerOut,
    EvaluationOut,
    FeedbackOut,
    FieldOut,
    GoalOut,
    PresetDetail,
    PresetOut,
    RunOut,
)
from server.run_view import view


def run_out(seen: RunOverview, now: datetime) -> RunOut:
    shown, run = view(seen, now), seen.run
    return RunOut(
        id=run.id,
        title=run.title,
        preset=run.preset,
        experiment=run.experiment,
        method=run.method,
        goal=GoalOut.model_validate(seen.goal),
        state=run.state,
        desired=run.desired,
        phase=run.phase,
        sentence=shown.sentence,
        actions=sorted(shown.actions),
        step=run.step,
        total_steps=seen.config.total_steps,
        steps_per_second=run.steps_per_second,
        queue_position=seen.queue_position,
        feedback=FeedbackOut.model_validate(seen.feedback),
        last_return=shown.last_return,
        attempt=run.attempt,
        heartbeat_at=run.heartbeat_at,
        created_at=run.created_at,
        ended_at=run.ended_at,
        error=run.error,
    )


def preset_out(preset: Preset) -> PresetOut:
    return PresetOut(
        name=preset.name,
        title=preset.title,
        goal=preset.goal,
        environment=preset.environment,
        profiles=list(preset.profiles),
    )


def preset_detail(preset: Preset, profile: str) -> PresetDetail:
    config = preset.config(profile)
    return PresetDetail(
        **preset_out(preset).model_dump(),
        profile=profile,
        fields=[FieldOut(**vars(field)) for field in fields_of(config)],
        bytes=estimate_bytes(config).total,
    )


def evaluation_out(found: EvaluationResult) -> EvaluationOut:
    return EvaluationOut(
        step=found.step,
        returns=found.returns,
        mean_return=found.mean_return,
        measures=found.measures,
        video_url=video_url(found),
        at=found.at,
    )


def video_url(found: EvaluationResult) -> str | None:
    return f"/runs/{found.run_id}/videos/{found.step}.mp4" if found.video_key else None


def answer_out(record: AnswerRecord) -> AnswerOut:
    answer = record.answer
    assert answer.choice is not None
    return AnswerOut(
        sequence=answer.sequence,
        query_id=answer.query_id,
        labeller=answer.labeller.name,
        choice=answer.choice,
        taken_back=record.taken_back,
        probability=record.probability,
        goal_version=answer.goal_card_version,
        answered_at=answer.answered_at,
    )
