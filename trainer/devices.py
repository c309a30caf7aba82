"""Where a run computes: the choice of a device, and the way of small arrays onto it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

if TYPE_CHECKING:
    from labels_db.run_config import RunConfig


def choose_device(config: RunConfig) -> torch.device:
    """The configured device; `auto` is the GPU where there is one."""
    if config.device == "auto":
        return torch.device("cuda" if torch.cuda.is_available() else "cpu")
    if config.device == "cuda" and not torch.cuda.is_available():
        raise ValueError("device 'cuda': this machine has no GPU that PyTorch can use; set device to 'auto'")
    return torch.device(config.device)


def on_device(array: NDArray[np.float32], device: torch.device) -> Tensor:
    """The array as a tensor there, without waiting for what a GPU is doing; on a CPU they share their memory."""
    given = torch.from_numpy(array)
    return given if device.type == "cpu" else given.pin_memory().to(device, non_blocking=True)
