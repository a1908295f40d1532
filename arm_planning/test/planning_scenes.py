# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Scenes and independent checks for the tests of planners."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

import arm_model as am
from arm_planning import OrientationConstraint, PathConstraints, PositionConstraint
from arm_trajectory import Path

DENSE = 1e-3  # motion of a joint from one look of the independent sampler to the next in [rad]
RATE_TOLERANCE = 1e-6  # share by which a limit may be exceeded, for rounding


def with_box(
    scene: am.PlanningScene, name: str, size: tuple[float, float, float], at: tuple[float, ...]
) -> am.PlanningScene:
    """Return a scene with a box."""
    place = am.Pose(am.ORIGIN.rotation, am.frozen(at))
    return scene.with_object(am.CollisionObject(name, am.Box(*size), pose=place))


def with_random_boxes(model: am.RobotModel, count: int, seed: int) -> am.PlanningScene:
    """Return the scene of an arm with boxes about it."""
    scene, size = model.scene, max(model.reach, 1.0)
    draw = np.random.default_rng(seed)
    for number in range(count):
        radius, angle = draw.uniform(0.35, 0.8), draw.uniform(-np.pi, np.pi)
        height = draw.uniform(0.05, 0.9)
        at = (size * radius * np.cos(angle), size * radius * np.sin(angle), size * height)
        x, y, z = (size * draw.uniform(0.05, 0.25, 3)).tolist()
        scene = with_box(scene, f'box_{number}', (x, y, z), at)
    return scene


def near(pose: am.Pose, shape: am.Box | am.Sphere, turn: am.Array) -> PathConstraints:
    """Return what holds where the tip is in a shape about a pose, and turned by angles at most."""
    region = am.PlacedShape(shape, am.Pose(am.ORIGIN.rotation, pose.position))
    return PathConstraints(
        orientations=[OrientationConstraint('', pose.rotation, turn)],
        positions=[PositionConstraint('', am.ORIGIN.position, [region])],
    )


def holds(
    shape: am.Box | am.Sphere | am.Cylinder | am.Cone, point: am.Array, margin: float
) -> bool:
    """Return whether a shape holds a point, or nearly; a cone has its tip above its middle."""
    x, y, z = point
    aside = np.hypot(x, y)
    match shape:
        case am.Box():
            inside = np.abs(point) <= 0.5 * np.array([shape.x, shape.y, shape.z]) + margin
            return bool(inside.all())
        case am.Sphere():
            return bool(np.hypot(aside, z) <= shape.radius + margin)
        case am.Cylinder():
            return bool(aside <= shape.radius + margin and abs(z) <= 0.5 * shape.length + margin)
        case am.Cone():
            half = 0.5 * shape.length
            radius = shape.radius * (half - z) / shape.length
            return bool(aside <= radius + margin and abs(z) <= half + margin)


def dense_times(path: Path) -> am.Array:
    """Return times between which no joint moves by more than :data:`DENSE`."""
    coarse = np.linspace(0.0, path.duration, 2000)
    turned = np.abs(np.diff(path.positions(coarse), axis=0)).max(axis=1)
    along = np.concatenate(((0.0,), np.cumsum(turned)))
    count = int(np.ceil(along[-1] / DENSE)) + 1
    times: am.Array = np.interp(np.linspace(0.0, along[-1], count + 1), along, coarse)
    return times


def distances(scene: am.PlanningScene, places: am.Array) -> am.Array:
    """Return the distance of each pair at each place in [m] (m, k).

    All are measured anew by pinocchio and coal: neither what was known of a place before, nor how
    far a joint moves a shape counts.
    """
    kinematics, geometry = scene.kinematics, scene.geometry
    data, results = kinematics.native.createData(), geometry.createData()
    found = []
    for place in np.atleast_2d(places):
        full = kinematics.expanded(place)
        pin.computeDistances(kinematics.native, data, geometry, results, full)
        found.append([each.min_distance for each in results.distanceResults])
    return np.array(found)


def deepest_overlap(path: Path, scene: am.PlanningScene) -> float:
    """Return the least distance of any pair at the places of the independent sampler in [m]."""
    return float(distances(scene, path.positions(dense_times(path))).min(initial=np.inf))


def broken_limits(
    path: Path, limits: am.JointLimits, tolerance: float = RATE_TOLERANCE
) -> list[str]:
    """Return what exceeds a limit on a path, looked at from its values alone.

    Args:
        tolerance: Share by which a rate may exceed its limit.
    """
    segments = np.repeat(np.arange(len(path.durations)), 200)
    shares = np.tile(np.linspace(0.0, 1.0, 200), len(path.durations))
    offsets = shares * path.durations[segments]
    positions = path.derived(0, segments, offsets)
    broken = []
    if (positions < limits.lower - 1e-6).any() or (positions > limits.upper + 1e-6).any():
        broken.append('position')
    for order, name in enumerate(('velocity', 'acceleration', 'jerk'), start=1):
        most = np.abs(path.derived(order, segments, offsets)).max(axis=0)
        if (most > getattr(limits, name) * (1.0 + tolerance)).any():
            broken.append(name)
    return broken
