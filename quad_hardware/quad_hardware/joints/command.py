# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What a joint command may do: right length, finite numbers, within limits, no jumps."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
import math

from quad_description import STREAM_TIMEOUT

from ..exceptions import CommandError
from .mapping import JointMap

NOMINAL_PERIOD = 0.02  # [s]
MAX_PERIOD = 0.03  # [s] a pause between two commands does not add up to a jump


@dataclass(frozen=True, slots=True)
class LimiterSettings:
    """How fast targets may move."""

    speed: float = 12.0  # fastest [rad/s]; of the gripper, times its travel in a radian of servo
    # fastest at the beginning of a stream of commands [rad/s]; never above speed
    start_speed: float = 2.0
    start_time: float = 0.5  # after which ``speed`` is reached [s]
    stream_timeout: float = STREAM_TIMEOUT  # a pause that ends a stream [s]


@dataclass(frozen=True, slots=True)
class Command:
    """What is sent for a joint command."""

    targets: tuple[float, ...]  # positions [rad], [m] of the first joints, in their order
    clamped: tuple[str, ...] = ()  # joints that were asked to go beyond their limits
    slowed: tuple[str, ...] = ()  # joints that were asked to move faster than allowed
    # joints that were found beyond their limits and are not back yet
    outside: tuple[str, ...] = ()
    unseen: tuple[str, ...] = ()  # joints that begin to move from an unknown place


class CommandLimiter:
    """Lets commands through so that no servo target jumps.

    A stream of commands begins where the joints are measured to be; it ends with a pause, or
    when :meth:`reset` is called because the robot was lost. A joint that is found beyond its
    limits may stay there or come back: its range reaches to where it is, and shrinks with it. A
    joint that is not measured is taken to be where it was sent last; before that its place is
    unknown, and its servo has to go slowly.
    """

    def __init__(self, joints: JointMap, settings: LimiterSettings | None = None) -> None:
        self.joints = joints  # may be exchanged for the same ones with other limits
        self._settings = settings or LimiterSettings()
        degree = math.pi / 180.0
        self._share = tuple(servo.gain / degree for servo in joints.servos)
        self._targets: list[float] = []
        self._previous: list[float] = []  # targets before the last step
        self._began_at = 0.0
        self._last_at = -math.inf
        self._end = self._seen_end = object()  # replaced by reset(), whichever thread it is in

    @property
    def largest_step(self) -> float:
        """Farthest that a target of a leg joint moves with one command [rad]."""
        return self._settings.speed * MAX_PERIOD

    def reset(self) -> None:
        """End the stream: the next command begins anew, and joints may have been moved.

        Any thread may call it; it counts from the next :meth:`step` on.
        """
        self._end = object()

    def withdraw(self) -> None:
        """Go back to before the last :meth:`step`: its targets were replaced before they left."""
        self._targets = list(self._previous)

    def step(
        self, positions: Sequence[float], measured: Sequence[float | None], now: float
    ) -> Command:
        """Limit a command.

        Args:
            positions: Targets of all joints, or of the legs only, in the order of the URDF [rad],
                [m].
            measured: Where the joints are; None where that is not known, which only joints behind
                the legs may be: what the protocol does not report.

        Raises:
            CommandError: A wrong length, a number that is not finite, or a leg of which nobody
                knows where it is; nothing is to be sent.
        """
        self.check(positions)
        if (end := self._end) is not self._seen_end:
            self._seen_end, self._last_at, self._targets = end, -math.inf, []
        if now - self._last_at > self._settings.stream_timeout:
            self._begin(measured, now)
        self._previous = list(self._targets)
        elapsed = min(max(now - self._last_at, 0.0), MAX_PERIOD)
        self._last_at = now
        return self._approach(positions, self._speed(now) * elapsed)

    def check(self, positions: Sequence[float]) -> None:
        """Refuse what is no command, wherever the joints are.

        Args:
            positions: As in :meth:`step`.

        Raises:
            CommandError: A wrong length, or a number that is not finite.
        """
        names = self.joints.names
        if len(positions) not in {len(names), self.joints.leg_count}:
            raise CommandError(
                f'{len(positions)} positions for {len(names)} joints; give one for each of '
                f'{", ".join(names)}'
                + (f', or the first {self.joints.leg_count}' if len(names) > 12 else '')
            )
        wrong = [name for name, p in zip(names, positions, strict=False) if not math.isfinite(p)]
        if wrong:
            raise CommandError(
                f'no finite position for {", ".join(wrong)}; the command is refused'
            )

    def _begin(self, measured: Sequence[float | None], now: float) -> None:
        legs = zip(self.joints.names[: self.joints.leg_count], measured, strict=False)
        lost = [name for name, place in legs if place is None]
        if lost:
            raise CommandError(
                f'no report of {", ".join(lost)}, so the target could jump; '
                'wait for reports of the robot'
            )
        sent = self._targets or [math.nan] * len(measured)
        self._targets = [
            last if place is None else place for last, place in zip(sent, measured, strict=True)
        ]
        self._began_at = now
        self._last_at = now - NOMINAL_PERIOD

    def _speed(self, now: float) -> float:
        settings = self._settings
        share = min((now - self._began_at) / settings.start_time, 1.0)
        start = min(settings.start_speed, settings.speed)
        return start + share * (settings.speed - start)

    def _approach(self, positions: Sequence[float], step: float) -> Command:
        clamped, slowed, outside, unseen = [], [], [], []
        for index, wanted in enumerate(positions):
            servo, last = self.joints.servos[index], self._targets[index]
            if math.isnan(last):
                unseen.append(servo.joint)
                last = min(max(wanted, servo.lower), servo.upper)
            goal = min(max(wanted, min(servo.lower, last)), max(servo.upper, last))
            if goal != wanted:
                clamped.append(servo.joint)
            reach = step * self._share[index]
            target = min(max(goal, last - reach), last + reach)
            if target != goal:
                slowed.append(servo.joint)
            if not servo.lower <= target <= servo.upper:
                outside.append(servo.joint)
            self._targets[index] = target
        return Command(
            tuple(self._targets[: len(positions)]),
            tuple(clamped),
            tuple(slowed),
            tuple(outside),
            tuple(unseen),
        )
