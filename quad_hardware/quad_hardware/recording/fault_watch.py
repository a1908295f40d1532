# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""When something begins to be wrong with a robot or its line: what a black box is written for."""

from __future__ import annotations

import math

from quad_description import MAX_TILT, RobotState

from ..estimation import BoardWatch
from ..estimation.plausibility import Confirmed, FAULT_TEXTS
from ..link import LinkState
from ..protocol import Fault
from ..report import Report

UPRIGHT = 0.8 * MAX_TILT  # [rad] below which a body that fell stands again
_LOST = {LinkState.STALE, LinkState.REFUSED, LinkState.FAILED}
_FOUND = {LinkState.WAITING, LinkState.RUNNING}


class FaultWatch:
    """Finds what begins to be wrong from one report to the next."""

    def __init__(self) -> None:
        self._boards = BoardWatch()
        self._bits = Confirmed[Fault]()
        self._imu_problem = ''
        self._fallen = False

    def check(self, report: Report, state: RobotState) -> list[str]:
        """Return what has begun, in words; empty as a rule."""
        begun: list[str] = []
        # without its clock a restart is a silence, which is a fault already
        if self._boards.restarted(report) and report.device_time is not None:
            begun.append('the board has begun anew; is the battery empty, or a plug loose?')
        before = self._bits.problems
        new = self._bits.take({bit for bit in Fault if bit & report.faults}) - before
        begun += [f'the robot reports {FAULT_TEXTS[bit]}' for bit in Fault if bit in new]
        if state.imu_problem and not self._imu_problem:
            begun.append(state.imu_problem)
        self._imu_problem = state.imu_problem
        if state.imu is not None:
            tilt = state.imu.tilt
            if tilt > MAX_TILT and not self._fallen:
                begun.append(f'the robot fell: its body is tilted by {math.degrees(tilt):.0f} deg')
            self._fallen = tilt > (UPRIGHT if self._fallen else MAX_TILT)
        return begun


class LossWatch:
    """Distinguishes the loss of a robot that was there from the search for one."""

    def __init__(self) -> None:
        self._found = False

    def is_lost(self, state: LinkState) -> bool:
        """Note the state that a link has entered; return whether that is a fault."""
        was_found = self._found
        if state in _FOUND or state in {LinkState.CONNECTING, LinkState.STOPPED}:
            self._found = state in _FOUND
        return state in _LOST or (was_found and state is LinkState.CONNECTING)
