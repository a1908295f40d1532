# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""How the motion core behaves."""

from __future__ import annotations

from dataclasses import dataclass, field

from ..controllers.jog import ServoSettings
from ..controllers.trajectory import ExecutionSettings


@dataclass(frozen=True, slots=True)
class CoreSettings:
    """How the core behaves."""

    servo: ServoSettings = field(default_factory=ServoSettings)  # how jogging behaves
    # how trajectories are followed
    execution: ExecutionSettings = field(default_factory=ExecutionSettings)
    # least distance between links that a jog and its stop may bring about in [m]; None is any
    clearance: float | None = 0.005
    # whether a trajectory or a single target is refused on whose way links meet
    check_self_collision: bool = True
