# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Octrees as OctoMap serializes them, as few boxes.

A tree has 16 levels around the origin of the map; a leaf may be at any of them. The child with the
number i of a node is on the positive side of x, y and z where bit 0, 1 and 2 of i are set.

The binary stream has two bytes for each inner node, two bits for each child from the least
significant ones on: 0 unknown, 1 free, 2 occupied, 3 an inner node. Inner children follow in
their order, each with all below it. The full stream has for each node its log-odds of being
occupied, a float32 in little-endian order, in coloured trees three bytes of colour, and one byte
with a bit for each child that there is; these follow in the same way.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from itertools import permutations
import math
import struct

import numpy as np
from numpy.typing import NDArray

from ..arrays import frozen
from ..exceptions import SceneError
from ..pose import ORIGIN, Pose
from .shapes import Box, PlacedShape

OCTOMAP_NAME = '<octomap>'
"""Name of the octomap among the objects of a scene, as in MoveIt."""

VALUES = {'OcTree': struct.Struct('<f'), 'ColorOcTree': struct.Struct('<f3x')}
"""What each node has in the full stream, by class of the tree."""

ROOT_SIZE = 1 << 16
"""Edge of the whole tree, in its smallest cells."""

MAX_BOXES = 1_000
"""How many boxes a map may have. pinocchio copies its table of pairs for each shape that is added
to a scene: 1,000 boxes take single copies of 4 MB, beside a control cycle."""

MAX_RUNS = 500_000
"""Rows of smallest cells into which leaves are cut so that they join across their borders."""

MAX_DATA = 2_000_000
"""Bytes of a stream at most; a million nodes take about a second."""

OCCUPIED, INNER = 2, 3
"""States of a child in the binary stream."""

Cubes = NDArray[np.int64]
"""Least corner x, y, z and edge of cubes, in smallest cells (n, 4)."""
Spans = NDArray[np.int64]
"""Least and greatest corners of boxes, in smallest cells (n, 2, 3)."""


@lru_cache(maxsize=4)
def octomap_boxes(
    kind: str, data: bytes, resolution: float, *, binary: bool
) -> tuple[PlacedShape, ...]:
    """Return what is occupied in a map, as few boxes that do not overlap, in its frame.

    Args:
        kind: Class of the tree.
        data: The stream.
        resolution: Edge of its smallest cells in [m].
        binary: Whether it is the binary stream, else the full one.

    Raises:
        SceneError: The kind is unknown, the stream is none, or the map is too fine.
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
    cubes: Cubes = np.array(list(leaves), dtype=np.int64).reshape(-1, 4)
    spans = merged(cubes)
    if len(spans) > MAX_BOXES:
        raise SceneError(
            f'octomap: {len(spans)} boxes are left when its cells are joined, {MAX_BOXES} are'
            ' looked at; send a coarser map, or what is in reach'
        )
    return tuple(_placed(span, resolution) for span in spans)


def merged(cubes: Cubes) -> Spans:
    """Return boxes that fill the same space as cubes which do not overlap; few of them.

    Rows of cells become rectangles, these become boxes; the order of the axes that gives the
    fewest counts.

    Args:
        cubes: The cubes.
    """
    if not len(cubes):
        return np.empty((0, 2, 3), dtype=np.int64)
    found = (_joined(_rows(cubes, order[0]), order) for order in permutations(range(3)))
    return min(found, key=len)


def _rows(cubes: Cubes, axis: int) -> Spans:
    """Cut cubes into rows of smallest cells along an axis, where these are not too many."""
    corner, edge = cubes[:, :3], cubes[:, 3]
    if int((edge * edge).sum()) > MAX_RUNS:
        return np.stack([corner, corner + edge[:, None]], axis=1)
    counts = edge * edge
    owner = np.repeat(np.arange(len(cubes)), counts)
    number = np.arange(len(owner)) - np.repeat(np.cumsum(counts) - counts, counts)
    lower = corner[owner].copy()
    first, second = (each for each in range(3) if each != axis)
    lower[:, first] += number // edge[owner]
    lower[:, second] += number % edge[owner]
    upper = lower + 1
    upper[:, axis] = lower[:, axis] + edge[owner]
    return np.stack([lower, upper], axis=1)


def _joined(spans: Spans, order: tuple[int, ...]) -> Spans:
    """Join boxes that touch with a whole face, along one axis after the other."""
    for axis in order:
        others = [each for each in range(3) if each != axis]
        across = spans[:, :, others].reshape(len(spans), 4)
        along = np.lexsort((spans[:, 0, axis], *across.T))
        spans, across = spans[along], across[along]
        goes_on = (across[1:] == across[:-1]).all(axis=1)
        goes_on &= spans[1:, 0, axis] == spans[:-1, 1, axis]
        starts = np.flatnonzero(np.concatenate([[True], ~goes_on]))
        ends = np.append(starts[1:], len(spans)) - 1
        upper = spans[ends, 1, axis]
        spans = spans[starts]
        spans[:, 1, axis] = upper
    return spans


def _placed(span: Spans, resolution: float) -> PlacedShape:
    lower, upper = (span - ROOT_SIZE // 2) * resolution
    return PlacedShape(
        Box(*(upper - lower).tolist()), Pose(ORIGIN.rotation, frozen(0.5 * (lower + upper)))
    )


def _child(x: int, y: int, z: int, edge: int, number: int) -> tuple[int, int, int, int]:
    """Return corner and edge of a child, by those of its parent."""
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
