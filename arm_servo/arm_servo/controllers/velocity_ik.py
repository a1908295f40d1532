# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Velocity inverse kinematics: tool or joint speeds to joint speeds within all limits.

A quadratic program finds the joint speeds x that come nearest to the commanded twist V::

    min  |W (J x - V)|^2 + sum_i d_i^2 (v_i' x)^2 + w (n' x - e)^2 + s |N x|^2
    with  -b(q - lower) <= x <= b(upper - q)          brakes before a joint limit
          x0 - c <= x <= x0 + c                       reachable with limited acceleration
          (dd/dq) x >= -k (d - margin)                brakes before each near pair of links meets

Held axes weigh more in W than commanded ones, so that a limit reduces the command instead of
making held axes drift. d_i damps only the directions that are nearly lost; n is the way out of a
singular pose; N x moves the joints but not the tool. In any state of the arm, standing still or
moving away from the limit is feasible.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
import math

import daqp
import numpy as np

from arm_model import Array, frozen, Mask, Proximity, RobotModel, RobotState, turned_twists
from arm_trajectory import brakeable

from .controller import Cause, Limiter, MotionReport
from .singularity import Directions, directions, ReachLimit

ACTIVE_FORCE = 1e-9  # force of a bound above which it counts as pressing

MIN_DECELERATION_FACTOR = 0.3
"""Least share of its deceleration that a joint uses while slower joints are stopping."""

MIN_APPROACH_CYCLES = 3.0  # least time for the remaining distance to a limit, in cycles


@dataclass(frozen=True, slots=True)
class VelocityBoundsSettings:
    """Settings of braking before limits."""

    margin: float = 0.01  # least distance between links that a command may bring about in [m]
    horizon: float = 0.15  # distance at which a pair of links is taken into account in [m]
    pairs: int = 3  # greatest number of pairs taken into account
    approach: float = 4.0  # greatest speed of approach per distance to the margin in [1/s]
    # share of acceleration and jerk that braking in front of a limit plans with
    braking: float = 0.7
    # distance from the position limits at which joints come to rest in [rad], one for all or one
    # each
    joint_margins: tuple[float, ...] = (0.0,)


@dataclass(slots=True, eq=False)
class Bounds:
    """Joint speed bounds in one state."""

    ways: Sequence[tuple[float, float]]  # distances to the lower and upper limits, less margins
    # least and greatest speeds in [rad/s] that can stop before the limits
    brakeable: Sequence[tuple[float, float]]
    lower: Array  # lower bounds, also limited by acceleration, in [rad/s]
    upper: Array  # upper bounds, also limited by acceleration, in [rad/s]
    near: Sequence[Proximity]  # the nearest pairs of links
    rows: Array  # gradients of their distances (m, n) in [m/rad]
    least: Array  # least rates of their distances (m) in [m/s]


class VelocityBounds:
    """Computes the joint speed bounds of an arm."""

    def __init__(self, model: RobotModel, settings: VelocityBoundsSettings) -> None:
        limits = model.limits
        self._model, self._settings, self._limits = model, settings, limits
        margins = np.array(settings.joint_margins)
        change = 1.5 * limits.acceleration**2 / limits.jerk + 0.025 * limits.acceleration
        # plain numbers by joint, as an array of few is slower than its numbers one by one
        self._joints = list(
            zip(
                (limits.lower + margins).tolist(),
                (limits.upper - margins).tolist(),
                limits.velocity.tolist(),
                limits.acceleration.tolist(),
                limits.jerk.tolist(),
                # what a speed can change by while its acceleration builds up and down, and
                # in the cycles of one solution
                change.tolist(),
                strict=True,
            )
        )
        self._nothing = np.empty((0, len(limits))), np.empty(0)

    def bounds(self, state: RobotState, period: float) -> Bounds:
        """Compute the bounds in a state."""
        settings = self._settings
        near = self._model.nearest(state.position, settings.horizon, settings.pairs)
        velocities, accelerations = state.velocity.tolist(), state.acceleration.tolist()
        longest = max(
            abs(velocity) / joint[3]
            for velocity, joint in zip(velocities, self._joints, strict=True)
        )
        last = MIN_APPROACH_CYCLES * period  # the last of the way is not run through in a cycle
        ways, both, lowest, highest = [], [], [], []
        for position, velocity, acceleration, joint in zip(
            state.position.tolist(), velocities, accelerations, self._joints, strict=True
        ):
            lower, upper, fastest, deceleration, jerk, change = joint
            below, above = position - lower, upper - position
            # all joints brake in step, so that the tool keeps its direction
            part = abs(velocity) / deceleration / longest if longest > 0.0 else 1.0
            share = settings.braking * max(part, MIN_DECELERATION_FACTOR)
            slowed, jerked = deceleration * share, jerk * share
            left = below - _lead(-velocity, -acceleration, jerk)
            down = _speed(left, slowed, jerked, min(fastest, left / last))
            left = above - _lead(velocity, acceleration, jerk)
            up = _speed(left, slowed, jerked, min(fastest, left / last))
            ways.append((below, above))
            both.append((-down, up))
            lowest.append(min(max(-down, velocity - change), up))
            highest.append(max(min(up, velocity + change), -down))
        lower_bounds, upper_bounds = np.array(lowest), np.array(highest)
        rows, least = self._nothing
        if near:
            rows = np.array([pair.gradient for pair in near])
            # no more than can be had soon: a fast approach is braked as hard as can be
            best = np.maximum(rows, 0.0) @ upper_bounds + np.minimum(rows, 0.0) @ lower_bounds
            allowed = [
                -settings.approach * max(pair.distance - settings.margin, 0.0) for pair in near
            ]
            least = np.minimum(allowed, best)
        return Bounds(ways, both, lower_bounds, upper_bounds, near, rows, least)

    def pressing(self, bounds: Bounds, forces: Sequence[float], factor: float) -> list[Limiter]:
        """Return the limiters of the active bounds and rows, the strongest first.

        Args:
            forces: Multipliers of the bounds (n), then of the rows (m); positive at upper bounds.
        """
        count, share = len(self._limits), min(max(factor, 0.0), 1.0)
        pressing = [place for place, force in enumerate(forces) if abs(force) > ACTIVE_FORCE]
        found = []
        for place in sorted(pressing, key=lambda each: -abs(forces[each])):
            if place >= count:
                pair = bounds.near[place - count]
                name = ' - '.join(pair.links)
                found.append(Limiter(Cause.COLLISION, name, pair.distance, share))
            else:
                found.append(self._bound(bounds, place, forces[place] > 0.0, share))
        return found

    def _bound(self, bounds: Bounds, joint: int, rising: bool, share: float) -> Limiter:
        """Return the limiter that causes a bound."""
        name, velocity = self._limits.names[joint], self._joints[joint][2]
        bound = float(bounds.upper[joint] if rising else -bounds.lower[joint])
        fastest = bounds.brakeable[joint][1] if rising else -bounds.brakeable[joint][0]
        if bound < fastest - ACTIVE_FORCE:
            return Limiter(Cause.JOINT_ACCELERATION, name, bound, share)
        if fastest >= velocity:
            return Limiter(Cause.JOINT_VELOCITY, name, bound, share)
        return Limiter(Cause.JOINT_POSITION, name, bounds.ways[joint][rising], share)


def _lead(velocity: float, acceleration: float, jerk: float) -> float:
    """Return the distance travelled while an acceleration is reduced to zero."""
    if acceleration <= 0.0:
        return 0.0
    time = acceleration / jerk
    return (max(velocity, 0.0) + acceleration * time / 3.0) * time


def _speed(way: float, deceleration: float, jerk: float, fastest: float) -> float:
    """Return the speed from which a joint can stop within ``way``, at most ``fastest``."""
    if way <= 0.0:
        return 0.0
    if fastest * (fastest / deceleration + deceleration / jerk) < 2.0 * way:
        return fastest  # the stop from there is shorter
    return min(brakeable(way, deceleration, jerk), fastest)


AXES = ('x', 'y', 'z', 'rotation x', 'rotation y', 'rotation z')  # names of the axes of a twist
OPTIMAL = 1  # exit flag of daqp
FREE = 1e30  # what daqp takes for no bound
BASE = np.eye(3)  # the axes of the base
REGULARIZATION = 1e-5  # weight of the joint speeds that keeps the program definite

SELF_MOTION_WEIGHT = 2e-3
"""Weight of joint speeds that do not move the tool.

It prevents a swing of the elbow where a bound limits one joint only for a moment. At a lasting
limit the swing costs little compared with its gain.
"""


@dataclass(frozen=True, slots=True)
class IkSettings:
    """Weights of the velocity inverse kinematics."""

    hold_weight: float = 30.0  # weight of held axes against commanded ones
    drift_weight: float = 0.01  # weight of axes that may drift
    escape: float = 0.3  # share of a joint's speed with which it leaves a singular pose
    # how it brakes in front of limits
    brakes: VelocityBoundsSettings = field(default_factory=VelocityBoundsSettings)


@dataclass(frozen=True, slots=True, eq=False)
class TwistTask:
    """A commanded tool twist and the axes to hold."""

    twist: Array  # linear [m/s], then angular [rad/s], along the task's axes (6)
    axes: Array  # rotation from the task's axes to the base link (3, 3)
    commanded: Mask  # mask of the axes that the command moves (6)
    drifting: Mask  # mask of the other axes that need not be held (6)
    # twist that corrects the held axes (6)
    correction: Array = field(default_factory=lambda: np.zeros(6))


@dataclass(frozen=True, slots=True, eq=False)
class IkAnswer:
    """Joint speeds, and a report of what limits them."""

    velocity: Array  # joint speeds in [rad/s]
    report: MotionReport  # what limits them


class VelocityIk:
    """Velocity inverse kinematics of an arm.

    Its only state is in :class:`ReachLimit`.
    """

    def __init__(self, model: RobotModel, settings: IkSettings | None = None) -> None:
        self._model = model
        self._settings = settings or IkSettings()
        self._limits = model.limits
        self._velocity_bounds = VelocityBounds(model, self._settings.brakes)
        length = model.reach / 3.0
        self._scale = np.array([1.0 / length] * 3 + [1.0] * 3)
        self._weighed = b''
        self._axis_weights = self._scale
        self._identity = np.eye(len(model))
        self._regularization = REGULARIZATION * self._identity
        settings = self._settings
        # bounds of joints, then of near pairs, as daqp reads them
        self._above = np.full(len(model) + settings.brakes.pairs, FREE)
        self._below = np.zeros_like(self._above)
        self._reach_limit = ReachLimit(model.limits, settings.escape, settings.brakes.braking)

    def cartesian(self, state: RobotState, task: TwistTask, period: float) -> IkAnswer:
        """Compute the joint speeds for a tool twist."""
        weights = self._weights(task)
        bounds = self._velocity_bounds.bounds(state, period)
        # the directions of the weighted task: how well the command does while held axes stay
        position = state.position
        jacobian = self._turned(position, task.axes, weights)
        command, correction = task.twist * weights, task.correction * weights
        found = directions(jacobian, command, correction, self._limits.velocity)

        def jacobian_at(other: Array) -> Array:
            return self._turned(other, task.axes, weights)

        found = self._reach_limit.slowed(jacobian_at, position, found, command)
        hessian = jacobian.T @ jacobian
        if found.damped:
            hessian += (found.joints.T * found.damping) @ found.joints
        if len(found.joints) < len(hessian):
            still = self._identity - found.joints.T @ found.joints
            hessian += SELF_MOTION_WEIGHT * still
        gradient = -((command + correction) @ jacobian)
        way = self._reach_limit.way_out(jacobian_at, position, found, command)
        if way is not None:
            hessian += way.weight * np.outer(way.direction, way.direction)
            gradient -= (way.weight * way.speed) * way.direction
        return self._answer(hessian, gradient, bounds, asked=(jacobian, command), found=found)

    def joints(
        self, state: RobotState, velocity: Array, commanded: Mask, period: float
    ) -> IkAnswer:
        """Compute joint speeds near the commanded ones; hold the other joints."""
        self._reach_limit.forget()
        weight = np.where(commanded, 1.0, self._settings.hold_weight)
        jacobian, command = np.diag(weight), weight * velocity
        bounds = self._velocity_bounds.bounds(state, period)
        return self._answer(
            jacobian * jacobian, -weight * command, bounds, asked=(jacobian, command)
        )

    def _weights(self, task: TwistTask) -> Array:
        """Return the axis weights, which depend only on the commanded and drifting axes."""
        key = task.commanded.tobytes() + task.drifting.tobytes()
        if key != self._weighed:
            weights = np.where(task.commanded, 1.0, self._settings.hold_weight)
            weights[task.drifting & ~task.commanded] = self._settings.drift_weight
            self._weighed, self._axis_weights = key, frozen(weights * self._scale)
        return self._axis_weights

    def _turned(self, position: Array, axes: Array, weights: Array) -> Array:
        """Return the weighted Jacobian along a task's axes."""
        jacobian = self._model.jacobian(position)
        if axes is not BASE:
            jacobian = turned_twists(axes, jacobian)
        return jacobian * weights[:, None]

    def _answer(
        self,
        hessian: Array,
        gradient: Array,
        bounds: Bounds,
        *,
        asked: tuple[Array, Array],
        found: Directions | None = None,
    ) -> IkAnswer:
        """Solve the program and report limiters; ``asked`` is the weighted (Jacobian, command)."""
        jacobian, command = asked
        hessian += self._regularization
        solution = self._minimum(hessian, gradient, bounds, bounds.lower, bounds.upper)
        if solution is None:  # too fast for the rows; standing still is feasible
            box = np.minimum(bounds.lower, 0.0), np.maximum(bounds.upper, 0.0)
            solution = self._minimum(hessian, gradient, bounds, *box)
        if solution is None:
            stuck = Limiter(Cause.SOLVER, 'no answer; standing still', 0.0, 0.0)
            return IkAnswer(np.zeros(len(gradient)), MotionReport(0.0, (stuck,)))
        velocity, forces = solution
        size = float(command @ command)
        factor = float(command @ (jacobian @ velocity)) / size if size else 1.0
        limiters = self._velocity_bounds.pressing(bounds, forces, factor)
        if found is not None and size:
            limiters += _losses(found, command, factor)
        return IkAnswer(velocity, MotionReport(factor, tuple(limiters)))

    def _minimum(
        self, hessian: Array, gradient: Array, bounds: Bounds, lower: Array, upper: Array
    ) -> tuple[Array, Sequence[float]] | None:
        """Minimise x'Hx/2 + g'x with x in a box and rows x >= least, by daqp.

        Returns:
            The variables (n), and multipliers of the bounds (n), then of the rows (m): positive
            at an active upper bound, negative at an active lower one. None if no x is feasible.
        """
        joints, count = len(lower), len(lower) + len(bounds.least)
        above, below = self._above[:count], self._below[:count]
        above[:joints], below[:joints], below[joints:] = upper, lower, bounds.least
        values, _, flag, info = daqp.solve(hessian, gradient, bounds.rows, above, below)
        if flag != OPTIMAL or not math.isfinite(values.sum()):
            return None
        return np.minimum(np.maximum(values, lower), upper), np.asarray(info['lam']).tolist()


def _losses(found: Directions, command: Array, factor: float) -> list[Limiter]:
    """Return limiters for the parts of the command that singular directions reduce."""
    if factor > 0.99:
        return []
    parts = command @ found.tool
    kept = float(np.sum(found.speed_factors * parts * parts) / (command @ command))
    if kept > 0.99:
        return []
    axis = AXES[int(np.argmax(np.abs(command)))]
    left = min(max(min(kept, factor), 0.0), 1.0)
    return [Limiter(Cause.SINGULARITY, f'{axis} is lost here', found.least, left)]
