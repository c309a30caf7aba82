"""Meta-world's tasks: settings of the paper, goals, success, and marks in the right place."""

from __future__ import annotations

import subprocess
import sys
from typing import Any

import numpy as np
import pytest

from labels_db.catalogue import EnvironmentUnavailableError, catalogue
from labels_db.run_config import MetaWorld
from tests.environments.given import actions, started
from trainer.environments import Environment, make_environment, without_gl

PAPER = ["drawer-close", "window-open", "door-open", "button-press", "sweep-into", "drawer-open"]
GOAL = slice(36, 39)
LOADED = "import sys; print([m for m in ('OpenGL', 'mujoco.egl', 'pygame', 'torch') if m in sys.modules])"


def task_of(environment: Any) -> Any:
    """Meta-world's own environment inside ours."""
    return environment._env


def success(environment: Environment, policy: Any, seed: int) -> float:
    """What a policy of Meta-world's reaches in an episode."""
    observation, info = environment.reset(seed=seed)
    over = False
    while not over and not info["measures"]["success"]:
        action = policy.get_action(observation.astype(np.float64)).astype(np.float32)
        observation, _, _, over, info = environment.step(action)
    reached: float = info["measures"]["success"]
    return reached


def solved(task: str, episodes: int) -> float:
    """The share of episodes that Meta-world's scripted policy solves in our environment."""
    with without_gl():
        from metaworld.policies import ENV_POLICY_MAP
    environment = make_environment(MetaWorld(task=task, goal_visible=True))
    policy: Any = ENV_POLICY_MAP[f"{task}-v3"]
    return float(np.mean([success(environment, policy(), seed) for seed in range(episodes)]))


@pytest.mark.filterwarnings("ignore:Constant:UserWarning")
def test_the_scripted_policy_closes_the_drawer() -> None:
    assert solved("drawer-close", 2) == 1.0


@pytest.mark.contracts
@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:Constant:UserWarning")
@pytest.mark.parametrize("task", PAPER)
def test_the_scripted_policies_solve_the_papers_tasks(task: str) -> None:
    assert solved(task, 10) >= 0.8


def test_every_task_is_in_the_catalogue() -> None:
    with without_gl():
        from metaworld.env_dict import ALL_V3_ENVIRONMENTS
    tasks = {f"metaworld:{name.removesuffix('-v3')}" for name in ALL_V3_ENVIRONMENTS}
    assert len(tasks) == 50
    assert tasks == {name for name in catalogue() if name.startswith("metaworld:")}


def test_the_goal_is_hidden_unless_asked_for() -> None:
    hidden, visible = (started(MetaWorld(goal_visible=seen), seed=4) for seen in (False, True))
    for action in actions(hidden, 3):
        without, *_ = hidden.step(action)
        with_it, *_ = visible.step(action)
        np.testing.assert_array_equal(without[: GOAL.start], with_it[: GOAL.start])
        np.testing.assert_array_equal(without[GOAL], 0)
        np.testing.assert_allclose(with_it[GOAL], task_of(visible)._target_pos)


def test_start_and_goal_differ_between_episodes() -> None:
    environment = make_environment(MetaWorld(task="push"))
    starts, goals = [], []
    for seed in range(4):
        starts.append(environment.reset(seed=seed)[0][4:7])
        goals.append(task_of(environment)._target_pos)
    assert len(np.unique(starts, axis=0)) == len(np.unique(goals, axis=0)) == 4


def test_an_episode_is_500_steps_and_only_truncated() -> None:
    environment, steps, truncated = started(MetaWorld(action_repeat=16)), 0, False
    while not truncated:
        *_, terminated, truncated, _ = environment.step(np.zeros(4, np.float32))
        steps += 1
        assert not terminated
    assert steps == 32  # 31 times 16, and 4
    assert task_of(environment).curr_path_length == 500


def test_success_stays_once_it_was_reached(monkeypatch: pytest.MonkeyPatch) -> None:
    environment = started(MetaWorld())
    plain, reached = task_of(environment).evaluate_state, iter([0.0, 1.0, 0.0])

    def told(*arguments: Any) -> tuple[float, dict[str, Any]]:
        reward, info = plain(*arguments)
        return reward, {**info, "success": next(reached)}

    monkeypatch.setattr(task_of(environment), "evaluate_state", told)
    seen = [environment.step(action)[4]["measures"]["success"] for action in actions(environment, 3)]
    assert seen == [0.0, 1.0, 1.0]
    assert environment.reset(seed=1)[1]["measures"] == {"success": 0.0}


MARKS = {
    **dict.fromkeys(PAPER, "goal"),
    "button-press": "hole",  # it has no other: where the button goes
    "sweep": "goal",  # in a moving body's frame
    "pick-out-of-hole": "goal",  # at the object's start
    "faucet-open": "goal_open",
}


@pytest.mark.parametrize(("task", "mark"), MARKS.items())
def test_a_restored_state_shows_the_goal_in_its_place(task: str, mark: str) -> None:
    live, drawn = (started(MetaWorld(task=task), seed) for seed in (3, 8))
    for action in actions(live, 20):
        live.step(action)
    drawn.scene.restore(3, live.physics_state())
    np.testing.assert_allclose(drawn.scene.data.site(mark).xpos, task_of(live)._target_pos)
    np.testing.assert_array_equal(drawn.scene.data.body("hand").xpos, live.scene.data.body("hand").xpos)


def test_an_unknown_task_is_refused_with_the_known_ones() -> None:
    with pytest.raises(ValueError, match=r"metaworld:drawer-shut: unknown task; one of .*drawer-close"):
        make_environment(MetaWorld.model_construct(task="drawer-shut"))


class NotInstalled:
    """Found first when Python looks for a module: Meta-world is not there."""

    def find_spec(self, name: str, *_: object) -> None:
        if name.partition(".")[0] == "metaworld":
            raise ModuleNotFoundError(f"No module named {name!r}", name="metaworld")


def test_without_meta_world_the_error_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in [*sys.modules]:
        if name.partition(".")[0] == "metaworld" or name == "trainer.environments.meta_world":
            monkeypatch.delitem(sys.modules, name)
    monkeypatch.setattr(sys, "meta_path", [NotInstalled(), *sys.meta_path])
    with pytest.raises(
        EnvironmentUnavailableError, match=r"metaworld:drawer-close needs .*pebble-teach\[metaworld\]"
    ):
        make_environment(MetaWorld())


def test_no_opengl_is_loaded() -> None:
    code = (
        "from labels_db.run_config import MetaWorld; from trainer.environments import make_environment;"
        f"make_environment(MetaWorld()).reset(seed=1); {LOADED}"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
