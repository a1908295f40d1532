# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Exports layers as an ONNX file that includes observation normalisation and metadata."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
import onnx
from onnx import helper, numpy_helper, TensorProto

Floats = npt.NDArray[np.float32]

OPSET = 17
IR_VERSION = 8  # what ONNX Runtime 1.14 reads, and everything newer


@dataclass(frozen=True, slots=True, eq=False)
class Layers:
    """Fully connected layers with ELU activations and normalised inputs."""

    mean: Floats  # subtracted from the inputs
    deviation: Floats  # the inputs are divided by it
    weights: Sequence[Floats]  # one matrix for each layer, inputs by outputs
    biases: Sequence[Floats]  # one row for each layer
    # Matrices that mirror normalised inputs, and outputs. The answer is then the mean of theirs
    # and of the mirror image of their answer in the mirror. None for theirs alone.
    mirror: tuple[Floats, Floats] | None = None


def export(layers: Layers, path: Path, metadata: Mapping[str, str]) -> None:
    """Write a network as an ONNX file."""
    tensors: dict[str, Floats] = {'mean': layers.mean, 'deviation': layers.deviation}
    last = len(layers.weights) - 1
    answers = ['actions'] if layers.mirror is None else ['here', 'mirrored']
    nodes = [
        helper.make_node('Sub', ['obs', 'mean'], ['centred']),
        helper.make_node('Div', ['centred', 'deviation'], [f'{answers[0]}_value0']),
    ]
    if layers.mirror is not None:
        tensors['seen_mirror'], tensors['action_mirror'] = layers.mirror
        nodes.append(
            helper.make_node('MatMul', ['here_value0', 'seen_mirror'], ['mirrored_value0'])
        )
    for layer, (weight, bias) in enumerate(zip(layers.weights, layers.biases, strict=True)):
        tensors[f'weight{layer}'], tensors[f'bias{layer}'] = weight, bias
        for answer in answers:
            out = answer if layer == last else f'{answer}_sum{layer}'
            inputs = [f'{answer}_value{layer}', f'weight{layer}', f'bias{layer}']
            nodes.append(helper.make_node('Gemm', inputs, [out]))
            if layer != last:
                nodes.append(helper.make_node('Elu', [out], [f'{answer}_value{layer + 1}']))
    if layers.mirror is not None:
        nodes.append(helper.make_node('MatMul', ['mirrored', 'action_mirror'], ['back']))
        nodes.append(helper.make_node('Mean', ['here', 'back'], ['actions']))
    graph = helper.make_graph(
        nodes,
        'policy',
        [helper.make_tensor_value_info('obs', TensorProto.FLOAT, [1, len(layers.mean)])],
        [helper.make_tensor_value_info('actions', TensorProto.FLOAT, [1, len(layers.biases[-1])])],
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
