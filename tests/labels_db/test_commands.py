"""A command is taken once, by whoever may do it, and answered."""

from __future__ import annotations

import pytest

from labels_db import claims, commands
from labels_db.database import Database
from labels_db.errors import NotFoundError
from labels_db.models import Command, utc_now
from tests.labels_db import given
from tests.labels_db.given import NOW, SECOND

KINDS = frozenset({"fit", "ask"})


def test_a_trainer_takes_each_command_once_in_order(database: Database) -> None:
    with database.write() as session:
        owner = given.a_claim(session)
        for kind in ("fit", "export", "ask"):
            commands.ask(session, "mill", kind, asked_by="eve", loud=True)
        taken = [commands.take(session, "mill", owner.attempt, KINDS) for _ in range(3)]
        assert [found and found.kind for found in taken] == ["fit", "ask", None]
        assert taken[0] is not None
        assert (taken[0].arguments, taken[0].taken_by_attempt) == ({"loud": True}, 1)


def test_a_command_is_for_its_run_only(database: Database) -> None:
    with database.write() as session:
        given.a_claim(session)
        other = given.a_claim(session, "other")
        commands.ask(session, "mill", "fit", asked_by="eve")
        assert commands.take(session, "other", other.attempt, KINDS) is None


def test_the_supervisor_takes_commands_of_runs_that_nobody_owns(database: Database) -> None:
    with database.write() as session:
        owner = given.a_claim(session)
        commands.ask(session, "mill", "fit", asked_by="eve")
        assert commands.take_of_ended_runs(session, KINDS) is None
        claims.finish_run(session, owner)
        assert commands.take_of_ended_runs(session, frozenset({"other"})) is None
        taken = commands.take_of_ended_runs(session, KINDS)
        assert taken is not None
        assert taken.taken_by_attempt == 0
        assert commands.take_of_ended_runs(session, KINDS) is None


def test_a_command_whose_taker_died_is_taken_again(database: Database) -> None:
    with database.write() as session:
        owner = given.a_claim(session)
        command = commands.ask(session, "mill", "fit", asked_by="eve")
        commands.take(session, "mill", owner.attempt, KINDS)
        claims.finish_run(session, owner)
        command.taken_at = utc_now() - commands.GIVEN_UP_AFTER + 60 * SECOND
        assert commands.take_of_ended_runs(session, KINDS) is None
        command.taken_at = utc_now() - commands.GIVEN_UP_AFTER - SECOND
        assert commands.take_of_ended_runs(session, KINDS) is command
        assert command.taken_by_attempt == 0
        assert commands.take_of_ended_runs(session, KINDS) is None


def test_a_command_that_is_done_is_never_taken_again(database: Database) -> None:
    with database.write() as session:
        owner = given.a_claim(session)
        command = commands.ask(session, "mill", "fit", asked_by="eve")
        commands.take(session, "mill", owner.attempt, KINDS)
        claims.finish_run(session, owner)
        commands.finish(session, command.id, {})
        command.taken_at = utc_now() - commands.GIVEN_UP_AFTER - SECOND
        assert commands.take_of_ended_runs(session, KINDS) is None


def test_a_command_given_up_says_why_unless_it_was_done(database: Database) -> None:
    with database.write() as session:
        given.a_run(session, at=NOW)
        lost, done = (commands.ask(session, "mill", "fit", asked_by="eve") for _ in range(2))
        commands.finish(session, done.id, {})
        for command in (lost, done):
            commands.give_up(session, command.id, "killed")
        assert (lost.result, done.result) == ({"error": "killed"}, {})
        assert lost.done_at is not None


def test_a_result_is_kept(database: Database) -> None:
    with database.write() as session:
        given.a_run(session, at=NOW)
        command = commands.ask(session, "mill", "fit", asked_by="eve")
        commands.finish(session, command.id, {"accuracy": 0.9})
    with database.read() as session:
        kept = session.get_one(Command, command.id)
        assert kept.result == {"accuracy": 0.9}
        assert kept.done_at is not None


def test_a_command_needs_a_run(database: Database) -> None:
    with database.write() as session, pytest.raises(NotFoundError, match="run 'nix'"):
        commands.ask(session, "nix", "fit", asked_by="eve")
