# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What the motion core does, for any thread."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from arm_model import Array, RobotState

from ..controllers.controller import SetPoint, Source
from ..controllers.trajectory import Execution

MAX_CYCLE_AGE = 0.25
"""Age of a cycle at which the cycle stands still: commands are refused, as they would surprise."""


@dataclass(frozen=True, slots=True, eq=False)
class Snapshot:
    """What the core did in a cycle."""

    time: float  # steady time of the cycle in [s]
    set_point: SetPoint | None  # what was commanded; None while the arm does not follow
    measured: RobotState | None  # what was measured; None before the first feedback
    blocked: str  # why the arm does not follow, with the remedy; empty while it does
    source: Source = Source.NONE  # what moves it
    paused: bool = False  # whether it is paused
    speed: float = 1.0  # speed override, 0 to 1
    cycles: int = 0  # cycles so far in which the arm followed
    period: float = 0.01  # period of the cycle in [s]
    # the trajectory that was followed last; None before the first
    execution: Execution | None = None
    # how old the measured values of each joint were in the cycle in [s]; None where they are as
    # old as the cycle
    ages: Array | None = None

    @property
    def speed_scaling(self) -> float:
        """Speed override that counts, 0 to 1: none while it is paused."""
        return 0.0 if self.paused else self.speed

    @property
    def reference(self) -> RobotState | None:
        """Where the arm is to be: where it stands while it does not follow; None while unknown."""
        if self.set_point is not None:
            return self.set_point.state
        if self.measured is None or not np.isfinite(self.measured.position).all():
            return None
        return RobotState.at_rest(self.measured.position)

    def stale(self, age: float) -> str:
        """Return that the cycle does not run; empty when it does."""
        if age <= MAX_CYCLE_AGE:
            return ''
        begun = f'{age:.1f} s ago' if self.time else 'never'
        return f'the cycle does not run (the last was {begun}); is the bus up?'
