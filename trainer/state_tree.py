"""States of parts as one JSON text and one set of arrays: what a checkpoint holds, without pickle.

A state is a tree of dictionaries and lists whose leaves are tensors, arrays or plain JSON values.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import torch

Arrays = dict[str, np.ndarray[Any, Any]]

TENSOR, ARRAY, ITEMS = "$tensor", "$array", "$items"


def pack(tree: Any) -> tuple[Any, Arrays]:
    """The tree with arrays replaced by their names, and the arrays by name."""
    arrays: Arrays = {}
    return _pack(tree, "", arrays), arrays


def unpack(values: Any, arrays: Arrays) -> Any:
    """The tree that `pack` took apart."""
    if isinstance(values, list):
        return [unpack(value, arrays) for value in values]
    if not isinstance(values, dict):
        return values
    if TENSOR in values:
        return torch.from_numpy(arrays[values[TENSOR]].copy())
    if ARRAY in values:
        return arrays[values[ARRAY]]
    if ITEMS in values:
        return {key: unpack(value, arrays) for key, value in values[ITEMS]}
    return {key: unpack(value, arrays) for key, value in values.items()}


def _pack(tree: Any, path: str, arrays: Arrays) -> Any:
    if isinstance(tree, torch.Tensor):
        arrays[path] = tree.detach().cpu().contiguous().numpy()
        return {TENSOR: path}
    if isinstance(tree, np.ndarray):
        arrays[path] = np.ascontiguousarray(tree)
        return {ARRAY: path}
    if isinstance(tree, dict):
        packed = {key: _pack(value, f"{path}/{key}", arrays) for key, value in tree.items()}
        # JSON would turn the number keys of an optimiser's state into words.
        return packed if all(isinstance(key, str) for key in packed) else {ITEMS: list(packed.items())}
    if isinstance(tree, list | tuple):
        return [_pack(value, f"{path}/{index}", arrays) for index, value in enumerate(tree)]
    return tree
