"""A policy for others: ONNX, or safetensors with a JSON layout; flat observation in, action out.

Neither needs this program: any ONNX runtime, or forty lines around a safetensors reader, can roll it out.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
import torch
from safetensors.numpy import save_file
from torch import nn

from trainer.policy import TrainedPolicy

TOLERANCE = 1e-5


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


def plain_network(policy: TrainedPolicy) -> nn.Sequential:
    """The deterministic policy as ordinary layers, ending in tanh."""
    modules: list[nn.Module] = []
    for weight, bias in policy.layers():
        linear = nn.Linear(*weight.shape)
        with torch.no_grad():
            linear.weight.copy_(torch.from_numpy(weight.T.copy()))
            linear.bias.copy_(torch.from_numpy(bias.copy()))
        modules += [linear, nn.ReLU()]
    return nn.Sequential(*modules[:-1], nn.Tanh()).eval()


def _onnx(policy: TrainedPolicy, path: Path) -> None:
    import onnx

    example = torch.zeros(1, policy.config.catalogue_entry.observation_size)
    program = torch.onnx.export(
        plain_network(policy),
        (example,),
        dynamo=True,
        input_names=["observation"],
        output_names=["action"],
        dynamic_shapes=({0: torch.export.Dim("batch")},),
        verbose=False,
    )
    assert program is not None
    model = program.model_proto
    onnx.helper.set_model_props(model, {k: json.dumps(v) for k, v in describe(policy).items()})
    _check_onnx(policy, model.SerializeToString())
    path.write_bytes(model.SerializeToString())


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
    """Arrays `weight.i` [in, out] and `bias.i` [out]; the layout beside them in `FILE.json`."""
    layers = policy.layers()
    arrays = {}
    for index, (weight, bias) in enumerate(layers):
        arrays[f"weight.{index}"] = np.ascontiguousarray(weight)
        arrays[f"bias.{index}"] = np.ascontiguousarray(bias)
    save_file(arrays, path)
    activations = ["relu"] * (len(layers) - 1) + ["tanh"]
    layout = {
        **describe(policy),
        "layers": [
            {"weight": f"weight.{i}", "bias": f"bias.{i}", "activation": activation}
            for i, activation in enumerate(activations)
        ],
    }
    path.with_suffix(".json").write_text(json.dumps(layout, indent=2) + "\n", encoding="utf-8")


FORMATS: Mapping[str, Callable[[TrainedPolicy, Path], None]] = MappingProxyType(
    {".onnx": _onnx, ".safetensors": _safetensors}
)
