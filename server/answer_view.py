"""An answer as the run's page shows it: two stills, what was chosen, what the model now says."""

from __future__ import annotations

from dataclasses import dataclass

from labels_db.history import AnswerRecord
from labels_db.models import Answer, Choice, Clip, Segment
from server.artifacts import clip_address

CHOSEN = {
    Choice.FIRST: "Chose the first",
    Choice.SECOND: "Chose the second",
    Choice.EQUAL: "Called them equal",
    Choice.SKIP: "Could not tell",
}


@dataclass(frozen=True)
class Still:
    """One frame out of the middle of a clip's sheet, as the window of an SVG on it."""

    url: str
    window: str
    sheet_width: int
    sheet_height: int
    chosen: bool
    name: str


@dataclass(frozen=True)
class AnswerView:
    """One answer in words."""

    answer: Answer
    text: str
    taken_back: bool
    stills: list[Still]
    opinion: str


def answer_view(record: AnswerRecord) -> AnswerView:
    """The answer, with its stills where the pair was rendered."""
    choice, query = record.answer.choice, record.answer.query
    assert choice is not None
    stills = [
        _still(query.first, "First", choice is Choice.FIRST),
        _still(query.second, "Second", choice is Choice.SECOND),
    ]
    return AnswerView(
        answer=record.answer,
        text=CHOSEN[choice],
        taken_back=record.taken_back,
        stills=[still for still in stills if still],
        opinion=_opinion(choice, record.probability),
    )


def _still(segment: Segment, name: str, chosen: bool) -> Still | None:
    clip = segment.clip
    if clip is None:
        return None
    return Still(
        url=clip_address(clip),
        window=_window(clip, clip.frames // 2),
        sheet_width=clip.columns * clip.width,
        sheet_height=clip.rows * clip.height,
        chosen=chosen,
        name=name,
    )


def _window(clip: Clip, frame: int) -> str:
    row, column = divmod(frame, clip.columns)
    return f"{column * clip.width} {row * clip.height} {clip.width} {clip.height}"


def _opinion(choice: Choice, second_wins: float | None) -> str:
    """What the reward model makes of the pair now, held against the answer."""
    if second_wins is None:
        return ""
    given = {Choice.FIRST: 1 - second_wins, Choice.SECOND: second_wins}.get(choice)
    if given is None:
        return f"The model gives the second {second_wins:.0%}."
    return f"The model {'agrees' if given >= 0.5 else 'differs'}: {given:.0%}."
