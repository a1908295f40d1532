# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The state frame of protocol v2 as a value, both ways."""

from __future__ import annotations

from dataclasses import dataclass

from .frame import Frame
from .function_table import SLOTS, STATE
from .schema import Kind

Vector = tuple[float, float, float]
Slots = tuple[float, ...]

NO_VALUES: Slots = (0.0,) * SLOTS


@dataclass(frozen=True, slots=True)
class Feedback:
    """State of a robot at one moment, in the units of the wire."""

    battery: int = 100  # charge [%]
    mode: int = 0  # mode of the board
    faults: int = 0  # bits of :class:`~.function_table.Fault`
    device_time: int = 0  # clock of the board [ms], wraps at 2³²
    attitude: Vector = (0.0, 0.0, 0.0)  # fused roll, pitch, yaw (fixed axes x, y, z) [deg]
    raw_attitude: Vector = (0.0, 0.0, 0.0)  # unfused attitude [deg]; not to be used
    acceleration: Vector = (0.0, 0.0, 9.8)  # specific force x, y, z [m/s²]; +9.8 upwards at rest
    position: Slots = NO_VALUES  # angles by slot [deg]
    velocity: Slots = NO_VALUES  # velocities by slot [deg/s]
    load: Slots = NO_VALUES  # loads by slot [%]
    temperature: Slots = NO_VALUES  # temperatures by slot [°C]
    battery_voltage: float = 0.0  # voltage of the battery [V]
    sequence: int = 0  # counts frames modulo 2¹⁶

    def frame(self) -> Frame:
        """Return the frame that a robot pushes.

        Raises:
            CodecError: A value does not fit its field.
        """
        payload = STATE.pack(
            battery=(self.battery,),
            mode=(self.mode,),
            faults=(self.faults,),
            device_time=(self.device_time,),
            euler1=self.raw_attitude,
            euler2=self.attitude,
            acceleration=self.acceleration,
            position=self.position,
            velocity=self.velocity,
            load=self.load,
            temperature=self.temperature,
            battery_voltage=(self.battery_voltage,),
            sequence=(self.sequence,),
        )
        return Frame(Kind.PUSH, STATE.address, payload)


def decode_feedback(payload: bytes) -> Feedback:
    """Decode the payload of a state frame.

    What a dead IMU reports, or the slot of a motor that is not fitted, may be no finite number.

    Raises:
        CodecError: The payload has another length.
    """
    values = STATE.unpack(payload)
    return Feedback(
        battery=int(values['battery'][0]),
        mode=int(values['mode'][0]),
        faults=int(values['faults'][0]),
        device_time=int(values['device_time'][0]),
        attitude=_vector(values['euler2']),
        raw_attitude=_vector(values['euler1']),
        acceleration=_vector(values['acceleration']),
        position=values['position'],
        velocity=values['velocity'],
        load=values['load'],
        temperature=values['temperature'],
        battery_voltage=values['battery_voltage'][0],
        sequence=int(values['sequence'][0]),
    )


def _vector(values: tuple[float, ...]) -> Vector:
    x, y, z = values
    return x, y, z
