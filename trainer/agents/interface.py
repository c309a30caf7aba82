"""What the training loop asks of an agent, whatever it learns by."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import NDArray
from torch import Tensor

from trainer.replay_buffer import Batch, ReplayBuffer, RewardFunction

if TYPE_CHECKING:
    from trainer.collector import Transitions

BatchReward = Callable[[Batch], Tensor]
"""A reward computed when it is learned from, instead of the stored one: rows [B] → reward [B]."""


class Losses(Protocol):
    """What an update says of itself."""

    def read(self) -> dict[str, float]:
        """The losses by name; on a GPU this waits."""


class Agent(Protocol):
    """Learns from whatever reward it is handed; it cannot tell a learned one from a true one."""

    @property
    def buffer(self) -> ReplayBuffer:
        """Transitions whose rewards can be written anew."""

    def act(self, observations: NDArray[np.float32], *, explore: bool) -> NDArray[np.float32]:
        """Actions [N, A] in [−1, 1] for observations [N, D]: with chance while exploring, the best otherwise."""

    def observe(self, transitions: Transitions, rewards: Tensor) -> None:
        """Remember one step of N environments with its rewards [N]."""

    def learn(self, reward: BatchReward | None, steps: int) -> Losses | None:
        """The updates due after so many steps, on the stored reward unless another is given; None: none was."""

    def begin_anew(self, updates: int, reward: BatchReward | None) -> None:
        """Forget how much was expected of `reward`, which is no more; then so many updates on the new one."""

    def relabel(self, reward: RewardFunction, between_parts: Callable[[], None]) -> None:
        """Write the reward of every stored transition anew."""

    def state(self) -> dict[str, Any]:
        """Everything but the buffer's rows, which checkpoints keep in chunks."""

    def load(self, state: dict[str, Any]) -> None:
        """Go on from a state; the buffer is filled again before."""
