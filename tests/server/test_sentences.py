"""What a run says of itself in every state."""

from __future__ import annotations

from collections.abc import Callable
from datetime import timedelta
from typing import Any

import pytest

from labels_db.models import Desired, Phase, RunState, utc_now
from labels_db.overview import RunOverview, overview
from labels_db.runs import pause_run, stop_run
from server.labelling_message import DOING
from server.run_view import actions_of, sparkline, view
from server.sentences import PHASES, state_sentence
from tests.server.conftest import Site
from tests.web import demo

Saying = Callable[..., RunOverview]


@pytest.fixture
def saying(site: Site) -> Saying:
    """A started windmill run on which the given columns are set."""

    def make(**columns: Any) -> RunOverview:
        with site.database.write() as session:
            run = demo.queued(session, demo.WINDMILL, {"total_steps": "40000"})
            demo.going(session, demo.started(session, run))
            for name, value in columns.items():
                setattr(run, name, value)
            session.flush()
            return overview(session, run.id)

    return make


TRAINING = "Training: step 12\u202f400 of 40\u202f000"
SENTENCES = [
    ({}, f"{TRAINING}, about 2 min left."),
    ({"next_session_step": 16_680}, f"{TRAINING}, first pairs in about 20 s."),
    ({"steps_per_second": None}, f"{TRAINING}."),
    ({"phase": "something new"}, f"{TRAINING}, about 2 min left."),
    ({"phase": "seeding", "step": 400}, "Moving at random: step 400 of 40\u202f000."),
    ({"phase": "asking"}, "Choosing pairs to ask about."),
    ({"phase": "fitting"}, "Learning the reward from 0 answers."),
    ({"phase": "evaluating"}, "Trying its policy out at step 12\u202f400."),
    ({"phase": "checkpointing"}, "Saving a checkpoint at step 12\u202f400."),
    ({"state": RunState.STARTING}, "Starting."),
    ({"state": RunState.WAITING, "wanted_answers": 6}, "Waiting for 6 answers."),
    ({"state": RunState.WAITING, "wanted_answers": 1}, "Waiting for 1 answer."),
    ({"state": RunState.WAITING}, "Waiting for answers."),
    ({"desired": Desired.PAUSE}, "Pausing at step 12\u202f400."),
    (
        {"state": RunState.PAUSED, "desired": Desired.PAUSE},
        "Paused at step 12\u202f400. Answers still count.",
    ),
    ({"desired": Desired.STOP}, "Stopping at step 12\u202f400, with a checkpoint."),
    ({"state": RunState.STOPPED}, "Stopped at step 12\u202f400. Resume continues from there."),
    ({"state": RunState.STOPPED, "step": 0}, "Stopped before its first step. Resume queues it again."),
    ({"state": RunState.FINISHED}, "Finished at step 12\u202f400."),
    ({"state": RunState.FAILED}, "Failed at step 12\u202f400. Resume tries again from the last checkpoint."),
    ({"state": RunState.QUEUED}, "Next in the queue."),
]


def test_every_phase_has_its_words() -> None:
    assert set(PHASES) == set(DOING) == set(Phase)


@pytest.mark.parametrize(("columns", "sentence"), SENTENCES)
def test_sentences(saying: Saying, columns: dict[str, Any], sentence: str) -> None:
    assert state_sentence(saying(**columns), utc_now()) == sentence


def test_a_silent_trainer_is_named(saying: Saying) -> None:
    seen = saying(heartbeat_at=utc_now() - timedelta(seconds=60))
    assert state_sentence(seen, utc_now()) == "No sign of life for 60 s. It will be queued again by itself."
    assert view(seen, utc_now()).tone == "wrong"


def test_a_trainer_that_loads_its_libraries_is_not_called_dead(saying: Saying) -> None:
    seen = saying(state=RunState.STARTING, heartbeat_at=utc_now() - timedelta(seconds=60))
    assert state_sentence(seen, utc_now()).startswith("Starting")


def test_places_in_the_queue(site: Site) -> None:
    with site.database.write() as session:
        runs = [demo.queued(session, "walker-walk") for _ in range(12)]
    with site.database.read() as session:
        places = [state_sentence(overview(session, run.id), utc_now()) for run in runs]
    assert sorted(places)[:2] == ["Eighth in the queue.", "Fifth in the queue."]
    assert "Number 12 in the queue." in places


def test_actions_follow_the_state(site: Site) -> None:
    with site.database.write() as session:
        run = demo.queued(session, "walker-walk")
        assert actions_of(run) == {"stop", "extend"}
        demo.going(session, demo.started(session, run))
        assert actions_of(run) == {"pause", "stop", "extend"}
        pause_run(session, run.id)
        assert actions_of(run) == {"resume", "stop", "extend"}
        stop_run(session, run.id)
        assert actions_of(run) == set()


@pytest.mark.parametrize(
    ("columns", "primary"),
    [
        ({}, "label"),
        ({"state": RunState.STOPPED}, "resume"),
        ({"state": RunState.FINISHED}, "watch"),
    ],
)
def test_one_primary_action(saying: Saying, columns: dict[str, Any], primary: str) -> None:
    assert view(saying(**columns), utc_now()).primary == primary


def test_sparklines_fill_their_box() -> None:
    assert sparkline([]) == sparkline([(0, 1.0)]) == ""
    assert sparkline([(0, 5.0), (50, 5.0)]) == "0.0,14.0 100.0,14.0"
    assert sparkline([(100, -1.0), (200, 0.0), (300, 1.0)]) == "0.0,27.0 50.0,14.0 100.0,1.0"
