# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Monitors measurements and commands: age, attitude, battery, joints that do not move.

The age of messages does not reveal frozen values: joints that stand still while their targets move
have frozen sensors, or servos without power.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
import math
from typing import Any

from quad_description import ImuSample, JointSample, RobotState, Targets

from ..gait.velocity import BodyPose, REST, UPRIGHT, Velocity
from ..policy.observation import Situation
from ..policy.runner import PolicyRunner
from .modes import Answer, Fault, MOVING_STATES, State, StateParameters

REFUSAL_LIFE = 0.2
"""How long a message of no use is a reason for silence in [s]; then nothing comes at all."""
MAX_PAUSE = 0.1  # [s] that counts of a single step that came late
AGED = ('joints', 'imu', 'linear_velocity', 'foot_contacts')
"""Values of a RobotState that are of no use when they are old."""
SUBJECTS = {'joints': Fault.JOINTS, 'imu': Fault.IMU}


class Health:
    """Holds the newest measurements with their ages, and evaluates faults and warnings."""

    def __init__(self, count: int, parameters: StateParameters) -> None:
        """Start without a measurement."""
        self._count = count
        self._parameters = parameters
        self.newest = RobotState()  # the newest usable values, however old
        self.ages = dict.fromkeys(AGED, math.inf)  # time since they were measured in [s]
        self._delays = dict.fromkeys(SUBJECTS, 0.0)  # age of the newest when it came in [s]
        self.refused = 0  # samples that could not be used
        self._refusals: dict[Fault, tuple[str, float]] = {}  # reason, and its age [s]
        self._late = False
        self._falling_for: float | None = None
        self._low_for: float | None = None

    def take(self, measurement: RobotState, dt: float) -> list[str]:
        """Store new measurements; return which ones were rejected and why."""
        waited = self._waited(dt, received=measurement.joints is not None)
        self._refusals = {
            what: (reason, age + waited)
            for what, (reason, age) in self._refusals.items()
            if age + waited <= REFUSAL_LIFE
        }
        problems: list[str] = []
        taken: dict[str, Any] = {}
        for name in (*AGED, 'battery', 'servo_problem'):
            value = getattr(measurement, name)
            if value is not None and self._usable(SUBJECTS.get(name), value, problems):
                taken[name] = value
        delays = {'joints': measurement.joints_age, 'imu': measurement.imu_age}
        self._delays |= {name: delay for name, delay in delays.items() if name in taken}
        for name, age in self.ages.items():  # what comes was not measured before what came
            delay = delays.get(name, 0.0) if name in taken else math.inf
            self.ages[name] = min(age + waited, delay)
        self.newest = replace(self.newest, **taken)
        self.refused += len(problems)
        battery = self.newest.battery
        low = battery is not None and battery < self._parameters.low_battery
        self._low_for = _longer(self._low_for, waited) if low else None
        self._falling_for = _longer(self._falling_for, waited) if self._falls() else None
        return problems

    def refuse(self, what: Fault, reason: str) -> None:
        """Record why received data are unusable, for a while or until usable data arrive."""
        self._refusals[what] = reason, 0.0

    def forget_joints(self) -> None:
        """Discard the joint states, because something else has moved the joints."""
        self.newest = replace(self.newest, joints=None)
        self.ages['joints'] = math.inf

    def situation(self, velocity: Velocity = REST, pose: BodyPose = UPRIGHT) -> Situation:
        """Return the measurements that are recent enough, with the commands."""
        fresh = {name: getattr(self.newest, name) for name in AGED if self._is_fresh(name)}
        return Situation(**fresh, velocity=velocity, pose=pose)

    @property
    def attitude(self) -> ImuSample | None:
        """The newest attitude; None if it is too old."""
        return self.newest.imu if self._is_fresh('imu') else None

    def _is_fresh(self, name: str) -> bool:
        return self.ages[name] <= self._parameters.hold_age

    @property
    def spins(self) -> bool:
        """Whether the body turns faster than a robot at rest, or the gyro is faulty."""
        imu = self.attitude
        return imu is not None and _turn_rate(imu) > self._parameters.max_turn_rate

    @property
    def complete(self) -> bool:
        """Whether all data that a robot on its legs needs have been received."""
        return self.newest.joints is not None and (
            self.newest.imu is not None or not self._parameters.require_imu
        )

    @property
    def held(self) -> bool:
        """Whether joint states are too old to continue a motion."""
        return not self._is_fresh('joints')

    @property
    def uncertainty(self) -> str:
        """Why the attitude is not used; empty if it is."""
        imu = self.newest.imu
        if imu is None or not imu.is_uncertain:
            return ''
        return (
            f'/imu is uncertain by {imu.deviation:.2f} rad (orientation_covariance), so '
            'nothing is levelled, no heading held and no policy followed; check how the IMU is '
            'mounted: ros2 run quad_hardware calibrate imu'
        )

    @property
    def warnings(self) -> tuple[str, ...]:
        """Conditions that are not a fault yet."""
        late = self._parameters.warn_age
        imu = self.newest.imu
        texts = [
            f'{what} {self.ages[name] * 1e3:.0f} ms old'
            for name, what in (('joints', 'joint states are'), ('imu', 'the attitude is'))
            if late < self.ages[name] < math.inf
        ]
        if imu is not None and imu.angular_velocity is None:
            texts.append('/imu has no angular velocity, so max_turn_rate is not watched')
        if self.uncertainty:
            texts.append(self.uncertainty)
        return (*texts, *(reason for reason, _ in self._refusals.values()))

    def faults(self) -> Iterator[tuple[Fault, str]]:
        """Yield each fault that prevents leg motion, with reason and remedy."""
        parameters = self._parameters
        if self.ages['joints'] > parameters.fault_age:
            yield Fault.JOINTS, self._silence('joints', '/joint_states')
        if parameters.require_imu and self.ages['imu'] > parameters.fault_age:
            yield Fault.IMU, self._silence('imu', '/imu')
        if self.newest.imu is not None and (self._falling_for or 0.0) > parameters.fall_time:
            yield Fault.FALLEN, self._fall(self.newest.imu)
        if self.newest.battery is not None and (self._low_for or 0.0) > parameters.battery_time:
            yield Fault.BATTERY, f'{self.newest.battery:.0%} left; charge it'
        if self.newest.servo_problem:
            yield Fault.SERVO, self.newest.servo_problem

    def unmeasured(self, policy: PolicyRunner | None) -> str:
        """Return what a policy needs and no sensor measures; empty if nothing."""
        if policy is None:
            return ''
        if self.uncertainty:
            return self.uncertainty
        joints, imu = self.newest.joints, self.newest.imu
        seen = replace(self.situation(), joints=joints, imu=imu)
        return policy.missing(seen) or policy.inexact(joints, stated=True)

    def _silence(self, name: str, topic: str) -> str:
        """Return why no new data arrived."""
        age, delay = self.ages[name], self._delays[name]
        if SUBJECTS[name] in self._refusals:
            return self._refusals[SUBJECTS[name]][0]
        if math.isinf(age):
            return f'none yet; is the hardware node running, and does it publish {topic}?'
        if delay > self._parameters.hold_age:
            return (
                f'{topic} comes {delay:.1f} s after its header.stamp; look at the hardware node, '
                'the network, and the clocks of both computers'
            )
        return f'none for {age:.1f} s; look at the hardware node and its cable'

    def _waited(self, dt: float, *, received: bool) -> float:
        """Return how much of a step counts towards message ages [s].

        After a pause of this process itself, messages sent meanwhile are still unread, so it does
        not count. The next pause does, unless joint states arrived on time in between.
        """
        waited = dt if self._late else min(dt, MAX_PAUSE)
        if dt > MAX_PAUSE:
            self._late = True
        elif received:
            self._late = False
        return waited

    def _falls(self) -> bool:
        imu = self.attitude
        if imu is None:
            return False
        return self.spins or imu.tilt > self._parameters.max_tilt

    def _fall(self, imu: ImuSample) -> str:
        most, fastest = self._parameters.max_tilt, self._parameters.max_turn_rate
        if imu.tilt > most:
            angles = f'{math.degrees(imu.tilt):.0f} deg, more than {math.degrees(most):.0f}'
            return (
                f'the body is tilted by {angles}; put it on its feet, or request the mode get_up'
            )
        rates = f'{_turn_rate(imu):.1f} rad/s, faster than {fastest:g}'
        return f'the body turns at {rates}; when it does not, /imu is wrong: look at the cable'

    def _usable(self, what: Fault | None, value: object, problems: list[str]) -> bool:
        """Whether a value is valid; an invalid one is recorded as rejected."""
        problem = ''
        if isinstance(value, JointSample):
            problem = value.problem(self._count)
        elif isinstance(value, ImuSample):
            problem = value.problem()
        elif isinstance(value, tuple) and not all(map(math.isfinite, value)):
            problem = 'a velocity of the body that is not finite'
        elif isinstance(value, float) and not math.isfinite(value):
            return False  # a charge that is not known
        if problem:
            problems.append(f'refused {problem}')
        if what and problem:
            self.refuse(what, problem)
        elif what:
            self._refusals.pop(what, None)
        return not problem


def _longer(time: float | None, dt: float) -> float:
    """Return how long a condition has lasted [s], counted from its first detection."""
    return 0.0 if time is None else time + dt


def _turn_rate(imu: ImuSample) -> float:
    """Return the largest angular rate of an attitude in [rad/s]; 0 if not measured."""
    return math.hypot(*(imu.angular_velocity or ()))


AGREEMENT = 0.05  # [rad] two samples of a robot that is not moved differ by less


class UnseenJoints:
    """Compares joints with their targets when they are measured again.

    A restarted robot lies down, and joints may be moved by hand while the cable is off. Holding
    the old targets would then move the robot without a command.

    Within a band, the joints count as unmoved or sagging under load. Beyond it, they were moved if
    a second sample confirms it, since one sample may be damaged.
    """

    def __init__(self, band: float) -> None:
        """Start with the joints unseen; one may deviate from its target by the band [rad]."""
        self._band = band
        self._is_unseen = True
        self._first: JointSample | None = None
        self._last: JointSample | None = None

    @property
    def is_pending(self) -> bool:
        """Whether a first sample is beyond the band and awaits confirmation."""
        return self._first is not None

    def lose(self) -> None:
        """Mark the joints as unseen; compare them with the next samples."""
        self._is_unseen, self._first = True, None

    def see(self) -> None:
        """Mark the joints as seen; do not compare until they are lost again."""
        self._is_unseen, self._first = False, None

    def moved(self, joints: JointSample, targets: Targets) -> bool:
        """Whether something else has moved the joints; evaluated once after a loss."""
        if joints is self._last:  # nothing new was received
            return False
        self._last = joints
        if not self._is_unseen:
            return False
        if _apart(joints.positions, targets) <= self._band:
            self.see()
            return False
        first, self._first = self._first, joints
        if first is None or _apart(joints.positions, first.positions) > AGREEMENT:
            return False
        self.see()
        return True


def _apart(one: Targets, other: Targets) -> float:
    return max(abs(a - b) for a, b in zip(one, other, strict=True))


WINDOW = 1.0  # [s] longer than a period of every gait
MIN_TRAVEL = 0.15  # [rad] that a target must have gone to be of interest
MIN_RATIO = 0.1  # of that way, that its joint must have gone; soft servos go a third


class TrackingMonitor:
    """Compares the travel of targets and joints."""

    def __init__(self, names: Sequence[str]) -> None:
        """Start with a new window."""
        self._names = tuple(names)
        self._targets: list[Sequence[float]] = []
        self._measured: list[Sequence[float]] = []
        self._time = 0.0
        self.text = ''  # which joints did not follow in the last window; empty when all did

    def step(self, targets: Sequence[float], measured: Sequence[float], dt: float) -> None:
        """Record targets and measured positions of all joints [rad]."""
        self._targets.append(targets)
        self._measured.append(measured)
        self._time += dt
        if self._time < WINDOW:
            return
        wanted, gone = _travel(self._targets), _travel(self._measured)
        stuck = [
            name
            for name, way, went in zip(self._names, wanted, gone, strict=True)
            if way > MIN_TRAVEL and went < MIN_RATIO * way
        ]
        moving = sum(way > MIN_TRAVEL for way in wanted)
        which = 'all that move' if len(stuck) == moving > 1 else ', '.join(stuck)
        self.text = (
            f'do not follow their targets: {which}; are the servos on, and their angles alive?'
            if stuck
            else ''
        )
        self._targets, self._measured, self._time = [], [], 0.0


def _travel(rows: Sequence[Sequence[float]]) -> list[float]:
    return [max(column) - min(column) for column in zip(*rows, strict=True)]


class Commands:
    """The newest commands."""

    def __init__(self, timeout: float) -> None:
        """Start at rest; a velocity older than the time-out [s] counts as zero."""
        self._timeout = timeout
        self._velocity = REST
        self._age = math.inf
        self.pose = UPRIGHT  # pose of the body over its feet
        self.refused = 0  # how many commands were not finite

    def set_velocity(self, velocity: Velocity) -> Answer:
        """Set the velocity; a non-finite one stops the robot."""
        if not velocity.finite:
            self.refused += 1
            self._velocity = REST
            return Answer(False, f'rejected {velocity}: it is not finite; stopping')
        self._velocity, self._age = velocity, 0.0
        return Answer(True, '')

    def set_pose(self, pose: BodyPose) -> Answer:
        """Set the pose of the body; it applies until the next one."""
        if not pose.finite:
            self.refused += 1
            return Answer(False, f'rejected {pose}: it is not finite; the pose stays')
        self.pose = pose
        return Answer(True, '')

    def pass_time(self, dt: float) -> None:
        """Increase the age of the velocity by a duration in [s]."""
        self._age += dt

    def velocity(self, state: State) -> Velocity:
        """Return the velocity that applies in a state."""
        if state not in MOVING_STATES or self._age > self._timeout:
            return REST
        if state is State.TURN:
            return Velocity(yaw=self._velocity.yaw)
        return self._velocity

    def warning(self, state: State) -> str:
        """Return a warning if velocities broke off without a final zero; else empty."""
        if state in MOVING_STATES and not self._velocity.at_rest and self._age > self._timeout:
            return f'the last velocity came {self._age:.1f} s ago; it counts as zero'
        return ''
