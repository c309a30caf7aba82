"""A trained policy leaves in formats that others can roll out without this program."""

from __future__ import annotations

import io
import json
from functools import partial
from pathlib import Path

import av
import numpy as np
import pytest
import torch
from safetensors.numpy import load_file

from labels_db.artifacts import video_of
from labels_db.claims import finish_run
from labels_db.errors import ConflictError
from labels_db.models import Command
from labels_db.policy_commands import POLICY_COMMANDS
from labels_db.records import evaluations_of, record_evaluation
from labels_db.run_config import RunConfig
from tests.trainer.conftest import RUN, Lab, small_config
from trainer import commands
from trainer.agents.registry import make_agent, policy_layers
from trainer.checkpoints import CheckpointError
from trainer.commands import DOERS, Record, do
from trainer.export import ExportError, export_policy
from trainer.policy import TrainedPolicy, load_policy
from trainer.randomness import Randomness
from trainer.rendering import Renderer


@pytest.fixture
def policy() -> TrainedPolicy:
    config: RunConfig = small_config()
    agent = make_agent(config, Randomness(4), torch.device("cpu"))
    return TrainedPolicy(config, 900, policy_layers(config, agent.state()))


OBSERVATIONS = np.random.default_rng(0).normal(size=(7, 5)).astype(np.float32)


def test_onnx_gives_the_same_actions_for_any_number_of_observations(
    policy: TrainedPolicy, tmp_path: Path
) -> None:
    import onnx
    import onnxruntime

    path = tmp_path / "policy.onnx"
    export_policy(policy, path)
    session = onnxruntime.InferenceSession(path, providers=["CPUExecutionProvider"])
    for count in (1, 7):
        (actions,) = session.run(["action"], {"observation": OBSERVATIONS[:count]})
        np.testing.assert_allclose(actions, policy(OBSERVATIONS[:count]), atol=1e-6)
    told = {entry.key: json.loads(entry.value) for entry in onnx.load(path).metadata_props}
    assert told["environment"] == "behaviour:cartpole-windmill-clockwise"
    assert told["seconds_per_action"] == pytest.approx(0.08)


def test_safetensors_with_its_layout_can_be_rolled_out_by_hand(policy: TrainedPolicy, tmp_path: Path) -> None:
    export_policy(policy, tmp_path / "policy.safetensors")
    arrays, layout = (
        load_file(tmp_path / "policy.safetensors"),
        json.loads((tmp_path / "policy.json").read_text()),
    )
    x = OBSERVATIONS
    for layer in layout["layers"]:
        x = x @ arrays[layer["weight"]] + arrays[layer["bias"]]
        x = np.maximum(x, 0) if layer["activation"] == "relu" else np.tanh(x)
    np.testing.assert_allclose(x, policy(OBSERVATIONS), atol=1e-6)


def test_every_command_has_its_doer() -> None:
    assert set(DOERS) == POLICY_COMMANDS


def test_an_exported_file_explains_itself(policy: TrainedPolicy, lab: Lab) -> None:
    command = Command(id=7, run_id=RUN, kind="export-policy", arguments={"format": "safetensors"})
    result = DOERS[command.kind](command, policy, Record(lab.database, lab.store))
    assert result["artifact"] == f"runs/{RUN}/exports/7/{RUN}-step-900.safetensors"
    data = lab.store.read(result["artifact"], result["sha256"])
    assert result["bytes"] == len(data)
    header = json.loads(data[8 : 8 + int.from_bytes(data[:8], "little")])
    layout = json.loads(header["__metadata__"]["layout"])
    assert (layout["step"], layout["layers"][-1]["activation"]) == (900, "tanh")
    assert all(layer["weight"] in header for layer in layout["layers"])


def asked_for_a_video(lab: Lab, policy: TrainedPolicy, command_id: int) -> dict[str, object]:
    command = Command(id=command_id, run_id=RUN, kind="video", arguments={})
    return DOERS[command.kind](command, policy, Record(lab.database, lab.store))


def test_a_video_is_kept_with_the_evaluation_that_it_begins(policy: TrainedPolicy, lab: Lab) -> None:
    lab.request(policy.config)
    owner = lab.claim()
    with lab.database.write() as session:
        finish_run(session, owner)
    assert asked_for_a_video(lab, policy, 7) == {"step": 900}
    with lab.database.read() as session:
        (kept,) = evaluations_of(session, RUN)
        assert video_of(session, RUN, 900) == f"runs/{RUN}/videos/c7-900.mp4"
    assert (kept.step, len(kept.returns)) == (900, policy.config.evaluation.episodes)
    assert set(kept.measures) == {"turns"}
    with av.open(io.BytesIO(lab.store.read(f"runs/{RUN}/videos/c7-900.mp4")), "r") as container:
        (stream,) = container.streams.video
        assert (stream.width, stream.height) == (64, 64)
        assert len(list(container.decode(stream))) == pytest.approx(
            250, abs=2
        )  # ten seconds, the whole episode


def test_an_evaluation_that_is_there_stays_and_has_the_video(policy: TrainedPolicy, lab: Lab) -> None:
    lab.request(policy.config)
    owner = lab.claim()
    with lab.database.write() as session:
        record_evaluation(session, owner, step=900, returns=[1.5, 2.5], measures={}, video_key=None)
        finish_run(session, owner)
    asked_for_a_video(lab, policy, 7)
    with lab.database.read() as session:
        (kept,) = evaluations_of(session, RUN)
    assert (kept.returns, kept.video_key) == ([1.5, 2.5], f"runs/{RUN}/videos/c7-900.mp4")


def test_a_video_of_a_run_that_goes_on_is_dropped(policy: TrainedPolicy, lab: Lab) -> None:
    lab.request(policy.config)
    with pytest.raises(ConflictError, match="ask again once it has ended"):
        asked_for_a_video(lab, policy, 7)
    assert list(lab.store.keys(f"runs/{RUN}")) == []
    with lab.database.read() as session:
        assert list(evaluations_of(session, RUN)) == []


def test_a_video_that_cannot_be_drawn_leaves_nothing_but_the_reason(
    undisturbed: Lab, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(commands, "Renderer", partial(Renderer, backends=("nothing",)))
    command = Command(id=7, run_id=RUN, kind="video", arguments={})
    (error,) = do(command, undisturbed.database, undisturbed.store).values()
    assert error.startswith("rendering: no OpenGL to draw with (nothing:")
    with undisturbed.database.read() as session:
        assert [found.video_key for found in evaluations_of(session, RUN) if found.video_key] == []


def test_a_command_that_cannot_be_done_says_why(lab: Lab) -> None:
    lab.request(small_config())
    command = Command(id=7, run_id=RUN, kind="evaluate", arguments={"episodes": 1})
    (error,) = do(command, lab.database, lab.store).values()
    assert error.startswith(f"run {RUN}: has no checkpoint yet")


def test_a_wrong_file_name_says_what_would_be_right(policy: TrainedPolicy, tmp_path: Path) -> None:
    with pytest.raises(ExportError, match=r"unknown format '\.pt'; one of \.onnx, \.safetensors"):
        export_policy(policy, tmp_path / "policy.pt")
    with pytest.raises(ExportError, match="no such folder"):
        export_policy(policy, tmp_path / "nowhere" / "policy.onnx")


def test_a_run_without_checkpoint_has_no_policy_yet(lab: Lab) -> None:
    lab.request(small_config())
    with pytest.raises(CheckpointError, match="no checkpoint yet"):
        load_policy(lab.database, lab.store, RUN)
