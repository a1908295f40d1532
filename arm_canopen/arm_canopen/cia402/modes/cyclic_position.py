# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Modes that command a position each cycle: 7 (interpolated) and 8 (cyclic synchronous).

A trapezoidal profile approaches the target, one step per cycle. It moves to a single target as
fast as the limits allow. Streamed targets are points of a path and arrive at irregular times: the
profile follows a line between them, at the speed of the path instead of rushing to each point.
The set-point can always stop at the end of the line, so it overshoots no target.

:class:`FollowingWatch` compares the positions of the axis with its set-points.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from enum import Enum
import math

from canopen_core.standard import Controlword, OperationMode

from ...master.process_image import IN_THE_IMAGE, Writer
from ...master.scheduler import Promise
from ..motion import Setpoint
from ..parameters import ProfileLimits
from ..state import Actual
from ..units import Units
from .mode import Mode, NO_BITS

SPREAD = 2.0  # time to reach the newest target, in mean intervals between targets
LEARNING = 0.25  # weight of the newest interval in the mean interval


class TargetLine:
    """Interpolates linearly to the newest of a stream of targets.

    It takes twice the mean interval between targets, so that it does not stop when one is
    late.

    Attributes:
        position: Current position.
        target: The newest target.
    """

    def __init__(self, target: float) -> None:
        self.position = self.target = target
        self._left = self._since = 0.0  # [s] left to the newest target, and since its arrival
        self._interval: float | None = None  # [s]

    def extend(self, target: float) -> None:
        """Set the next target, and update the mean interval between targets."""
        before = self._since if self._interval is None else self._interval
        self._interval = before + LEARNING * (self._since - before)
        self._left, self._since = SPREAD * self._interval, 0.0
        self.target = target

    def step(self, period: float) -> float:
        """Advance by a ``period`` in [s], and return the new position."""
        if self._left > period:
            self.position += period / self._left * (self.target - self.position)
        else:
            self.position = self.target
        self._left -= period
        self._since += period
        return self.position


class SetpointProfile:
    """Moves a set-point to a target that may change at any time, without a step in velocity."""

    def __init__(self, position: float, velocity: float = 0.0) -> None:
        """Start at a position and velocity in [unit/s], and brake to a stop."""
        self.position = position  # set-point of this cycle
        self.velocity = velocity  # rate of the set-point in [unit/s]
        self.target: float | None = None  # end of the motion; None brakes to a stop
        self._line: TargetLine | None = None

    @property
    def at_rest(self) -> bool:
        """Whether the set-point stands still and has no target."""
        return self.velocity == 0.0 and self.target in (None, self.position)

    @property
    def is_idle(self) -> bool:
        """Whether it is at rest and follows no stream of targets, so that a step has no effect."""
        return self._line is None and self.at_rest

    def go(self, target: float | None) -> None:
        """Move to a single target; brake to a stop if it is None."""
        self.target, self._line = target, None

    def track(self, target: float) -> None:
        """Move to the next target of a stream; the first one is handled like a single target."""
        if self._line is None:
            self._line, self.target = TargetLine(target), target
        else:
            self._line.extend(target)

    def follow(self, position: float, period: float) -> None:
        """Adopt the set-point of a motion source, and store its rate for a smooth stop."""
        self.velocity = (position - self.position) / period
        self.position = position
        self.go(None)

    def step(self, period: float, limits: ProfileLimits) -> float:
        """Advance by a cycle.

        The speed is limited so that braking can still end at the target: of
        ``v * period + v^2 / (2 * deceleration) = distance`` the positive root.

        Returns:
            The new set-point.
        """
        speed_limit = limits.velocity
        if self._line is not None:
            before, self.target = self._line.position, self._line.step(period)
            line_speed = abs(self.target - before) / period
            speed_limit = max(speed_limit, min(line_speed, limits.speed_limit))
        if self.at_rest:
            return self.position
        wanted = 0.0
        if self.target is not None:
            wanted = self._wanted(self.target, period, speed_limit, limits.deceleration)
        braking = abs(wanted) < abs(self.velocity) or wanted * self.velocity < 0
        change = (limits.deceleration if braking else limits.acceleration) * period
        self.velocity += max(-change, min(change, wanted - self.velocity))
        self.position += self.velocity * period
        if (
            self.target is not None
            and abs(self.target - self.position) < 1e-9
            and (abs(self.velocity) <= limits.deceleration * period)
        ):
            self.position, self.velocity = self.target, 0.0
        return self.position

    def _wanted(
        self, target: float, period: float, speed_limit: float, deceleration: float
    ) -> float:
        distance = target - self.position
        root = math.sqrt(period**2 + 2.0 * abs(distance) / deceleration)
        speed = min(speed_limit, deceleration * (root - period))
        # the last cycle covers the remaining distance in one step
        if abs(distance) <= speed * period:
            speed = abs(distance) / period
        return math.copysign(speed, distance)


class CyclicPosition(Mode):
    """Mode 8: a set-point each cycle, from a motion source or a profile towards a target."""

    number = OperationMode.CYCLIC_POSITION
    halts_by_bit = False
    cyclic = True
    bits = NO_BITS

    def __init__(self, units: Units, target: Writer, limits: Callable[[], ProfileLimits]) -> None:
        self._scale = units.position
        self._target = target
        self._limits = limits
        self._profile = SetpointProfile(0.0)
        self._streamed: tuple[float, int] | None = None  # position, the same in [inc]
        self._position_inc = 0  # last value written
        self._stands = False  # the set-point equals that value

    @property
    def setpoint(self) -> float:  # type: ignore[override]  # never none, and never written
        """Set-point of this cycle, in user units."""
        return self._profile.position

    @property
    def velocity(self) -> float:
        """Rate of the set-point in user units per second."""
        return self._profile.velocity

    @property
    def goes_to_single_target(self) -> bool:
        """Whether the profile is moving to a single target."""
        return self._profile.target is not None and not self._profile.at_rest

    def reached(self, statusword: int) -> bool:
        """Whether the profile has ended; modes 7 and 8 do not use bit 10."""
        return not self.goes_to_single_target

    def preload(self, actual: Actual) -> Promise[None]:
        """Hold the actual position."""
        self._streamed, self._stands = None, False
        position = self._scale.commanded(actual.position_inc)
        self._profile = SetpointProfile(position, actual.velocity)
        return self._target.deliver(actual.position_inc)

    def set_target(self, target: float) -> Promise[None]:
        """Move to a single target by a profile."""
        self._scale.to_device(target, self._target.limits)  # else it would fail on arrival
        self._profile.go(target)
        return IN_THE_IMAGE

    def follow_target(self, target: float) -> Promise[None]:
        """Move to the next target of a stream, at the speed of the stream."""
        self._scale.to_device(target, self._target.limits)
        self._profile.track(target)
        return IN_THE_IMAGE

    def brake(self) -> None:
        """Brake to a stop within the limits, at any position."""
        self._streamed = None
        self._profile.go(None)

    @property
    def braked(self) -> bool:
        """Whether the set-point stands still."""
        return self._profile.velocity == 0.0

    def stream(self, setpoint: float) -> None:
        """Set the set-point of a motion source for this cycle.

        Raises:
            DriveError: It is not finite or does not fit the object.
        """
        self._streamed = setpoint, self._scale.to_device(setpoint, self._target.limits)

    def step(self, now: float, period: float, statusword: int) -> int:
        """Write the set-point of the stream or the profile; brake when a stream ends."""
        profile = self._profile
        if self._streamed is not None:
            position, self._position_inc = self._streamed
            profile.follow(position, period)
            self._streamed, self._stands = None, False
        elif not (self._stands and profile.is_idle):
            self._position_inc = self._scale.to_device(profile.step(period, self._limits()))
            self._stands = profile.is_idle
        self._target.write(self._position_inc)
        return self.bits


class InterpolatedPosition(CyclicPosition):
    """Mode 7: like mode 8, but writes 0x60C1:1, and bit 4 enables the interpolation."""

    number = OperationMode.INTERPOLATED_POSITION
    bits = int(Controlword.ENABLE_INTERPOLATION)


class FeedForward:
    """Feed-forward of mode 8: velocity offset 0x60B1 and torque offset 0x60B2.

    Only offsets that RPDOs carry are used (CiA 402-2, clause 13). In modes 9 and 10 a drive adds
    them to the target, so they are reset after a stream. An offset that no stream has set stays
    unchanged: another program may have written it.
    """

    def __init__(self, velocity: Writer | None, torque: Writer | None, units: Units) -> None:
        self._velocity, self._torque = velocity, torque
        self._units = units
        self._acts = False

    def follow(self, setpoint: Setpoint) -> None:
        """Write the offsets of a set-point.

        Raises:
            DriveError: A value is not finite or does not fit its object; nothing is written.
        """
        units, velocity, torque = self._units, self._velocity, self._torque
        limits = None if velocity is None else velocity.limits
        velocity_dev = units.velocity.to_device(setpoint.velocity, limits)
        limits = None if torque is None else torque.limits
        torque_dev = units.effort.to_device(setpoint.effort, limits)
        if velocity_dev or torque_dev:
            self._acts = True
            self._write(velocity_dev, torque_dev)
        else:
            self.end()

    def end(self) -> None:
        """Reset the offsets that were written."""
        if self._acts:
            self._acts = False
            self._write(0, 0)

    def _write(self, velocity_dev: int, torque_dev: int) -> None:
        if self._velocity is not None:
            self._velocity.write(velocity_dev)
        if self._torque is not None:
            self._torque.write(torque_dev)


FOLLOWING_WINDOW = 0.5  # [s] of set-points with which the position is compared
MARGIN_TIME = 0.1  # [s] times the profile velocity is the allowed deviation from them
LASTING_ERROR_TIME = 1.0  # [s] of a following error after which the axis is disabled
MOVED_SHARE = 0.1  # smallest change of set-points that is a motion, as share of the margin
FOLLOWED_SHARE = 0.5  # smallest share of the motion that a following axis makes


class Following(Enum):
    """Result of comparing the positions of the last half second with the set-points."""

    FOLLOWS = 'it follows'
    UNDECIDED = 'it is seen again, where it was before'
    LEFT_BEHIND = 'the set-points moved, and it did not'
    LASTING_ERROR = 'it has been beside its set-points for too long'


class FollowingWatch:
    """Compares the position of an axis with the set-points of the last half second.

    A drive that receives no RPDOs still reports that it follows, as it compares its position with
    the last set-point received. Its position then stays behind the set-points, and would jump to
    them when RPDOs arrive again. An axis that a load pulls away from constant set-points is
    treated differently: a set-point at its position would let the load pull it further.
    """

    def __init__(self) -> None:
        self._samples: deque[tuple[float, float, float]] = deque()
        self._beside_since: float | None = None
        self._unseen_from: float | None = None  # set-point at the last fresh position
        self._received = 0  # positions received when feedback resumed

    def clear(self) -> None:
        """Forget the set-points: the axis no longer follows them."""
        self._samples.clear()
        self._beside_since = self._unseen_from = None

    def lose_sight(self) -> None:
        """Suspend the comparison: the axis is still commanded, but its positions are too old.

        The first position received afterwards may be old, too. If frames were lost, the axis
        stands there, and the current set-point would make it jump. If they were late, several
        positions arrive per cycle: the axis has moved on, and a set-point at the first would make
        it jump back. Therefore no set-point is sent in the first cycle.
        """
        if self._samples:
            unseen_from = self._unseen_from  # kept if feedback was too short to judge
            if unseen_from is None:
                unseen_from = self._samples[0][1]  # positions become too old only after some time
            self.clear()
            self._unseen_from = unseen_from

    def judge(
        self,
        now: float,
        setpoint: float,
        position: float,
        *,
        margin: float,
        window: float,
        error: bool,
        received: int,
    ) -> Following:
        """Add set-point and position of this cycle; return whether the axis follows.

        Args:
            now: Steady time in [s].
            setpoint: Last commanded position in user units.
            position: Actual position in user units.
            margin: Allowed deviation of an axis that has stopped from its set-points in user
                units.
            window: Allowed lasting deviation of an axis that moves, or that a load pulls, in user
                units; not below the margin.
            error: The drive reports a following error.
            received: Number of positions received from the axis so far.
        """
        samples = self._samples
        samples.append((now, setpoint, position))
        while samples[0][0] < now - FOLLOWING_WINDOW:
            samples.popleft()
        if not error and abs(position - setpoint) <= margin:
            self._beside_since = self._unseen_from = None
            return Following.FOLLOWS
        unseen_from, cycles = self._unseen_from, len(samples) - 1
        if unseen_from is not None and abs(setpoint - unseen_from) > MOVED_SHARE * margin:
            if not cycles:
                self._received = received
                return Following.UNDECIDED
            if received - self._received <= cycles:
                return Following.LEFT_BEHIND
        self._unseen_from = None
        setpoints = [sample[1] for sample in samples]
        low, high = min(setpoints), max(setpoints)
        beside = max(low - position, position - high)
        positions = [sample[2] for sample in samples]
        way = max(positions) - min(positions)
        left = high - low > MOVED_SHARE * margin and way < FOLLOWED_SHARE * (high - low)
        if left and (error or beside > margin):
            return Following.LEFT_BEHIND
        if not error and beside <= window:
            self._beside_since = None
            return Following.FOLLOWS
        if self._beside_since is None:
            self._beside_since = now
        lasting = now - self._beside_since > LASTING_ERROR_TIME
        return Following.LASTING_ERROR if lasting else Following.FOLLOWS
