# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What is requested while the robot moves: a velocity, which goes stale, and a body pose."""

from __future__ import annotations

import math

from ..gait.body import BodyPose, UPRIGHT
from ..gait.velocity import REST, Velocity
from .modes import Answer, MOVING_STATES, State


class Commands:
    """The newest commands."""

    def __init__(self, timeout: float) -> None:
        """Start at rest.

        Args:
            timeout: A velocity that is older counts as zero, in [s].
        """
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
