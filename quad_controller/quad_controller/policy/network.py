# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Runs a policy's network, and reads weights and metadata of its ONNX file.

An ONNX file is a message of protocol buffers (onnx.proto), which ONNX Runtime brings: weights may
lie in other files beside it (``external_data``), and metadata are entries of a repeated field. The
package onnx, 20 MB, would do the same; a robot does not need it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
import functools
import hashlib
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ..exceptions import PolicyError
from .contract.model import RecurrentState

Floats = npt.NDArray[np.float32]
Port = tuple[str, str, tuple[object, ...]]
FLOAT = 'tensor(float)'  # ONNX Runtime's name of the type
SIDES_KEY = 'weights_sha256'
"""Metadata key of the digest of the side files that belong to a model."""


class OnnxNetwork:
    """A network from an ONNX file, run by ONNX Runtime on one thread."""

    def __init__(self, path: Path, *, new_weights: bool = False) -> None:
        """Load the network.

        Args:
            new_weights: Accept external weight files that differ from those of the contract.

        Raises:
            PolicyError: The file or ONNX Runtime is missing, or the model cannot be loaded.
        """
        model = read_model(path)
        # SHA-256 of the file and of the side files that its weights lie in
        self.name, self.digest, self.sides = path.name, model.digest, tuple(model.sides)
        session = _session(path, model)
        self.metadata: Mapping[str, str] = dict(session.get_modelmeta().custom_metadata_map)
        self.warnings = _check_weights(path, model, {} if new_weights else self.metadata)
        # name, type and shape of each
        self.inputs = _ports(session.get_inputs())
        self.outputs = _ports(session.get_outputs())
        self._session = session
        self._states: tuple[RecurrentState, ...] = ()
        self._memory: dict[str, Floats] = {}
        self._input = self.inputs[0][0] if self.inputs else ''
        self._output = [self.outputs[0][0]] if self.outputs else []

    def recur(self, states: tuple[RecurrentState, ...], actions: str = '') -> None:
        """Feed outputs back to inputs in the next step; `actions` names the action output."""
        self._states = states
        inputs, outputs = observation_ports(self, states, actions)
        self._input = inputs[0][0] if inputs else ''
        self._output = [outputs[0][0] if outputs else '', *(state.output for state in states)]
        self.reset()

    def reset(self) -> None:
        """Set recurrent states to zero."""
        shapes = {name: shape for name, _, shape in self.inputs}
        self._memory = {
            state.input: np.zeros(
                [size if isinstance(size, int) else 1 for size in shapes[state.input]], np.float32
            )
            for state in self._states
        }

    def run(self, observation: Floats) -> Floats:
        """Return the action for an observation; both are arrays with one row."""
        answers = self._session.run(self._output, {self._input: observation, **self._memory})
        for state, answer in zip(self._states, answers[1:], strict=True):
            self._memory[state.input] = answer
        action: Floats = answers[0]
        return action


def observation_ports(
    network: OnnxNetwork, states: tuple[RecurrentState, ...], actions: str
) -> tuple[list[Port], list[Port]]:
    """Return the non-recurrent inputs and outputs; a valid network has one of each.

    Args:
        actions: Name of the output that holds the actions; empty if there is only one.
    """
    fed, kept = {state.input for state in states}, {state.output for state in states}
    outputs = [port for port in network.outputs if port[0] not in kept]
    return (
        [port for port in network.inputs if port[0] not in fed],
        [port for port in outputs if port[0] == actions] or outputs,
    )


def _ports(nodes: Any) -> tuple[Port, ...]:  # noqa: ANN401  # ONNX Runtime has no types
    return tuple((node.name, node.type, tuple(node.shape)) for node in nodes)


def _check_weights(path: Path, model: OnnxModel, metadata: Mapping[str, str]) -> tuple[str, ...]:
    """Reject weights that are not finite or not the expected ones; return warnings.

    Recurrent cells of ONNX Runtime turn NaN into ordinary numbers, so outputs do not reveal it.
    """
    damaged = model.not_finite()
    if damaged:
        raise PolicyError(
            f'policy {path}: weights of {", ".join(damaged)} are not finite numbers; '
            'export a checkpoint from before the training diverged'
        )
    if metadata.get(SIDES_KEY, model.sides_digest) != model.sides_digest:
        raise PolicyError(
            f'policy {path}: the weights in {", ".join(model.sides)} are not those that it was '
            'given its contract with; export it again, or run attach_contract again'
        )
    return tuple(
        f'weights lie in {side}, which exports of other names may overwrite'
        for side in model.sides
        if SIDES_KEY not in metadata and not side.startswith(path.stem)
    )


def _session(path: Path, model: OnnxModel) -> Any:  # noqa: ANN401  # ONNX Runtime has no types
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


# what is read of onnx.proto: number and type of each field, those with a * repeated
ONNX: Mapping[str, Mapping[str, tuple[int, str]]] = {
    'Entry': {'key': (1, 'string'), 'value': (2, 'string')},
    'Tensor': {
        'data_type': (2, 'int32'),
        'float_data': (4, 'float*'),
        'name': (8, 'string'),
        'raw_data': (9, 'bytes'),
        'double_data': (10, 'double*'),
        'external_data': (13, 'Entry*'),
    },
    'Attribute': {
        't': (5, 'Tensor'),
        'g': (6, 'Graph'),
        'tensors': (10, 'Tensor*'),
        'graphs': (11, 'Graph*'),
    },
    'Node': {'attribute': (5, 'Attribute*')},
    'Graph': {'node': (1, 'Node*'), 'initializer': (5, 'Tensor*')},
    'Model': {'graph': (7, 'Graph'), 'metadata_props': (14, 'Entry*')},
}
FLOATS = {1: '<f4', 10: '<f2', 11: '<f8'}  # types of tensors


@functools.cache
def _model_class() -> Any:  # noqa: ANN401  # made of the table
    """Return the protobuf class of a model; it keeps unknown fields."""
    from google.protobuf import descriptor_pb2, descriptor_pool, message_factory

    file = descriptor_pb2.FileDescriptorProto(name='onnx.proto', package='onnx')
    for name, fields in ONNX.items():
        message = file.message_type.add(name=name)
        for field, (number, kind) in fields.items():
            repeated, plain = kind.endswith('*'), kind.rstrip('*')
            made = message.field.add(name=field, number=number, label=3 if repeated else 1)
            made.type = made.Type.Value('TYPE_' + ('MESSAGE' if plain in ONNX else plain.upper()))
            if plain in ONNX:
                made.type_name = f'.onnx.{plain}'
            made.options.packed = plain in {'float', 'double'}
    pool = descriptor_pool.DescriptorPool()
    pool.Add(file)
    model = pool.FindMessageTypeByName('onnx.Model')
    if hasattr(message_factory, 'GetMessageClass'):
        return message_factory.GetMessageClass(model)
    return message_factory.MessageFactory(pool).GetPrototype(model)  # 4.21, of Ubuntu 24.04


def _parsed(data: bytes) -> Any:  # noqa: ANN401  # made of the table
    """Parse a model; invalid data give an empty one, since ONNX Runtime reports that better."""
    from google.protobuf.message import DecodeError

    try:
        return _model_class().FromString(data)
    except DecodeError:
        return _model_class()()


@dataclass(frozen=True, slots=True)
class OnnxModel:
    """A model held in memory: later changes to its files have no effect."""

    data: bytes  # its file
    # files that its weights lie in, by the names that the model has for them
    sides: Mapping[str, bytes]

    @property
    def digest(self) -> str:
        """SHA-256 of the model file and of each external weight file."""
        if not self.sides:
            return hashlib.sha256(self.data).hexdigest()
        whole = hashlib.sha256(hashlib.sha256(self.data).digest())
        for name, side in self.sides.items():
            whole.update(Path(name).name.encode())
            whole.update(hashlib.sha256(side).digest())
        return whole.hexdigest()

    @property
    def sides_digest(self) -> str:
        """SHA-256 of the external weight files alone; empty if there are none."""
        whole = hashlib.sha256(b''.join(self.sides.values()))
        return whole.hexdigest() if self.sides else ''

    def not_finite(self) -> list[str]:
        """Return the names of tensors that contain a non-finite weight."""
        tensors = _tensors(_parsed(self.data).graph)
        return [each.name for each in tensors if not np.isfinite(self._weights(each)).all()]

    def _weights(self, tensor: Any) -> npt.NDArray[Any]:  # noqa: ANN401  # made of the table
        kind = FLOATS.get(tensor.data_type)
        if kind is None:
            return np.zeros(0)
        raw = tensor.raw_data
        if tensor.external_data:
            place = {entry.key: entry.value for entry in tensor.external_data}
            start, side = int(place.get('offset', 0)), self.sides[place['location']]
            raw = side[start : start + int(place.get('length', len(side)))]
        numbers = [*tensor.float_data, *tensor.double_data]
        return np.frombuffer(raw, kind) if raw else np.array(numbers)


def read_model(path: Path) -> OnnxModel:
    """Read a model and its external weight files.

    Raises:
        PolicyError: A file cannot be read, or lies outside of the model's folder.
    """
    data = _read(path)
    lack = f'; weights of {path.name} lie there: copy that file along'
    sides = side_files(path, data).items()
    return OnnxModel(data, {name: _read(file, lack) for name, file in sides})


def side_files(path: Path, data: bytes) -> dict[str, Path]:
    """Return the external weight files of a model, by their names in the model.

    Raises:
        PolicyError: A name points outside of the model's folder.
    """
    entries = (entry for each in _tensors(_parsed(data).graph) for entry in each.external_data)
    names = sorted({entry.value for entry in entries if entry.key == 'location'})
    files = {}
    for name in names:
        if Path(name).is_absolute() or '..' in Path(name).parts:
            raise PolicyError(f'policy {path}: its weights lie in {name!r}, outside of its folder')
        beside = path.parent / name  # where the policy is a link, such as in a download cache
        files[name] = beside if beside.exists() else path.resolve().parent / name
    return files


def with_metadata(data: bytes, key: str, value: str) -> bytes:
    """Return a copy of a model with one metadata entry set."""
    model = _parsed(data)
    kept = {entry.key: entry.value for entry in model.metadata_props}
    del model.metadata_props[:]
    for each, text in {**kept, key: value}.items():
        model.metadata_props.add(key=each, value=text)
    serialized: bytes = model.SerializeToString()
    return serialized


def _tensors(graph: Any) -> Iterator[Any]:  # noqa: ANN401  # made of the table
    yield from graph.initializer
    for attribute in (each for node in graph.node for each in node.attribute):
        yield from (attribute.t, *attribute.tensors)
        for inner in (attribute.g, *attribute.graphs):
            yield from _tensors(inner)


def _read(path: Path, remedy: str = '') -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise PolicyError(f'policy {path}: {error.strerror}{remedy}') from error
