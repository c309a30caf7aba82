"""What units of work have in common."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import torch

from trainer.arithmetic import ONEDNN

Work = Callable[[], Any]
CPU = torch.device("cpu")
OBSERVATION, ACTION = 24, 6
PRECISIONS = {"float32": torch.float32, "bfloat16": torch.bfloat16}


def as_pytorch_comes() -> None:
    """Products as whoever writes plain code has them: nothing is set up for this processor."""
    ONEDNN.matmul.fp32_precision = "none"
