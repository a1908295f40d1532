# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""How the body stands on its feet, as a person requests it."""

from __future__ import annotations

from dataclasses import dataclass, replace

from quad_description.rotations import from_roll_pitch_yaw, Quaternion

from .exceptions import SettingError


@dataclass(frozen=True, slots=True)
class BodyPose:
    """Offset of the body from how it stands by itself.

    Attributes:
        height: Upwards [m].
        roll: Right side down [rad].
        pitch: Nose down [rad].
        yaw: Nose to the left [rad].
    """

    height: float = 0.0
    roll: float = 0.0
    pitch: float = 0.0
    yaw: float = 0.0

    def quaternion(self) -> Quaternion:
        """Return the attitude as a unit quaternion (x, y, z, w).

        Roll, pitch, yaw about fixed axes, as in REP 103.
        """
        return from_roll_pitch_yaw(self.roll, self.pitch, self.yaw)


NEUTRAL = BodyPose()
"""As the robot stands by itself."""


@dataclass(frozen=True, slots=True)
class PoseSteps:
    """By how much a key changes the pose, and how far it may go.

    Attributes:
        height_step: Of one stroke [m].
        height_limit: Up or down [m].
        angle_step: Of one stroke [rad].
        angle_limit: To either side [rad].

    Raises:
        SettingError: A step is not positive, or above its limit.
    """

    height_step: float = 0.005
    height_limit: float = 0.03
    angle_step: float = 0.05
    angle_limit: float = 0.3

    def __post_init__(self) -> None:
        """Check the order of the values."""
        for name, step, limit in (
            ('height', self.height_step, self.height_limit),
            ('angle', self.angle_step, self.angle_limit),
        ):
            if not 0.0 < step <= limit:
                raise SettingError(
                    f'{name}_step is {step}: it must be above 0 and at most {name}_limit, {limit}'
                )

    def moved(self, pose: BodyPose, direction: BodyPose) -> BodyPose:
        """Return the pose one stroke further; at a limit it stays there.

        Args:
            pose: Present pose.
            direction: Steps of each part, 1 or -1 for those that change.
        """
        return replace(
            pose,
            height=_moved(pose.height, direction.height, self.height_step, self.height_limit),
            roll=_moved(pose.roll, direction.roll, self.angle_step, self.angle_limit),
            pitch=_moved(pose.pitch, direction.pitch, self.angle_step, self.angle_limit),
            yaw=_moved(pose.yaw, direction.yaw, self.angle_step, self.angle_limit),
        )


def _moved(value: float, steps: float, step: float, limit: float) -> float:
    moved = min(max(value + steps * step, -limit), limit)
    return 0.0 if abs(moved) < step / 1000 else moved  # rounding must not leave the middle
