"""The rendering process: its pictures, its deaths, its order of work."""

from __future__ import annotations

import io
import math
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from concurrent.futures import Future
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import av
import numpy as np
import pytest

from labels_db.run_config import Behaviour, Clips, DMControl, EnvironmentConfig, Gymnasium, MetaWorld
from tests.rendering.given import CART_POLE, SEED, frames, lived
from trainer.environments import PhysicsState
from trainer.rendering import (
    EncodedClip,
    Renderer,
    RenderingError,
    RenderingLost,
    RenderingUnavailable,
    check_rendering,
    drawn,
    verify_clip,
)
from trainer.rendering.renderer import MAX_RESTARTS
from trainer.rendering.sheet import MAX_BYTES, Frame

NO_VENDORS = "__EGL_VENDOR_LIBRARY_FILENAMES"  # GLVND's list of drivers: none there, no EGL
WAIT = 60.0


@pytest.fixture(scope="module")
def renderer() -> Iterator[Renderer]:
    with Renderer(CART_POLE, Clips()) as shared:
        shared.warm()
        yield shared


@pytest.fixture(scope="module")
def states() -> PhysicsState:
    return lived(CART_POLE, 100)


def check_light(clip: EncodedClip) -> None:
    """A second of 50 steps, in a sheet that any connection carries."""
    verify_clip(clip)
    assert 10_000 < len(clip.data) <= MAX_BYTES
    assert (clip.frames, clip.rows, clip.columns, clip.width, clip.height) == (25, 5, 5, 320, 240)
    assert clip.duration == pytest.approx(1.0)
    assert clip.times == pytest.approx([0.04 * index for index in range(25)])


@pytest.mark.parametrize(
    "config",
    [
        DMControl(task="quadruped-walk"),
        DMControl(task="humanoid-walk"),
        MetaWorld(task="door-open"),
        Gymnasium(id="Ant-v5"),
        Gymnasium(id="Pendulum-v1"),
        Gymnasium(id="LunarLanderContinuous-v3"),
    ],
    ids=lambda config: config.name,
)
def test_clips_are_light(config: EnvironmentConfig) -> None:
    with Renderer(config, Clips()) as own:
        check_light(own.clip(SEED, lived(config, 50), 0.02).result(WAIT))


def test_a_model_without_a_sky_has_a_pale_one() -> None:
    config = Gymnasium(id="InvertedPendulum-v5")
    with Renderer(config, Clips()) as own:
        frame = frames(own.clip(SEED, lived(config, 4), 0.04).result(WAIT))[0]
    assert np.median(frame) > 200
    assert np.mean(frame.max(axis=-1) < 30) < 0.01


def test_a_robot_far_away_looks_the_same() -> None:
    """The floor is endless, and lit alike everywhere."""
    walker = DMControl(task="walker-walk")
    near = lived(walker, 50)
    far = near.copy()
    far[:, 2] += 500  # metres to the right: after the time and the height
    with Renderer(walker, Clips()) as own:
        clips = [own.clip(SEED, states, 0.02).result(WAIT) for states in (near, far)]
    check_light(clips[0])
    here, there = (np.array(frames(clip), int) for clip in clips)
    assert np.abs(here - there).mean() < 1


def test_contact_with_a_tiled_floor_can_be_seen(renderer: Renderer, states: PhysicsState) -> None:
    frame = frames(renderer.clip(SEED, states[:20], 0.01).result(WAIT))[0].astype(int)
    floor = frame[160:][np.ptp(frame[160:], axis=-1) < 30].mean(axis=-1)  # all but the orange robot
    tile, shadow = np.median(floor), np.min(floor)
    assert shadow < 0.7 * tile
    assert 0.002 < np.mean(floor < 0.75 * tile) < 0.1
    assert min(np.mean(floor > tile + 3), np.mean(floor < tile - 3)) > 0.2  # pale tiles, dark tiles


def test_a_state_is_drawn_the_same_again(renderer: Renderer, states: PhysicsState) -> None:
    first, other, again = (renderer.clip(seed, states[:20], 0.01) for seed in (SEED, 9, SEED))
    assert first.result(WAIT) == again.result(WAIT)
    verify_clip(other.result(WAIT))


@pytest.mark.parametrize(
    "config",
    [
        DMControl(task="reacher-easy"),
        DMControl(task="quadruped-escape"),
        MetaWorld(task="drawer-open"),
    ],
    ids=lambda config: config.name,
)
def test_a_restored_state_looks_like_the_live_scene(config: EnvironmentConfig) -> None:
    """Each moves things at reset: the target, the terrain, the drawer and the mark of its goal."""
    command = [sys.executable, "-m", "tests.rendering.live_scene", config.model_dump_json()]
    done = subprocess.run(
        command, env={**os.environ, "MUJOCO_GL": "egl"}, capture_output=True, text=True, check=True
    )
    difference, to_another_episode = map(int, done.stdout.split())
    assert difference == 0
    assert to_another_episode > 50


def pole_angle(frame: Frame) -> float:
    """Where the pole points, in radians clockwise from straight up, from the picture alone."""
    red, green, blue = np.moveaxis(frame.astype(int), -1, 0)
    down, right = np.nonzero((red > blue + 50) & (red > green + 15))
    cart = (frame.shape[0] / 2, frame.shape[1] / 2)
    tip = np.argmax(np.hypot(down - cart[0], right - cart[1]))
    return math.atan2(right[tip] - cart[1], cart[0] - down[tip])


@pytest.mark.parametrize(("way", "sign"), [("clockwise", 1), ("counter-clockwise", -1)])
def test_a_windmill_turns_the_wished_way_as_seen(renderer: Renderer, way: str, sign: int) -> None:
    from tests.environments.given import started

    environment = started(Behaviour(behaviour=f"cartpole-windmill-{way}"), SEED)
    environment.scene.data.qvel[1] = sign * 4 * math.pi  # two turns a second, from hanging down
    environment.set_state(environment.get_state())
    turning, rewards = [], []
    for _ in range(100):
        turning.append(environment.physics_state())
        _, reward, _, _, info = environment.step(np.zeros(1, np.float32))
        rewards.append(reward)
    pictures = frames(renderer.clip(SEED, np.array(turning), 0.01).result(WAIT))
    steps = np.diff([pole_angle(picture) for picture in pictures])
    seen = ((steps + math.pi) % (2 * math.pi) - math.pi).sum() / (2 * math.pi)
    assert min(rewards) > 0
    assert info["measures"]["turns"] > 1
    assert sign * seen == pytest.approx(info["measures"]["turns"] * 96 / 100, abs=0.15)


def decoded(video: bytes) -> list[av.VideoFrame]:
    with av.open(io.BytesIO(video), "r") as container:
        return list(container.decode(video=0))


def test_videos_play_in_real_time(renderer: Renderer, states: PhysicsState) -> None:
    video = renderer.video(SEED, states, 0.01).result(WAIT)
    pictures = decoded(video)
    assert len(pictures) == 25  # every fourth step of 0.01 s
    assert pictures[-1].time == pytest.approx(0.96, abs=1e-3)
    assert (pictures[0].width, pictures[0].height) == (320, 240)
    assert video.index(b"moov") < video.index(b"mdat")  # so that a browser can seek at once


def test_clips_go_before_a_video_that_began(renderer: Renderer, states: PhysicsState) -> None:
    video = renderer.video(SEED, states, 0.04)
    clip = renderer.clip(SEED, states, 0.01)
    verify_clip(clip.result(WAIT))
    assert not video.done()
    video.result(2 * WAIT)


def test_a_bad_request_fails_alone(renderer: Renderer, states: PhysicsState) -> None:
    bad, good = renderer.clip(SEED, states[:, :5], 0.01), renderer.clip(SEED, states[:20], 0.01)
    with pytest.raises(RenderingError, match=r"a clip: .*shape \(5,\).*cartpole-swingup has shape \(28,\)"):
        bad.result(WAIT)
    verify_clip(good.result(WAIT))


def process_of(renderer: Renderer) -> int | None:
    """The rendering process, while there is one."""
    child = renderer._child
    return None if child is None else child._process.pid


def warmed(renderer: Renderer, last: int | None = None) -> int:
    """The process, once there is one that draws, other than the last one."""
    deadline = time.monotonic() + WAIT
    while (process := process_of(renderer)) in (None, last) and time.monotonic() < deadline:
        time.sleep(0.01)
    assert process is not None
    return process


def kill(victim: Renderer, last: int | None = None) -> int:
    process = warmed(victim, last)
    os.kill(process, signal.SIGKILL)
    return process


def test_a_killed_process_comes_back(states: PhysicsState, monkeypatch: pytest.MonkeyPatch) -> None:
    assert MAX_RESTARTS == 3
    monkeypatch.setattr("trainer.rendering.renderer.MAX_RESTARTS", 1)
    with Renderer(CART_POLE, Clips(width=65, height=67)) as victim:
        clips = [victim.clip(SEED, states, 0.01) for _ in range(2)]
        killed = kill(victim)
        for clip in clips:
            verify_clip(clip.result(WAIT))
        video = victim.video(SEED, np.tile(states, (100, 1)), 0.04)
        kill(victim, killed)
        with pytest.raises(RenderingLost, match=r"died 2 times, the last one ended with code -9"):
            video.result(WAIT)
        with pytest.raises(RenderingLost):
            victim.clip(SEED, states, 0.01).result(WAIT)


def test_closing_fails_what_was_not_drawn(states: PhysicsState) -> None:
    closed = Renderer(CART_POLE, Clips())
    clip = closed.clip(SEED, states, 0.01)
    closed.close()
    with pytest.raises(RenderingLost, match="closed"):
        clip.result(WAIT)
    with pytest.raises(RenderingLost, match="closed"):
        closed.clip(SEED, states, 0.01).result(WAIT)
    closed.warm()
    assert process_of(closed) is None


def test_an_unused_renderer_starts_nothing() -> None:
    with Renderer(CART_POLE, Clips()) as unused:
        assert process_of(unused) is None


def test_warming_starts_the_process_at_once_and_only_once(states: PhysicsState) -> None:
    with Renderer(CART_POLE, Clips(width=64, height=64)) as warm:
        began = time.monotonic()
        warm.warm()
        assert time.monotonic() - began < 0.5
        process = warmed(warm)
        warm.warm()
        verify_clip(warm.clip(SEED, states, 0.01).result(WAIT))
        assert process_of(warm) == process


def processor_seconds(process: int) -> float:
    """What the process has computed so far, by the kernel's account."""
    user, system = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[11:13]
    return (int(user) + int(system)) / os.sysconf("SC_CLK_TCK")


def test_for_every_second_of_drawing_it_rests_as_long_as_it_is_told(states: PhysicsState) -> None:
    with Renderer(CART_POLE, Clips(), rest=3.0) as resting:
        resting.clip(SEED, states, 0.01).result(WAIT)
        process = warmed(resting)
        began, computed = time.monotonic(), processor_seconds(process)
        for clip in [resting.clip(SEED, states, 0.01) for _ in range(10)]:
            clip.result(WAIT)
        share = (processor_seconds(process) - computed) / (time.monotonic() - began)
    assert 0 < share < 1 / 2, "a quarter of the time, less what it waited for others"


def test_osmesa_draws_where_egl_cannot(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(NO_VENDORS, os.devnull)
    assert check_rendering() == "osmesa"


def test_without_opengl_the_error_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(NO_VENDORS, os.devnull)
    needed = r"egl: .*apt-get install libegl1 libgl1-mesa-dri libosmesa6"
    with pytest.raises(RenderingUnavailable, match=needed):
        check_rendering(backends=("egl",))
    with Renderer(CART_POLE, Clips(), backends=("egl",)) as blind, pytest.raises(RenderingUnavailable):
        blind.clip(SEED, np.zeros((20, 28)), 0.01).result(WAIT)


ORPHAN = """
import numpy, os, sys, time
from labels_db.run_config import Clips, DMControl
from trainer.rendering import Renderer
renderer = Renderer(DMControl(task="cartpole-swingup"), Clips())
renderer.clip(3, numpy.zeros((20, 28)), 0.01).result()
print(renderer._child._process.pid, flush=True)
os.kill(os.getpid(), 9)
"""


def test_the_process_leaves_with_its_parent() -> None:
    done = subprocess.run([sys.executable, "-c", ORPHAN], capture_output=True, text=True, check=False)
    child, deadline = int(done.stdout), time.monotonic() + 10
    while Path(f"/proc/{child}").exists() and time.monotonic() < deadline:
        time.sleep(0.05)
    assert not Path(f"/proc/{child}").exists()


def test_importing_loads_no_opengl() -> None:
    code = (
        "import sys, trainer.rendering;"
        "print([m for m in ('mujoco', 'dm_control', 'OpenGL', 'glfw', 'torch') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_clips_compare_by_value() -> None:
    clip = EncodedClip(b"", 1, 1, 1, 2, 2, 0.1, (0.0,))
    assert clip == EncodedClip(b"", 1, 1, 1, 2, 2, 0.1, (0.0,))


def test_a_driver_that_hangs_is_named_to_who_waits() -> None:
    with pytest.raises(RenderingLost, match=r"nothing was drawn within 0 s; `pebble doctor`"):
        drawn(Future(), 0.01)


@pytest.fixture
def hanging(monkeypatch: pytest.MonkeyPatch) -> None:
    """Processes that never draw a first frame."""
    start = subprocess.Popen

    def sleep(_command: object, **settings: Any) -> subprocess.Popen[bytes]:
        return start(["sleep", "60"], **settings)

    monkeypatch.setattr(
        "trainer.rendering.process.subprocess", SimpleNamespace(**{**vars(subprocess), "Popen": sleep})
    )
    monkeypatch.setattr("trainer.rendering.process.GRACE_SECONDS", 0.2)


@pytest.mark.timeout(30)
@pytest.mark.usefixtures("hanging")
def test_a_renderer_whose_process_hangs_before_its_first_frame_can_be_closed() -> None:
    renderer = Renderer(CART_POLE, Clips())
    clip = renderer.clip(SEED, lived(CART_POLE, 2), 0.1)
    renderer.close()
    with pytest.raises(RenderingLost, match="closed"):
        clip.result(0)


@pytest.mark.timeout(30)
@pytest.mark.usefixtures("hanging")
def test_a_driver_that_hangs_at_its_first_frame_is_as_good_as_none(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("trainer.rendering.process.START_SECONDS", 0.3)
    with Renderer(CART_POLE, Clips()) as renderer, pytest.raises(RenderingUnavailable, match="code -9"):
        renderer.clip(SEED, lived(CART_POLE, 2), 0.1).result(20)


def test_a_process_that_owes_an_answer_for_too_long_is_started_again(monkeypatch: pytest.MonkeyPatch) -> None:
    with Renderer(CART_POLE, Clips()) as renderer:
        renderer.clip(SEED, lived(CART_POLE, 2), 0.1).result(60)
        assert renderer._child is not None
        process = renderer._child._process
        os.kill(process.pid, signal.SIGSTOP)
        owed = renderer.clip(SEED, lived(CART_POLE, 2), 0.1)
        monkeypatch.setattr("trainer.rendering.renderer.CLIP_SECONDS", 0.0)
        time.sleep(0.1)
        asked = renderer.clip(SEED, lived(CART_POLE, 2), 0.1)
        monkeypatch.setattr("trainer.rendering.renderer.CLIP_SECONDS", 120)
        assert owed.result(60).data == asked.result(60).data
        assert process.wait(5) == -signal.SIGKILL
