# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Action goals that are motions of an arm: every goal becomes a command, and ends with a reason.

rclpy runs a goal in a callback or coroutine, which would keep the executor from everything else;
here timers watch the commands. A goal that cannot be carried out is accepted and aborted at once,
since a rejection could carry neither code nor reason.

What is refused of topics is remembered: for the status as long as it is fresh, for the log once.
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

START_TIMEOUT = 5.0  # time in which a goal must be planned and taken by the cycle in [s]
REST_TIMEOUT = 10.0  # time after which a goal is answered although no rest was seen in [s]


@dataclass(slots=True, eq=False)
class MotionGoal(ServedGoal):
    """A goal from its request to its end."""

    number: int  # its place among all commands and stops
    command: MotionCommand | None = None  # None for a goal that is refused at once
    begin: float = field(default_factory=time.monotonic)
    outcome: Outcome | None = None  # how it ended; None while it goes on
    rest_by: float = math.inf  # steady time at which it is answered although the arm moves
    unrest: str = ''  # says in the answer that no rest was seen; empty where it was


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
        # requests the motion of a goal with its number; raises an ArmError where it is refused
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
        """Return how the motion of a goal ended; None while it goes on.

        Args:
            goal: A goal whose motion was requested.
            timeout: Time in which the cycle must begin with it in [s]; it is canceled then.
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
        """Return whether a goal that is ending can be answered.

        The arm has come to rest for it, others move the arm, or ``REST_TIMEOUT`` is over, which
        the answer says.
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
"""Time without a refusal after which one that was logged is logged again in [s]."""

NUMBER_PATTERN = re.compile(r'(?<![\w.])\d+(\.\d+)?')
"""What differs from message to message of one stream, such as the age of its stamps."""


class LoggedReasons:
    """Which reasons of one stream are in the log already."""

    def __init__(self, period: float = REPEAT_PERIOD) -> None:
        """Log one again that has not come for a period in [s]."""
        self._logged, self._period = ('', -math.inf), period

    def is_new(self, reason: str, now: float) -> bool:
        """Return whether a reason is to be logged; one that differs in numbers only is not."""
        kind, (logged, seen) = NUMBER_PATTERN.sub('', reason), self._logged
        self._logged = (kind, now)
        return kind != logged or now - seen >= self._period


class Refusals:
    """Remembers the last refusal; any thread may note one, a single thread reports."""

    def __init__(self) -> None:
        self._last = ('', -math.inf)
        self._logged = LoggedReasons()

    def note(self, reason: str, now: float) -> None:
        """Note why a command was refused."""
        self._last = (reason, now)

    def clear(self, sent: float) -> None:
        """Note that a command of a time in [s] was taken: a refusal since then stands."""
        if self._last[1] <= sent:
            self._last = ('', -math.inf)

    def fresh(self, now: float) -> str:
        """Return the refusal for the status; empty when there is none."""
        reason, since = self._last
        return reason if now - since <= STATUS_PERIOD else ''

    def to_log(self, now: float) -> str:
        """Return the refusal if it is not in the log; one that differs in numbers only is."""
        reason = self.fresh(now)
        return reason if reason and self._logged.is_new(reason, now) else ''
