# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The state frame of protocol v2 as a value, both ways."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

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
        values = {'euler1': self.raw_attitude, 'euler2': self.attitude}
        values |= {
            part.name: getattr(self, part.name) for part in STATE.fields if part.name not in values
        }
        runs = {name: v if isinstance(v, tuple) else (v,) for name, v in values.items()}
        return Frame(Kind.PUSH, STATE.address, STATE.pack(**runs))


def decode_feedback(payload: bytes) -> Feedback:
    """Decode the payload of a state frame.

    What a dead IMU reports, or the slot of a motor that is not fitted, may be no finite number.

    Raises:
        CodecError: The payload has another length.
    """
    runs: dict[str, Any] = STATE.unpack(payload)
    raw_attitude, attitude = runs.pop('euler1'), runs.pop('euler2')
    values = {name: run if len(run) > 1 else run[0] for name, run in runs.items()}
    return Feedback(raw_attitude=raw_attitude, attitude=attitude, **values)
