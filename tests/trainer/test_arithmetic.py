"""How a process computes: threads, and products that stay float32's whoever takes them."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from trainer import arithmetic
from trainer.arithmetic import ONEDNN, multiply_by_onednn, set_up_arithmetic

sides = st.integers(1, 300)


@pytest.fixture(autouse=True)
def as_before() -> Iterator[None]:
    threads, products = torch.get_num_threads(), ONEDNN.matmul.fp32_precision
    ONEDNN.matmul.fp32_precision = "none"
    yield
    torch.set_num_threads(threads)
    ONEDNN.matmul.fp32_precision = products


def given_processor(monkeypatch: pytest.MonkeyPatch, **capabilities: object) -> None:
    monkeypatch.setattr(torch.cpu, "get_capabilities", lambda: capabilities)


@pytest.mark.parametrize(
    ("capabilities", "spares"),
    [
        ({"cpu_name": "AMD EPYC 9655", "avx512_f": True}, True),
        ({"cpu_name": "AMD EPYC 7763", "avx512_f": False}, False),
        ({"cpu_name": "Intel Xeon Platinum 8481C", "avx512_f": True}, False),
        ({"architecture": "aarch64"}, False),
    ],
)
def test_onednn_multiplies_where_mkl_spares_wide_instructions(
    monkeypatch: pytest.MonkeyPatch, capabilities: dict[str, object], spares: bool
) -> None:
    asked: list[bool] = []
    monkeypatch.setattr(arithmetic, "multiply_by_onednn", lambda: asked.append(True))
    given_processor(monkeypatch, **capabilities)
    set_up_arithmetic(1)
    assert torch.get_num_threads() == 1
    assert bool(asked) is spares


def test_an_older_pytorch_is_left_as_it_is(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(arithmetic, "ONEDNN", None)  # nothing of it may be asked
    monkeypatch.delattr(torch.cpu, "get_capabilities", raising=False)
    set_up_arithmetic(1)


def test_products_that_round_are_not_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(torch, "mm", lambda left, right: (left.bfloat16() @ right.bfloat16()).float())
    multiply_by_onednn()
    assert ONEDNN.matmul.fp32_precision == "none"


@settings(max_examples=40, deadline=None)
@given(st.integers(1, 3), sides, sides, sides, st.booleans(), st.booleans())
def test_products_are_float32_s(
    members: int, rows: int, inner: int, columns: int, left_turned: bool, right_turned: bool
) -> None:
    set_up_arithmetic(1)
    multiply_by_onednn()  # wherever this runs: it is kept only where it does not round
    generator = torch.Generator().manual_seed(rows + inner + columns)
    left = torch.randn(members, rows, inner, generator=generator)
    right = torch.randn(members, inner, columns, generator=generator)
    left = left.mT.contiguous().mT if left_turned else left
    right = right.mT.contiguous().mT if right_turned else right
    added = torch.randn(members, 1, columns, generator=generator)
    exact = left.double() @ right.double() + added
    allowed = 1e-6 * (left.double().abs() @ right.double().abs() + added.abs())
    for found in (
        torch.bmm(left, right) + added,
        torch.baddbmm(added, left, right),
        torch.stack([torch.mm(*pair) for pair in zip(left, right, strict=True)]) + added,
        torch.stack([torch.addmm(*three) for three in zip(added[:, 0], left, right, strict=True)]),
    ):
        assert bool(((found - exact).abs() <= allowed).all())
