#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
#
# onnxruntime 1.31.1: a file of external weights that is written over in place changes a session that is running,
# but only in part: the biases are read anew from the file at each run, the matrices were packed when it was loaded.
# Expected: a session keeps the weights that it was made with. A new export over the old one makes a policy of both.
# Seen: 10 x 1 + 1 = 11, after all weights became 5: 10 x 1 + 5 = 15; a new session says 10 x 5 x 64 + 5 = 3205
set -eu
unset PYTHONPATH LD_LIBRARY_PATH
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
{ python3 -m venv venv && venv/bin/pip install --quiet onnx==1.23.2 onnxruntime==1.31.1; } || exit 2
venv/bin/python -I - <<'END'
from pathlib import Path

import numpy as np
import onnx
import onnxruntime
from onnx import TensorProto, helper, numpy_helper

SIZE = 64
weights = [
    numpy_helper.from_array(np.eye(SIZE, dtype=np.float32), 'matrix'),
    numpy_helper.from_array(np.ones(SIZE, np.float32), 'bias'),
]
graph = helper.make_graph(
    [helper.make_node('MatMul', ['x', 'matrix'], ['m']), helper.make_node('Add', ['m', 'bias'], ['y'])],
    'policy',
    [helper.make_tensor_value_info('x', TensorProto.FLOAT, [1, SIZE])],
    [helper.make_tensor_value_info('y', TensorProto.FLOAT, [1, SIZE])],
    weights,
)
model = helper.make_model(graph, opset_imports=[helper.make_opsetid('', 17)], ir_version=8)
onnx.save(
    model, 'policy.onnx', save_as_external_data=True, location='policy.onnx.data', size_threshold=0
)


def session():
    return onnxruntime.InferenceSession('policy.onnx', providers=['CPUExecutionProvider'])


def answer(policy):
    return float(policy.run(None, {'x': np.full((1, SIZE), 10, np.float32)})[0][0, 0])


running = session()
before = answer(running)
data = Path('policy.onnx.data')
with data.open('r+b') as file:  # of the same size, as an export of the same network is
    file.write(np.full(data.stat().st_size // 4, 5, np.float32).tobytes())
found = before, answer(running), answer(session())
print('before, after, anew:', *found)
raise SystemExit(found != (11, 15, 3205))
END
