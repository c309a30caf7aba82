"""Other libraries' soft actor-critic, as their users run it: `python peers.py NAME THREADS WIDTH BATCH`.

This runs in the peers' own environment and imports nothing of the project. It prints `ready`, then answers each
line N with the seconds that N updates took.
"""

from __future__ import annotations

import os
import sys
import time
from typing import Any

OBSERVATION, ACTION = 24, 6


def main() -> None:
    name, threads, width, batch = sys.argv[1], *map(int, sys.argv[2:5])
    os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[:threads])  # XLA takes every core it sees
    model = make(name, threads, width, batch)
    warmed = 0
    print("ready", flush=True)
    for line in sys.stdin:
        count = int(line)
        if name == "sbx" and count != warmed:  # its loop is compiled for each number of updates
            model.train(count, batch)
            warmed = count
        began = time.perf_counter()
        model.train(count, batch)
        print(time.perf_counter() - began, flush=True)


def make(name: str, threads: int, width: int, batch: int) -> Any:
    """A learner whose replay buffer holds noise."""
    import numpy as np

    if name == "sb3":
        import torch
        from stable_baselines3 import SAC

        torch.set_num_threads(threads)
    else:
        from sbx import SAC
    settings = {"policy_kwargs": {"net_arch": [width, width]}, "batch_size": batch, "buffer_size": 20_000}
    model = SAC("MlpPolicy", noise(), learning_starts=10, seed=0, device="cpu", **settings)
    model.learn(20)
    rng = np.random.default_rng(0)
    for _ in range(2000):
        state, following = rng.normal(size=(2, 1, OBSERVATION))
        action = np.tanh(rng.normal(size=(1, ACTION)))
        model.replay_buffer.add(state, following, action, rng.normal(size=1), np.zeros(1), [{}])
    return model


def noise() -> Any:
    """An environment of the right shape in which nothing matters."""
    import gymnasium
    import numpy as np

    class Noise(gymnasium.Env):
        observation_space = gymnasium.spaces.Box(-np.inf, np.inf, (OBSERVATION,), np.float32)
        action_space = gymnasium.spaces.Box(-1, 1, (ACTION,), np.float32)

        def reset(self, seed: Any = None, options: Any = None) -> Any:
            return np.zeros(OBSERVATION, np.float32), {}

        def step(self, action: Any) -> Any:
            return np.random.randn(OBSERVATION).astype(np.float32), 0.0, False, False, {}

    return Noise()


if __name__ == "__main__":
    main()
