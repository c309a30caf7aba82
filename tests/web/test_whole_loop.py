"""The product's main job on real parts: form, exploration, clips, keys, reward, policy, all through the browser.

A simulated person looks the true returns up in the record, beside the page and never in it, and presses keys.
The short version runs with every test; `make demo-human` runs the whole windmill.
"""

from __future__ import annotations

import json
import math
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path

import pytest
from playwright.sync_api import Page, expect
from sqlalchemy import func, select

from labels_db.data_folder import DataFolder
from labels_db.database import Database
from labels_db.models import Answer, Choice, FeedbackSession, Query, Run, RunState
from labels_db.records import evaluations_of, fits_of
from labels_db.runs import get_run
from tests.trainer.people import by_true_return

AGAIN_S = 2.0
PRESET = "cartpole-windmill-clockwise"


@dataclass
class Installation:
    """What `pebble up` started."""

    url: str
    database: Database
    data: Path

    def run(self) -> Run | None:
        with self.database.read() as session:
            return session.scalars(select(Run)).first()


@pytest.fixture
def installation(tmp_path: Path) -> Iterator[Installation]:
    data = tmp_path / "data"
    command = [sys.executable, "-m", "cli", "up", "--port", "0", "--data", str(data)]
    environment = {**os.environ, "PYTHONUNBUFFERED": "1"}
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment)
    assert process.stdout is not None
    url = next(found[0] for line in process.stdout if (found := re.search(r"http://\S+", line)))
    database = DataFolder(data).open_database()
    try:
        yield Installation(url, database, data)
    finally:
        database.close()
        process.send_signal(signal.SIGINT)
        status = process.wait(timeout=90)
        process.stdout.close()
        assert status == 0


@dataclass
class SimulatedPerson:
    """Presses the key of the clip with the larger true return, told from the query on screen."""

    page: Page
    database: Database
    said: dict[int, Choice] = field(default_factory=dict)
    pressed: dict[int, float] = field(default_factory=dict)
    first_shown: list[float] = field(default_factory=list)

    def work(self, done: Mapping[str, int], seconds: float) -> None:
        """Answer until so many answers have been given."""
        ends = time.monotonic() + seconds
        while (given := self.given()) < done["answers"]:
            assert time.monotonic() < ends, f"{given} answers in {seconds} s; {self.sentence()}"
            query = self.on_screen()
            if query is None or self.has_just_pressed(query):
                self.page.wait_for_timeout(50)
                continue
            if query not in self.said:
                self.note_latency(query)
            self.page.wait_for_timeout(170)  # a person's reaction, and the page's guard against slips
            if self.on_screen() == query:
                self.press(query)

    def given(self) -> int:
        with self.database.read() as session:
            return session.scalars(select(func.count(Answer.id))).one()

    def has_just_pressed(self, query_id: int) -> bool:
        """On a slow machine a key may come so soon that the page takes it for a slip: people press again."""
        return time.monotonic() < self.pressed.get(query_id, -math.inf) + AGAIN_S

    def on_screen(self) -> int | None:
        query = self.page.evaluate(
            "(() => { const mode = document.querySelector('[data-label]').dataset.mode;"
            " return mode === 'pair' ? document.querySelector('[data-stage]').dataset.query : null })()"
        )
        return int(query) if query else None

    def sentence(self) -> str:
        return self.page.locator("[data-sentence]").inner_text()

    def note_latency(self, query_id: int) -> None:
        """Seconds from a session's opening to its first pair on screen."""
        with self.database.read() as session:
            query = session.get_one(Query, query_id)
            opened: datetime = session.get_one(FeedbackSession, query.session_id).opened_at
        if query.index == 0:
            self.first_shown.append(time.time() - opened.timestamp())

    def press(self, query_id: int) -> None:
        with self.database.read() as session:
            query = session.get_one(Query, query_id)
            choice = by_true_return(query)
        self.page.keyboard.press(self.key(query, choice))
        self.said[query_id], self.pressed[query_id] = choice, time.monotonic()

    def key(self, query: Query, choice: Choice) -> str:
        """Where the preferred clip is: its address names the segment."""
        if choice is Choice.EQUAL:
            return "ArrowUp"
        preferred = query.first_id if choice is Choice.FIRST else query.second_id
        left = self.page.locator("[data-press=left].clip canvas").get_attribute("data-clip") or ""
        return "ArrowLeft" if re.search(rf"/clips/{preferred}\b", left) else "ArrowRight"


def start_from_the_form(page: Page, installation: Installation, settings: Mapping[str, object]) -> str:
    """Fill the form as a person would, and open the labelling page of the run it starts."""
    page.goto(installation.url)
    page.goto(page.url.rstrip("/") + f"/new?preset={PRESET}")
    page.locator("details.all > summary").click()
    for path, value in settings.items():
        page.locator(f"[name='{path}']").fill(str(value))
    page.get_by_role("button", name="Start the run").click()
    expect(page).to_have_url(re.compile(r"/runs/"))
    run = installation.run()
    assert run is not None
    page.goto(f"{page.url}/label")
    return run.id


def wait_for_end(installation: Installation, run_id: str, seconds: float) -> None:
    ends = time.monotonic() + seconds
    while True:
        with installation.database.read() as session:
            run = get_run(session, run_id)
        if run.state not in (RunState.RUNNING, RunState.WAITING, RunState.STARTING):
            assert run.state is RunState.FINISHED, run.error
            return
        assert time.monotonic() < ends, f"{run.state} at step {run.step}"
        time.sleep(0.2)


def check_it_learned_from_exactly_those_answers(
    installation: Installation, run_id: str, person: SimulatedPerson
) -> None:
    with installation.database.read() as session:
        answers = session.scalars(select(Answer).order_by(Answer.sequence)).all()
        fits = fits_of(session, run_id)
        swapped = {answer.lease.swapped for answer in answers if answer.lease}
    assert {answer.query_id: answer.choice for answer in answers} == person.said
    assert swapped == {True, False}
    assert fits[-1].cursor == len(answers)
    assert fits[-1].preferences == len(answers)


@pytest.mark.timeout(420)
def test_a_run_started_from_the_form_learns_from_the_keys_pressed(
    page_alone: Page, installation: Installation
) -> None:
    short = {
        "feedback.budget": 8,
        "feedback.queries_per_session": 4,
        "feedback.steps_between": 400,
        "feedback.patience_steps": 100,  # however slow the machine, training waits for the person
        "exploration.seed_steps": 300,
        "exploration.explore_steps": 300,
        "agent.width": 32,
        "agent.batch_size": 32,
        "evaluation.every": 1000,
        "total_steps": 2500,
    }
    run_id = start_from_the_form(page_alone, installation, short)
    person = SimulatedPerson(page_alone, installation.database)
    person.work({"answers": 8}, seconds=240)
    wait_for_end(installation, run_id, seconds=180)
    check_it_learned_from_exactly_those_answers(installation, run_id, person)
    page_alone.goto(page_alone.url.removesuffix("/label"))
    expect(page_alone.locator("video")).to_be_visible()


@pytest.mark.demo
@pytest.mark.timeout(1800)
def test_fifty_keys_teach_the_windmill(page_alone: Page, installation: Installation) -> None:
    run_id = start_from_the_form(page_alone, installation, {})
    person = SimulatedPerson(page_alone, installation.database)
    person.work({"answers": 50}, seconds=1200)
    wait_for_end(installation, run_id, seconds=900)
    check_it_learned_from_exactly_those_answers(installation, run_id, person)
    with installation.database.read() as session:
        last = evaluations_of(session, run_id)[-1]
        steps = [session_.step for session_ in session.scalars(select(FeedbackSession))]
    report = {
        "turns": last.measures["turns"],
        "return": last.mean_return,
        "answers": len(person.said),
        "sessions at steps": steps,
        "seconds from a session's opening to its first pair on screen": person.first_shown,
    }
    print(json.dumps(report))
    assert last.measures["turns"] >= 10
    assert sorted(person.first_shown)[len(person.first_shown) // 2] < 2
