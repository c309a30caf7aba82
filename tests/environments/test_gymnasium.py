"""Gymnasium's environments: what is taken, what is refused and why, how they end, go on and are drawn."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces
from PIL import Image

from labels_db import catalogue
from labels_db.data_folder import DataFolder
from labels_db.run_config import Gymnasium, Human, RunConfig, Sessions
from tests.environments.given import lived, started
from trainer.environments import Environment, make_environment
from trainer.environments.filmed import kept, shown
from trainer.environments.trial import add, random_steps

LOOKS: dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": 20}


class Cart(gymnasium.Env[Any, Any]):
    """A cart on a rail, written in Python; `Opaque` keeps an object of its own too, `Blind` shows nothing."""

    metadata = LOOKS
    observation_space: spaces.Space[Any] = spaces.Dict(
        place=spaces.Box(-np.inf, np.inf, (2,)), lights=spaces.MultiBinary(3)
    )
    action_space: spaces.Space[Any] = spaces.Box(np.array([0.0, -np.inf], np.float32), np.inf)

    def __init__(self, render_mode: str | None = None) -> None:
        self.render_mode, self.place = render_mode, np.zeros(2)
        self.pushed: float | None = None

    def reset(self, *, seed: int | None = None, options: Any = None) -> tuple[Any, dict[str, Any]]:
        super().reset(seed=seed)
        self.place, self.pushed = self.np_random.uniform(-1, 1, 2), None
        return self._seen(), {}

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        self.place = self.place + 0.1 * action + 0.01 * self.np_random.normal(size=2)
        self.pushed = float(action[0])
        return self._seen(), float(self.place[0]), bool(self.place[0] > 1), False, {}

    def render(self) -> Any:
        shade = 0 if self.pushed is None else 200
        return np.full((30, 60, 3), [shade, 0, min(max(100 * self.place[0], 0), 255)], np.uint8)

    def _seen(self) -> Any:
        return {"place": self.place.astype(np.float32), "lights": np.ones(3, np.int8)}


class Opaque(Cart):
    open = 0

    def __init__(self, render_mode: str | None = None) -> None:
        super().__init__(render_mode)
        self.world = object()
        Opaque.open += 1

    def close(self) -> None:
        Opaque.open -= 1


class Blind(Cart):
    metadata: dict[str, Any] = {"render_modes": [], "render_fps": 20}  # noqa: RUF012  (as gymnasium has it)


class Moody(Cart):
    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        self.place = self.place + np.random.normal(size=2)
        return super().step(action)


class Picture(Cart):
    observation_space = spaces.Box(0, 255, (8, 8, 3), np.uint8)


class Sentence(Cart):
    observation_space = spaces.Sequence(spaces.Box(-1, 1, (2,)))


KINDS: dict[str, Any] = {kind.__name__: kind for kind in (Cart, Opaque, Blind, Moody, Picture, Sentence)}


@pytest.fixture(autouse=True)
def registered(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Environments of an installed package, as it were; what a test adds to a catalogue is forgotten."""
    monkeypatch.setattr(catalogue, "_included", set())
    for name, kind in KINDS.items():
        gymnasium.register(f"tests/{name}-v0", entry_point=kind, max_episode_steps=40)
    gymnasium.register("tests/Endless-v0", entry_point=KINDS["Cart"])
    gymnasium.register(
        "tests/Dice-v0", entry_point=KINDS["Cart"], max_episode_steps=40, nondeterministic=True
    )
    yield
    for id in [id for id in gymnasium.registry if id.startswith("tests/")]:
        del gymnasium.registry[id]


def gym(id: str, **settings: Any) -> Gymnasium:
    """A configuration of an id that is in no catalogue."""
    return Gymnasium.model_construct(id=id, **settings)


@pytest.mark.parametrize(
    ("id", "reason"),
    [
        ("CartPole-v1", r"gym:CartPole-v1: takes actions from Discrete\(2\); only continuous ones"),
        ("tests/Picture-v0", r"gym:tests/Picture-v0: observes images"),
        ("tests/Sentence-v0", r"observations \(Sequence.*cannot be put into one vector"),
        ("tests/Endless-v0", r"has no time limit; register it with max_episode_steps"),
        ("tests/Dice-v0", r"registered as nondeterministic"),
        ("os:Hopper-v5", r"a module cannot be named"),
        ("Hoper-v5", r"Did you mean: `Hopper`"),
    ],
)
def test_what_cannot_be_learned_in_is_refused_with_the_reason(id: str, reason: str) -> None:
    with pytest.raises(ValueError, match=reason):
        make_environment(gym(id))


def test_actions_are_rescaled_and_observations_flat() -> None:
    environment: Any = started(gym("tests/Cart-v0"))  # whose insides are looked at
    observation, *_ = environment.step(np.array([0.5, 0.25], np.float32))
    assert observation.shape == (5,)
    assert environment._task.unwrapped.pushed == 0.5  # no upper limit: taken as it is
    pendulum: Any = started(Gymnasium(id="Pendulum-v1"))
    pendulum.step(np.array([0.5], np.float32))
    assert pendulum._task.unwrapped.last_u == 1.0  # of at most 2


def test_an_episode_can_end_early_and_must_then_be_reset() -> None:
    environment, terminated, steps = started(Gymnasium(id="Hopper-v5")), False, 0
    while not terminated:
        _, _, terminated, truncated, info = environment.step(np.ones(3, np.float32))
        steps += 1
    assert not truncated
    assert info["measures"] == {"seconds": pytest.approx(steps * 0.008)}
    with pytest.raises(RuntimeError, match="reset"):
        environment.step(np.ones(3, np.float32))


def test_the_time_limit_truncates() -> None:
    environment = started(Gymnasium(id="Reacher-v5", action_repeat=16))
    ends = [environment.step(np.zeros(2, np.float32))[2:4] for _ in range(4)]
    assert ends == [*3 * [(False, False)], (False, True)]
    assert environment.get_state().step == 50


def test_mujocos_warnings_leave_no_file(tmp_path: Path) -> None:
    """Half cheetah's model is written in words that MuJoCo calls deprecated."""
    code = (
        "from labels_db.run_config import Gymnasium; from trainer.environments import make_environment;"
        "make_environment(Gymnasium(id='HalfCheetah-v5'))"
    )
    path = os.pathsep.join([str(Path(__file__).parents[2]), *sys.path])
    subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, env={**os.environ, "PYTHONPATH": path}, check=True
    )
    assert list(tmp_path.iterdir()) == []


# Drawing by themselves ---------------------------------------------------------------------------


def moment(environment: Environment, steps: int) -> Any:
    lived(environment, steps)
    return environment.physics_state()


def test_an_environment_in_python_is_drawn_from_its_numbers() -> None:
    environment: Any = started(gym("tests/Cart-v0"))  # whose insides are looked at
    before, after = moment(environment, 0), moment(environment, 9)
    scene: Any = environment.scene
    scene.restore(3, after)
    assert (scene.picture() == environment._task.unwrapped.render()).all()
    scene.restore(3, before)
    assert scene.picture()[0, 0, 0] == 0  # not pushed yet: None, as it was
    with pytest.raises(ValueError, match=r"shape \(7,\), but a state of tests/Cart-v0 has shape \(3,\)"):
        scene.restore(3, np.zeros(7))


def test_of_an_environment_with_objects_each_picture_is_kept() -> None:
    environment: Any = started(gym("tests/Opaque-v0"))
    before, after = moment(environment, 0), moment(environment, 9)
    scene: Any = environment.scene
    assert (
        np.abs(scene.picture() - environment._task.unwrapped.render().astype(int)).max() < 10
    )  # it is compressed
    scene.restore(3, before)
    assert scene.picture()[0, 0, 0] < 10
    scene.restore(3, after)
    assert scene.picture()[0, 0, 0] > 190
    with pytest.raises(ValueError, match=r"shape \(7,\), but a state of tests/Opaque-v0 has shape \(640,\)"):
        scene.restore(3, np.zeros(7))


def test_what_is_made_anew_for_every_episode_is_closed_before(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Opaque, "open", 0)
    lived(started(gym("tests/Opaque-v0")), 200)
    assert Opaque.open == 1


def test_a_picture_is_kept_as_well_as_there_is_room() -> None:
    tiles = np.random.default_rng(0).integers(0, 256, (60, 80, 3), dtype=np.uint8)
    busy = tiles.repeat(4, 0).repeat(4, 1)
    flat = np.full((400, 600, 3), 90, np.uint8)
    assert shown(kept(flat)).shape == (200, 300, 3)
    assert np.abs(shown(kept(flat)).astype(int) - 90).max() < 3
    smaller = np.asarray(Image.fromarray(busy).reduce(2))
    assert shown(kept(busy)).shape == smaller.shape  # the best has no room
    assert np.corrcoef(shown(kept(busy)).ravel(), smaller.ravel())[0, 1] > 0.5


def test_what_cannot_be_drawn_has_only_scripted_teachers(tmp_path: Path) -> None:
    environment = started(gym("tests/Blind-v0"))
    assert environment.physics_state().shape == (0,) == (environment.state_size,)
    with pytest.raises(ValueError, match=r"gym:tests/Blind-v0: draws no pictures"):
        _ = environment.scene
    add(DataFolder(tmp_path).catalogue_path, "gym:tests/Blind-v0", "Blind", "…")
    config = RunConfig(environment=Gymnasium(id="tests/Blind-v0"))
    assert any("cannot be drawn" in caveat for caveat in config.caveats)
    with pytest.raises(ValueError, match="gym:tests/Blind-v0 cannot be drawn, so ask a scripted teacher"):
        RunConfig(environment=config.environment, feedback=Sessions(teacher=Human()))


# Adding ------------------------------------------------------------------------------------------


def test_random_steps_are_measured_where_episodes_end_early() -> None:
    hopper, pendulum = (make_environment(Gymnasium(id=id)) for id in ("Hopper-v5", "Pendulum-v1"))
    assert 10 < random_steps(hopper) < 40
    assert random_steps(pendulum) == 0


def test_an_environment_is_added_to_its_data_folder(tmp_path: Path) -> None:
    data = DataFolder(tmp_path / "data")
    with pytest.raises(ValueError, match="unknown"):
        Gymnasium(id="tests/Cart-v0")
    added = add(data.catalogue_path, "gym:tests/Cart-v0", "Cart", "Prefer the clip in which it is far.")
    assert (added.observation_size, added.action_size, added.state_size) == (5, 2, 3)
    assert (added.control_step, added.episode_steps, added.ends_early) == (0.05, 40, True)
    assert 0 < added.random_steps <= 40
    assert json.loads(data.catalogue_path.read_text())[0]["title"] == "Cart"
    config = RunConfig(environment=Gymnasium(id="tests/Cart-v0"))
    assert config.catalogue_entry == added
    assert any("can end early" in caveat for caveat in config.caveats)
    catalogue._included.clear()
    with pytest.raises(ValueError, match="unknown"):
        Gymnasium(id="tests/Cart-v0")


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("gym:tests/Moody-v0", "'gym:tests/Moody-v0': the same seed and actions led elsewhere"),
        ("dmc:walker-fly", "cannot be added; one is named as in gym:Hopper-v5"),
    ],
)
def test_what_cannot_go_on_is_not_added(tmp_path: Path, name: str, reason: str) -> None:
    with pytest.raises(ValueError, match=reason):
        add(tmp_path / "catalogue.json", name, "x", "x")
    assert not (tmp_path / "catalogue.json").exists()
