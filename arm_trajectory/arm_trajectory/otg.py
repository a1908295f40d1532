# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Jerk-limited steps between states of motion, by ruckig from state to state.

Way-points are never given to ruckig: it would send them to a service on the network.
"""

from __future__ import annotations

import math

import numpy as np
import ruckig

from arm_model import Array, JointLimits, Native, RobotState

MIN_ACCELERATION_FACTOR = 0.05
"""Least share of its acceleration that a joint keeps while others take longer."""

SHORTEST_CHANGE = 1e-12  # time of a change of speed that counts for none in [s]


class Plan:
    """A jerk-limited motion from one state to another."""

    __slots__ = ('_begin', '_lower', '_trajectory', '_upper', 'duration')

    def __init__(self, trajectory: Native, begin: Array | None = None) -> None:
        """Wrap a trajectory of ruckig; one planned from zero begins at ``begin`` in [rad]."""
        self._begin = begin
        self._trajectory = trajectory
        self.duration = float(trajectory.duration)
        self._lower: Array | None = None
        self._upper: Array | None = None

    def at(self, time: float) -> RobotState:
        """Return the state at a time since the start; beyond the end it goes on evenly."""
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
        """Least and greatest position of each joint on the way in [rad]."""
        if self._lower is None or self._upper is None:
            bounds = self._trajectory.position_extrema
            self._lower = np.array([bound.min for bound in bounds])
            self._upper = np.array([bound.max for bound in bounds])
            if self._begin is not None:
                self._lower, self._upper = self._lower + self._begin, self._upper + self._begin
        return self._lower, self._upper


class OnlineTrajectoryGenerator:
    """Plans jerk-limited motions of one arm.

    It is ruckig with the arm's limits; None where ruckig has no answer, which its callers meet
    with :func:`hard_brake`.
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
        """Plan to a velocity, the joints in step so that the direction is kept.

        Each joint gets the share of its acceleration and jerk that its change of speed has in the
        change of the joint that needs longest. Other than ruckig's own synchronisation this holds
        when the target changes in every cycle.
        """
        demand, target = self._to_velocity, velocity.tolist()
        speeds, accelerations = state.velocity.tolist(), state.acceleration.tolist()
        rows = list(zip(target, speeds, accelerations, self._numbers, strict=True))
        changes = [abs(to - speed) / most for to, speed, _, (_, most, _) in rows]
        longest = max(*changes, SHORTEST_CHANGE)
        unwound = []
        for change, (_, _, acceleration, (_, most, jerk)) in zip(changes, rows, strict=True):
            # what is there is taken back in time
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
        """Return the state after a period on the way to a velocity, as :meth:`to_velocity`."""
        plan = self.to_velocity(state, velocity)
        if plan is None:
            return hard_brake(state, self.limits, period)
        if period >= plan.duration and not velocity.any():
            return RobotState.at_rest(plan.at(plan.duration).position)
        return plan.at(period)

    def brake(self, state: RobotState) -> Plan | None:
        """Plan the shortest way to a standstill, each joint for itself.

        It is planned from zero, since ruckig counts zero among the extremes of such a motion.
        """
        demand = self._to_standstill
        demand.current_velocity = state.velocity.tolist()
        demand.current_acceleration = state.acceleration.tolist()
        return self._plan(demand, state.position)

    def to_state(
        self, state: RobotState, target: RobotState, shortest: float | None = None
    ) -> Plan | None:
        """Plan to a state whose velocity and acceleration are within the limits."""
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
    """Slow down for a period with the greatest deceleration: for when ruckig has no answer.

    Returns:
        The state at the end; the jerk limit does not hold on the way.
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
    """Return the velocity that can be braked to a standstill within a way, of any size.

    A stop from velocity v with a jerk j up to the deceleration a takes the way
    v/2 (v/a + a/j) where a is reached (v >= a^2/j), v sqrt(v/j) where it is not. A way below zero
    counts as zero.
    """
    way = max(way, 0.0)
    half = 0.5 * acceleration * acceleration / jerk
    if way * jerk <= 2.0 * half * acceleration:
        return float((way * way * jerk) ** (1.0 / 3.0))
    return math.sqrt(half * half + 2.0 * acceleration * way) - half
