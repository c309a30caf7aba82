"""Experiments and comparisons without scripts: the dashboard's row, their pages, the API."""

from __future__ import annotations

import pytest

from labels_db.experiments import request_experiment
from tests.server.conftest import Site
from tests.web import demo, demo_experiment
from tests.web.demo_experiment import NAME, TASKS, TITLE

PAGE = f"/experiments/{NAME}"
API = f"/api/experiments/{NAME}"


@pytest.fixture
def runs(site: Site) -> list[str]:
    """An experiment half done, and two runs that belong to none."""
    with site.database.write() as session:
        found = demo_experiment.populate(session)
        demo.queued(session, "cartpole-swingup", title="<b>Alone</b>")
        demo.queued(session, "walker-walk", title="Walker")
    return found


def test_the_dashboard_has_one_row_for_all_its_runs(site: Site, runs: list[str]) -> None:
    page = site.client.get("/").text
    assert f'href="{PAGE}"' in page
    assert "12 of 18 runs finished, 2 under way, 3 queued, 1 failed." in page
    assert TITLE in page
    assert f"{NAME}: 2 tasks, 3 methods" in page
    assert runs[0] not in page
    assert "&lt;b&gt;Alone&lt;/b&gt;" in page
    assert page.count('type="checkbox" name="run"') == 2


def test_one_run_alone_is_not_compared(site: Site) -> None:
    with site.database.write() as session:
        demo.queued(session, "cartpole-swingup")
    page = site.client.get("/").text
    assert "Compare" not in page
    assert "Experiments" not in page


@pytest.mark.usefixtures("runs")
def test_a_page_tells_results_by_task_and_method(site: Site) -> None:
    page = site.client.get(PAGE).text
    found = site.client.get(API).json()["results"][0]
    assert f"{found['mean']:.1f} ± {found['deviation']:.1f}" in page
    for words in ("Cart pole · swing up", "2 of 3 seeds finished", "1 failed", "60 answers", "no answers"):
        assert words in page
    for raw in (">None<", "null", "RunState"):
        assert raw not in page


def test_its_runs_are_listed_task_by_task(site: Site, runs: list[str]) -> None:
    page = site.client.get(PAGE).text
    places = [page.index(f'href="/runs/{run_id}"') for run_id in runs]
    assert len(places) == 18
    first = [run for _, run in sorted(zip(places, runs, strict=True))][:3]
    assert first == [f"{NAME}-{TASKS[0]}-pebble-{seed}" for seed in (1, 2, 3)]
    assert f'Part of the experiment <a href="{PAGE}">{TITLE}</a>.' in site.client.get(f"/runs/{runs[0]}").text


@pytest.mark.usefixtures("runs")
def test_another_measure_is_a_link_away(site: Site) -> None:
    assert f'href="{PAGE}?measure=success"' in site.client.get(PAGE).text
    page = site.client.get(f"{PAGE}?measure=success").text
    assert "Success at the last evaluation" in page
    assert "<strong>–</strong>" in page  # the other task does not measure it


@pytest.mark.parametrize("address", [PAGE, API])
@pytest.mark.usefixtures("runs")
def test_a_measure_that_nothing_has_is_refused(site: Site, address: str) -> None:
    answer = site.client.get(f"{address}?measure=%3Cb%3E")
    assert answer.status_code == 422
    assert "one of return, success" in answer.text
    assert "<b>" not in answer.text or address == API


@pytest.mark.parametrize("address", [PAGE, API])
def test_an_experiment_without_runs_is_missing(site: Site, address: str) -> None:
    answer = site.client.get(address)
    assert answer.status_code == 404
    assert NAME in answer.text


def test_an_experiment_that_has_not_begun_has_a_page(site: Site) -> None:
    with site.database.write() as session:
        request_experiment(session, demo_experiment.experiment(seeds=1))
    page = site.client.get(PAGE).text
    assert "0 of 6 runs finished, 6 queued." in page
    assert "0 of 1 seed finished" in page
    assert site.client.get(API).json()["results"][0]["curve"]["steps"] == []


def test_the_api_lists_experiments(site: Site, runs: list[str]) -> None:
    (found,) = site.client.get("/api/experiments").json()
    assert (found["name"], found["methods"]) == (NAME, ["pebble", "preference-ppo", "sac"])
    assert found["tasks"][0] == {"name": TASKS[0], "title": "Cart pole · swing up"}
    assert found["tally"] == {
        "runs": 18,
        "finished": 12,
        "going": 2,
        "queued": 3,
        "failed": 1,
        "stopped": 0,
    }
    run = site.client.get(f"/api/runs/{runs[0]}").json()
    assert (run["experiment"], run["method"]) == (NAME, "pebble")


@pytest.mark.usefixtures("runs")
def test_the_api_has_every_curve_and_the_mean_at_shared_steps(site: Site) -> None:
    found = site.client.get(f"{API}?measure=success").json()
    assert (found["measures"], found["measure"]) == (["return", "success"], "success")
    result = found["results"][0]
    curves = {
        run["seed"]: run["curve"]
        for run in found["runs"]
        if run["id"].startswith(f"{NAME}-{TASKS[0]}-pebble")
    }
    assert [len(curves[seed]["steps"]) for seed in (1, 2, 3)] == [10, 10, 5]
    assert result["curve"]["steps"] == curves[1]["steps"]  # of the two that have finished
    assert result["curve"]["means"][0] == pytest.approx(sum(curves[s]["values"][0] for s in (1, 2)) / 2)
    assert (result["evaluated"], result["answers"]) == (2, 60)


def test_runs_are_compared_with_what_differs(site: Site, runs: list[str]) -> None:
    page = site.client.get(f"/compare?run={runs[0]}&run={runs[2]}&run={runs[0]}").text
    assert "2 runs compared" in page
    assert "agent.<wbr>" not in page
    assert "reward.<wbr>kind" in page
    assert "settings that only some of them have" in page
    assert f"run={runs[0]}&amp;run={runs[2]}&amp;measure=success" in page


def test_equal_runs_differ_in_nothing(site: Site) -> None:
    with site.database.write() as session:
        ids = [demo.queued(session, "cartpole-swingup").id for _ in range(2)]
    page = site.client.get(f"/compare?run={ids[0]}&run={ids[1]}").text
    assert "Nothing: their configurations are the same." in page


@pytest.mark.parametrize("count", [0, 1, 11, 12])
def test_a_comparison_begins_with_any_run_and_takes_others(site: Site, runs: list[str], count: int) -> None:
    chosen = runs[:count]
    page = site.client.get("/compare?run=&" + "&".join(f"run={run_id}" for run_id in chosen * 2)).text
    for run_id in chosen:
        assert page.count(f'type="hidden" name="run" value="{run_id}"') == (count < 12)
        assert f'<option value="{run_id}"' not in page
    rest = [run_id for run_id in runs if f'<option value="{run_id}"' in page]
    assert rest == (runs[count:] if count < 12 else [])
    assert (f'<optgroup label="{TITLE}">' in page) == (count < 12)
    assert ("&lt;b&gt;Alone&lt;/b&gt;</option>" in page) == (count < 12)
    assert ("Leave one out to add another." in page) == (count == 12)
    assert ("What differs between them" in page) == (count > 1)


def test_a_run_with_no_others_says_so(site: Site) -> None:
    assert "There is no run yet." in site.client.get("/compare").text
    with site.database.write() as session:
        alone = demo.queued(session, "cartpole-swingup").id
    assert f'href="/compare?run={alone}"' in site.client.get(f"/runs/{alone}").text
    assert "There is no other run to add." in site.client.get(f"/compare?run={alone}").text


@pytest.mark.parametrize(
    ("query", "status", "words"),
    [
        ("?" + "&".join(f"run={number}" for number in range(14)), 422, "go back and leave out 2"),
        ("?run=nobody&run=else", 404, "nobody"),
        ("?run=%3Cb%3E&run=else", 404, "&lt;b&gt;"),
    ],
)
def test_what_cannot_be_compared_says_why(site: Site, query: str, status: int, words: str) -> None:
    answer = site.client.get(f"/compare{query}")
    assert answer.status_code == status
    assert words in answer.text
