# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The servos: their ids, their order on the wire and the joints that they move.

An id is ``10 * leg + joint``: legs count 1 left front, 2 right front, 3 right rear, 4 left rear;
joints 1 calf, 2 thigh, 3 hip, which is the reverse of the order in a URDF. 51 is the gripper, 52
to 54 are the arm from the elbow to its yaw. Sources: the vendor's Luwu-OS (robot_tools), its
Python library and the limits in its micro:bit library.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from .schema import Model, Span

LEG_MOTORS = (11, 12, 13, 21, 22, 23, 31, 32, 33, 41, 42, 43)
ARM_MOTORS = (51, 52, 53, 54)
MOTOR_ORDER = LEG_MOTORS + ARM_MOTORS  # slots of the feedback frame
BULK_READ_ORDER = MOTOR_ORDER[:15]  # what reading 15 bytes at 0x50 answers (v1)

_SLOT = {motor: slot for slot, motor in enumerate(MOTOR_ORDER)}

MOTOR_OF_JOINT: Mapping[str, int] = MappingProxyType(
    {
        f'{leg}_{joint}_joint': 10 * number + digit
        for leg, number in (('fl', 1), ('fr', 2), ('bl', 4), ('br', 3))
        for joint, digit in (('hip', 3), ('thigh', 2), ('calf', 1))
    }
    | {'arm_yaw_joint': 54, 'arm_thigh_joint': 53, 'arm_calf_joint': 52, 'hand_right_joint': 51}
)

_HIP, _CLAW = Span(-30, 30), Span(-65, 65)


def _angles(calf: Span, thigh: Span, hip: Span, arm: Mapping[int, Span]) -> dict[int, Span]:
    legs = {motor: (calf, thigh, hip)[motor % 10 - 1] for motor in LEG_MOTORS}
    return legs | {51: _CLAW} | dict(arm)


# What the byte of a servo angle spreads over [deg] (quad.md 1.3); 54 moves on mini2SW and mini3W.
ANGLE_SPANS: Mapping[Model, Mapping[int, Span]] = MappingProxyType(
    {
        Model.MINI: _angles(
            Span(-73, 57),
            Span(-66, 93),
            Span(-31, 31),
            {52: Span(-85, 50), 53: Span(-75, 90), 54: Span(-175, 175)},
        ),
        Model.LITE: _angles(
            Span(-70, 50),
            Span(-70, 90),
            _HIP,
            {52: Span(-115, 70), 53: Span(-85, 100), 54: Span(-175, 175)},
        ),
        Model.WHEELED: _angles(
            Span(-70, 50),
            Span(-70, 90),
            _HIP,
            {52: Span(-50, 83), 53: Span(-90, 90), 54: Span(-175, 175)},
        ),
    }
)


def slot_of(motor: int) -> int:
    """Return where a motor stands in :data:`MOTOR_ORDER`.

    Raises:
        ValueError: There is no such motor; the message names those that there are.
    """
    try:
        return _SLOT[motor]
    except KeyError:
        known = ', '.join(map(str, MOTOR_ORDER))
        raise ValueError(f'no motor has id {motor}; there are {known}') from None
