"""The paper's locomotion tasks (section 5.1), to the number of its tables; PPO's in its appendix B."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from labels_db.overrides import Settings
from labels_db.presets.preset import FewLabels, Preset, Profiles
from labels_db.run_config import (
    SAC,
    DMControl,
    EnvironmentConfig,
    Evaluation,
    LearnedReward,
    Oracle,
    RunConfig,
    Sessions,
    StateEntropy,
)

PAPER_PPO: Settings = {
    "agent.width": "1024",
    "agent.depth": "3",
    "agent.epochs": "20",
    "agent.state_dependent_noise": "true",
    "agent.clip_range": "0.2",
    "evaluation.every": "10000",
    "total_steps": "4000000",
}
"""What all its tasks have in common."""

WALKER_PPO: Settings = {
    "agent.learning_rate": "5e-5",
    "agent.rollout_steps": "100",
    "agent.batch_size": "128",
    "environments": "32",
}
QUADRUPED_PPO: Settings = {
    "agent.learning_rate": "1e-4",
    "agent.rollout_steps": "500",
    "agent.batch_size": "128",
    "environments": "16",
}


@dataclass(frozen=True)
class _Task:
    name: str
    rate: float
    """Of the paper; its follow-ups take `public_rate`."""
    public_rate: float
    queries: int
    total_steps: int
    laptop_steps: int
    few: FewLabels
    ppo: Settings
    ppo_queries: int


TASKS = (
    _Task(
        name="walker-walk",
        rate=5e-4,
        public_rate=5e-4,
        queries=140,
        total_steps=500_000,
        laptop_steps=80_000,
        few=FewLabels(100, 10, 20_000, 500_000),
        ppo=WALKER_PPO,
        ppo_queries=70,
    ),
    _Task(
        name="cheetah-run",
        rate=1e-3,
        public_rate=5e-4,
        queries=140,
        total_steps=1_000_000,
        laptop_steps=160_000,
        few=FewLabels(100, 10, 20_000, 1_000_000),
        ppo={
            "agent.learning_rate": "5e-5",
            "agent.rollout_steps": "100",
            "agent.batch_size": "512",
            "environments": "16",
        },
        ppo_queries=70,
    ),
    _Task(
        name="quadruped-walk",
        rate=1e-4,
        public_rate=1e-4,
        queries=70,
        total_steps=1_000_000,
        laptop_steps=160_000,
        few=FewLabels(1000, 100, 30_000, 1_000_000),
        ppo=QUADRUPED_PPO,
        ppo_queries=70,
    ),
)


def locomotion() -> Iterator[Preset]:
    for task in TASKS:
        yield Preset(task.name, _profiles(task), _on_policy(task))


def _profiles(task: _Task) -> Profiles:
    public = _as_published(task, rate=task.public_rate, transform="distance", tie="first")
    return {
        "laptop": laptop(DMControl(task=task.name, action_repeat=4), task.laptop_steps),
        "paper": _as_published(task, rate=task.rate, transform="log", tie="equal"),
        "public": public,
        "few-labels": task.few.of(public),
    }


def _as_published(task: _Task, *, rate: float, transform: str, tie: str) -> RunConfig:
    return RunConfig(
        environment=DMControl(task=task.name),
        agent=SAC(width=1024, depth=2, batch_size=1024, learning_rate=rate),
        exploration=StateEntropy.model_validate({"transform": transform}),
        feedback=Sessions(
            teacher=Oracle.model_validate({"tie": tie}),
            budget=1400,
            queries_per_session=task.queries,
            steps_between=20_000,
            segment_steps=50,
        ),
        evaluation=Evaluation(every=10_000, episodes=10),
        total_steps=task.total_steps,
    )


def laptop(environment: EnvironmentConfig, total_steps: int) -> RunConfig:
    """Chosen by measurement, the agent on walker-walk, its reward model on three tasks: benchmarks/README.md."""
    return RunConfig(
        environment=environment,
        agent=SAC(
            width=128, layer_norm=True, batch_size=256, learning_rate=1e-3, temperature_learning_rate=1e-3
        ),
        reward=LearnedReward(depth=1, batch_size=32),
        exploration=StateEntropy(seed_steps=1000, explore_steps=4000),
        feedback=Sessions(
            teacher=Oracle(), budget=400, queries_per_session=40, steps_between=4000, pool_episodes=20
        ),
        evaluation=Evaluation(every=5000, episodes=5),
        total_steps=total_steps,
        precision="auto",
    )


def _on_policy(task: _Task) -> Mapping[str, Settings]:
    paper: Settings = {
        **PAPER_PPO,
        **task.ppo,
        "feedback.budget": "2100",
        "feedback.queries_per_session": str(task.ppo_queries),
    }
    public = {**paper, "agent.clip_range": "0.4", "agent.clip_schedule": "linear"}
    asked = ("feedback.budget", "feedback.queries_per_session")
    few = {path: value for path, value in public.items() if path not in asked}
    few["feedback.steps_between"] = str(task.few.steps_between)
    return {"paper": paper, "public": public, "few-labels": few}
