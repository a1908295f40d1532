# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What the states need of a policy."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from ..gait.velocity import Velocity
from ..model.quadruped import Targets
from ..states.measurement import ImuSample, JointSample


@dataclass(frozen=True, slots=True)
class PolicyStep:
    """What a policy answers in one step.

    Attributes:
        targets: Positions of all joints in [rad]; None when the answer cannot be used.
        reason: Why it cannot be used.
    """

    targets: Targets | None
    reason: str = ''


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
            velocity: Velocity that is asked for.
            dt: Duration of the step in [s].
        """
        ...
