"""How a process computes on a CPU: with how many threads, and by whose products of float32 matrices."""

from __future__ import annotations

from typing import Any

import torch

ONEDNN: Any = torch.backends.mkldnn
"""Its annotations do not know all of its settings."""


def set_up_arithmetic(threads: int) -> None:
    """So many threads, and of large float32 matrices the quickest products that round no more than float32 does."""
    torch.set_num_threads(threads)
    if mkl_spares_wide_instructions():
        multiply_by_onednn()


def mkl_spares_wide_instructions() -> bool:
    """MKL keeps to 256 bits on AMD's processors, oneDNN takes the 512 that the later ones have."""
    capabilities = getattr(torch.cpu, "get_capabilities", None)
    if capabilities is None:
        return False  # an older PyTorch cannot say, and cannot be asked for oneDNN's products
    has = capabilities()
    return "AMD" in has.get("cpu_name", "") and bool(has.get("avx512_f"))


def multiply_by_onednn() -> None:
    """Have oneDNN multiply float32 matrices, if it does so exactly.

    PyTorch hands it those only where it may round them to bfloat16. That it does on matrix tiles alone; elsewhere its
    kernels are float32's. This is oneDNN's own setting: `torch.set_float32_matmul_precision` would reach a GPU too.
    """
    products = ONEDNN.matmul
    before, products.fp32_precision = products.fp32_precision, "bf16"
    if products_round():
        products.fp32_precision = before


def products_round() -> bool:
    """Whether a product of float32 matrices loses what float32 can hold and less cannot."""
    fine = torch.full((256, 256), 1 + 2**-20)
    return not torch.equal(torch.mm(fine, torch.eye(256)), fine)
