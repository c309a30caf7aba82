"""In which precision large matrix products are taken."""

from __future__ import annotations

from typing import TYPE_CHECKING

import torch

if TYPE_CHECKING:
    from labels_db.run_config import RunConfig

WORTH_ROUNDING = 256 * 256
"""Rows × width from which bfloat16 products win; smaller ones cost more around than within."""


def product_precision(
    config: RunConfig, device: torch.device, *, rows: int, width: int, depth: int
) -> torch.dtype:
    """bfloat16 where the run allows it, the device is fast at it and the products are large; else float32.

    The large products are those between hidden layers: a network with one has none.
    """
    large = depth > 1 and rows * width >= WORTH_ROUNDING
    return (
        torch.bfloat16 if config.precision == "auto" and large and fast_in_bfloat16(device) else torch.float32
    )


def fast_in_bfloat16(device: torch.device) -> bool:
    """Whether there are instructions for it: without them PyTorch widens every number, which is slower."""
    if device.type == "cuda":
        return bool(torch.cuda.is_bf16_supported(including_emulation=False))
    return bool(torch.cpu._is_avx512_bf16_supported() or torch.cpu._is_amx_tile_supported())
