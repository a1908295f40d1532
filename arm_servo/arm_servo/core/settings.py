# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""How the motion core behaves."""

from __future__ import annotations

from dataclasses import dataclass, field

from ..jog.servo_source import ServoSettings
from .execution import ExecutionSettings


@dataclass(frozen=True, slots=True)
class CoreSettings:
    """How the core behaves.

    Attributes:
        servo: How jogging behaves.
        execution: How trajectories are followed.
        timeout: Time without a fresh jog command after which the arm comes to rest in [s].
        clearance: Least distance between links that a jog and its stop may bring about in [m];
            None is any.
        check_self_collision: Whether a trajectory or a single target is refused on whose way
            links meet.
    """

    servo: ServoSettings = field(default_factory=ServoSettings)
    execution: ExecutionSettings = field(default_factory=ExecutionSettings)
    timeout: float = 0.1
    clearance: float | None = 0.005
    check_self_collision: bool = True
