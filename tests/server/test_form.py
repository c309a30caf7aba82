"""The form of a new run: it says what every preset and kind needs, and its words come back as they went."""

from __future__ import annotations

import re
from dataclasses import replace
from html import unescape
from html.parser import HTMLParser
from urllib.parse import urlencode

import pytest

from labels_db.catalogue import catalogue, entry
from labels_db.config_fields import fields_of
from labels_db.overrides import with_kinds
from labels_db.presets import presets
from labels_db.run_config import Mistaken, RunConfig, Sessions
from labels_db.runs import config_of, get_run
from tests.server.conftest import BASE, Site

SAME = {"Origin": BASE}
CASES = [(name, profile) for name, preset in presets().items() for profile in preset.profiles]
KINDS = [
    (field.path, kind)
    for field in fields_of(next(iter(presets().values())).config())
    if field.path.endswith(".kind")
    for kind in field.choices
]


class Form(HTMLParser):
    """What a browser would send for a page's form as it stands."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.values: dict[str, str] = {}
        self._select = self._text = ""
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        found = dict(attrs)
        name = found.get("name") or ""
        if tag == "input" and name and (found.get("type") != "checkbox" or "checked" in found):
            self.values[name] = found.get("value") or ""
        elif tag == "select":
            self._select = name
        elif tag == "option" and self._select and "selected" in found:
            self.values[self._select] = found.get("value") or ""
        elif tag == "textarea":
            self._text = name

    def handle_endtag(self, tag: str) -> None:
        if tag in ("select", "textarea"):
            self._select = self._text = ""

    def handle_data(self, data: str) -> None:
        if self._text:
            self.values[self._text] = data


def form_of(site: Site, query: str) -> dict[str, str]:
    answer = site.client.get(f"/new?{query}")
    assert answer.status_code == 200, answer.text
    return Form(answer.text).values


def config_made(site: Site, form: dict[str, str]) -> RunConfig:
    answer = site.client.post("/new", data=form, headers=SAME)
    assert answer.status_code == 303, re.findall(r'class="error[^>]*>([^<]*)', answer.text) or answer.text
    run_id = answer.headers["location"].removeprefix("/runs/")
    with site.database.read() as session:
        return config_of(get_run(session, run_id))


@pytest.mark.parametrize(("name", "profile"), CASES)
def test_every_preset_comes_back_as_it_is(site: Site, name: str, profile: str) -> None:
    form = form_of(site, f"preset={name}&profile={profile}")
    assert config_made(site, form) == presets()[name].config(profile)


@pytest.mark.parametrize(("path", "kind"), KINDS)
def test_every_kind_brings_its_fields(site: Site, path: str, kind: str) -> None:
    name = next(iter(presets()))
    form = form_of(site, f"preset={name}&{path}={kind}")
    assert form[path] == kind
    shape = with_kinds(presets()[name].config(), {path: kind})
    expected = {field.path for field in fields_of(shape)}
    sent = {field for field in form if "." in field and not field.endswith(".shown")}
    assert sent == {field for field in expected if "." in field}


def test_a_run_without_feedback(site: Site) -> None:
    form = form_of(site, "preset=cartpole-swingup&reward.kind=true&feedback.kind=none")
    config = config_made(site, form)
    assert (config.reward.kind, config.feedback.kind) == ("true", "none")


@pytest.mark.parametrize(
    ("kind", "suggested", "not_suggested"),
    [
        ("dmc", "walker-run", "drawer-close"),
        ("metaworld", "drawer-close", "walker-run"),
        ("gym", "Ant-v5", "x"),
    ],
)
def test_environments_of_the_chosen_family_are_suggested(
    site: Site, kind: str, suggested: str, not_suggested: str
) -> None:
    page = site.client.get(f"/new?preset=cartpole-swingup&environment.kind={kind}").text
    assert f'<option value="{suggested}">' in page
    assert f'<option value="{not_suggested}">' not in page


def test_environments_of_installed_packages_are_suggested(
    site: Site, monkeypatch: pytest.MonkeyPatch
) -> None:
    """None is named to begin with."""
    known = catalogue()
    maze = replace(known["dmc:walker-walk"], name="installed:maze")
    monkeypatch.setattr("server.run_form.catalogue", lambda: {**known, maze.name: maze})
    page = site.client.get("/new?preset=cartpole-swingup&environment.kind=installed").text
    assert '<option value="maze">' in page


def test_fields_of_kinds_left_behind_are_passed_over(site: Site) -> None:
    """Without scripts the form still shows the old kind's fields when the new kind is chosen and sent."""
    form = form_of(site, "preset=cartpole-swingup")
    config = config_made(site, {**form, "feedback.kind": "continuous"})
    assert config.feedback.kind == "continuous"
    assert config.budget == 200


@pytest.mark.parametrize("redrawn", [True, False])
def test_another_kind_brings_its_own_defaults(site: Site, redrawn: bool) -> None:
    """With scripts the form is drawn again when a kind is chosen, with all that it said; without, it is sent."""
    form = form_of(site, "preset=cartpole-swingup")
    changed = {
        **form,
        "feedback.teacher.kind": "mistake",
        "feedback.teacher.equal": "0.2",
        "feedback.budget": "77",
    }
    if redrawn:
        changed = form_of(site, urlencode(changed))
        assert (changed["feedback.teacher.mistake"], changed["feedback.teacher.equal"]) == ("0.1", "0.2")
    config = config_made(site, changed)
    assert isinstance(config.feedback, Sessions)
    teacher = config.feedback.teacher
    assert isinstance(teacher, Mistaken)
    assert (teacher.kind, teacher.mistake, teacher.equal) == ("mistake", 0.1, 0.2)
    assert config.budget == 77


def test_what_a_kind_brought_goes_with_it(site: Site) -> None:
    form = form_of(site, "preset=cartpole-swingup&feedback.teacher.kind=mistake")
    form = form_of(site, urlencode({**form, "feedback.teacher.kind": "stochastic"}))
    assert (form["feedback.teacher.mistake"], form["feedback.teacher.rationality"]) == ("0.0", "1.0")


def test_ticked_and_unticked(site: Site) -> None:
    form = form_of(site, "preset=cartpole-swingup")
    assert form["checkpoints.keep_buffer"] == "false"
    ticked = config_made(site, {**form, "checkpoints.keep_buffer": "true"})
    assert ticked.checkpoints.keep_buffer is True


def test_everything_wrong_is_said_at_its_field(site: Site) -> None:
    form = form_of(site, "preset=cartpole-swingup")
    wrong = {**form, "title": " ", "feedback.budget": "0", "agent.width": "wide", "seed": ""}
    answer = site.client.post("/new", data=wrong, headers=SAME)
    assert answer.status_code == 422
    said = [unescape(text) for text in re.findall(r'class="error[^>]*>([^<]*)', answer.text)]
    assert said == [
        "Name is missing.",
        "Budget must be at least 1, not '0'.",
        "Seed needs a whole number, and is empty.",
        "Width needs a whole number, not 'wide'.",
    ]
    assert Form(answer.text).values == wrong
    assert '<details class="all" open>' in answer.text
    assert site.client.get("/api/runs").json() == []


def test_words_have_limits(site: Site) -> None:
    form = form_of(site, "preset=cartpole-swingup")
    answer = site.client.post("/new", data={**form, "title": "a\0", "goal": "x" * 1001}, headers=SAME)
    said = re.findall(r'class="error[^>]*>([^<]*)', answer.text)
    assert said == [
        "Name may not have control characters in it.",
        "What labellers look for may have 1000 characters at most.",
    ]


def test_parts_that_do_not_fit_are_said_above(site: Site) -> None:
    form = form_of(site, "preset=cartpole-swingup&reward.kind=true")
    answer = site.client.post("/new", data=form, headers=SAME)
    assert answer.status_code == 422
    assert "set feedback.kind to &#39;none&#39;" in answer.text


@pytest.mark.parametrize("query", ["preset=nothing", "preset=walker-walk&profile=nothing"])
def test_unknown_presets_get_a_page(site: Site, query: str) -> None:
    answer = site.client.get(f"/new?{query}")
    assert answer.status_code == 422
    assert "Something does not fit" in answer.text


def test_words_are_escaped(site: Site) -> None:
    form = form_of(site, "preset=cartpole-swingup")
    site.client.post("/new", data={**form, "title": "<script>alert(1)</script>"}, headers=SAME)
    page = site.client.get("/").text
    assert "<script>alert" not in page
    assert "&lt;script&gt;alert(1)&lt;/script&gt;" in page


def test_bounds_and_room_are_said(site: Site) -> None:
    page = site.client.get("/new?preset=cartpole-swingup").text
    assert "From 1 to 16." in page
    assert "More than 0, at most 0.1." in page
    assert "Needs at most about" in page


def test_an_environment_that_gives_its_task_away_is_warned_of(site: Site) -> None:
    hopper = {"environment.kind": "gym", "environment.id": "Hopper-v5", "feedback.teacher.kind": "oracle"}
    wanted = {"preset": "walker-walk", **hopper}
    warning = "Episodes of gym:Hopper-v5 can end early. What ends them gives the task away"
    assert warning in site.client.get("/new", params=wanted).text
    assert warning not in site.client.get("/new", params={"preset": "walker-walk"}).text
    sent = {**wanted, "title": "Hop", "goal": "Hop."}
    made = site.client.post("/new", data=sent, headers=SAME, follow_redirects=True)
    assert warning in made.text  # on the run's own page


def test_another_environment_brings_its_own_words(site: Site) -> None:
    """People were asked for what the preset's own robot does."""
    stand = {"preset": "walker-walk", "environment.task": "walker-stand"}
    walking = form_of(site, urlencode({"preset": "walker-walk"}))
    standing = form_of(site, urlencode({**walking, **stand}))
    known = entry("dmc:walker-stand")
    assert (standing["title"], standing["goal"]) == (known.title, known.goal)
    assert walking["goal"] != known.goal
    for form in ({**walking, **stand}, standing):
        assert words_made(site, form) == (known.title, known.goal)
    typed = {
        **standing,
        "title": "My own",
        "goal": "Prefer the taller one.",
        "environment.task": "walker-run",
    }
    assert words_made(site, typed) == ("My own", "Prefer the taller one.")


def words_made(site: Site, form: dict[str, str]) -> tuple[str, str]:
    """Title and first goal of the run that the form makes."""
    answer = site.client.post("/new", data=form, headers=SAME)
    assert answer.status_code == 303
    with site.database.read() as session:
        run = get_run(session, answer.headers["location"].removeprefix("/runs/"))
        return run.title, run.goal_cards[0].text
