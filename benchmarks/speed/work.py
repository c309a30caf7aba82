"""What units of work have in common."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import torch

Work = Callable[[], Any]
CPU = torch.device("cpu")
OBSERVATION, ACTION = 24, 6
PRECISIONS = {"float32": torch.float32, "bfloat16": torch.bfloat16}
