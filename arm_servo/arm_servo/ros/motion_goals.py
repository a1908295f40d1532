# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Action goals that move an arm: every goal becomes a command, and its result has a reason.

rclpy runs a goal in a callback or coroutine, which would block the executor; here timers poll the
commands instead. A goal that cannot be executed is accepted and aborted at once, since a rejection
could carry neither code nor reason.

Refused topic commands appear in the status while they are recent, and once in the log.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
import math
import re
import time
from typing import Any, TypeVar

import numpy as np
from rclpy.node import Node

from arm_model import ArmError
from arm_trajectory import GoalCode
from node_runner.action_goals import Ending, GoalServer, ServedGoal

from ..controllers.controller import Outcome, Source
from ..core.gateway import CommandGateway, MotionCommand

START_TIMEOUT = 5.0  # time in which a goal must be planned and started in [s]
REST_TIMEOUT = 10.0  # time after which a result is sent although the arm moves in [s]


@dataclass(slots=True, eq=False)
class MotionGoal(ServedGoal):
    """A goal from its request to its end."""

    number: int  # sequence number among all commands and stops
    command: MotionCommand | None = None  # None for a goal that is refused at once
    begin: float = field(default_factory=time.monotonic)
    outcome: Outcome | None = None  # how it ended; None while it goes on
    rest_by: float = math.inf  # steady time at which the result is sent although the arm moves
    unrest: str = ''  # states in the result that the arm did not rest; empty if it did


GoalT = TypeVar('GoalT', bound=MotionGoal)


class MotionGoals(GoalServer[GoalT]):
    """The goals of one action of one arm."""

    def __init__(
        self,
        node: Node,
        gateway: CommandGateway,
        action: Any,  # noqa: ANN401  # rclpy has no types here
        name: str,
        *,
        accept: Callable[[int], GoalT],  # makes the record of a goal from its number
        # requests the motion of a numbered goal; raises an ArmError if it is refused
        request: Callable[[GoalT], MotionCommand],
        canceled: str,  # reason of an outcome that a client has asked for
        conclude: Callable[[GoalT], tuple[Ending, Any]],
        fail: Callable[[GoalT, Exception], Any],
        rest_speed: float,  # speed above which a joint moves in [rad/s] or [m/s]
    ) -> None:
        self._gateway, self._rest_speed = gateway, rest_speed
        self._request, self._canceled = request, canceled
        super().__init__(
            node,
            action,
            name,
            accept=lambda: accept(gateway.number()),
            start=self._order,
            cancel=self._end_motion,
            conclude=conclude,
            fail=fail,
            refusals=(ArmError,),
            has_stopped=self.has_stopped,
        )

    def outcome(self, goal: GoalT, timeout: float = START_TIMEOUT) -> Outcome | None:
        """Return the outcome of a goal's motion; None while it continues.

        Args:
            goal: A goal whose motion was requested.
            timeout: Time in [s] in which the motion must start; then the goal is canceled.
        """
        command = goal.command
        if command is None:
            return None
        if command.ended.done():
            return command.ended.result()
        if command.motion is not None or time.monotonic() - goal.begin <= timeout:
            return None
        reason = 'the cycle does not run; is the bus up?'
        self._gateway.cancel(command, reason)
        return Outcome(GoalCode.INVALID_GOAL, reason)

    def _order(self, goal: GoalT) -> None:
        goal.command = self._request(goal)

    def has_stopped(self, goal: GoalT) -> bool:
        """Return whether the result of an ended goal can be sent.

        That is when the arm is at rest, something else moves the arm, or ``REST_TIMEOUT`` has
        expired, which the result reports.
        """
        has_ended = goal.command is None or goal.command.ended.done()  # first: a cycle may come
        now, snapshot = time.monotonic(), self._gateway.snapshot
        point, measured = snapshot.set_point, snapshot.measured
        goal.rest_by = min(goal.rest_by, now + REST_TIMEOUT)
        is_braking = point is not None and point.source is Source.NONE and point.state.moving
        if point is None or point.source is Source.NONE:
            speed = 0.0 if measured is None else np.abs(measured.velocity).max()
            is_braking |= bool(speed > self._rest_speed)
        if has_ended and not is_braking:
            return True
        if now > goal.rest_by:
            goal.unrest = f'; it was not seen at rest for {REST_TIMEOUT:g} s and may still move'
        return bool(goal.unrest)

    def _end_motion(self, goal: GoalT) -> None:
        if goal.command is not None:
            self._gateway.cancel(goal.command, self._canceled)


STATUS_PERIOD = 0.5  # how long a refusal stands in the status in [s]

REPEAT_PERIOD = 5.0
"""Time in [s] without a refusal after which the same refusal is logged again."""

NUMBER_PATTERN = re.compile(r'(?<![\w.])\d+(\.\d+)?')
"""Numbers, which differ between messages of one stream, such as the age of a stamp."""


class LoggedReasons:
    """Reasons of one stream that are already in the log."""

    def __init__(self, period: float = REPEAT_PERIOD) -> None:
        """Log a reason again if it has not occurred for ``period`` in [s]."""
        self._logged, self._period = ('', -math.inf), period

    def is_new(self, reason: str, now: float) -> bool:
        """Return whether to log a reason; one that differs only in numbers counts as logged."""
        kind, (logged, seen) = NUMBER_PATTERN.sub('', reason), self._logged
        self._logged = (kind, now)
        return kind != logged or now - seen >= self._period


class Refusals:
    """Stores the last refusal. Any thread may record one; a single thread reports them."""

    def __init__(self) -> None:
        self._last = ('', -math.inf)
        self._logged = LoggedReasons()

    def note(self, reason: str, now: float) -> None:
        """Record why a command was refused."""
        self._last = (reason, now)

    def clear(self, sent: float) -> None:
        """Clear refusals older than an accepted command that was sent at ``sent`` in [s]."""
        if self._last[1] <= sent:
            self._last = ('', -math.inf)

    def fresh(self, now: float) -> str:
        """Return the recent refusal for the status; empty if there is none."""
        reason, since = self._last
        return reason if now - since <= STATUS_PERIOD else ''

    def to_log(self, now: float) -> str:
        """Return the refusal unless it is logged already; differing numbers do not matter."""
        reason = self.fresh(now)
        return reason if reason and self._logged.is_new(reason, now) else ''
