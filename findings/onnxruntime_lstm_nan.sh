#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
#
# onnxruntime 1.31.1: an LSTM or GRU with biases answers an observation of NaN with ordinary numbers on the CPU.
# Expected: NaN, as without biases, and as of RNN, Tanh, Relu and Clip. A check of the actions does not see the
# dead sensor; only one of the observations does (and of the weights: NaN in them is hidden as well).
# Seen: RNN [nan nan nan nan], GRU [0. 0. 0. 0.], LSTM [0.7615942 0.7615942 0.7615942 0.7615942], without biases nan
set -eu
unset PYTHONPATH LD_LIBRARY_PATH
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
{ python3 -m venv venv && venv/bin/pip install --quiet onnx==1.23.2 onnxruntime==1.31.1; } || exit 2
venv/bin/python -I - <<'END'
import numpy as np
import onnx
import onnxruntime
from onnx import TensorProto, helper, numpy_helper

INPUTS, HIDDEN = 3, 4


def is_nan(kind, gates, names='WRB'):
    rng = np.random.default_rng(0)
    shapes = {'W': (gates * HIDDEN, INPUTS), 'R': (gates * HIDDEN, HIDDEN), 'B': (2 * gates * HIDDEN,)}
    weights = [
        numpy_helper.from_array(rng.normal(size=(1, *shapes[name])).astype(np.float32), name)
        for name in names
    ]
    graph = helper.make_graph(
        [helper.make_node(kind, ['x', *names], ['y'], hidden_size=HIDDEN)],
        'policy',
        [helper.make_tensor_value_info('x', TensorProto.FLOAT, [1, 1, INPUTS])],
        [helper.make_tensor_value_info('y', TensorProto.FLOAT, [1, 1, 1, HIDDEN])],
        weights,
    )
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid('', 17)], ir_version=8)
    onnx.checker.check_model(model)
    session = onnxruntime.InferenceSession(
        model.SerializeToString(), providers=['CPUExecutionProvider']
    )
    (found,) = session.run(None, {'x': np.full((1, 1, INPUTS), np.nan, np.float32)})
    print(kind, *names, found.ravel())
    return bool(np.isnan(found).any())


found = is_nan('RNN', 1), is_nan('GRU', 3), is_nan('LSTM', 4), is_nan('LSTM', 4, 'WR')
raise SystemExit(found != (True, False, False, True))
END
