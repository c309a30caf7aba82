"""The paper's manipulation tasks (section 5.2) in today's Meta-world, whose figures are not the paper's."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from labels_db.overrides import Settings
from labels_db.presets.preset import FewLabels, Preset, Profiles
from labels_db.run_config import (
    SAC,
    Evaluation,
    LearnedReward,
    MetaWorld,
    Oracle,
    RunConfig,
    Sessions,
    StateEntropy,
)


@dataclass(frozen=True)
class _Task:
    name: str
    budget: int
    queries: int
    steps_between: int
    few: FewLabels | None = None


TASKS = (
    _Task("drawer-close", 10_000, 64, 2400),
    _Task("window-open", 10_000, 64, 2400, FewLabels(400, 10, 5000, 500_000)),
    _Task("door-open", 10_000, 64, 2400, FewLabels(3000, 30, 5000, 1_000_000)),
    _Task("button-press", 10_000, 64, 2400, FewLabels(2000, 25, 5000, 1_000_000)),
    _Task("sweep-into", 50_000, 128, 4800),
    _Task("drawer-open", 50_000, 128, 4800),
)


def manipulation() -> Iterator[Preset]:
    for task in TASKS:
        yield Preset(task.name, _profiles(task), _on_policy(task))


def manipulating(name: str, task: str) -> Preset:
    """A preset of that name for any of the 50 tasks, with the settings that most have in the paper."""
    return Preset(name, _profiles(_Task(task, 10_000, 64, 2400)), ON_POLICY)


def _on_policy(task: _Task) -> Mapping[str, Settings]:
    """With few labels they come as often as PEBBLE's."""
    if task.few is None:
        return ON_POLICY
    return {**ON_POLICY, "few-labels": {**PUBLIC_PPO, "feedback.steps_between": str(task.few.steps_between)}}


def _profiles(task: _Task) -> Profiles:
    public = _as_published(task, segment_steps=50, transform="distance", tie="first")
    published = {
        "laptop": _laptop(task),
        "paper": _as_published(task, segment_steps=10, transform="log", tie="equal"),
        "public": public,
    }
    return published if task.few is None else {**published, "few-labels": task.few.of(public)}


def _as_published(task: _Task, *, segment_steps: int, transform: str, tie: str) -> RunConfig:
    return RunConfig(
        environment=MetaWorld(task=task.name),
        agent=SAC(width=256, depth=3, batch_size=512, learning_rate=3e-4),
        reward=LearnedReward(max_epochs=10),
        exploration=StateEntropy.model_validate({"transform": transform}),
        feedback=Sessions(
            teacher=Oracle.model_validate({"tie": tie}),
            budget=task.budget,
            queries_per_session=task.queries,
            steps_between=task.steps_between,
            segment_steps=segment_steps,
        ),
        evaluation=Evaluation(every=10_000, episodes=10),
        total_steps=1_000_000,
    )


def _laptop(task: _Task) -> RunConfig:
    """An action is held four control steps, as on other tasks; SAC then opens the window (`benchmarks/README.md`)."""
    return RunConfig(
        environment=MetaWorld(task=task.name, goal_visible=True, action_repeat=4),
        agent=SAC(width=256, batch_size=256, learning_rate=5e-4, layer_norm=True),
        reward=LearnedReward(max_epochs=10),
        exploration=StateEntropy(explore_steps=3000),
        feedback=Sessions(
            teacher=Oracle(), budget=1000, queries_per_session=50, steps_between=1500, segment_steps=25
        ),
        evaluation=Evaluation(every=5000, episodes=10),
        total_steps=50_000,
        precision="auto",
    )


PAPER_PPO: Settings = {
    "agent.width": "256",
    "agent.depth": "3",
    "agent.learning_rate": "3e-4",
    "agent.rollout_steps": "250",
    "agent.batch_size": "128",
    "agent.epochs": "20",
    "agent.state_dependent_noise": "true",
    "environments": "32",
    "evaluation.every": "10000",
    "total_steps": "3000000",
}
PUBLIC_PPO: Settings = {
    **PAPER_PPO,
    "agent.batch_size": "256",
    "agent.clip_range": "0.4",
    "agent.clip_schedule": "linear",
}
ASKED: Settings = {"feedback.queries_per_session": "256", "feedback.steps_between": "2400"}
ON_POLICY: Mapping[str, Settings] = {
    "paper": {**PAPER_PPO, **ASKED},
    "public": {**PUBLIC_PPO, **ASKED},
}
