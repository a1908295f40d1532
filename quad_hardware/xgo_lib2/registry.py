# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Functions by main and sub code, and motors by feedback slot."""

from __future__ import annotations

from collections.abc import Mapping

from quad_hardware.protocol import Function, MOTOR_ORDER, slot_of, V2

MOTOR_IDS = MOTOR_ORDER

FUNCTIONS: Mapping[tuple[int, int], Function] = {
    divmod(address, 256): function for address, function in V2.functions.items()
}


def feedback_slot_of(motor_id: int) -> int:
    """Return the index of a motor in ``joint_pos_deg`` and ``joint_vel_deg_s``.

    Args:
        motor_id: Ten times the leg (1 left front, 2 right front, 3 right rear, 4 left rear) plus
            the joint (1 calf, 2 thigh, 3 hip), or 51 to 54 for gripper and arm.

    Raises:
        ValueError: The motor is unknown.
    """
    return slot_of(motor_id)
