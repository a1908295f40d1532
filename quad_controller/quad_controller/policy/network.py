# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The network behind a policy: numbers in, numbers out."""

from __future__ import annotations

from collections.abc import Mapping
import hashlib
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from ..exceptions import PolicyError

Floats = npt.NDArray[np.float32]
Port = tuple[str, str, tuple[object, ...]]
FLOAT = 'tensor(float)'  # ONNX Runtime's name of the type


class Network(Protocol):
    """A network with one input and one output.

    Attributes:
        metadata: What the file has of it.
        inputs: Name, type and shape of each input.
        outputs: The same of each output.
        digest: SHA-256 of the file.
    """

    metadata: Mapping[str, str]
    inputs: tuple[Port, ...]
    outputs: tuple[Port, ...]
    digest: str

    def run(self, observation: Floats) -> Floats:
        """Return the action for an observation; both have one row."""
        ...


class OnnxNetwork:
    """A network in an ONNX file, run by ONNX Runtime on one thread."""

    def __init__(self, path: Path) -> None:
        """Load it.

        Raises:
            PolicyError: There is no such file, no ONNX Runtime, or it cannot be loaded.
        """
        try:
            data = path.read_bytes()
        except OSError as error:
            raise PolicyError(f'policy {path}: {error.strerror}') from error
        session = _session(data, path)
        self.digest = hashlib.sha256(data).hexdigest()
        self.metadata: Mapping[str, str] = dict(session.get_modelmeta().custom_metadata_map)
        self.inputs = tuple(
            (node.name, node.type, tuple(node.shape)) for node in session.get_inputs()
        )
        self.outputs = tuple(
            (node.name, node.type, tuple(node.shape)) for node in session.get_outputs()
        )
        self._session = session
        self._input = self.inputs[0][0] if self.inputs else ''
        self._output = [self.outputs[0][0]] if self.outputs else []

    def run(self, observation: Floats) -> Floats:
        """Return the action for an observation; both have one row."""
        action: Floats = self._session.run(self._output, {self._input: observation})[0]
        return action


def _ports(nodes: Any) -> tuple[Port, ...]:  # noqa: ANN401  # ONNX Runtime has no types
    return tuple((node.name, node.type, tuple(node.shape)) for node in nodes)


def _session(data: bytes, path: Path) -> Any:  # noqa: ANN401  # ONNX Runtime has no types
    try:
        import onnxruntime
    except ImportError as error:
        raise PolicyError(
            f'policy {path}: no onnxruntime; install it (pip install onnxruntime)'
        ) from error
    options = onnxruntime.SessionOptions()
    # more threads cost more than they give for networks of this size
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    options.add_session_config_entry('session.intra_op.allow_spinning', '0')
    try:
        return onnxruntime.InferenceSession(
            data, sess_options=options, providers=['CPUExecutionProvider']
        )
    except Exception as error:
        raise PolicyError(f'policy {path} is not an ONNX model that runs: {error}') from error
