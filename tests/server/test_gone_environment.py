"""A run whose environment the catalogue has lost is shown like any other, and says what is missing."""

from __future__ import annotations

import pytest

from labels_db.models import Run
from labels_db.presets import preset_named
from labels_db.runs import config_of, get_run, request_run
from tests.server.conftest import Site

GONE = "gym:gone/Cart-v0"


@pytest.fixture
def run(site: Site) -> str:
    config = preset_named("gym:Hopper-v5").config().model_dump(mode="json")
    with site.database.write() as session:
        run = request_run(session, preset_named("gym:Hopper-v5").config(), title="Cart", goal="Up.")
        run.config = {**config, "environment": {**config["environment"], "id": "gone/Cart-v0"}}
        return run.id


@pytest.mark.parametrize("address", ["/", "/api/runs", "/runs/{run}", "/api/runs/{run}", "/runs/{run}/label"])
def test_every_page_is_there(site: Site, run: str, address: str) -> None:
    assert site.client.get(address.format(run=run)).status_code == 200


def test_its_page_says_how_it_comes_back(site: Site, run: str) -> None:
    page = site.client.get(f"/runs/{run}").text
    assert f"pebble environments --add {GONE}" in page


def test_it_can_be_stopped_but_not_made_longer(site: Site, run: str) -> None:
    assert site.client.post(f"/api/runs/{run}/stop", json={}).status_code == 200
    refused = site.client.post(f"/api/runs/{run}/extend", json={"total_steps": 10_000_000})
    assert refused.status_code == 422
    assert GONE in refused.json()["detail"][0]["reason"]


def test_it_is_no_environment_for_a_new_run(site: Site, run: str) -> None:
    with site.database.read() as session:
        stored = config_of(get_run(session, run))
    with pytest.raises(ValueError, match="unknown"):
        type(stored).model_validate(stored.model_dump())


def test_a_fault_of_ours_is_not_called_the_clients(site: Site, run: str) -> None:
    with site.database.write() as session:
        found = session.get_one(Run, run)
        found.config = {**found.config, "total_steps": "many"}
    assert site.client.get(f"/api/runs/{run}").status_code == 500
