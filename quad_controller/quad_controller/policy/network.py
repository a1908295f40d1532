# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The network behind a policy: numbers in, numbers out."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ..exceptions import PolicyError
from . import onnx_file
from .contract.model import RecurrentState

Floats = npt.NDArray[np.float32]
Port = tuple[str, str, tuple[object, ...]]
FLOAT = 'tensor(float)'  # ONNX Runtime's name of the type


class OnnxNetwork:
    """A network in an ONNX file, run by ONNX Runtime on one thread.

    Attributes:
        name: Of its file.
        digest: SHA-256 of its file and of those that its weights lie in.
        sides: Names of the files that its weights lie in.
        metadata: What its file has.
        inputs: Name, type and shape of each input.
        outputs: The same of each output.
        warnings: What a person should know of the file.
    """

    def __init__(self, path: Path, *, new_weights: bool = False) -> None:
        """Load it.

        Args:
            new_weights: Accept side files other than those that its contract was written for.

        Raises:
            PolicyError: There is no such file, no ONNX Runtime, or it cannot be loaded.
        """
        model = onnx_file.read_model(path)
        self.name, self.digest, self.sides = path.name, model.digest, tuple(model.sides)
        session = _session(path, model)
        self.metadata: Mapping[str, str] = dict(session.get_modelmeta().custom_metadata_map)
        self.warnings = _check_weights(path, model, {} if new_weights else self.metadata)
        self.inputs = _ports(session.get_inputs())
        self.outputs = _ports(session.get_outputs())
        self._session = session
        self._states: tuple[RecurrentState, ...] = ()
        self._memory: dict[str, Floats] = {}
        self._input = self.inputs[0][0] if self.inputs else ''
        self._output = [self.outputs[0][0]] if self.outputs else []

    def recur(self, states: tuple[RecurrentState, ...], actions: str = '') -> None:
        """Feed outputs to inputs in the step after; `actions` names the output of the actions."""
        self._states = states
        inputs, outputs = observation_ports(self, states, actions)
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
    network: OnnxNetwork, states: tuple[RecurrentState, ...], actions: str
) -> tuple[list[Port], list[Port]]:
    """Return the inputs and outputs that are not recurrent: one each in a network that fits.

    Args:
        actions: Name of the output that holds the actions; empty where there is one only.
    """
    fed, kept = {state.input for state in states}, {state.output for state in states}
    outputs = [port for port in network.outputs if port[0] not in kept]
    return (
        [port for port in network.inputs if port[0] not in fed],
        [port for port in outputs if port[0] == actions] or outputs,
    )


def _ports(nodes: Any) -> tuple[Port, ...]:  # noqa: ANN401  # ONNX Runtime has no types
    return tuple((node.name, node.type, tuple(node.shape)) for node in nodes)


def _check_weights(
    path: Path, model: onnx_file.OnnxModel, metadata: Mapping[str, str]
) -> tuple[str, ...]:
    """Refuse weights that are not numbers, or not those of the model; return warnings.

    Recurrent cells of ONNX Runtime turn NaN into ordinary numbers, so answers do not show it.
    """
    damaged = model.not_finite()
    if damaged:
        raise PolicyError(
            f'policy {path}: weights of {", ".join(damaged)} are not finite numbers; '
            'export a checkpoint from before the training diverged'
        )
    if metadata.get(onnx_file.SIDES_KEY, model.sides_digest) != model.sides_digest:
        raise PolicyError(
            f'policy {path}: the weights in {", ".join(model.sides)} are not those that it was '
            'given its contract with; export it again, or run attach_contract again'
        )
    return tuple(
        f'weights lie in {side}, which exports of other names may overwrite'
        for side in model.sides
        if onnx_file.SIDES_KEY not in metadata and not side.startswith(path.stem)
    )


def _session(path: Path, model: onnx_file.OnnxModel) -> Any:  # noqa: ANN401  # ONNX Runtime has no types
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
    options.log_severity_level = 3  # its warnings are of no use to a user; errors are raised
    try:
        if model.sides:
            # from memory: ONNX Runtime keeps side files mapped, and a policy that runs would
            # change when they are overwritten
            sides = list(model.sides.values())
            options.add_external_initializers_from_files_in_memory(
                list(model.sides), sides, [len(side) for side in sides]
            )
        return onnxruntime.InferenceSession(
            model.data, sess_options=options, providers=['CPUExecutionProvider']
        )
    except Exception as error:
        raise PolicyError(f'policy {path} is not an ONNX model that runs: {error}') from error
