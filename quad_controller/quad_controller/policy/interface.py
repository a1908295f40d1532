# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What the states need of a policy."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from quad_description import ImuSample, JointSample, Targets

from ..gait.velocity import Velocity


@dataclass(frozen=True, slots=True)
class PolicyStep:
    """What a policy answers in one step.

    Attributes:
        targets: Positions of all joints in [rad]; None when the answer cannot be used.
        reason: Why it cannot be used.
    """

    targets: Targets | None
    reason: str = ''


def missing_inputs(joints: JointSample, imu: ImuSample) -> str:
    """Return what is not measured that a policy needs; nothing when all is there.

    Args:
        joints: The joints.
        imu: Attitude and turning.
    """
    if joints.velocities is None:
        return 'a policy needs the velocities of the joints, which /joint_states does not have'
    if imu.angular_velocity is None:
        return 'a policy needs the angular velocity, which /imu does not have'
    return ''


class Policy(Protocol):
    """A trained policy that fits the robot."""

    @property
    def name(self) -> str:
        """How it is called in messages."""
        ...

    def reset(self, others: Targets) -> None:
        """Begin anew: no previous action, phase zero.

        Args:
            others: Positions of all joints, for those that the policy does not move [rad].
        """
        ...

    def step(
        self, joints: JointSample, imu: ImuSample, velocity: Velocity, dt: float
    ) -> PolicyStep:
        """Advance.

        Args:
            joints: Measured joints.
            imu: Measured attitude and turning.
            velocity: Velocity that is requested.
            dt: Duration of the step in [s].
        """
        ...
