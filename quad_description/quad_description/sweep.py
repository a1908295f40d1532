# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Motions to look at: every joint through its range, one after the other."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
import math
from typing import Final

from .urdf import Joint

SWEEP_DURATION: Final = 2.5  # [s] for one joint, there and back


def sweep(joints: Sequence[Joint], rest: Mapping[str, float], elapsed: float) -> dict[str, float]:
    """Return the positions at a time of a sweep, which begins anew after the last joint.

    The joint whose turn it is goes from its rest position to its upper limit, to its lower limit
    and back, along a sine each way; the others rest.

    Args:
        joints: The joints, in the order of their turns.
        rest: Their rest positions in [rad] or [m].
        elapsed: Time since the start in [s].

    Returns:
        Positions in [rad] or [m] by name, in the order of the joints.
    """
    positions = {joint.name: rest[joint.name] for joint in joints}
    turn, phase = divmod(elapsed / SWEEP_DURATION, 1.0)
    moving = joints[int(turn) % len(joints)]
    wave = math.sin(2.0 * math.pi * phase)
    here = rest[moving.name]
    amplitude = moving.limits.upper - here if wave > 0.0 else here - moving.limits.lower
    positions[moving.name] = here + amplitude * wave
    return positions
