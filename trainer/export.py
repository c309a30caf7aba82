"""A policy for others: ONNX, or safetensors with a JSON layout; flat observation in, action out.

Neither needs this program: any ONNX runtime, or forty lines around a safetensors reader, can roll it out.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
from safetensors.numpy import save_file

from trainer.policy import TrainedPolicy

TOLERANCE = 1e-5

ONNX_ACTIVATIONS: Mapping[str, Sequence[str]] = MappingProxyType(
    {"relu": ["Relu"], "tanh": ["Tanh"], "clip_1": ["Clip", "-1", "+1"], "clip_10": ["Clip", "-10", "+10"]}
)
"""Each activation's operator and its bounds, which are constants of the graph."""


class ExportError(Exception):
    """The policy cannot be exported so."""


def export_policy(policy: TrainedPolicy, path: Path) -> None:
    """Write the policy in the format of the path's ending."""
    write = FORMATS.get(path.suffix)
    if write is None:
        raise ExportError(f"{path.name}: unknown format {path.suffix!r}; one of {', '.join(FORMATS)}")
    if not path.parent.is_dir():
        raise ExportError(f"{path.parent}: no such folder; make it first")
    write(policy, path)


def describe(policy: TrainedPolicy) -> dict[str, Any]:
    """What whoever rolls the policy out must know."""
    known, config = policy.config.catalogue_entry, policy.config
    return {
        "environment": config.environment.name,
        "step": policy.step,
        "observation_size": known.observation_size,
        "action_size": known.action_size,
        "action_range": [-1.0, 1.0],
        "seconds_per_action": config.step_seconds,
    }


def _onnx(policy: TrainedPolicy, path: Path) -> None:
    """A plain chain of Gemm and activation nodes: no exporter is needed for a perceptron."""
    data = onnx_model(policy).SerializeToString()
    _check_onnx(policy, data)
    path.write_bytes(data)


def onnx_model(policy: TrainedPolicy) -> Any:
    """The deterministic policy as an `onnx.ModelProto`, with `describe` as its metadata."""
    from onnx import TensorProto, checker, helper, numpy_helper

    layers, facts = policy.layers, describe(policy)
    bounds = {f"{sign}{n}": np.array(float(f"{sign}{n}"), np.float32) for sign in "+-" for n in (1, 10)}
    nodes, name = [], "observation"
    weights = [numpy_helper.from_array(bound, name) for name, bound in bounds.items()]
    for i, layer in enumerate(layers):
        out = "action" if i == len(layers) - 1 else f"hidden.{i}"
        weights += [numpy_helper.from_array(np.ascontiguousarray(layer.weight), f"weight.{i}")]
        weights += [numpy_helper.from_array(np.ascontiguousarray(layer.bias), f"bias.{i}")]
        nodes += [helper.make_node("Gemm", [name, f"weight.{i}", f"bias.{i}"], [f"sum.{i}"])]
        operator, *bounds_of_it = ONNX_ACTIVATIONS[layer.activation]
        nodes += [helper.make_node(operator, [f"sum.{i}", *bounds_of_it], [out])]
        name = out
    ends = [
        helper.make_tensor_value_info(end, TensorProto.FLOAT, ["batch", facts[f"{end}_size"]])
        for end in ("observation", "action")
    ]
    graph = helper.make_graph(nodes, "policy", ends[:1], ends[1:], weights)
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=10)
    helper.set_model_props(model, {key: json.dumps(value) for key, value in facts.items()})
    checker.check_model(model)
    return model


def _check_onnx(policy: TrainedPolicy, model: bytes) -> None:
    """Run it in onnxruntime beside the policy itself."""
    import onnxruntime

    session = onnxruntime.InferenceSession(model, providers=["CPUExecutionProvider"])
    size = policy.config.catalogue_entry.observation_size
    observations = np.random.default_rng(0).normal(size=(16, size)).astype(np.float32)
    (actions,) = session.run(["action"], {"observation": observations})
    difference = float(np.abs(actions - policy(observations)).max())
    if difference > TOLERANCE:
        raise ExportError(f"the exported policy differs from the trained one by {difference:.1e}")


def _safetensors(policy: TrainedPolicy, path: Path) -> None:
    """Arrays `weight.i` [in, out] and `bias.i` [out]; the layout in the metadata and beside, in `FILE.json`."""
    arrays = {}
    for index, layer in enumerate(policy.layers):
        arrays[f"weight.{index}"] = np.ascontiguousarray(layer.weight)
        arrays[f"bias.{index}"] = np.ascontiguousarray(layer.bias)
    layout = json.dumps(_layout(policy), indent=2)
    save_file(arrays, path, metadata={"layout": layout})  # a file that travels alone still explains itself
    path.with_suffix(".json").write_text(layout + "\n", encoding="utf-8")


def _layout(policy: TrainedPolicy) -> dict[str, Any]:
    return {
        **describe(policy),
        "layers": [
            {"weight": f"weight.{i}", "bias": f"bias.{i}", "activation": layer.activation}
            for i, layer in enumerate(policy.layers)
        ],
    }


FORMATS: Mapping[str, Callable[[TrainedPolicy, Path], None]] = MappingProxyType(
    {".onnx": _onnx, ".safetensors": _safetensors}
)
