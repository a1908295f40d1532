# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What the states need of a policy."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

from quad_description import ImuSample, JointSample, Targets
from quad_description.rotations import Vector

from ..gait.velocity import Velocity

Numbers = npt.NDArray[np.float32]


@dataclass(frozen=True, slots=True)
class PolicyInputs:
    """What a policy may see in one step."""

    joints: JointSample  # measured joints
    imu: ImuSample  # measured attitude and turning
    velocity: Velocity  # velocity that is requested
    # of the body in its own frame in [m/s], estimated; None where nobody does
    linear_velocity: Vector | None = None
    # which feet are on the ground, in the order of :data:`quad_description.FEET`; None where
    # nobody estimates it
    foot_contacts: tuple[bool, ...] | None = None


@dataclass(frozen=True, slots=True)
class PolicyStep:
    """What a policy answers in one step."""

    # positions of all joints in [rad]; None when the answer cannot be used
    targets: Targets | None
    reason: str = ''  # why it cannot be used
    observation: Numbers | None = None  # what the network was given; None when it was not asked
    action: Numbers | None = None  # what it answered


class Policy(Protocol):
    """A trained policy that fits the robot."""

    @property
    def name(self) -> str:
        """How it is called in messages."""
        ...

    @property
    def needs_linear_velocity(self) -> bool:
        """Whether it sees the linear velocity of the body, which has to be estimated."""
        ...

    @property
    def needs_foot_contacts(self) -> bool:
        """Whether it sees which feet are on the ground, which has to be estimated."""
        ...

    @property
    def digest(self) -> str:
        """SHA-256 of its file."""
        ...

    def missing(self, inputs: PolicyInputs) -> str:
        """Return what it needs and nobody measures; nothing when all is there."""
        ...

    def reset(self, others: Targets) -> None:
        """Begin anew: no previous action, phase zero.

        Args:
            others: Positions of all joints, for those that the policy does not move [rad].
        """
        ...

    def step(self, inputs: PolicyInputs, dt: float) -> PolicyStep:
        """Advance by some [s]."""
        ...
