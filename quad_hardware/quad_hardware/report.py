# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What a robot reports, whichever protocol it speaks; in the units of the wire."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from quad_description.rotations import Vector

DEVICE_TIME_WRAP = 2**32 / 1000.0  # [s]


@dataclass(frozen=True, slots=True)
class Report:
    """One report, with angles by motor id in the units of the wire."""

    arrival: float  # when its last byte came, on the monotonic clock [s]
    wire_time: float  # how long its bytes were on the line [s]
    # roll, pitch, yaw of the body about fixed axes x, y, z [deg]; of a dead IMU, anything
    attitude: Vector
    # specific force x, y, z [m/s²]; +9.8 upwards at rest; None where it is not reported
    acceleration: Vector | None
    # servo angles by motor id [deg]; of a motor that is not fitted, anything
    positions: Mapping[int, float]
    # servo velocities by motor id [deg/s], likewise; empty where they are not reported
    velocities: Mapping[int, float]
    # angular velocity x, y, z of the body [deg/s]; None where there is no gyro
    rates: Vector | None = None
    battery: float | None = None  # charge [%]; None while unknown
    voltage: float | None = None  # voltage of the battery [V]; None where it is not reported
    # when it was made, on the clock of the robot [s], which wraps at :data:`DEVICE_TIME_WRAP`;
    # None where it is not reported
    device_time: float | None = None
    faults: int = 0  # fault bits of protocol v2
    # of the servos by motor id [°C]; empty where they are not reported
    temperatures: Mapping[int, float] | None = None
    # of the servos by motor id, share of their stall torque [%]; empty where not reported
    loads: Mapping[int, float] | None = None
    joints_age: float = 0.0  # by how much the angles were measured before the rest [s]
