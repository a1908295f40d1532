# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
r"""Identifies the servo model: one thigh of a suspended robot does steps and swings.

The model is that of quad_sim: a leg that hangs free turns about one joint by

.. math:: I \ddot q = \mathrm{clamp}(k_p\,\mathrm{dead}(q^* - q) - k_v \dot q, \pm\tau_{max})
          - d \dot q + \tau_g(q)

The largest torque, the inertia of the links and their weight come from the URDF, so the stiffness
has a unit. The parameters minimize the position error (Levenberg-Marquardt); a
Cauchy loss gives outliers, as after a late command, little weight. Standard deviations follow from
the Jacobian and show whether the recording determines the parameters.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
import itertools
import math
import random
from statistics import median

import numpy as np
from numpy.typing import NDArray
from urdf_reader import compose, KinematicTree, link_poses, read_urdf, rotate, Transform

from quad_description import movable_joints

from ..exceptions import CommandError
from ..joints import JointServo
from ..link import STALE_TIME
from ..protocol import LEG_MOTORS
from ..report import SampleClock
from .wizard import Console, LimpRobot

GRAVITY = 9.81  # [m/s²]
ENCODER_STEP = 0.0015  # [rad] of 12 bits: the dead band that the rest of the free play is beside
INTERPOLATION = 0.02  # [s] in which the board leads a servo from one target to the next: assumed

_STEP = 0.002  # [s] of the integration
_MIN_SAMPLES = 300
_MAX_GAP = STALE_TIME  # between two reports; in a longer one nothing is commanded
_MIN_TRAVEL = 0.2  # [rad] between the ends of what was reported
_MAX_ERROR = 0.006  # [rad] rms: twice the rounding of protocol v1
_MAX_DEVIATION = 0.1  # standard deviation of a parameter, as a share of it
_OUTLIER = 0.004  # [rad] from which on the weight of a position falls
# share of positions that a busy computer may spoil; the others have the error
_MAX_OUTLIERS = 0.25
_ITERATIONS = 15

Array = NDArray[np.float64]
Series = Sequence[tuple[float, float]]


@dataclass(frozen=True, slots=True)
class Recording:
    """Recorded motion of one commanded joint."""

    targets: Series  # when each was on the line [s], and what it was [rad]
    positions: Series  # when each was measured [s], and what it was [rad]


@dataclass(frozen=True, slots=True)
class Load:
    """Mechanical load of a servo."""

    inertia: float  # of the links about the axis [kg m²]
    level: float  # torque of gravity with the joint at zero [N m]
    turned: float  # torque of gravity a quarter turn later [N m]
    max_torque: float  # of the servo [N m]


@dataclass(frozen=True, slots=True)
class ServoFit:
    """Identified servo parameters, as in quad_sim."""

    stiffness: float  # [N m/rad]
    velocity_gain: float  # torque against speed inside the clamp [N m s/rad]
    damping: float  # torque-speed line of the motor [N m s/rad]
    free_width: float  # error to either side that moves nothing [rad]
    armature: float  # inertia of rotor and gear at the joint [kg m²]
    delay: float  # from the end of a command on the line to the servo [s]
    error: float  # of the positions [rad] rms
    deviations: Mapping[str, float]  # standard deviations, as shares, by name

    @property
    def argument(self) -> str:
        """Value for ``fake_xgo --servo``; its free width is dead band plus half the play."""
        deadband = min(ENCODER_STEP, self.free_width)
        values = {
            'kp': self.stiffness,
            'kv': self.velocity_gain,
            'damping': self.damping,
            'armature': self.armature,
            'deadband': deadband,
            'backlash': 2.0 * (self.free_width - deadband),
            'delay': self.delay,
            'interpolation': INTERPOLATION,
        }
        return ','.join(f'{name}={value:.3g}' for name, value in values.items())


def leg_load(
    tree: KinematicTree, joint: str, positions: Mapping[str, float], max_torque: float
) -> Load:
    """Return the load of a joint, with the others at given positions [rad] and a level trunk."""
    (hinge,) = (each for each in tree.joints if each.name == joint)
    masses = tuple(tree.masses())

    def at(position: float) -> tuple[float, float]:
        poses = link_poses(tree, {**positions, joint: position})
        below = link_poses(tree, {**positions, joint: position}, hinge.child)
        axis = np.array(rotate(poses[hinge.child].rotation, hinge.axis))
        inertia = torque = 0.0
        for part in (each for each in masses if each.link in below):
            place = compose(poses[part.link], Transform(part.centre)).translation
            arm = np.cross(axis, np.subtract(place, poses[hinge.child].translation))
            inertia += part.mass * float(arm @ arm)
            torque -= part.mass * GRAVITY * float(arm[2])
        return inertia, torque

    (inertia, level), (_, turned) = at(0.0), at(math.pi / 2)
    return Load(inertia, level, turned, max_torque)


_NAMES = ('stiffness', 'velocity_gain', 'damping', 'free_width', 'delay', 'armature', 'zero')
_START = (3.0, 0.05, 0.05, 0.01, 0.03, 0.001, 0.0)


def fit_servo(recording: Recording, load: Load) -> ServoFit:
    """Identify the servo from a recording.

    Raises:
        CommandError: Identification fails; the message has the reason and the remedy.
    """
    _check(recording)
    model = _Model(recording, load)
    found, error, deviations = model.solve()
    if error > _MAX_ERROR:
        raise CommandError(
            f'positions differ by {error:.3f} rad rms from those of any servo; at most '
            f'{_MAX_ERROR} fit. Was the leg touched, did it reach the ground or its stop, or did '
            'the computer have other work? Record again'
        )
    for name in ('stiffness', 'damping', 'free_width', 'delay'):
        if not deviations[name] <= _MAX_DEVIATION:
            raise CommandError(
                f'the recording does not determine {name}: {deviations[name]:.0%} uncertain, at '
                f'most {_MAX_DEVIATION:.0%} are of use. Record again, with a larger --repeat'
            )
    values = dict(zip(_NAMES, found, strict=True))
    del values['zero']
    return ServoFit(**values, error=error, deviations=deviations)


def _check(recording: Recording) -> None:
    times = [time for time, _ in recording.positions]
    places = [place for _, place in recording.positions]
    if len(times) < _MIN_SAMPLES:
        raise CommandError(
            f'{len(times)} reports in the recording, {_MIN_SAMPLES} are needed; '
            'look at the line with doctor'
        )
    gap = max(b - a for a, b in itertools.pairwise(times))
    if gap > _MAX_GAP:
        raise CommandError(
            f'no report for {gap:.2f} s in the recording, at most {_MAX_GAP:g} s are of use; '
            'look at the line with doctor'
        )
    travel = max(places) - min(places)
    if travel < _MIN_TRAVEL:
        raise CommandError(
            f'the joint moved by {travel:.2f} rad, at least {_MIN_TRAVEL} are needed; '
            'does its servo hold (torque on), and does the leg hang free?'
        )


class _Model:
    """Predicts the positions of a recording from servo parameters."""

    def __init__(self, recording: Recording, load: Load) -> None:
        times, places = map(np.array, zip(*recording.positions, strict=True))
        self._load, self._measured = load, places
        self._times = np.arange(times[0], times[-1] + _STEP, _STEP)
        self._samples = times
        self._ramp = _set_points(recording.targets, INTERPOLATION)

    def solve(self) -> tuple[list[float], float, dict[str, float]]:
        """Return parameters, residual [rad] rms, and standard deviations."""
        place = np.array(_START)
        count = len(place)
        scale = np.array([1.0, 0.02, 0.02, 0.005, 0.01, 0.0005, 0.01])
        trust = 1e-2
        small = 1e-3 * scale
        residual = self._measured - self.predict(place[:, None])[:, 0]
        cost = _cost(residual)
        for _ in range(_ITERATIONS):
            columns = self.predict(place[:, None] + np.diag(small))
            base = self._measured - residual
            jacobian = (columns - base[:, None]) / small * scale
            weights = 1.0 / (1.0 + (residual / _OUTLIER) ** 2)
            weighted = jacobian.T * weights
            normal, slope = weighted @ jacobian, weighted @ residual
            damping = [trust * each * np.diag(np.diag(normal) + 1e-9) for each in (1, 30)]
            tries = np.array(
                [place + scale * np.linalg.solve(normal + each, slope) for each in damping]
            )
            tries[:, : count - 1] = np.maximum(tries[:, : count - 1], 1e-4)
            errors = self._measured[:, None] - self.predict(tries.T)
            costs = _cost(errors)
            best = int(np.argmin(costs))
            if not costs[best] < cost:
                if trust > 1e3:
                    break
                trust *= 1e3
                continue
            moved = np.abs((tries[best] - place) / scale).max()
            place, residual, cost = tries[best], errors[:, best], costs[best]
            trust = max(trust * (0.1, 10.0)[best], 1e-9)
            if moved < 1e-3:
                break
        kept = np.sort(residual**2)[: round((1.0 - _MAX_OUTLIERS) * len(residual))]
        variance = float(kept.sum()) / (len(kept) - count)
        spread = np.sqrt(np.diag(np.linalg.pinv(normal)) * variance) * scale
        shares = spread / np.maximum(np.abs(place), 1e-6)
        return (
            place.tolist(),
            math.sqrt(variance),
            dict(zip(_NAMES, shares.tolist(), strict=True)),
        )

    def predict(self, parameters: Array) -> Array:
        """Return the positions at the samples, one column per parameter column."""
        stiffness, gain, damping, free, delay, armature, zero = parameters
        load, times = self._load, self._times
        places, knots = self._ramp
        goals = np.stack(
            [np.interp(times + _STEP - each, places, knots) for each in delay], axis=1
        )
        position, velocity = goals[0].copy(), np.zeros(len(delay))
        turning = load.inertia + armature
        path = np.empty_like(goals)
        for index, goal in enumerate(goals):
            path[index] = position
            error = goal - position
            error -= np.minimum(np.maximum(error, -free), free)
            wanted = stiffness * error - gain * velocity
            torque = np.minimum(np.maximum(wanted, -load.max_torque), load.max_torque)
            weight = load.level * np.cos(position) + load.turned * np.sin(position)
            # implicit in the velocity, as the physics of quad_sim
            inertia = turning + _STEP * (damping + np.where(torque == wanted, gain, 0.0))
            velocity = velocity + _STEP * (torque + weight - damping * velocity) / inertia
            position = position + _STEP * velocity
        found = [np.interp(self._samples, times, column) for column in path.T]
        predicted: Array = np.stack(found, axis=1) + zero
        return predicted


def _cost(residuals: Array) -> Array:
    """Return the Cauchy loss of each column, in which outliers have little weight."""
    cost: Array = np.log1p((residuals / _OUTLIER) ** 2).sum(axis=0)
    return cost


def _set_points(targets: Series, interpolation: float) -> tuple[Array, Array]:
    """Return times and set-points of a servo without delay, piecewise linear."""
    times, values = [targets[0][0] - 1.0], [targets[0][1]]
    now, goal, arrival = targets[0][1], targets[0][1], -math.inf
    for time, target in targets:
        if time < arrival:
            share = (time - times[-1]) / (arrival - times[-1])
            now += share * (goal - now)
        else:
            if arrival > times[-1]:
                times.append(arrival)
                values.append(goal)
            now = goal
        times.append(time)
        values.append(now)
        goal, arrival = target, time + interpolation
    return np.array([*times, arrival]), np.array([*values, goal])


AMPLITUDE = 0.4  # [rad] to either side of where the leg hangs
PERIOD = 0.02  # [s] between two commands on a way
APPROACH_SPEED = 0.5  # [rad/s]
STEPS = 44  # to either side in turn, of 0.3 to 1 of the amplitude
STEP_TIMES = 0.2, 0.4  # [s] between two steps; uneven, so that reports meet them at all phases
SWEEP = 0.3, 3.5  # [Hz] at its ends
SWEEP_TIME = 12.0  # [s]
MAX_OFFSET = 0.15  # [rad] between a servo that follows and its target at rest
SETTLING = 1.0  # [s]


def calibrate_servos(
    console: Console,
    robot: LimpRobot,
    servos: Sequence[JointServo],
    urdf: str,
    leg: str,
    *,
    repeat: int = 1,
) -> ServoFit:
    """Swing the thigh of a leg, fit the servo model, and print it for the other packages.

    Args:
        servos: Servos of all joints.
        leg: Name of the leg, such as fl.
        repeat: Number of repetitions of the motion.

    Raises:
        CommandError: The joint does not follow, or identification fails.
        NoAnswerError: The robot does not report, or commands are not sent.
    """
    (servo,) = (each for each in servos if each.joint == f'{leg}_thigh_joint')
    console.write(
        f'{servo.joint} (motor {servo.motor}) will swing by {math.degrees(AMPLITUDE):.0f} degrees '
        f'to either side for {repeat * 25} s; all other servos hold.'
    )
    console.prompt(
        'Put the trunk on a stand, level, so that all legs hang free, and keep hands away. '
        'Enter begins; Ctrl-C ends it: the leg goes back slowly, and at a second one stays'
    )
    limits = next(each.limits for each in movable_joints(urdf) if each.name == servo.joint)
    held = robot.angles()  # without those that the protocol does not report: they stay
    if missing := sorted(set(LEG_MOTORS) - held.keys()):
        raise CommandError(f'motor {missing[0]} reports no angle; look at the robot with doctor')
    positions = {s.joint: s.position(held[s.motor]) for s in servos if s.motor in held}
    load = leg_load(read_urdf(urdf), servo.joint, positions, limits.effort)
    centre = math.atan(-load.level / load.turned)  # where gravity turns it neither way
    lower, upper = max(limits.lower, servo.lower), min(limits.upper, servo.upper)
    if upper - lower < 2.0 * AMPLITUDE:
        raise CommandError(
            f'{servo.joint} has no room to swing between {lower:g} and {upper:g} rad'
        )
    centre = min(max(centre, lower + AMPLITUDE), upper - AMPLITUDE)
    start = positions[servo.joint]
    try:
        _go(robot, servo, held, start, centre)
        offset = servo.position(_angle(robot, servo)) - centre
        if abs(offset) > MAX_OFFSET:
            raise CommandError(
                f'{servo.joint} is {offset:+.2f} rad from where it was sent; is its torque on, '
                'and does the leg hang free? calibrate joints first where signs are not known'
            )
        motion = list(_motion(centre, repeat))
        recording = _record(robot, servo, held, motion)
    finally:
        _go(robot, servo, held, servo.position(_angle(robot, servo)), start)
    found = fit_servo(recording, load)
    times = [time for time, _ in recording.positions]
    period = median(b - a for a, b in itertools.pairwise(times))
    console.write(
        f'{servo.joint}: {found.error:.4f} rad rms between recording and model; '
        + ', '.join(f'{name} ±{share:.0%}' for name, share in found.deviations.items())
    )
    console.write('the simulated robot, and policies on it:')
    console.write(f'  ros2 run quad_sim fake_xgo --servo {found.argument}')
    console.write('  ros2 run quad_controller check_policy MODEL --servo ... (the same)')
    console.write(f'  without a serial line, add refresh={period:.3g}: reports came so often')
    console.write('the gait:')
    kp = f'servo_compensation.kp:={found.stiffness:.3g}'
    console.write(f'  ros2 run quad_controller controller_node --ros-args -p {kp}')
    return found


def _angle(robot: LimpRobot, servo: JointServo) -> float:
    angle = robot.angles().get(servo.motor)
    if angle is None:
        raise CommandError(f'motor {servo.motor} reports no angle any more')
    return angle


def _motion(centre: float, repeat: int) -> Iterator[tuple[float, float]]:
    """Yield pairs: pause before a target [s], and the target [rad]."""
    uneven = random.Random(1)  # noqa: S311  no secret
    yield 0.0, centre
    for _ in range(repeat):
        for index in range(STEPS):
            size = AMPLITUDE * uneven.uniform(0.3, 1.0)
            yield uneven.uniform(*STEP_TIMES), centre + (size if index % 2 else -size)
        yield SETTLING, centre
        for index in range(round(SWEEP_TIME / PERIOD)):
            time = index * PERIOD
            cycles = SWEEP[0] * time + (SWEEP[1] - SWEEP[0]) * time * time / (2 * SWEEP_TIME)
            yield PERIOD, centre + 0.5 * AMPLITUDE * math.sin(2 * math.pi * cycles)


def _record(
    robot: LimpRobot,
    servo: JointServo,
    held: Mapping[int, float],
    motion: Sequence[tuple[float, float]],
) -> Recording:
    targets: list[tuple[float, float]] = []
    robot.reports()
    due = robot.now()
    for pause, target in motion:
        due += pause
        robot.wait_until(due)
        angle = robot.rounded(servo.motor, servo.angle(target))
        sent = robot.command({**held, servo.motor: angle})
        targets.append((sent, servo.position(angle)))
    robot.wait_until(due + SETTLING)
    clock = SampleClock()
    positions = [
        (clock.time(report) - report.joints_age, servo.position(angle))
        for report in robot.reports()
        if math.isfinite(angle := report.positions.get(servo.motor, math.nan))
    ]
    return Recording(targets, positions)


def _go(
    robot: LimpRobot, servo: JointServo, held: Mapping[int, float], start: float, end: float
) -> None:
    count = max(math.ceil(abs(end - start) / (APPROACH_SPEED * PERIOD)), 1)
    due = robot.now()
    for index in range(1, count + 1):
        place = start + (end - start) * index / count
        robot.command({**held, servo.motor: servo.angle(place)})
        due += PERIOD
        robot.wait_until(due)
    robot.wait_until(due + SETTLING)
