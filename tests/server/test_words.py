"""Numbers and times as people say them."""

from __future__ import annotations

import math
from datetime import timedelta

import pytest

from labels_db.config_differences import ABSENT
from labels_db.evaluation_curves import spread_of
from labels_db.models import utc_now
from labels_db.numbers import number
from server import words


def test_numbers() -> None:
    assert number(12400) == "12\u202f400"
    assert number(-5) == "−5"
    assert words.decimal(None) == "–"
    assert words.decimal(1234.56) == "1\u202f234.6"
    assert words.percent(0.876) == "88%"
    assert words.percent(None) == "–"


@pytest.mark.parametrize(
    ("count", "text"),
    [(0, "0 bytes"), (999, "999 bytes"), (1500, "1.5 kB"), (52_000_000, "52 MB"), (8.2e10, "82 GB")],
)
def test_sizes(count: int, text: str) -> None:
    assert words.size(count) == text


@pytest.mark.parametrize(
    ("seconds", "text"),
    [(0, "0 s"), (19.6, "20 s"), (89, "89 s"), (120, "2 min"), (7200, "2 h"), (5 * 86400, "5 days")],
)
def test_durations(seconds: float, text: str) -> None:
    assert words.duration(seconds) == text


def test_ago() -> None:
    now = utc_now()
    assert words.ago(None) == "never"
    assert words.ago(now, now) == "just now"
    assert words.ago(now - timedelta(seconds=40), now) == "40 s ago"


def test_plurals() -> None:
    assert [words.plural(n, "answer") for n in (0, 1, 6)] == ["0 answers", "1 answer", "6 answers"]
    assert words.plural(2, "query") == "2 queries"


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (20, "20"),
        (20.0, "20"),
        (1.25, "1.2"),
        (math.inf, "inf"),
        (math.nan, "nan"),
        (True, "True"),
        ("x", "x"),
    ],
)
def test_measures(value: object, text: str) -> None:
    assert words.measure(value) == text


def test_measured_numbers_have_the_decimals_that_their_size_bears() -> None:
    assert [words.figure(value) for value in (None, 0.856, -12.34, 812.3)] == ["–", "0.86", "−12.3", "812.3"]
    assert words.spread(None) == "–"
    assert words.spread(spread_of([0.5])) == "0.50"
    assert words.spread(spread_of([800.0, 804.0])) == "802.0 ± 2.0"
    assert [words.measure_name(name) for name in ("return", "largest_tilt")] == [
        "True return",
        "Largest tilt",
    ]


def test_settings() -> None:
    values = (ABSENT, None, True, 500_000, 0.0003, "sessions")
    assert [words.setting(value) for value in values] == [
        "–",
        "not set",
        "yes",
        "500\u202f000",
        "0.0003",
        "sessions",
    ]
