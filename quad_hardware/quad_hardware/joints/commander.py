# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""From joint commands to servo angles: checked, limited, counted, and watched for their end."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
import math

from ..exceptions import CommandError
from .command import Command, CommandLimiter, LimiterSettings
from .command_loss import CommandLoss, LossReaction
from .mapping import JointMap

START_BAND = 0.3  # [rad] between leg and target; a controller that is relaxed keeps to 0.25


@dataclass(slots=True)
class CommandCounters:
    """What became of joint commands."""

    received: int = 0  # all of them
    refused: int = 0  # of wrong length, not finite, or far from legs that something else has moved
    clamped: int = 0  # went beyond limits and were taken to them
    slowed: int = 0  # asked for more speed than allowed, and were approached
    reason: str = ''  # why the last one was refused, or which joints were clamped
    troubled: bool = field(default=False)  # something was refused or clamped since the last look
    largest_step: float = 0.0  # of a target since the last look [rad]
    loss: str = ''  # what became of the robot when commands broke off; empty while they come


class JointCommander:
    """Lets joint commands through to the servos; times are on the monotonic clock [s]."""

    def __init__(
        self,
        joints: JointMap,
        limiter: LimiterSettings,
        reaction: LossReaction,
        *,
        raised: Callable[[Sequence[float]], Sequence[str]],
        send: Callable[[Mapping[int, float]], bool],
        obstacle: Callable[[], str],
        warn: Callable[[str], None],
    ) -> None:
        """Begin without a stream.

        Args:
            reaction: What the robot does when commands break off while its legs move.
            raised: Names the feet that are in the air at targets of the legs [rad].
            send: Has servo angles sent, by motor id [deg]; returns whether they are.
            obstacle: Says why nothing is sent.
            warn: Takes what is the matter with a command.
        """
        self.counters = CommandCounters()  # what became of them
        self._joints = joints
        # two streams: one that wakes after the way down begins anew, however the legs moved
        self._commanded = CommandLimiter(joints, limiter)
        self._descent = CommandLimiter(joints, limiter)
        self._loss = CommandLoss(joints, raised, reaction, limiter.stream_timeout)
        self._send_angles, self._obstacle, self._warn = send, obstacle, warn
        self._last_targets: tuple[float, ...] = ()
        self._moved_by = ''  # what took the legs from where the commands of before left them
        # time after the last command at which :meth:`miss` is to be called [s]
        self.timeout = self._loss.timeout

    @property
    def hazard(self) -> str:
        """How the last stream ended, if that is nothing to be left so; else nothing."""
        return self._loss.hazard

    @property
    def goes_down(self) -> bool:
        """Whether the robot is on its way down, because commands broke off."""
        return self._loss.goes_down

    def is_commanded(self, now: float) -> bool:
        """Whether commands come."""
        return self._loss.is_commanded(now)

    def lose(self) -> None:
        """Begin anew with the next command, for the robot was lost; any thread may call it."""
        self._commanded.reset()
        self._descent.reset()

    def let_go(self) -> None:
        """Send nothing more until a command begins where the legs are.

        What a controller streams is where they were: the robot would rise unasked. A pause of
        the stream is no new request; a stalled process makes one, too.
        """
        self._forget()
        self._moved_by, self.counters.loss = 'the servos were let go', ''

    def refuse(self, error: CommandError) -> None:
        """Count a command that is none."""
        self.counters.refused += 1
        self._trouble(f'joint command refused: {error}')

    def take(
        self, positions: Sequence[float], place: Mapping[str, float], now: float
    ) -> Command | None:
        """Take a command, and return what was sent for it; None for nothing.

        Args:
            positions: Targets of the first joints, in the order of the URDF [rad], [m].
            place: Where the joints are [rad], [m]; empty when the robot was not seen lately.
        """
        command = self._send(self._commanded, positions, place, now)
        if command is not None:
            self._moved_by = ''
            self._loss.commanded(command.targets, now)
            self.counters.loss = ''
        return command

    def miss(self, place: Mapping[str, float], tilt: float | None, now: float) -> str:
        """Bring the robot down, if the end of its commands is a hazard; return what it does.

        Args:
            place: As in :meth:`take`.
            tilt: Of the body [rad]; None when nobody knows.
        """
        hazard = self._loss.hazard
        if not hazard:
            return ''
        reason = self._loss.begin(place, tilt, now)
        if not reason:  # commands that only did not arrive raise no robot that lies, either
            self._commanded.reset()
            self._moved_by = 'joint commands broke off and the robot was laid down'
        does = f'holds as it is, for {reason}' if reason else 'lies down'
        self.counters.loss = (
            f'joint commands broke off {hazard}: the robot {does}; is the controller running?'
        )
        return self.counters.loss

    def go_down(self, place: Mapping[str, float], now: float) -> Command | None:
        """Send the next targets on the way down; None for nothing, at its end too."""
        positions = self._loss.step(now)
        if positions is None:
            return None
        command = self._send(self._descent, positions, place, now)
        if command is None:
            self._loss.forget()
        return command

    def _send(
        self,
        stream: CommandLimiter,
        positions: Sequence[float],
        place: Mapping[str, float],
        now: float,
    ) -> Command | None:
        try:
            stream.check(positions)
            if not place:
                self._drop(self._obstacle())
                return None
            if self._moved_by and stream is self._commanded:
                self._check_start(positions, place)
            measured = [place.get(name) for name in self._joints.names]
            command = stream.step(positions, measured, now)
        except CommandError as error:
            self.refuse(error)
            return None
        if not self._send_angles(self._joints.angles(command.targets)):
            self._drop(self._obstacle())
            return None
        self._count(command)
        return command

    def _check_start(self, positions: Sequence[float], place: Mapping[str, float]) -> None:
        """Refuse targets that do not begin where the legs are."""
        distance, joint = self._farthest(positions, place)
        if distance > START_BAND:
            raise CommandError(
                f'{self._moved_by}, and {joint} is {distance:.2f} rad from its target; set the '
                f'mode relax, then stand (commands begin up to {START_BAND:g} rad off the legs)'
            )

    def _farthest(
        self, positions: Sequence[float], place: Mapping[str, float]
    ) -> tuple[float, str]:
        """Return how far the targets of the legs are from where these are [rad], and where most.

        A target that is no number, and a leg that is not measured, are infinitely far.
        """
        legs = self._joints.names[: self._joints.leg_count]
        distances = (
            (abs(target - place.get(name, math.nan)), name)
            for target, name in zip(positions, legs, strict=False)
        )
        return max(
            ((math.inf if math.isnan(far) else far, name) for far, name in distances),
            default=(math.inf, ''),
        )

    def _forget(self) -> None:
        """Begin anew with the next command, and do not miss it: the robot does not get it."""
        self.lose()
        self._loss.forget()
        self._last_targets = ()

    def _drop(self, reason: str) -> None:
        self._forget()
        self._trouble(f'joint command not sent: {reason}')

    def _count(self, command: Command) -> None:
        counters, legs = self.counters, self._joints.leg_count
        pairs = zip(self._last_targets[:legs], command.targets[:legs], strict=False)
        step = max((abs(after - before) for before, after in pairs), default=0.0)
        counters.largest_step = max(counters.largest_step, step)
        self._last_targets = command.targets
        counters.slowed += bool(command.slowed)
        if command.unseen:
            self._trouble(
                f'{", ".join(command.unseen)} is not measured: it goes to its first '
                'target at the lowest speed'
            )
        if command.clamped:
            counters.clamped += 1
        beyond = {
            'beyond limits, taken to them': set(command.clamped) - set(command.outside),
            'found beyond limits, moved only towards them': command.outside,
        }
        if troubles := [
            f'{what}: {", ".join(sorted(who))}' for what, who in beyond.items() if who
        ]:
            self._trouble('; '.join(troubles))

    def _trouble(self, reason: str) -> None:
        self.counters.reason, self.counters.troubled = reason, True
        self._warn(reason)
