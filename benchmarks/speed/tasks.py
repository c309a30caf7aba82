"""Units of work to be timed: each function prepares and returns what is done once per unit."""

from __future__ import annotations

import io
from collections.abc import Callable
from typing import Any

import numpy as np
import torch

from labels_db.run_config import SAC, Clips, DMControl, Entropy, LearnedReward
from trainer.agents.sac import SACAgent
from trainer.agents.sac_autograd import AutogradUpdate
from trainer.candidate_scores import entropy
from trainer.episodes import EpisodePool, FinishedEpisode
from trainer.neighbours import neighbour_distance
from trainer.query_selection import Selection, select
from trainer.randomness import Randomness
from trainer.replay_buffer import ReplayBuffer
from trainer.reward_model import Preferences, RewardModel
from trainer.segments import PairSampler

Work = Callable[[], Any]
CPU = torch.device("cpu")
OBSERVATION, ACTION = 24, 6
PRECISIONS = {"float32": torch.float32, "bfloat16": torch.bfloat16}


def peak(precision: str, size: int = 2048) -> Work:
    """One product of square matrices: 2·size³ floating-point operations."""
    left, right = (torch.randn(size, size, dtype=PRECISIONS[precision]) for _ in range(2))
    out = torch.empty_like(left)
    return lambda: torch.mm(left, right, out=out)


def sac(width: int, batch: int, precision: str = "float32", plain: bool = False) -> Work:
    """One update of critics, actor and temperature; every second moves the targets."""
    agent = SACAgent(
        SAC(width=width, batch_size=batch),
        OBSERVATION,
        ACTION,
        20_000,
        Randomness(0),
        CPU,
        PRECISIONS[precision],
    )
    rng = np.random.default_rng(0)
    rows = [rng.normal(size=(5000, n)).astype(np.float32) for n in (OBSERVATION, ACTION, 1, OBSERVATION)]
    columns = (rows[0], np.tanh(rows[1]), rows[2][:, 0], rows[3], np.zeros(5000, bool))
    agent.buffer.add(*map(torch.from_numpy, columns))
    if plain:
        agent._update = AutogradUpdate(agent)
    return agent.update


# Neighbours --------------------------------------------------------------------------------------


def _states(count: int, size: int) -> torch.Tensor:
    """Correlated, off-centre states, as a robot's are."""
    generator = torch.Generator().manual_seed(0)
    mixing = 0.3 * torch.randn(size, size, generator=generator)
    return torch.randn(count, size, generator=generator) @ mixing + torch.randn(size, generator=generator)


def neighbours(size: int, count: int = 100_000, batch: int = 1024) -> Work:
    """The intrinsic reward's distances."""
    states = _states(count, size)
    rows = torch.randint(count, (batch,), generator=torch.Generator().manual_seed(1))
    return lambda: neighbour_distance(states[rows], rows, states, 5)


def sliced_neighbours(size: int, count: int = 100_000, batch: int = 1024) -> Work:
    """The same as it is usually done: every difference, in slices of the buffer, then one sort-like selection."""
    states = _states(count, size)
    rows = torch.randint(count, (batch,), generator=torch.Generator().manual_seed(1))

    def work() -> torch.Tensor:
        parts = [
            torch.norm(states[rows][:, None] - part[None], dim=-1, p=2) for part in torch.split(states, 500)
        ]
        return torch.kthvalue(torch.cat(parts, 1), k=6, dim=1).values

    return work


# The reward model --------------------------------------------------------------------------------


class PlainRewardModel(RewardModel):
    """The same under autograd, whole minibatches at a time."""

    def member_rewards(self, inputs: torch.Tensor) -> torch.Tensor:
        with torch.no_grad():
            return torch.tanh(
                torch.cat([self.members(rows)[..., 0] for rows in torch.split(inputs, 10_000)], 1)
            )

    def _learn(self, preferences: Preferences, rows: torch.Tensor) -> torch.Tensor:
        label, sums = preferences.label[rows], []
        with torch.enable_grad():
            for segments in (preferences.first[rows], preferences.second[rows]):
                rewards = torch.tanh(self.members(segments.flatten(1, 2))[..., 0])
                sums.append(rewards.view(*segments.shape[:3]).sum(-1))
            logit = sums[1] - sums[0]
            loss = torch.nn.functional.binary_cross_entropy_with_logits(logit, label, reduction="none")
            self.optimizer.clear()
            torch.autograd.backward(loss.mean(1).sum())
        self.optimizer.step()
        return ((logit.detach() > 0) == (label > 0.5))[label != 0.5]


def _model(precision: str, plain: bool, **changes: Any) -> RewardModel:
    kind = PlainRewardModel if plain else RewardModel
    config = LearnedReward(stop_accuracy=1.0, **changes)
    return kind(config, OBSERVATION, ACTION, Randomness(0), CPU, PRECISIONS[precision])


def fit(labels: int = 700, precision: str = "float32", plain: bool = False) -> Work:
    """One epoch over all labels of 2 × 50 steps, 3 members."""
    generator = torch.Generator().manual_seed(0)
    first, second = (torch.randn(labels, 50, OBSERVATION + ACTION, generator=generator) for _ in range(2))
    label = (second[..., 0].sum(-1) > first[..., 0].sum(-1)).float()
    model = _model(precision, plain, max_epochs=1)
    return lambda: model.fit(Preferences(first, second, label))


def relabel(rows: int, precision: str = "float32", plain: bool = False) -> Work:
    """Every reward of a buffer anew."""
    buffer, model = ReplayBuffer(rows, OBSERVATION, ACTION), _model(precision, plain)
    buffer.added = rows
    buffer.table.normal_()
    return lambda: buffer.relabel(model)


def choose(count: int = 140, precision: str = "float32", plain: bool = False) -> Work:
    """`count` pairs by entropy out of ten times as many, from 100 episodes of 1000 steps."""
    pool, rng = EpisodePool(100), np.random.default_rng(0)
    for number in range(100):
        columns = [rng.normal(size=(1000, n)).astype(np.float32) for n in (OBSERVATION, ACTION, 1)]
        pool.add(FinishedEpisode(number, 0, 0, columns[0], columns[1], columns[2][:, 0], columns[0]))
    sampler, model = PairSampler(pool, 50, rng), _model(precision, plain)
    if not plain:
        wanted = Selection(sampler, model, count, 10, lambda: torch.empty(0, 0))
        return lambda: select(Entropy(), wanted)

    def each_by_itself() -> torch.Tensor:
        pairs = sampler.draw(10 * count)
        sides = [torch.from_numpy(np.stack([pair[side].inputs for pair in pairs])) for side in (0, 1)]
        return entropy(model.probabilities(sides[0], sides[1])).topk(count).indices

    return each_by_itself


# Clips -------------------------------------------------------------------------------------------


def clip(scene: str) -> Work:
    """25 frames of 320 × 240, drawn and encoded as the rendering process does."""
    from trainer.environments import make_environment
    from trainer.rendering.painter import Painter
    from trainer.rendering.sheet import encode_clip

    environment = make_environment(DMControl(task=scene))
    environment.reset(seed=0)
    states = [environment.physics_state() for _ in range(25) if environment.step(_action(environment))]
    painter = Painter(make_environment(DMControl(task=scene)).scene, Clips().width, Clips().height)
    times = tuple(index / 25 for index in range(25))
    return lambda: encode_clip([painter.draw(0, state) for state in states], times, 1.0)


def clip_by_defaults(scene: str) -> Work:
    """25 frames as dm_control draws them, tiled, as the WebP that Pillow writes when told nothing."""
    from dm_control import suite
    from PIL import Image

    domain, name = scene.split("-", 1)
    environment = suite.load(domain, name)
    environment.reset()
    spec = environment.action_spec()

    def work() -> int:
        frames = []
        for _ in range(25):
            environment.step(np.random.uniform(spec.minimum, spec.maximum))
            frames.append(environment.physics.render(height=240, width=320, camera_id=0))
        rows = [np.concatenate(frames[start : start + 5], 1) for start in range(0, 25, 5)]
        file = io.BytesIO()
        Image.fromarray(np.concatenate(rows)).save(file, "WEBP")
        return file.tell()

    return work


def _action(environment: Any) -> Any:
    return np.random.default_rng(0).uniform(-1, 1, environment.action_space.shape).astype(np.float32)


# The whole loop ----------------------------------------------------------------------------------


def loop(
    preset: str, exploring: bool, precision: str = "auto", plain: bool = False, profile: str | None = None
) -> Work:
    """One step of training: environment, memory, update; while exploring also the intrinsic reward."""
    from benchmarks.speed.loop import Stepper

    return Stepper(preset, exploring=exploring, precision=precision, plain=plain, profile=profile)


TASKS: dict[str, Callable[..., Work]] = {
    task.__name__: task
    for task in (peak, sac, neighbours, sliced_neighbours, fit, relabel, choose, clip, clip_by_defaults, loop)
}
