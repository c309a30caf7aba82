"""How many threads a run has, and that those nobody chose leave the cores to others while they wait."""

from __future__ import annotations

import os
import subprocess
import sys
from typing import Any

import pytest
import torch

from labels_db.overrides import with_settings
from labels_db.presets import preset_named, presets
from labels_db.run_config import RunConfig
from tests.trainer.conftest import Lab, small_config
from trainer import threads
from trainer.assembly import Foundation
from trainer.threads import rest_between_clips, threads_of, wait_asleep

CORES = 6


@pytest.fixture(autouse=True)
def six_cores(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(threads, "available_cores", lambda: CORES)


def paper(**settings: object) -> RunConfig:
    changes = {path.replace("__", "."): str(value) for path, value in settings.items()}
    return with_settings(preset_named("walker-walk").config("paper"), changes)


def test_wide_layers_take_every_core() -> None:
    assert threads_of(paper()) == CORES
    assert threads_of(paper(agent__batch_size=512)) == CORES
    assert threads_of(paper(agent__batch_size=256)) == 1
    assert threads_of(paper(agent__width=256)) == 1


def test_a_chosen_number_is_kept() -> None:
    assert threads_of(paper(threads=3)) == 3
    assert threads_of(small_config(threads=2)) == 2


def test_drawing_rests_where_nobody_chose_that_every_core_is_taken() -> None:
    assert rest_between_clips(paper()) > 1
    assert rest_between_clips(paper(agent__width=256)) == 0
    assert rest_between_clips(paper(threads=CORES)) == 0


def test_a_laptop_s_runs_have_one_thread_and_so_repeat_exactly() -> None:
    laptops = [preset.config("laptop") for preset in presets().values() if "laptop" in preset.profiles]
    assert laptops
    assert {threads_of(config) for config in laptops} == {1}


def test_a_run_computes_with_as_many() -> None:
    before = torch.get_num_threads()
    try:
        Foundation(small_config(threads=2), torch.device("cpu"))
        assert torch.get_num_threads() == 2
        Foundation(small_config(), torch.device("cpu"))
        assert torch.get_num_threads() == 1
    finally:
        torch.set_num_threads(before)


def test_the_operator_s_own_policy_stays() -> None:
    environment = {"OMP_WAIT_POLICY": "active"}
    wait_asleep(paper(), environment)
    assert environment == {"OMP_WAIT_POLICY": "active"}


@pytest.mark.parametrize(("chosen", "spins"), [({}, False), ({"threads": 2}, True)])
def test_threads_that_nobody_chose_never_spin(lab: Lab, chosen: dict[str, Any], spins: bool) -> None:
    """OpenMP itself says how often a waiting thread looks before it sleeps."""
    run_id = lab.request(small_config(total_steps=310, **chosen))
    command = [sys.executable, "-m", "trainer.process", run_id, str(lab.claim().attempt), str(lab.data.path)]
    shown = {**os.environ, "OMP_DISPLAY_ENV": "VERBOSE"}
    shown.pop("OMP_WAIT_POLICY", None)
    said = subprocess.run(command, env=shown, capture_output=True, text=True)
    assert said.returncode == 0, said.stdout + said.stderr
    if "GOMP_SPINCOUNT" not in said.stderr:
        pytest.skip("this PyTorch has another OpenMP")
    assert ("GOMP_SPINCOUNT = '0'" not in said.stderr) is spins
