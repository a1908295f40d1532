# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Modes that command a position each cycle: 7 (interpolated) and 8 (cyclic synchronous).

Targets are approached by a trapezoidal profile, one step a cycle: a single one as fast as the
limits allow. Those of a stream are points of a path, and come at times of their own: the profile
follows a line between them, so that its speed is that of the path and not that of a dash to each
point. A set-point that can always stop at the end of the line goes beyond none of the targets.

:class:`FollowingWatch` judges by its own positions whether the axis goes where they lead it.
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

SPREAD = 2.0  # intervals between targets over which the way to the newest one is spread
LEARNING = 0.25  # share of the newest interval in their mean


class TargetLine:
    """Goes to the newest of a stream of targets at a constant rate.

    It takes twice the usual interval between them for that, so that it does not rest when one is
    late.

    Attributes:
        position: Where it is.
        target: The newest target.
    """

    def __init__(self, target: float) -> None:
        self.position = self.target = target
        self._left = self._since = 0.0  # [s] to the newest target, and since it came
        self._interval: float | None = None  # [s]

    def extend(self, target: float) -> None:
        """Set the next target, and update the mean interval between targets."""
        before = self._since if self._interval is None else self._interval
        self._interval = before + LEARNING * (self._since - before)
        self._left, self._since = SPREAD * self._interval, 0.0
        self.target = target

    def step(self, period: float) -> float:
        """Advance by a cycle of that length in [s], and return the new position."""
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
        """Start at a position with a rate in [unit/s], and brake."""
        self.position = position  # set-point of this cycle
        self.velocity = velocity  # its rate in [unit/s]
        self.target: float | None = None  # where it goes; None brakes to a stop
        self._line: TargetLine | None = None

    @property
    def at_rest(self) -> bool:
        """Whether the set-point stands still and has nowhere to go."""
        return self.velocity == 0.0 and self.target in (None, self.position)

    @property
    def is_idle(self) -> bool:
        """Whether a step changes nothing: it is at rest, and follows no stream of targets."""
        return self._line is None and self.at_rest

    def go(self, target: float | None) -> None:
        """Go to a single target; without one brake to a stop."""
        self.target, self._line = target, None

    def track(self, target: float) -> None:
        """Go on to the next target of a stream; the first one is like a single target."""
        if self._line is None:
            self._line, self.target = TargetLine(target), target
        else:
            self._line.extend(target)

    def follow(self, position: float, period: float) -> None:
        """Follow the set-point of a stream, and remember its rate for a smooth stop."""
        self.velocity = (position - self.position) / period
        self.position = position
        self.go(None)

    def step(self, period: float, limits: ProfileLimits) -> float:
        """Advance by a cycle.

        The speed is never above the one from which the target can still be met by braking: of
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
        # on the last cycle the rest of the way is taken in one step
        if abs(distance) <= speed * period:
            speed = abs(distance) / period
        return math.copysign(speed, distance)


class CyclicPosition(Mode):
    """Mode 8: a set-point each cycle, of a motion source or from a profile towards targets."""

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
        self._position_inc = 0  # that was written last
        self._stands = False  # the set-point is that one

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
        """Whether the profile is on the way to a single target."""
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
        """Go to a single target by a profile."""
        self._scale.to_device(target, self._target.limits)  # else it would fail on arrival
        self._profile.go(target)
        return IN_THE_IMAGE

    def follow_target(self, target: float) -> Promise[None]:
        """Go to the next target of a stream by a profile that is as even as they come."""
        self._scale.to_device(target, self._target.limits)
        self._profile.track(target)
        return IN_THE_IMAGE

    def brake(self) -> None:
        """Come to a stop within the limits, wherever that is."""
        self._streamed = None
        self._profile.go(None)

    @property
    def braked(self) -> bool:
        """Whether the set-point stands."""
        return self._profile.velocity == 0.0

    def stream(self, setpoint: float) -> None:
        """Set the set-point of a motion source for this cycle.

        Raises:
            DriveError: It is not finite or does not fit the object.
        """
        self._streamed = setpoint, self._scale.to_device(setpoint, self._target.limits)

    def step(self, now: float, period: float, statusword: int) -> int:
        """Write the streamed set-point, or the profile's; a stream that ends is braked."""
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
    """Mode 7: as mode 8, into 0x60C1:1, with bit 4 enabling the interpolation."""

    number = OperationMode.INTERPOLATED_POSITION
    bits = int(Controlword.ENABLE_INTERPOLATION)


class FeedForward:
    """What a drive adds in mode 8 to its own control: velocity 0x60B1, torque 0x60B2.

    As far as RPDOs carry them (CiA 402-2, clause 13). In the modes 9 and 10 a drive adds them to
    the target, so none may be left over from a stream. An offset that no stream has set is left as
    it is: another program may have written it.
    """

    def __init__(self, velocity: Writer | None, torque: Writer | None, units: Units) -> None:
        self._velocity, self._torque = velocity, torque
        self._units = units
        self._acts = False

    def follow(self, setpoint: Setpoint) -> None:
        """Write what belongs to a set-point.

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


FOLLOWING_WINDOW = 0.5  # [s] of set-points among which the position has to be
MARGIN_TIME = 0.1  # [s] of the profile velocity by which it may be beside them
LASTING_ERROR_TIME = 1.0  # [s] of a following error after which the axis is taken out of operation
MOVED_SHARE = 0.1  # share of the margin by which set-points have to move to count as a motion
FOLLOWED_SHARE = 0.5  # share of the motion of the set-points that an axis makes at least


class Following(Enum):
    """What the positions of the last half second show."""

    FOLLOWS = 'it follows'
    UNDECIDED = 'it is seen again, where it was before'
    LEFT_BEHIND = 'the set-points moved, and it did not'
    LASTING_ERROR = 'it has been beside its set-points for too long'


class FollowingWatch:
    """Compares the position of an axis with the set-points of the last half second.

    A drive that has lost its RPDOs goes on to report that it follows: it compares itself with the
    last set-point that reached it. Its position is then left behind by the set-points, and would
    jump to them when the RPDOs arrive again. An axis that a load pulls away from set-points that
    stand is another matter: a new set-point where it is would let the load pull it further.
    """

    def __init__(self) -> None:
        self._samples: deque[tuple[float, float, float]] = deque()
        self._beside_since: float | None = None
        self._unseen_from: float | None = None  # set-point when the axis was seen last
        self._received = 0  # positions, in the cycle in which it was seen again

    def clear(self) -> None:
        """Forget the set-points: the axis is not led by them any more."""
        self._samples.clear()
        self._beside_since = self._unseen_from = None

    def lose_sight(self) -> None:
        """The axis is led on, but its positions are too old to be judged.

        The first that comes again may be old, too. Where frames were lost, the axis stands there,
        and the set-point that is due would make it jump. Where they were late, several positions
        come in a cycle: the axis is led on, and a set-point at the first would make it jump back.
        Thus none leaves in the first cycle.
        """
        if self._samples:
            unseen_from = self._unseen_from  # of a sight that was too short to judge
            if unseen_from is None:
                unseen_from = self._samples[0][1]  # positions are too old after some time only
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
        """Judge by set-point and position of this cycle whether the axis follows.

        Args:
            now: Steady time in [s].
            setpoint: Position commanded last in user units.
            position: Actual position in user units.
            margin: How far an axis that has stopped to move may be beside its set-points in user
                units.
            window: How far one that moves, or is pulled by a load, may lastingly be beside them
                in user units; not below the margin.
            error: The drive itself shows a following error.
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
