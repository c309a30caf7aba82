"""In which precision large matrix products are taken."""

from __future__ import annotations

import torch

from labels_db.run_config import RunConfig

WORTH_ROUNDING = 256 * 256
"""Rows × width from which bfloat16 products win; smaller ones cost more around than within."""


def product_precision(config: RunConfig, device: torch.device, *, rows: int, width: int) -> torch.dtype:
    """bfloat16 where the run allows it, the processor is fast at it and the products are large; else float32."""
    allowed = config.precision == "auto" and device.type == "cpu"
    if allowed and rows * width >= WORTH_ROUNDING and processor_is_fast_in_bfloat16():
        return torch.bfloat16
    return torch.float32


def processor_is_fast_in_bfloat16() -> bool:
    """Whether there are instructions for it: without them PyTorch widens every number, which is slower."""
    return bool(torch.cpu._is_avx512_bf16_supported() or torch.cpu._is_amx_tile_supported())
