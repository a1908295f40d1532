# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Reads octrees serialized by OctoMap, as their occupied cells.

A tree has 16 levels around the origin of the map; a leaf may be at any of them. Bits 0, 1 and 2 of
a child's number are set if the child is on the positive side of its node in x, y and z.

The binary stream has two bytes for each inner node, two bits for each child from the least
significant ones on: 0 unknown, 1 free, 2 occupied, 3 an inner node. Inner children follow in
their order, each with its whole subtree. The full stream has for each node its log-odds of being
occupied, a little-endian float32, in coloured trees three bytes of colour, and one byte with a bit
for each existing child; the children follow in the same way.
"""

from __future__ import annotations

from array import array
from collections.abc import Iterator
from functools import lru_cache
import math
import struct

import numpy as np
from numpy.typing import NDArray

from ..exceptions import SceneError
from .objects import Cells, PlacedShape

OCTOMAP_NAME = '<octomap>'  # name of the octomap among the objects of a scene, as in MoveIt

VALUES = {'OcTree': struct.Struct('<f'), 'ColorOcTree': struct.Struct('<f3x')}
"""Fields of a node in the full stream, by class of the tree."""

ROOT_SIZE = 1 << 16  # edge of the whole tree, in its smallest cells
MAX_CELLS = 100_000  # how many occupied cells a map may have

BLOCK = 256
"""Cells of one shape, which lie together: a distance to it takes about 30 us, so that no control
cycle waits long for the interpreter."""

MAX_DATA = 2_000_000  # bytes of a stream at most; a million nodes take about a second
OCCUPIED, INNER = 2, 3  # states of a child in the binary stream
Cubes = NDArray[np.int64]  # least corner x, y, z and edge of cubes, in smallest cells (n, 4)


@lru_cache(maxsize=4)
def octomap_shapes(
    kind: str, data: bytes, resolution: float, *, binary: bool
) -> tuple[PlacedShape, ...]:
    """Return the occupied cells of a map in its frame, grouped by size and neighbourhood.

    Args:
        resolution: Edge of the smallest cells in [m].
        binary: Whether the data are the binary stream, else the full one.

    Raises:
        SceneError: The kind is unknown, the stream is invalid, or the map is too fine.
    """
    if kind not in VALUES:
        raise SceneError(f'octomap: a tree {kind!r}; send {" or ".join(VALUES)}')
    if not (math.isfinite(resolution) and resolution > 0.0):
        raise SceneError(f'octomap: its resolution is {resolution:g}; it must be positive')
    if len(data) > MAX_DATA:
        raise SceneError(
            f'octomap: {len(data)} bytes, {MAX_DATA} are read; send a coarser map, or what is in'
            ' reach'
        )
    leaves = _binary_leaves(data) if binary else _full_leaves(data, VALUES[kind])
    numbers = array('q')  # numpy would take all leaves in one step, for which other threads wait
    for leaf in leaves:
        numbers.extend(leaf)
    cubes: Cubes = np.frombuffer(numbers, dtype=np.int64).reshape(-1, 4)
    if len(cubes) > MAX_CELLS:
        raise SceneError(
            f'octomap: {len(cubes)} cells are occupied, {MAX_CELLS} are looked at; send a coarser'
            ' map, or what is in reach'
        )
    return tuple(PlacedShape(each) for each in _blocks(cubes, resolution))


def _blocks(cubes: Cubes, resolution: float) -> Iterator[Cells]:
    """Yield cubes of the same edge, some at a time in the order of the tree."""
    for edge in np.unique(cubes[:, 3]).tolist():
        corners = cubes[cubes[:, 3] == edge, :3]
        middles = (corners - ROOT_SIZE // 2 + 0.5 * edge) * resolution
        for begin in range(0, len(middles), BLOCK):
            yield Cells(middles[begin : begin + BLOCK], edge * resolution)


def _child(x: int, y: int, z: int, edge: int, number: int) -> tuple[int, int, int, int]:
    """Return corner and edge of a child from those of its parent."""
    half = edge >> 1
    return (
        x + half * (number & 1),
        y + half * (number >> 1 & 1),
        z + half * (number >> 2 & 1),
        half,
    )


def _binary_leaves(data: bytes) -> Iterator[tuple[int, int, int, int]]:
    """Yield occupied leaves of the binary stream."""
    if not data:
        return
    waiting, place = [(0, 0, 0, ROOT_SIZE)], 0
    while waiting:
        cube = waiting.pop()
        if place + 2 > len(data):
            raise _ends_early(place, len(data))
        word = data[place] | data[place + 1] << 8
        place += 2
        if cube[3] == 1 and word:
            raise SceneError(f'octomap: byte {place - 2}: a smallest cell has children')
        inner = []
        for number in range(8):
            state = word >> 2 * number & 3
            if state == OCCUPIED:
                yield _child(*cube, number)
            elif state == INNER:
                inner.append(_child(*cube, number))
        waiting += reversed(inner)
    _require_end(place, len(data))


def _full_leaves(data: bytes, value: struct.Struct) -> Iterator[tuple[int, int, int, int]]:
    """Yield occupied leaves of the full stream."""
    if not data:
        return
    waiting, place = [(0, 0, 0, ROOT_SIZE)], 0
    while waiting:
        cube = waiting.pop()
        if place + value.size + 1 > len(data):
            raise _ends_early(place, len(data))
        (log_odds,) = value.unpack_from(data, place)
        children = data[place + value.size]
        if not math.isfinite(log_odds):
            raise SceneError(f'octomap: byte {place}: a cell is occupied by {log_odds}')
        if cube[3] == 1 and children:
            raise SceneError(f'octomap: byte {place}: a smallest cell has children')
        place += value.size + 1
        if children:
            waiting += (_child(*cube, each) for each in range(7, -1, -1) if children >> each & 1)
        elif log_odds >= 0.0 and cube[3] == ROOT_SIZE:
            yield from (_child(*cube, number) for number in range(8))
        elif log_odds >= 0.0:
            yield cube
    _require_end(place, len(data))


def _ends_early(place: int, length: int) -> SceneError:
    return SceneError(
        f'octomap: its data end within a node, at byte {place} of {length}; send all of them, and'
        ' binary as they are'
    )


def _require_end(place: int, length: int) -> None:
    if place != length:
        raise SceneError(
            f'octomap: the tree ends at byte {place}, its data have {length}; check id and binary'
        )
