# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""How a robot is put on the ground at the start."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import mujoco
import numpy as np

from quad_description import Pose, pose_positions
from quad_description.rotations import multiply, Quaternion

from ..exceptions import SetupError
from ..plant.state import Array
from ..plant.terrain import Terrain
from .model import BUMPS, FLOOR

_FAR = 10.0  # [m] farther than any part of a robot is from the floor at the start


def start_positions(joints: Sequence[str], pose: Mapping[str, float]) -> Array:
    """Return where the joints are at the start.

    Args:
        pose: Positions of some [rad]; the others stand.

    Raises:
        SetupError: The pose names joints that the robot lacks.
    """
    unknown = sorted(pose.keys() - set(joints))
    if unknown:
        raise SetupError(f'the start pose names {", ".join(unknown)}, which the robot lacks')
    stand = pose_positions(Pose.STAND, arm=True)
    return np.array([pose.get(name, stand.get(name, 0.0)) for name in joints])


def place(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    terrain: Terrain,
    orientation: Quaternion,
    drop: float,
) -> None:
    """Put the robot on the ground with the joint positions that it has.

    Joints that mimic others go where those are; the base turns as the ground does and comes down
    until the robot's lowest point touches it.

    Args:
        data: Its state; changed in place.
        drop: How far the lowest point is above the ground [m].
    """
    _follow_mimics(model, data)
    normal = np.array(terrain.normal)
    data.qpos[:3] = normal
    data.qpos[3:7] = np.roll(multiply(terrain.orientation, orientation), 1)  # w first in MuJoCo
    mujoco.mj_kinematics(model, data)
    floor, points = model.geom(FLOOR).id, np.empty(6)
    gap = min(
        mujoco.mj_geomDistance(model, data, geom, floor, _FAR, points)
        for geom in range(model.ngeom)
        if model.geom(geom).name not in {FLOOR, BUMPS}  # there are no bumps at the start
    )
    data.qpos[:3] -= (gap - drop) * normal


def _follow_mimics(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    for index in range(model.neq):
        if model.eq_type[index] == mujoco.mjtEq.mjEQ_JOINT:
            follower, leader = (
                model.jnt_qposadr[joint]
                for joint in (model.eq_obj1id[index], model.eq_obj2id[index])
            )
            offset, multiplier = model.eq_data[index][:2]
            data.qpos[follower] = offset + multiplier * data.qpos[leader]
