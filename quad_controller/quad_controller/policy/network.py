# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The network behind a policy: numbers in, numbers out."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from ..exceptions import PolicyError
from . import onnx_file
from .contract.model import RecurrentState

Floats = npt.NDArray[np.float32]
Port = tuple[str, str, tuple[object, ...]]
FLOAT = 'tensor(float)'  # ONNX Runtime's name of the type


class Network(Protocol):
    """A network that answers an observation with an action.

    Attributes:
        metadata: What the file has of it.
        inputs: Name, type and shape of each input.
        outputs: The same of each output.
        digest: SHA-256 of the file and of those that its weights lie in.
    """

    metadata: Mapping[str, str]
    inputs: tuple[Port, ...]
    outputs: tuple[Port, ...]
    digest: str

    def recur(self, states: tuple[RecurrentState, ...]) -> None:
        """Have inputs that get what outputs were a step before."""
        ...

    def reset(self) -> None:
        """Begin anew: recurrent states are zero."""
        ...

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
        self.digest = onnx_file.digest(path)
        session = _session(path)
        self.metadata: Mapping[str, str] = dict(session.get_modelmeta().custom_metadata_map)
        self.inputs = _ports(session.get_inputs())
        self.outputs = _ports(session.get_outputs())
        self._session = session
        self._states: tuple[RecurrentState, ...] = ()
        self._memory: dict[str, Floats] = {}
        self._input = self.inputs[0][0] if self.inputs else ''
        self._output = [self.outputs[0][0]] if self.outputs else []

    def recur(self, states: tuple[RecurrentState, ...]) -> None:
        """Have inputs that get what outputs were a step before."""
        self._states = states
        inputs, outputs = observation_ports(self, states)
        self._input = inputs[0][0] if inputs else ''
        self._output = [outputs[0][0] if outputs else '', *(state.output for state in states)]
        self.reset()

    def reset(self) -> None:
        """Begin anew: recurrent states are zero."""
        shapes = {name: shape for name, _, shape in self.inputs}
        self._memory = {
            state.input: np.zeros(
                [size if isinstance(size, int) else 1 for size in shapes[state.input]], np.float32
            )
            for state in self._states
        }

    def run(self, observation: Floats) -> Floats:
        """Return the action for an observation; both have one row."""
        answers = self._session.run(self._output, {self._input: observation, **self._memory})
        for state, answer in zip(self._states, answers[1:], strict=True):
            self._memory[state.input] = answer
        action: Floats = answers[0]
        return action


def observation_ports(
    network: Network, states: tuple[RecurrentState, ...]
) -> tuple[list[Port], list[Port]]:
    """Return the inputs and outputs that are not recurrent: one each in a network that fits."""
    fed, kept = {state.input for state in states}, {state.output for state in states}
    return (
        [port for port in network.inputs if port[0] not in fed],
        [port for port in network.outputs if port[0] not in kept],
    )


def _ports(nodes: Any) -> tuple[Port, ...]:  # noqa: ANN401  # ONNX Runtime has no types
    return tuple((node.name, node.type, tuple(node.shape)) for node in nodes)


def _session(path: Path) -> Any:  # noqa: ANN401  # ONNX Runtime has no types
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
        # by its path, since weights in side files are found beside it
        return onnxruntime.InferenceSession(
            str(path), sess_options=options, providers=['CPUExecutionProvider']
        )
    except Exception as error:
        raise PolicyError(f'policy {path} is not an ONNX model that runs: {error}') from error
