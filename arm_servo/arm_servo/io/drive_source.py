# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The motion core as a motion source of arm_canopen: stepped in the CANopen cycle."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Future
import math
from typing import TYPE_CHECKING

import numpy as np

from arm_model import frozen, RobotState

from ..controllers.controller import Source
from ..core.gateway import CommandGateway
from .drive_reasons import (
    before_first_command,
    COMMAND,
    taken_away,
    too_fast,
    what_happened,
    why_not,
)

if TYPE_CHECKING:
    from arm_canopen import AxisFeedback, MotionSource, Refusal, Setpoint


NOT_ATTACHED = f'was not attached yet; {COMMAND}'


class DriveSource:
    """Commands the drives of an arm; a :class:`arm_canopen.MotionSource`.

    It follows while every drive can. When one drops out, the others stop on the path, and a
    trajectory ends with the drive named. Afterwards it takes the arm over where the drives'
    set-points are: at once when no drive was taken away, else when it is attached again.
    """

    def __init__(self, gateway: CommandGateway) -> None:
        """Wait for the drives.

        Args:
            gateway: Commands to the core; it is stepped here only.
        """
        from arm_canopen import Setpoint

        self._make: type[Setpoint] = Setpoint
        self._gateway = gateway
        self._axes = list(gateway.model.joints)
        self._released: dict[str, Refusal | str] = dict.fromkeys(self._axes, NOT_ATTACHED)
        self._left: set[str] = set()  # drives that dropped out since all of them followed
        self._has_moved = False  # on behalf of anybody

    @property
    def axes(self) -> Sequence[str]:
        """Names of the drives, which are those of the joints."""
        return self._axes

    @property
    def detached(self) -> bool:
        """Whether a drive was taken away, so that it has to be attached again; any thread."""
        return bool(self._released)

    def attach(self, attach: Callable[[MotionSource], Future[None]]) -> None:
        """Get back the drives that were taken away; any thread, and it waits for nothing.

        Args:
            attach: What attaches a source to the bus before the next cycle. When that fails, the
                drives are away as before, and the next command tries again.
        """
        before = self._released
        self._released = {}  # before, so that a drive which is taken away right after is known

        def finish(future: Future[None]) -> None:
            if future.cancelled() or future.exception() is not None:
                self._released = {**before, **self._released}

        attach(self).add_done_callback(finish)

    def released(self, axis: str, refusal: Refusal) -> None:
        """Come to rest, and leave the drives alone until attached again.

        What was requested before is refused, also where it would get the drive back.
        """
        reason = refusal if self._has_moved else before_first_command(refusal)
        self._released = {axis: reason, **self._released}
        self._gateway.interrupt(taken_away(axis, refusal))

    def update(
        self, now: float, period: float, feedback: Sequence[AxisFeedback]
    ) -> Sequence[Setpoint | None]:
        """Answer the set-points of a cycle.

        Returns:
            Position in [rad] and velocity in [rad/s] of each drive that follows.
        """
        try:
            return self._update(now, period, feedback)
        except Exception as error:  # the bus detaches it then
            what = f'{type(error).__name__}: {error}'
            reason = f'was let go, because the motion core raised {what}; {COMMAND}'
            self._released = dict.fromkeys(self._axes, reason)
            self._gateway.abandon(now, reason)
            raise

    def _update(
        self, now: float, period: float, feedback: Sequence[AxisFeedback]
    ) -> Sequence[Setpoint | None]:
        gateway = self._gateway
        blocked = why_not(feedback, self._released)
        if not gateway.is_following:
            blocked = blocked or too_fast(feedback, gateway.model.limits.velocity)
            self._left.clear()
        elif blocked:
            self._left.update(axis.name for axis in feedback if not axis.followable)
        point = gateway.update(
            now,
            period,
            measured_state(feedback),
            None if gateway.is_following else frozen([axis.setpoint for axis in feedback]),
            blocked,
            explain=lambda: what_happened(feedback, self._released),
            is_gone=len(self._left) == len(feedback),
            ages=frozen([axis.age for axis in feedback]),
        )
        if point is None:
            return [None] * len(feedback)
        self._has_moved |= point.source is not Source.NONE
        rows = zip(
            point.state.position.tolist(), point.state.velocity.tolist(), feedback, strict=True
        )
        return [
            None if axis.name in self._left else self._make(position, velocity)
            for position, velocity, axis in rows
        ]


def measured_state(feedback: Sequence[AxisFeedback]) -> RobotState | None:
    """Return what the drives measure; None while one of them has sent nothing yet."""
    positions = [axis.position for axis in feedback]
    if not math.isfinite(sum(positions)):
        return None
    velocities = [axis.velocity for axis in feedback]
    return RobotState(frozen(positions), frozen(velocities), np.zeros(len(feedback)))
