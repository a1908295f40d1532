# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Online trajectory generation: jerk-limited motions from state to state, by ruckig.

Waypoints are never passed to ruckig, which would send them to a service on the network.
"""

from __future__ import annotations

import math

import numpy as np
import ruckig

from arm_model import Array, JointLimits, Native, RobotState

MIN_ACCELERATION_FACTOR = 0.05
"""Least share of its acceleration that a joint uses while slower joints need more time."""

SHORTEST_CHANGE = 1e-12  # time of a speed change that counts as zero in [s]


class Plan:
    """A jerk-limited motion from one state to another."""

    __slots__ = ('_begin', '_lower', '_trajectory', '_upper', 'duration')

    def __init__(self, trajectory: Native, begin: Array | None = None) -> None:
        """Wrap a ruckig trajectory; ``begin`` in [rad] offsets one planned from zero."""
        self._begin = begin
        self._trajectory = trajectory
        self.duration = float(trajectory.duration)
        self._lower: Array | None = None
        self._upper: Array | None = None

    def at(self, time: float) -> RobotState:
        """Return the state at a time since the start; after the end, velocity is constant."""
        position, velocity, acceleration = self._trajectory.at_time(time)
        places = np.array(position)
        if self._begin is not None:
            places += self._begin
        return RobotState(places, np.array(velocity), np.array(acceleration))

    @property
    def switches(self) -> Array:
        """Times at which the jerk of a joint changes, to the end, in [s]."""
        ends = [np.array([self.duration])]
        for profile in self._trajectory.profiles[0]:
            phases = (*profile.brake.t, *profile.t)
            ends.append(np.minimum(np.cumsum(phases), self.duration))
        return np.unique(np.concatenate(ends))

    @property
    def extremes(self) -> tuple[Array, Array]:
        """Least and greatest position in [rad] of each joint during the motion."""
        if self._lower is None or self._upper is None:
            bounds = self._trajectory.position_extrema
            self._lower = np.array([bound.min for bound in bounds])
            self._upper = np.array([bound.max for bound in bounds])
            if self._begin is not None:
                self._lower, self._upper = self._lower + self._begin, self._upper + self._begin
        return self._lower, self._upper


class OnlineTrajectoryGenerator:
    """Plans jerk-limited motions of one arm.

    It runs ruckig with the arm's limits. Methods return None if ruckig finds no solution; callers
    then use :func:`hard_brake`.
    """

    def __init__(self, limits: JointLimits) -> None:
        count = len(limits)
        self.limits = limits
        self._numbers = list(
            zip(
                limits.velocity.tolist(),
                limits.acceleration.tolist(),
                limits.jerk.tolist(),
                strict=True,
            )
        )
        self._otg = ruckig.Ruckig(count)
        velocity, apart = ruckig.ControlInterface.Velocity, ruckig.Synchronization.No
        self._to_velocity = self._input(velocity, apart)
        self._to_position = self._input(
            ruckig.ControlInterface.Position, ruckig.Synchronization.Phase
        )
        self._to_standstill = self._input(velocity, apart)
        self._to_standstill.target_velocity = np.zeros(count)
        self._to_standstill.current_position = np.zeros(count)

    def to_velocity(self, state: RobotState, velocity: Array) -> Plan | None:
        """Plan to a velocity with synchronised joints, which keeps the direction.

        Each joint gets a share of its acceleration and jerk: its time for the change of speed
        relative to that of the slowest joint. Unlike ruckig's own synchronisation, this works
        when the target changes in every cycle.
        """
        demand, target = self._to_velocity, velocity.tolist()
        speeds, accelerations = state.velocity.tolist(), state.acceleration.tolist()
        rows = list(zip(target, speeds, accelerations, self._numbers, strict=True))
        changes = [abs(to - speed) / most for to, speed, _, (_, most, _) in rows]
        longest = max(*changes, SHORTEST_CHANGE)
        unwound = []
        for change, (_, _, acceleration, (_, most, jerk)) in zip(changes, rows, strict=True):
            # the present acceleration is reduced in time
            share = max(change / longest, MIN_ACCELERATION_FACTOR, abs(acceleration) / most)
            unwound.append(acceleration * abs(acceleration) / (2.0 * jerk * share))
        changes = [
            abs(to - speed - back) / most
            for back, (to, speed, _, (_, most, _)) in zip(unwound, rows, strict=True)
        ]
        longest = max(*changes, SHORTEST_CHANGE)
        most_acceleration, most_jerk = [], []
        for change, back, row in zip(changes, unwound, rows, strict=True):
            _, speed, acceleration, (fastest, most, jerk) = row
            share = max(change / longest, MIN_ACCELERATION_FACTOR)
            if abs(speed + back) > fastest:  # no time to lose
                share = 1.0
            most_acceleration.append(most * share)
            most_jerk.append(jerk * max(share, min(abs(acceleration) / most, 1.0)))
        demand.current_position = state.position.tolist()
        demand.current_velocity, demand.current_acceleration = speeds, accelerations
        demand.max_acceleration, demand.max_jerk = most_acceleration, most_jerk
        demand.target_velocity = target
        return self._plan(demand)

    def step(self, state: RobotState, velocity: Array, period: float) -> RobotState:
        """Return the state after one period of the plan of :meth:`to_velocity`."""
        plan = self.to_velocity(state, velocity)
        if plan is None:
            return hard_brake(state, self.limits, period)
        if period >= plan.duration and not velocity.any():
            return RobotState.at_rest(plan.at(plan.duration).position)
        return plan.at(period)

    def brake(self, state: RobotState) -> Plan | None:
        """Plan the fastest stop, each joint individually.

        The plan starts at position zero, since ruckig includes zero in the extremes of a stop.
        """
        demand = self._to_standstill
        demand.current_velocity = state.velocity.tolist()
        demand.current_acceleration = state.acceleration.tolist()
        return self._plan(demand, state.position)

    def to_state(
        self, state: RobotState, target: RobotState, shortest: float | None = None
    ) -> Plan | None:
        """Plan to a state with feasible velocity and acceleration, in ``shortest`` [s] or more."""
        demand = self._to_position
        demand.current_position = state.position.tolist()
        demand.current_velocity = state.velocity.tolist()
        demand.current_acceleration = state.acceleration.tolist()
        demand.target_position = target.position
        demand.target_velocity = target.velocity
        demand.target_acceleration = target.acceleration
        demand.minimum_duration = shortest
        return self._plan(demand)

    def _input(self, interface: Native, synchronization: Native) -> Native:
        demand = ruckig.InputParameter(len(self.limits))
        demand.control_interface = interface
        demand.synchronization = synchronization
        demand.max_velocity = self.limits.velocity
        demand.max_acceleration = self.limits.acceleration
        demand.max_jerk = self.limits.jerk
        return demand

    def _plan(self, demand: Native, begin: Array | None = None) -> Plan | None:
        trajectory = ruckig.Trajectory(len(self.limits))
        try:
            result = self._otg.calculate(demand, trajectory)
        except ruckig.RuckigError:
            return None
        if result not in {ruckig.Result.Working, ruckig.Result.Finished}:
            return None
        return Plan(trajectory, begin)


def hard_brake(state: RobotState, limits: JointLimits, period: float) -> RobotState:
    """Decelerate for one period at the acceleration limit, if ruckig finds no solution.

    Returns:
        The state at the end; the jerk limit is not kept.
    """
    step = limits.acceleration * period
    velocity = np.sign(state.velocity) * np.maximum(np.abs(state.velocity) - step, 0.0)
    position = state.position + 0.5 * (state.velocity + velocity) * period
    return RobotState(
        position,
        velocity,
        np.where(velocity == 0.0, 0.0, -np.sign(velocity) * limits.acceleration),
    )


def brakeable(way: float, acceleration: float, jerk: float) -> float:
    """Return the greatest velocity from which a stop within a distance is possible.

    A stop from velocity v with jerk j and deceleration a takes the distance
    v/2 (v/a + a/j) if a is reached (v >= a^2/j), else v sqrt(v/j). A negative distance
    counts as zero.
    """
    way = max(way, 0.0)
    half = 0.5 * acceleration * acceleration / jerk
    if way * jerk <= 2.0 * half * acceleration:
        return float((way * way * jerk) ** (1.0 / 3.0))
    return math.sqrt(half * half + 2.0 * acceleration * way) - half
