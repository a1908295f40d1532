# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Shapes that are scaled and padded, as MoveIt's link_scale and link_padding do."""

from __future__ import annotations

from dataclasses import astuple
from functools import lru_cache

from ..arrays import Native
from ..exceptions import SceneError
from .shapes import Cells, Mesh, native, Plane, Shape


@lru_cache(maxsize=1024)
def padded(shape: Shape, padding: float, scale: float = 1.0) -> Native:
    """Return a shape of coal that is scaled about its middle, then padded in every direction.

    Args:
        padding: How far it reaches beyond its surface in [m].
        scale: Factor of its lengths; a plane has none.

    Raises:
        SceneError: The shape is not usable.
    """
    solid = native(_scaled(shape, scale))
    solid.setSweptSphereRadius(padding)
    solid.computeLocalAABB()
    return solid


def check_padding(link: str, padding: float, scale: float) -> None:
    """Refuse a padding that is negative, a scale that is not positive, and what is not finite."""
    if not (0.0 <= padding < float('inf') and 0.0 < scale < float('inf')):
        raise SceneError(
            f'{link}: padding {padding:g} m and scale {scale:g}: the padding must be 0 or more,'
            ' the scale positive, both finite'
        )


def _scaled(shape: Shape, scale: float) -> Shape:
    if isinstance(shape, Mesh):  # a hull of its own, also where the scale is 1
        middle = shape.points.mean(axis=0)
        return Mesh(middle + scale * (shape.points - middle))
    if isinstance(shape, Plane | Cells):  # which links do not have
        return shape
    return type(shape)(*(scale * length for length in astuple(shape)))
