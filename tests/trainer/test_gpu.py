"""What is done on a GPU equals what is done plainly; and the learner's core runs where there is only PyTorch.

Tests marked for CUDA run where a GPU is and are skipped elsewhere.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import torch

from benchmarks.speed.gpu import Settings
from benchmarks.speed.gpu import agent as made
from labels_db.run_config import SAC, StateEntropy
from tests.trainer.given import lived
from trainer.agents.on_gpu import CapturedUpdate
from trainer.agents.sac import SACAgent
from trainer.agents.sac_autograd import AutogradUpdate
from trainer.exploration import StateEntropyReward
from trainer.neighbours import neighbour_distance, plain_neighbour_distance
from trainer.randomness import Randomness
from trainer.reward_source import EnvironmentReward

ROOT = Path(__file__).parents[2]
on_a_gpu = pytest.mark.skipif(not torch.cuda.is_available(), reason="needs a GPU")

BARE = """
import sys

class Nothing:
    def find_spec(self, name, path=None, target=None):
        root = name.partition(".")[0]
        if root not in sys.stdlib_module_names | {"torch", "numpy", "trainer", "benchmarks"} | loaded:
            raise ModuleNotFoundError(name)

import torch, torch._dynamo, numpy
loaded = {name.partition(".")[0] for name in sys.modules} - {"pydantic", "labels_db", "gymnasium"}
sys.meta_path.insert(0, Nothing())
for name in [name for name in sys.modules if name.partition(".")[0] in ("pydantic", "gymnasium")]:
    del sys.modules[name]
import benchmarks.speed.gpu as gpu
print(gpu.largest_difference(torch.device("cpu"), updates=3))
gpu.whole_loop(torch.device("cpu"), 0.1)
assert not {"pydantic", "gymnasium", "labels_db", "dm_control"} & set(sys.modules)
"""


def test_the_benchmark_needs_nothing_but_pytorch_and_numpy() -> None:
    done = subprocess.run([sys.executable, "-c", BARE], cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    difference, *said = done.stdout.split("\n", 1)
    assert float(difference) < 1e-4
    assert "is missing here: no measurement of the whole loop" in said[0]


def test_the_benchmark_measures_the_agent_that_runs_have() -> None:
    shared = set(vars(Settings(8, 8)))
    defaults = SAC(width=8, batch_size=8).model_dump(include=shared)
    assert vars(Settings(8, 8)) == defaults


def test_a_run_that_moves_to_another_kind_of_device_draws_anew_from_its_seed() -> None:
    streams = Randomness(1)
    streams.torch("agent sampling")
    state = streams.state()
    state["torch"]["agent sampling"] = torch.zeros(16, dtype=torch.uint8)  # as a GPU's generator says it
    moved = [Randomness(1) for _ in range(2)]
    for one in moved:
        one.torch("agent sampling")
        one.load(state)
    first, second = (torch.rand(3, generator=one.torch("agent sampling")) for one in moved)
    assert torch.equal(first, second)
    assert not torch.equal(first, torch.rand(3, generator=streams.torch("agent sampling")))


def gpu_agents() -> tuple[SACAgent, SACAgent]:
    """One that captures its updates and one that makes them plainly, otherwise alike."""
    device = torch.device("cuda")
    captured, plain = (made(64, 64, device, torch.float32) for _ in range(2))
    plain._update = AutogradUpdate(plain)
    return captured, plain


@on_a_gpu
def test_captured_updates_equal_plain_ones() -> None:
    captured, plain = gpu_agents()
    for _ in range(10 * CapturedUpdate.PLAINLY):
        found, expected = captured.update().read(), plain.update().read()
        assert found == pytest.approx(expected, rel=1e-3)
    torch.testing.assert_close(captured.critic.twins.flat, plain.critic.twins.flat, rtol=1e-4, atol=1e-5)
    torch.testing.assert_close(captured.actor.trunk.flat, plain.actor.trunk.flat, rtol=1e-4, atol=1e-5)


@on_a_gpu
@pytest.mark.parametrize("normalised", [False, True])
def test_captured_updates_in_bfloat16_stay_close(normalised: bool) -> None:
    """Weights rounded anew after every step are where a graph could go on with stale ones."""
    precisions = (torch.float32, torch.bfloat16)
    exact, rounded = (made(256, 256, torch.device("cuda"), p, normalised=normalised) for p in precisions)
    for _ in range(30):
        expected, found = exact.update().read(), rounded.update().read()
    assert found["critic_loss"] == pytest.approx(expected["critic_loss"], rel=0.1)


@on_a_gpu
def test_a_captured_update_goes_on_from_a_loaded_state() -> None:
    captured, other = gpu_agents()
    for _ in range(10):
        captured.update()
    for _ in range(30):
        other.update()
    captured.load(other.state())
    captured._sampling.set_state(other._sampling.get_state())
    captured.update()
    other.update()
    torch.testing.assert_close(captured.critic.twins.flat, other.critic.twins.flat, rtol=1e-4, atol=1e-5)


@on_a_gpu
def test_an_agent_on_a_gpu_acts_by_the_policy_before_the_update_under_way() -> None:
    agent = made(64, 64, torch.device("cuda"), torch.float32)
    seen = np.ones((2, 24), np.float32)
    agent.learn(None, 1)
    acting = agent._acting.get_state()
    before = agent.act(seen, explore=True)
    agent._acting.set_state(acting)
    np.testing.assert_array_equal(agent.act(seen, explore=True), before)
    agent.learn(None, 50)
    agent.learn(None, 1)
    agent._acting.set_state(acting)
    assert not np.array_equal(agent.act(seen, explore=True), before)


@on_a_gpu
def test_a_step_on_a_gpu_waits_for_nothing_but_its_actions() -> None:
    agent = made(64, 64, torch.device("cuda"), torch.float32)
    seen, done = np.ones((1, 24), np.float32), np.ones((1, 6), np.float32)
    for _ in range(2 * CapturedUpdate.PLAINLY):
        agent.learn(None, 1)
    intrinsic = StateEntropyReward(StateEntropy(states_compared=100), agent.buffer, Randomness(0))
    torch.cuda.set_sync_debug_mode("error")
    try:
        agent.learn(None, 1)
        transitions = lived(seen, done, seen, np.ones(1, bool))
        agent.observe(transitions, EnvironmentReward(torch.device("cuda")).of(transitions))
        intrinsic(agent.buffer.batch(torch.arange(64, device="cuda")))
    finally:
        torch.cuda.set_sync_debug_mode("default")


@on_a_gpu
def test_neighbours_on_a_gpu_are_those_on_a_cpu() -> None:
    states = torch.randn(5000, 24, generator=torch.Generator().manual_seed(0))
    rows = torch.arange(0, 5000, 50)
    expected = plain_neighbour_distance(states[rows], rows, states, 5)
    found = neighbour_distance(states[rows].cuda(), rows.cuda(), states.cuda(), 5)
    torch.testing.assert_close(found.cpu(), expected)
