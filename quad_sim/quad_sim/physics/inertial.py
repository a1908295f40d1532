# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The IMU of the robot in physics: an ideal chip with a low-pass behind its accelerometer."""

from __future__ import annotations

import math
from typing import Final

import mujoco
import numpy as np

from quad_description.rotations import roll_pitch_yaw, Vector

from ..plant.state import Array, Imu
from .model import ACCELEROMETER, GYRO, IMU

BANDWIDTH: Final = 20.0  # [Hz] of the accelerometer's low-pass, as IMU chips have one


def base_rotation(data: mujoco.MjData) -> Array:
    """Return the rotation of base_link to the world, of the positions as they are now."""
    return _matrix(data.qpos[3:7])


def vector(array: Array) -> Vector:
    """Return three numbers of an array."""
    x, y, z = array.tolist()
    return x, y, z


class InertialUnit:
    """What imu_link feels. :meth:`sample` goes with every step of the physics."""

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData) -> None:
        """Fix the unit to the robot.

        Args:
            model: With the sensors of :func:`~.model.build_model`.
            data: What it feels; its arrays stay where they are.
        """
        self._data = data
        self._accelerometer = _readings(model, data, ACCELEROMETER)
        self._gyro = _readings(model, data, GYRO)
        self._imu_to_base = _matrix(model.body(IMU).quat)
        self._gravity = np.array([0.0, 0.0, -model.opt.gravity[2]])
        self._share = 1.0 - math.exp(-2.0 * math.pi * BANDWIDTH * model.opt.timestep)
        self._force: Array = np.zeros(3)
        self._change: Array = np.zeros(3)
        self.rest()

    def rest(self) -> None:
        """Be at rest: a low-pass that begins at zero would report a fall."""
        self._force = self._rotation().T @ self._gravity

    def sample(self) -> None:
        """Filter what the accelerometer measures now."""
        # in place: this is done 500 times a second of the simulation
        change = self._change
        np.subtract(self._accelerometer, self._force, out=change)
        change *= self._share
        self._force += change

    def read(self) -> Imu:
        """Return what the unit measures; its attitude is that of imu_link in the world."""
        quaternion = np.empty(4)
        mujoco.mju_mat2Quat(quaternion, self._rotation().ravel())
        w, x, y, z = quaternion.tolist()
        return Imu(vector(self._force), vector(self._gyro), roll_pitch_yaw((x, y, z, w)))

    def _rotation(self) -> Array:
        rotation: Array = base_rotation(self._data) @ self._imu_to_base
        return rotation


def _readings(model: mujoco.MjModel, data: mujoco.MjData, name: str) -> Array:
    """Return a view of what a sensor measures."""
    sensor = model.sensor(name)
    start = int(sensor.adr[0])
    view: Array = data.sensordata[start : start + int(sensor.dim[0])]
    return view


def _matrix(quaternion: Array) -> Array:
    """Return the rotation matrix of a quaternion (w, x, y, z)."""
    matrix = np.empty(9)
    mujoco.mju_quat2Mat(matrix, quaternion)
    return matrix.reshape(3, 3)
