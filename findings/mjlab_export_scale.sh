#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
#
# mjlab 1.6.0: the metadata of an exported policy have three decimals, whatever their size: a scale of 0.0004 is 0.000.
# Expected: the shortest text that is read as the same number. A robot that reads the file multiplies that action with 0,
# without an error. Two functions of the exporter run here, from its own file; what it imports besides (torch, the
# simulation) they do not use.
# Seen: action_scale 0.25,0.0004,0.0015 is written as 0.250,0.000,0.002
set -eu
unset PYTHONPATH LD_LIBRARY_PATH
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
{ python3 -m venv venv && venv/bin/pip install --quiet --no-deps mjlab==1.6.0 onnx==1.23.2 \
    numpy==2.4.6 protobuf==6.33.2 typing_extensions ml_dtypes; } || exit 2
venv/bin/python -I - <<'END'
import ast
from importlib.metadata import distribution
from pathlib import Path

import onnx
from onnx import TensorProto, helper

source = Path(distribution('mjlab').locate_file('mjlab/rl/exporter_utils.py')).read_text()
wanted = {'list_to_csv_str', 'attach_metadata_to_onnx'}
tree = ast.parse(source)
tree.body = [each for each in tree.body if getattr(each, 'name', None) in wanted]
exporter = {'onnx': onnx}
exec(compile(tree, 'exporter_utils.py', 'exec'), exporter)

x, y = (helper.make_tensor_value_info(name, TensorProto.FLOAT, [1, 3]) for name in 'xy')
graph = helper.make_graph([helper.make_node('Tanh', ['x'], ['y'])], 'policy', [x], [y])
onnx.save(helper.make_model(graph), 'policy.onnx')
exporter['attach_metadata_to_onnx']('policy.onnx', {'action_scale': [0.25, 0.0004, 0.0015]})
written = {each.key: each.value for each in onnx.load('policy.onnx').metadata_props}
print(written)
raise SystemExit(written['action_scale'] != '0.250,0.000,0.002')
END
