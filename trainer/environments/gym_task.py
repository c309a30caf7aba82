"""An environment registered with Gymnasium, in flat terms."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import gymnasium
import numpy as np
import numpy.typing as npt
from gymnasium import spaces

from trainer.environments.interface import Observation

Array = npt.NDArray[np.float64]


class GymTask:
    """Observations are flat float32 [D], controls lie in [-1, 1]^A, and the time limit is told, not kept.

    ValueError where an environment cannot be learned in, with the reason.
    """

    def __init__(self, id: str, **looks: str) -> None:
        self.id, self._env = id, make(id, **looks)
        self.unwrapped: Any = self._env.unwrapped
        self.episode_steps = time_limit(id)
        self.control_step = step_seconds(id, self.unwrapped)
        check_observations(id, self._env.observation_space)
        self._centre, self._reach = control_range(id, self._env.action_space)

    @property
    def action_size(self) -> int:
        return self._centre.size

    def begin(self, seed: int) -> Observation:
        """The first observation [D] of that seed's episode."""
        observation, _ = self._env.reset(seed=seed)
        return self._flat(observation)

    def step(self, control: Array) -> tuple[Observation, float, bool, bool]:
        """(observation [D], reward, terminated, truncated) after a control [A]."""
        space = self._env.action_space
        action = (self._centre + self._reach * control).reshape(space.shape).astype(space.dtype)
        observation, reward, terminated, truncated, _ = self._env.step(action)
        return self._flat(observation), float(reward), bool(terminated), bool(truncated)

    def picture(self) -> npt.NDArray[np.uint8]:
        """What it looks like now [height, width, 3]; it was made with `render_mode="rgb_array"`."""
        return np.array(self._env.render(), np.uint8)

    def close(self) -> None:
        """Give back whatever it holds; nothing may be asked of it afterwards."""
        self._env.close()

    def _flat(self, observation: Any) -> Observation:
        return np.asarray(spaces.flatten(self._env.observation_space, observation), np.float32)


def make(id: str, **looks: str) -> gymnasium.Env[Any, Any]:
    """Gymnasium's environment without its time limit; ValueError says why there is none."""
    if ":" in id:
        raise ValueError(f"gym:{id}: a module cannot be named, only an environment that is registered")
    try:
        return gymnasium.make(id, max_episode_steps=-1, disable_env_checker=True, **looks)
    except gymnasium.error.Error as error:
        raise ValueError(f"gym:{id}: {error}") from error


def time_limit(id: str) -> int:
    """Control steps of an episode."""
    spec = gymnasium.spec(id)
    if spec.nondeterministic:
        raise ValueError(
            f"gym:{id}: is registered as nondeterministic, so that no run in it could be resumed"
        )
    if spec.max_episode_steps is None:
        raise ValueError(f"gym:{id}: has no time limit; register it with max_episode_steps")
    return spec.max_episode_steps


def step_seconds(id: str, unwrapped: Any) -> float:
    """Seconds of one control step: its own `dt`, or else one frame."""
    frames = unwrapped.metadata.get("render_fps")
    seconds = getattr(unwrapped, "dt", None) or (frames and 1 / frames)
    if not seconds:
        raise ValueError(
            f"gym:{id}: tells neither `dt` nor metadata['render_fps'], so clips could not be timed"
        )
    return float(seconds)


def check_observations(id: str, space: spaces.Space[Any]) -> None:
    """Numbers only: vectors, or dictionaries and tuples of them."""
    if any(len(leaf.shape or ()) > 2 or leaf.dtype == np.uint8 for leaf in leaves(space)):
        raise ValueError(f"gym:{id}: observes images ({space}); only vectors can be learned from")
    if not space.is_np_flattenable:
        raise ValueError(f"gym:{id}: its observations ({space}) cannot be put into one vector")


def leaves(space: spaces.Space[Any]) -> Iterator[spaces.Space[Any]]:
    """The spaces that a space is made of."""
    if isinstance(space, spaces.Dict | spaces.Tuple):
        parts = space.values() if isinstance(space, spaces.Dict) else space
        for part in parts:
            yield from leaves(part)
    else:
        yield space


def control_range(id: str, space: spaces.Space[Any]) -> tuple[Array, Array]:
    """Centre and reach [A] of the actions; those without limits take [-1, 1] as it is."""
    if not isinstance(space, spaces.Box) or not np.issubdtype(space.dtype, np.floating):
        raise ValueError(
            f"gym:{id}: takes actions from {space}; only continuous ones can be learned, a Box of floats"
        )
    low, high = (bound.astype(np.float64).ravel() for bound in (space.low, space.high))
    limited = np.isfinite(low) & np.isfinite(high)
    low, high = np.where(limited, low, -1.0), np.where(limited, high, 1.0)
    return (high + low) / 2, (high - low) / 2
