# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Jerk-limited steps between states of motion, by ruckig from state to state.

Way-points are never given to ruckig: it would send them to a service on the network.
"""

from __future__ import annotations

import numpy as np
import ruckig

from arm_model import Array, JointLimits, Native, RobotState

CONTINUOUS_DISTANCE = 1e6  # what counts for the way of a joint without end in [rad]

MIN_ACCELERATION_FACTOR = 0.05
"""Least share of its acceleration that a joint keeps while others take longer."""


class Plan:
    """A jerk-limited motion from one state to another."""

    __slots__ = ('_begin', '_lower', '_trajectory', '_upper', 'duration')

    def __init__(self, trajectory: Native, begin: Array | None = None) -> None:
        """Wrap a trajectory of ruckig.

        Args:
            begin: Where it begins in [rad], for one that was planned from zero.
        """
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
        limits, demand = self.limits, self._to_velocity
        present = np.abs(state.acceleration) / limits.acceleration
        share = _shares(velocity - state.velocity, limits.acceleration)
        jerk = limits.jerk * np.maximum(share, present)  # what is there is taken back in time
        unwound = state.acceleration * np.abs(state.acceleration) / (2.0 * jerk)
        share = _shares(velocity - state.velocity - unwound, limits.acceleration)
        # no time to lose where the speed would overrun its limit
        share[np.abs(state.velocity + unwound) > limits.velocity] = 1.0
        _start(demand, state)
        demand.max_acceleration = limits.acceleration * share
        demand.max_jerk = limits.jerk * np.maximum(share, np.minimum(present, 1.0))
        demand.target_velocity = velocity
        return self._plan(demand)

    def brake(self, state: RobotState) -> Plan | None:
        """Plan the shortest way to a standstill, each joint for itself.

        It is planned from zero, since ruckig counts zero among the extremes of such a motion.
        """
        demand = self._to_standstill
        demand.current_velocity = state.velocity
        demand.current_acceleration = state.acceleration
        return self._plan(demand, state.position)

    def to_state(
        self, state: RobotState, target: RobotState, shortest: float | None = None
    ) -> Plan | None:
        """Plan to a state.

        Args:
            target: Where to arrive, its velocity and acceleration within the limits.
        """
        demand = self._to_position
        _start(demand, state)
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


def _start(demand: Native, state: RobotState) -> None:
    demand.current_position = state.position
    demand.current_velocity = state.velocity
    demand.current_acceleration = state.acceleration


def _shares(change: Array, acceleration: Array) -> Array:
    """Return the share of each joint's acceleration that changes all speeds in the same time."""
    needed = np.abs(change) / acceleration
    shares: Array = np.maximum(needed / max(float(needed.max()), 1e-12), MIN_ACCELERATION_FACTOR)
    return shares


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


def brakeable_velocity(distance: Array, limits: JointLimits) -> Array:
    """Return the velocity that can be braked to a standstill within a distance.

    A stop from velocity v with a jerk j up to the deceleration a takes the way
    v/2 (v/a + a/j) where a is reached (v >= a^2/j), v sqrt(v/j) where it is not.

    Args:
        distance: Ways left in [rad] (n) or (k, n); negative ones count as zero.

    Returns:
        Velocities in [rad/s], at most those of the limits.
    """
    return np.minimum(brakeable(distance, limits.acceleration, limits.jerk), limits.velocity)


def brakeable(distance: Array, acceleration: Array, jerk: Array) -> Array:
    """Return the speed that can be braked to a standstill within a distance, of any size.

    Args:
        distance: Ways left in [rad]; negative ones count as zero.
    """
    way = np.minimum(np.maximum(distance, 0.0), CONTINUOUS_DISTANCE)
    half = 0.5 * acceleration * acceleration / jerk
    short = np.cbrt(way * way * jerk)
    long = np.sqrt(half * half + 2.0 * acceleration * way) - half
    speeds: Array = np.where(way <= 2.0 * half * acceleration / jerk, short, long)
    return speeds
