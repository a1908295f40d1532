# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Watches what is measured and requested: ages, attitude, battery, joints that stand still.

Messages that keep coming with the same values have no age that would show it: joints that stand
still while their targets move have frozen sensors, or servos without power.
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
    """The newest measurements, how old they are, and what is wrong."""

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
        """Record new values; return what was refused and why."""
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
        """Remember for a while, or until something usable comes, why what comes is not."""
        self._refusals[what] = reason, 0.0

    def forget_joints(self) -> None:
        """Wait for the next joint states: something else has moved the joints meanwhile."""
        self.newest = replace(self.newest, joints=None)
        self.ages['joints'] = math.inf

    def situation(self, velocity: Velocity = REST, pose: BodyPose = UPRIGHT) -> Situation:
        """Return what is new enough to act upon, and what is requested."""
        fresh = {name: getattr(self.newest, name) for name in AGED if self._is_fresh(name)}
        return Situation(**fresh, velocity=velocity, pose=pose)

    @property
    def attitude(self) -> ImuSample | None:
        """The newest attitude, None when it is too old to act upon."""
        return self.newest.imu if self._is_fresh('imu') else None

    def _is_fresh(self, name: str) -> bool:
        return self.ages[name] <= self._parameters.hold_age

    @property
    def spins(self) -> bool:
        """Whether the body turns faster than a robot at rest does, or the gyro is wrong."""
        imu = self.attitude
        return imu is not None and _turn_rate(imu) > self._parameters.max_turn_rate

    @property
    def complete(self) -> bool:
        """Whether everything has been received that a robot on its legs needs."""
        return self.newest.joints is not None and (
            self.newest.imu is not None or not self._parameters.require_imu
        )

    @property
    def held(self) -> bool:
        """Whether the joint states are too old to move on."""
        return not self._is_fresh('joints')

    @property
    def uncertainty(self) -> str:
        """Why the attitude is not acted upon, nothing when it is."""
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
        """What is not right, but no fault yet."""
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
        """Yield what keeps the robot from moving its legs, each with its reason and remedy."""
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
        """Return what a policy needs and no sensor measures; nothing for none."""
        if policy is None:
            return ''
        if self.uncertainty:
            return self.uncertainty
        joints, imu = self.newest.joints, self.newest.imu
        seen = replace(self.situation(), joints=joints, imu=imu)
        return policy.missing(seen) or policy.inexact(joints, stated=True)

    def _silence(self, name: str, topic: str) -> str:
        """Return why nothing new was received."""
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
        """Return how much of a step counts [s].

        After one pause of this process itself, what was sent meanwhile is yet to be read; the
        next one has no such excuse, unless joint states came on time in between.
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
        """Whether a value has no problem; one that has is refused."""
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
    """Return how long something has been so [s]; it begins with the first time it is seen."""
    return 0.0 if time is None else time + dt


def _turn_rate(imu: ImuSample) -> float:
    """Return the greatest rate of an attitude in [rad/s], 0 when it is not measured."""
    return math.hypot(*(imu.angular_velocity or ()))


AGREEMENT = 0.05  # [rad] two samples of a robot that is not moved differ by less


class UnseenJoints:
    """Compares joints with their targets when they are known again.

    A robot that was started anew lies; one without its cable may be bent by hand. What was held
    before would move it unasked.

    Within a band they are as they were, or gave way to their load. Beyond it they were moved,
    if a second sample has the same: one may be damaged.
    """

    def __init__(self, band: float) -> None:
        """Begin without having seen them; a joint may be off its target by the band [rad]."""
        self._band = band
        self._is_unseen = True
        self._first: JointSample | None = None
        self._last: JointSample | None = None

    @property
    def is_pending(self) -> bool:
        """Whether a first sample is beyond the band, and a second one is to agree."""
        return self._first is not None

    def lose(self) -> None:
        """Compare anew with the next samples."""
        self._is_unseen, self._first = True, None

    def see(self) -> None:
        """Compare nothing until they are lost again."""
        self._is_unseen, self._first = False, None

    def moved(self, joints: JointSample, targets: Targets) -> bool:
        """Whether something else has moved them from their targets; once, after they were lost."""
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
    """Compares how far targets and joints went."""

    def __init__(self, names: Sequence[str]) -> None:
        """Begin with a new window."""
        self._names = tuple(names)
        self._targets: list[Sequence[float]] = []
        self._measured: list[Sequence[float]] = []
        self._time = 0.0
        self.text = ''  # which joints did not follow in the last window; empty when all did

    def step(self, targets: Sequence[float], measured: Sequence[float], dt: float) -> None:
        """Record where all joints were sent and are measured in a step [rad]."""
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
        """Start at rest; a velocity that is older than the time-out [s] counts as zero."""
        self._timeout = timeout
        self._velocity = REST
        self._age = math.inf
        self.pose = UPRIGHT  # pose of the body over its feet
        self.refused = 0  # how many commands were not finite

    def set_velocity(self, velocity: Velocity) -> Answer:
        """Set the velocity; one that is not finite stops the robot."""
        if not velocity.finite:
            self.refused += 1
            self._velocity = REST
            return Answer(False, f'rejected {velocity}: it is not finite; stopping')
        self._velocity, self._age = velocity, 0.0
        return Answer(True, '')

    def set_pose(self, pose: BodyPose) -> Answer:
        """Set the pose of the body; it stays until the next one."""
        if not pose.finite:
            self.refused += 1
            return Answer(False, f'rejected {pose}: it is not finite; the pose stays')
        self.pose = pose
        return Answer(True, '')

    def pass_time(self, dt: float) -> None:
        """Increase the age of the velocity by a duration in [s]."""
        self._age += dt

    def velocity(self, state: State) -> Velocity:
        """Return the velocity that counts in a state."""
        if state not in MOVING_STATES or self._age > self._timeout:
            return REST
        if state is State.TURN:
            return Velocity(yaw=self._velocity.yaw)
        return self._velocity

    def warning(self, state: State) -> str:
        """Return a warning of a stream of velocities that broke off without a zero, or nothing."""
        if state in MOVING_STATES and not self._velocity.at_rest and self._age > self._timeout:
            return f'the last velocity came {self._age:.1f} s ago; it counts as zero'
        return ''
