# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What ONNX Runtime does not show of a file: its side files; and metadata, written into it.

An ONNX file is a message of protocol buffers (onnx.proto): weights may lie in other files beside
it (``external_data``), and metadata are entries of a repeated field, so that one more entry is
some bytes at the end. The package onnx, 20 MB, would do the same; a robot does not need it.
"""

from __future__ import annotations

from collections.abc import Iterator
import hashlib
from pathlib import Path

from ..exceptions import PolicyError

# numbers of fields in onnx.proto
MODEL_GRAPH, MODEL_METADATA = 7, 14
GRAPH_NODE, GRAPH_INITIALIZER = 1, 5
NODE_ATTRIBUTE = 5
ATTRIBUTE_TENSOR, ATTRIBUTE_GRAPH, ATTRIBUTE_TENSORS, ATTRIBUTE_GRAPHS = 5, 6, 10, 11
TENSOR_EXTERNAL_DATA = 13
ENTRY_KEY, ENTRY_VALUE = 1, 2

VARINT, FIXED64, BYTES, FIXED32 = 0, 1, 2, 5  # wire types
FIXED_SIZES = {FIXED64: 8, FIXED32: 4}


def digest(path: Path) -> str:
    """Return the SHA-256 of a file, with that of each file that its weights lie in.

    Raises:
        PolicyError: A file cannot be read, or lies outside of the folder of the first one.
    """
    data = _read(path)
    sides = side_files(path, data)
    if not sides:
        return hashlib.sha256(data).hexdigest()
    whole = hashlib.sha256(hashlib.sha256(data).digest())
    for side in sides:
        whole.update(side.name.encode())
        whole.update(hashlib.sha256(_read(side)).digest())
    return whole.hexdigest()


def side_files(path: Path, data: bytes) -> list[Path]:
    """Return the files that the weights of a model lie in, each once.

    Raises:
        PolicyError: A name leads out of the folder of the model.
    """
    try:
        names = sorted(set(_locations(memoryview(data))))
    except (IndexError, ValueError):
        return []  # no ONNX; ONNX Runtime says so better
    folder = path.resolve().parent
    files = [(folder / name).resolve() for name in names]
    for name, file in zip(names, files, strict=True):
        if folder not in file.parents:
            raise PolicyError(f'policy {path}: its weights lie in {name!r}, outside of its folder')
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
    for graph in _each(model, MODEL_GRAPH):
        yield from _graph_locations(graph)


def _graph_locations(graph: memoryview) -> Iterator[str]:
    for tensor in _each(graph, GRAPH_INITIALIZER):
        yield from _tensor_locations(tensor)
    for node in _each(graph, GRAPH_NODE):
        for attribute in _each(node, NODE_ATTRIBUTE):
            for number in (ATTRIBUTE_TENSOR, ATTRIBUTE_TENSORS):
                for tensor in _each(attribute, number):
                    yield from _tensor_locations(tensor)
            for number in (ATTRIBUTE_GRAPH, ATTRIBUTE_GRAPHS):
                for inner in _each(attribute, number):
                    yield from _graph_locations(inner)


def _tensor_locations(tensor: memoryview) -> Iterator[str]:
    for entry in _each(tensor, TENSOR_EXTERNAL_DATA):
        key, value = _entry(entry)
        if key == 'location':
            yield value


def _each(message: memoryview, wanted: int) -> Iterator[memoryview]:
    for number, _, content, _ in _fields(message):
        if number == wanted:
            yield content


def _entry(entry: memoryview) -> tuple[str, str]:
    texts = {number: bytes(content).decode() for number, _, content, _ in _fields(entry)}
    return texts.get(ENTRY_KEY, ''), texts.get(ENTRY_VALUE, '')


def _fields(message: memoryview) -> Iterator[tuple[int, int, memoryview, int]]:
    """Yield number, start, content and end of each field; numbers have no content.

    Raises:
        ValueError: It is no message of protocol buffers.
        IndexError: It ends too early.
    """
    place = 0
    while place < len(message):
        start = place
        tag, place = _varint(message, place)
        number, kind = tag >> 3, tag & 7
        content = message[:0]
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


def _read(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise PolicyError(f'policy {path}: {error.strerror}') from error
