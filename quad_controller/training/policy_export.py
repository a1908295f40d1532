# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Writes a network as an ONNX file, its normalisation inside and mjlab's metadata with it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import onnx
from onnx import helper, numpy_helper, TensorProto
from policy_mlp import Floats, Mlp

OPSET = 17
IR_VERSION = 8  # what ONNX Runtime 1.14 reads, and everything newer


def export(network: Mlp, path: Path, metadata: Mapping[str, str]) -> None:
    """Write a network.

    Args:
        network: What to write.
        path: Where to.
        metadata: Keys and texts for the file.
    """
    tensors: dict[str, Floats] = {'mean': network.mean, 'deviation': network.deviation}
    nodes = [
        helper.make_node('Sub', ['obs', 'mean'], ['centred']),
        helper.make_node('Div', ['centred', 'deviation'], ['value0']),
    ]
    last = len(network.weights) - 1
    for layer, (weight, bias) in enumerate(zip(network.weights, network.biases, strict=True)):
        tensors[f'weight{layer}'], tensors[f'bias{layer}'] = weight, bias
        out = 'actions' if layer == last else f'sum{layer}'
        inputs = [f'value{layer}', f'weight{layer}', f'bias{layer}']
        nodes.append(helper.make_node('Gemm', inputs, [out]))
        if layer != last:
            nodes.append(helper.make_node('Elu', [out], [f'value{layer + 1}']))
    graph = helper.make_graph(
        nodes,
        'policy',
        [helper.make_tensor_value_info('obs', TensorProto.FLOAT, [1, len(network.mean)])],
        [
            helper.make_tensor_value_info(
                'actions', TensorProto.FLOAT, [1, len(network.biases[-1])]
            )
        ],
        [numpy_helper.from_array(np.asarray(value), name) for name, value in tensors.items()],
    )
    model = helper.make_model(
        graph,
        producer_name='quad_controller',
        opset_imports=[helper.make_opsetid('', OPSET)],
        ir_version=IR_VERSION,
    )
    helper.set_model_props(model, dict(metadata))
    onnx.checker.check_model(model)
    onnx.save(model, str(path))


def joined(values: object) -> str:
    """Return a list as the exporters write it: by commas, numbers with three decimals."""
    if isinstance(values, str):
        return values
    if isinstance(values, (int, float)):
        return f'{values:.3f}'
    return ','.join(joined(value) for value in values)  # type: ignore[attr-defined]
