# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The network behind a policy: numbers in, numbers out; its ONNX file with weights and metadata.

An ONNX file is a message of protocol buffers (onnx.proto): weights may lie in other files beside
it (``external_data``), and metadata are entries of a repeated field, so that one more entry is
some bytes at the end. The package onnx, 20 MB, would do the same; a robot does not need it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
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
    """A network in an ONNX file, run by ONNX Runtime on one thread."""

    def __init__(self, path: Path, *, new_weights: bool = False) -> None:
        """Load it.

        Args:
            new_weights: Accept side files other than those that its contract was written for.

        Raises:
            PolicyError: There is no such file, no ONNX Runtime, or it cannot be loaded.
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


def _check_weights(path: Path, model: OnnxModel, metadata: Mapping[str, str]) -> tuple[str, ...]:
    """Refuse weights that are not numbers, or not those of the model; return warnings.

    Recurrent cells of ONNX Runtime turn NaN into ordinary numbers, so answers do not show it.
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


# numbers of fields in onnx.proto
MODEL_GRAPH, MODEL_METADATA = 7, 14
GRAPH_NODE, GRAPH_INITIALIZER = 1, 5
NODE_ATTRIBUTE = 5
ATTRIBUTE_TENSOR, ATTRIBUTE_GRAPH, ATTRIBUTE_TENSORS, ATTRIBUTE_GRAPHS = 5, 6, 10, 11
TENSOR_TYPE, TENSOR_NAME, TENSOR_RAW, TENSOR_EXTERNAL_DATA = 2, 8, 9, 13
FLOATS = {1: '<f4', 10: '<f2', 11: '<f8'}  # types of tensors
FLOAT_DATA = {1: 4, 11: 10}  # where numbers of a type stand that are not raw
ENTRY_KEY, ENTRY_VALUE = 1, 2

VARINT, FIXED64, BYTES, FIXED32 = 0, 1, 2, 5  # wire types
FIXED_SIZES = {FIXED64: 8, FIXED32: 4}


@dataclass(frozen=True, slots=True)
class OnnxModel:
    """A model as it was read once: what happens to its files later does not count."""

    data: bytes  # its file
    # files that its weights lie in, by the names that the model has for them
    sides: Mapping[str, bytes]

    @property
    def digest(self) -> str:
        """SHA-256 of the file, with that of each side file."""
        if not self.sides:
            return hashlib.sha256(self.data).hexdigest()
        whole = hashlib.sha256(hashlib.sha256(self.data).digest())
        for name, side in self.sides.items():
            whole.update(Path(name).name.encode())
            whole.update(hashlib.sha256(side).digest())
        return whole.hexdigest()

    @property
    def sides_digest(self) -> str:
        """SHA-256 of the side files alone; empty where there is none."""
        whole = hashlib.sha256(b''.join(self.sides.values()))
        return whole.hexdigest() if self.sides else ''

    def not_finite(self) -> list[str]:
        """Name the tensors with a weight that is not finite."""
        try:
            return [
                name
                for tensor in _tensors(memoryview(self.data))
                for name, weights in [self._weights(tensor)]
                if not np.isfinite(weights).all()
            ]
        except (IndexError, ValueError):
            return []  # no ONNX; ONNX Runtime says so better

    def _weights(self, tensor: memoryview) -> tuple[str, npt.NDArray[Any]]:
        fields = [(number, content) for number, _, content, _ in _fields(tensor)]
        parts = dict(fields)
        kind, _ = _varint(parts[TENSOR_TYPE], 0)
        name = bytes(parts.get(TENSOR_NAME, b'')).decode()
        if kind not in FLOATS:
            return name, np.zeros(0)
        if TENSOR_EXTERNAL_DATA in parts:
            place = dict(_entry(content) for number, content in fields
                         if number == TENSOR_EXTERNAL_DATA)  # fmt: skip
            start, side = int(place.get('offset', 0)), self.sides[place['location']]
            raw = side[start : start + int(place.get('length', len(side)))]
        else:
            raw = bytes(
                parts.get(TENSOR_RAW) or parts.get(FLOAT_DATA.get(kind, 0), memoryview(b''))
            )
        return name, np.frombuffer(raw, FLOATS[kind])


def read_model(path: Path) -> OnnxModel:
    """Read a model and the files that its weights lie in.

    Raises:
        PolicyError: A file cannot be read, or lies outside of the folder of the first one.
    """
    data = _read(path)
    lack = f'; weights of {path.name} lie there: copy that file along'
    sides = side_files(path, data).items()
    return OnnxModel(data, {name: _read(file, lack) for name, file in sides})


def side_files(path: Path, data: bytes) -> dict[str, Path]:
    """Return the files that the weights of a model lie in, by their names in the model.

    Raises:
        PolicyError: A name leads out of the folder of the model.
    """
    try:
        names = sorted(set(_locations(memoryview(data))))
    except (IndexError, ValueError):
        return {}  # no ONNX; ONNX Runtime says so better
    files = {}
    for name in names:
        if Path(name).is_absolute() or '..' in Path(name).parts:
            raise PolicyError(f'policy {path}: its weights lie in {name!r}, outside of its folder')
        beside = path.parent / name  # where the policy is a link, such as in a download cache
        files[name] = beside if beside.exists() else path.resolve().parent / name
    return files


def with_metadata(data: bytes, key: str, value: str) -> bytes:
    """Return a model with one entry of its metadata set; all else stays byte by byte."""
    kept = bytearray()
    view = memoryview(data)
    for number, start, content, end in _fields(view):
        if number == MODEL_METADATA and _entry(content)[0] == key:
            continue
        kept += view[start:end]
    entry = _field(ENTRY_KEY, key.encode()) + _field(ENTRY_VALUE, value.encode())
    return bytes(kept) + _field(MODEL_METADATA, entry)


def _locations(model: memoryview) -> Iterator[str]:
    for tensor in _tensors(model):
        for entry in _each(tensor, TENSOR_EXTERNAL_DATA):
            key, value = _entry(entry)
            if key == 'location':
                yield value


def _tensors(model: memoryview) -> Iterator[memoryview]:
    for graph in _each(model, MODEL_GRAPH):
        yield from _graph_tensors(graph)


def _graph_tensors(graph: memoryview) -> Iterator[memoryview]:
    yield from _each(graph, GRAPH_INITIALIZER)
    for node in _each(graph, GRAPH_NODE):
        for attribute in _each(node, NODE_ATTRIBUTE):
            for number in (ATTRIBUTE_TENSOR, ATTRIBUTE_TENSORS):
                yield from _each(attribute, number)
            for number in (ATTRIBUTE_GRAPH, ATTRIBUTE_GRAPHS):
                for inner in _each(attribute, number):
                    yield from _graph_tensors(inner)


def _each(message: memoryview, wanted: int) -> Iterator[memoryview]:
    for number, _, content, _ in _fields(message):
        if number == wanted:
            yield content


def _entry(entry: memoryview) -> tuple[str, str]:
    texts = {number: bytes(content).decode() for number, _, content, _ in _fields(entry)}
    return texts.get(ENTRY_KEY, ''), texts.get(ENTRY_VALUE, '')


def _fields(message: memoryview) -> Iterator[tuple[int, int, memoryview, int]]:
    """Yield number, start, content and end of each field."""
    place = 0
    while place < len(message):
        start = place
        tag, place = _varint(message, place)
        number, kind = tag >> 3, tag & 7
        content = message[place:]
        if kind == VARINT:
            _, place = _varint(message, place)
        elif kind == BYTES:
            size, place = _varint(message, place)
            content = message[place : place + size]
            place += size
        elif kind in FIXED_SIZES:
            place += FIXED_SIZES[kind]
        else:
            raise ValueError(f'wire type {kind}')
        if place > len(message):
            raise IndexError('a field ends behind its message')
        yield number, start, content, place


def _varint(message: memoryview, place: int) -> tuple[int, int]:
    value = shift = 0
    while True:
        byte = message[place]
        place += 1
        value |= (byte & 0x7F) << shift
        if byte < 0x80:
            return value, place
        shift += 7


def _field(number: int, content: bytes) -> bytes:
    return _number(number << 3 | BYTES) + _number(len(content)) + content


def _number(value: int) -> bytes:
    encoded = bytearray()
    while value >= 0x80:
        encoded.append(value & 0x7F | 0x80)
        value >>= 7
    encoded.append(value)
    return bytes(encoded)


def _read(path: Path, remedy: str = '') -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise PolicyError(f'policy {path}: {error.strerror}{remedy}') from error
