# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Converts joint commands to servo angles: checks, limits and counts them, detects their end."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
import math

from quad_description import MAX_TILT, Pose, pose_positions

from .exceptions import CommandError
from .joints import (
    Command,
    CommandLimiter,
    JointMap,
    LimiterSettings,
    LossReaction,
    MAX_PERIOD,
)

START_BAND = 0.3  # [rad] between leg and target; a controller that is relaxed keeps to 0.25
MIN_STREAM = 0.5  # [s] a person who tries out a servo sends no stream
SPEED = 1.0  # [rad/s] of the fastest joint on the way down
MIN_DURATION = 1.0  # [s]
REPORT_TIMEOUT = 0.4  # [s] for a report after commands broke off; a stall delays both


@dataclass(slots=True)
class CommandCounters:
    """Counters of joint commands by outcome."""

    received: int = 0  # all of them
    refused: int = 0  # of wrong length, not finite, or far from legs that something else has moved
    clamped: int = 0  # went beyond limits and were taken to them
    slowed: int = 0  # asked for more speed than allowed, and were approached
    reason: str = ''  # why the last one was refused, or which joints were clamped
    troubled: bool = False  # something was refused or clamped since the last look
    largest_step: float = 0.0  # of a target since the last look [rad]
    loss: str = ''  # what became of the robot when commands broke off; empty while they come


class JointCommander:
    """Passes joint commands to the servos, and lays the robot down if they break off.

    Times are on the monotonic clock [s]. A controller that dies in the middle of a trot leaves two
    legs in the air, held by the servos; so does one that held there because of a fault and then
    exited. A robot on all its feet stays as it is, whatever its posture.
    """

    def __init__(
        self,
        joints: JointMap,
        limiter: LimiterSettings,
        *,
        raised: Callable[[Sequence[float]], Sequence[str]],
        send: Callable[[Mapping[int, float]], bool],
        waits: Callable[[], bool],
        obstacle: Callable[[], str],
        warn: Callable[[str], None],
    ) -> None:
        """Start without a stream.

        Args:
            raised: Returns the feet that are in the air at targets of the legs [rad].
            send: Sends servo angles, by motor id [deg]; returns whether it does.
            waits: Returns whether the last angles are still unsent; newer ones replace them.
            obstacle: Returns why nothing can be sent; empty if it can.
            warn: Receives warnings about commands.
        """
        self.timeout = limiter.stream_timeout  # a pause after which a stream has ended [s]
        self.counters = CommandCounters()  # what became of them
        self._joints, self._legs = joints, joints.names[: joints.leg_count]
        pose = pose_positions(Pose.LIE)
        self._lying = {s.joint: min(max(pose[s.joint], s.lower), s.upper)
                       for s in joints.servos[: joints.leg_count] if s.joint in pose}  # fmt: skip
        self._raised, self._reaction = raised, limiter.command_loss
        self._limiter = CommandLimiter(joints, limiter)
        self._limits_descent = False  # the last command was one of the way down
        self._send_angles, self._waits = send, waits
        self._obstacle, self._warn = obstacle, warn
        self._last_targets: tuple[float, ...] = ()
        self._moved_by = ''  # what took the legs from where the commands of before left them
        self._began_at = self._last_at = -math.inf
        self._unseen_at = math.inf  # when they were missed and no report said where the legs are
        self._last: Sequence[float] = ()
        self._place: Mapping[str, float] | None = None  # where the way down began [rad]
        self._duration = self._elapsed = self._stepped_at = 0.0  # of the way down [s]

    @property
    def goes_down(self) -> bool:
        """Whether the robot is lying down."""
        return self._place is not None

    def is_commanded(self, now: float) -> bool:
        """Whether the last command is recent."""
        return now - self._last_at < self.timeout

    @property
    def _hazard(self) -> str:
        """Why the end of the last stream is a hazard; empty if it is not."""
        if not self._last or self._last_at - self._began_at < MIN_STREAM:
            return ''
        raised = self._raised(self._last)
        return f'with {" or ".join(raised)} in the air' if raised else ''

    def _forget(self) -> None:
        """Discard the stream after a loss or release, so that the robot does not move unasked."""
        self._place, self._unseen_at = None, math.inf
        self._began_at = self._last_at = -math.inf
        self._last = ()

    def _refusal(self, place: Mapping[str, float], tilt: float | None) -> str:
        if self._reaction is LossReaction.HOLD:
            return 'the parameter command_loss is hold'
        if unknown := [name for name in self._legs if name not in self._lying]:
            return f'no lying pose is known of {", ".join(unknown)}'
        if missing := [name for name in self._legs if name not in place]:
            return f'no report of {", ".join(missing)}'
        if tilt is not None and tilt > MAX_TILT:
            return f'the body is tilted by {math.degrees(tilt):.0f} degrees'
        return ''

    def limit_to(self, joints: JointMap) -> None:
        """Use the limits of these joints from now on; thread-safe."""
        self._limiter.joints = joints

    def lose(self) -> None:
        """Start a new stream with the next command, after loss of the robot; thread-safe."""
        self._limiter.reset()
        self._last_targets = ()

    def let_go(self) -> None:
        """Send nothing until a command begins at the present leg positions.

        A controller still streams the old positions: the robot would rise unasked. A pause in the
        stream is not a new request, because a stalled process causes one, too.
        """
        self.lose()
        self._forget()
        self._moved_by, self.counters.loss = 'the servos were let go', ''

    def refuse(self, error: CommandError) -> None:
        """Count an invalid command."""
        self.counters.refused += 1
        self._trouble(f'joint command refused: {error}')

    def take(
        self, positions: Sequence[float], place: Mapping[str, float], now: float
    ) -> Command | None:
        """Send a command; return what was sent; None if nothing was.

        Args:
            positions: Targets of the first joints, in the order of the URDF [rad], [m].
            place: Joint positions [rad], [m]; empty without a recent report.
        """
        command = self._send(positions, place, now, descent=False)
        if command is not None:
            if not self.is_commanded(now) and not (self.goes_down or self._hazard):
                self._began_at = now  # a pause with a foot in the air is part of a stream
            self._place, self._unseen_at = None, math.inf  # it ends the way down
            self._last_at, self._last = now, command.targets[: len(self._legs)]
            self._moved_by = self.counters.loss = ''
        return command

    def miss(self, place: Mapping[str, float], tilt: float | None, now: float) -> str | None:
        """Lay the robot down if missing commands are a hazard; return what it does.

        Args:
            place: See :meth:`take`.
            tilt: Tilt of the body [rad]; None if unknown.

        Returns:
            What the robot does; empty without a hazard; None while a report is pending.
        """
        hazard = self._hazard
        if not hazard:
            return ''
        if self._awaits_report(place, now):
            return None
        began_at = self._began_at
        self._forget()
        reason = self._refusal(place, tilt)
        if not reason:
            travel = max(abs(self._lying[name] - place[name]) for name in self._legs)
            # a cosine is pi / 2 times as fast in its middle as on average
            self._duration = max(MIN_DURATION, travel * math.pi / 2 / SPEED)
            self._place, self._elapsed = dict(place), 0.0
            self._stepped_at, self._began_at = now, began_at
            # commands that only did not arrive raise no robot that lies, either
            self._limiter.reset()
            self._moved_by = 'joint commands broke off and the robot was laid down'
        does = f'holds as it is, for {reason}' if reason else 'lies down'
        self.counters.loss = (
            f'joint commands broke off {hazard}: the robot {does}; is the controller running?'
        )
        return self.counters.loss

    def go_down(self, place: Mapping[str, float], now: float) -> Command | None:
        """Send the next targets on the way down; None if nothing is sent, as in a wait.

        They follow a path with a soft start and end, whose time stands still between calls, so the
        sent targets keep up with it to its end.
        """
        start = self._place
        if start is None or self._awaits_report(place, now):
            return None
        self._elapsed += min(max(now - self._stepped_at, 0.0), MAX_PERIOD)
        self._stepped_at = now
        share = 0.5 * (1.0 - math.cos(math.pi * min(self._elapsed / self._duration, 1.0)))
        if self._elapsed >= self._duration:
            self._forget()
        positions = [
            start[name] + share * (self._lying[name] - start[name]) for name in self._legs
        ]
        command = self._send(positions, place, now, descent=True)
        if command is None:
            self._forget()
        return command

    def _awaits_report(self, place: Mapping[str, float], now: float) -> bool:
        """Return whether a leg report is missing, but not for long yet."""
        self._unseen_at = math.inf if place else min(self._unseen_at, now)
        return not place and now < self._unseen_at + REPORT_TIMEOUT

    def _send(
        self,
        positions: Sequence[float],
        place: Mapping[str, float],
        now: float,
        *,
        descent: bool,
    ) -> Command | None:
        limiter = self._limiter
        try:
            limiter.check(positions)
            if not place:
                self._drop(forget=False)  # a stall held up reports, too: it may yet be missed
                return None
            if self._moved_by and not descent:
                self._check_start(positions, place)
            if descent is not self._limits_descent:
                # the way down begins anew, and so does a stream that wakes after it
                limiter.reset()
                self._limits_descent = descent
            elif self._waits():  # else the servos would see a jump
                limiter.withdraw()
            measured = [place.get(name) for name in self._joints.names]
            command = limiter.step(positions, measured, now)
        except CommandError as error:
            self.refuse(error)
            return None
        if not self._send_angles(self._joints.angles(command.targets)):
            self._drop()
            return None
        self._count(command)
        return command

    def _check_start(self, positions: Sequence[float], place: Mapping[str, float]) -> None:
        """Reject targets that do not start at the legs' positions, or if one is unmeasured."""
        pairs = zip(self._legs, positions, strict=False)
        far = {name: abs(target - place.get(name, math.inf)) for name, target in pairs}
        joint = max(far, key=far.__getitem__)
        if far[joint] > START_BAND:
            raise CommandError(
                f'{self._moved_by}, and {joint} is {far[joint]:.2f} rad from its target; set the '
                f'mode relax, then stand (commands begin up to {START_BAND:g} rad off the legs)'
            )

    def _drop(self, *, forget: bool = True) -> None:
        self.lose()
        if forget:
            self._forget()
        self._trouble(f'joint command not sent: {self._obstacle()}')

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
