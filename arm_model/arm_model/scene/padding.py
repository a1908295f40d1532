# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Shapes that are scaled and padded, as MoveIt's link_scale and link_padding do."""

from __future__ import annotations

import numpy as np

from ..arrays import Array
from ..exceptions import SceneError
from .shapes import Box, Capsule, Mesh, Plane, Shape, Sphere


def padded(shape: Shape, padding: float, scale: float = 1.0) -> Shape:
    """Return a shape that is scaled about its middle, and then thicker on every side.

    Args:
        shape: The shape.
        padding: How much thicker on each side in [m].
        scale: Factor of its lengths; a plane has none.

    Raises:
        SceneError: The padding is negative, the scale is not positive, or one is not finite.
    """
    if not (0.0 <= padding < np.inf and 0.0 < scale < np.inf):
        raise SceneError(
            f'padding {padding:g} m and scale {scale:g}: the padding must be 0 or more, the scale'
            ' positive, both finite'
        )
    match shape:
        case Box(x, y, z):
            return Box(*(scale * edge + 2.0 * padding for edge in (x, y, z)))
        case Sphere(radius):
            return Sphere(scale * radius + padding)
        case Capsule(radius, length):
            return Capsule(scale * radius + padding, scale * length)
        case Plane(normal, offset):
            return Plane(normal, offset + padding)
        case Mesh():
            return Mesh(_outward(shape.points, padding, scale))
        case _:  # a cylinder or a cone
            return type(shape)(scale * shape.radius + padding, scale * shape.length + 2 * padding)


def _outward(points: Array, padding: float, scale: float) -> Array:
    """Return corners that are moved away from their middle."""
    middle = points.mean(axis=0)
    arms = points - middle
    lengths = np.linalg.norm(arms, axis=1, keepdims=True)
    moved: Array = middle + arms * (scale + padding / lengths)
    return moved
