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
    """One report, with angles by motor id in the units of the wire.

    Attributes:
        arrival: When its last byte came, on the monotonic clock [s].
        wire_time: How long its bytes were on the line [s].
        attitude: Roll, pitch, yaw of the body about fixed axes x, y, z [deg]; of a dead IMU,
            anything.
        acceleration: Specific force x, y, z [m/s²]; +9.8 upwards at rest; None where it is not
            reported.
        positions: Servo angles by motor id [deg]; of a motor that is not fitted, anything.
        velocities: Servo velocities by motor id [deg/s], likewise; empty where they are not
            reported.
        rates: Angular velocity x, y, z of the body [deg/s]; None where there is no gyro.
        battery: Charge [%]; None while unknown.
        voltage: Voltage of the battery [V]; None where it is not reported.
        device_time: When it was made, on the clock of the robot [s], which wraps at
            :data:`DEVICE_TIME_WRAP`; None where it is not reported.
        faults: Fault bits of protocol v2.
        temperatures: Of the servos by motor id [°C]; empty where they are not reported.
        joints_age: By how much the angles were measured before the rest [s].
    """

    arrival: float
    wire_time: float
    attitude: Vector
    acceleration: Vector | None
    positions: Mapping[int, float]
    velocities: Mapping[int, float]
    rates: Vector | None = None
    battery: float | None = None
    voltage: float | None = None
    device_time: float | None = None
    faults: int = 0
    temperatures: Mapping[int, float] | None = None
    joints_age: float = 0.0
