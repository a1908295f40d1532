# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Where the body has walked to, from the legs that stand: heading from the attitude.

There are no contact switches. A foot is taken to stand where its *commanded* height was the
lowest, a servo's lag ago; without commands, where its measured height is. The body moves opposite
to the feet that stood at both ends of a period; without any the last velocity is held. The feet
are balls that roll on the ground while the leg swings over them: their centres go a little way
along, which is more than a tenth of the way (radius over height of the hip).
"""

from __future__ import annotations

from dataclasses import dataclass
import math

import numpy as np
from numpy.typing import NDArray

from .feet import FootPoses
from .filters import low_pass_share
from .rotation import about_z, multiply, Quaternion, yaw_of

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

LONGEST_GAP = 0.2  # [s] more than that cannot be bridged: the body may have been carried
DRIFT = 0.07  # share of the way that is the standard deviation of the position
LEAST_VARIANCE = 1e-4  # [m²]
KEPT_COMMANDS = 32


@dataclass(frozen=True, slots=True)
class OdometrySettings:
    """How the legs are read.

    Attributes:
        delay: By which the servos follow their commands [s].
        tolerance: Height above the lowest foot up to which a foot is taken to stand [m].
        margin: Before and after a swing in which a foot does not count [s].
        cutoff: Of the low-pass of the velocity that is published [Hz].
        command_age: Commands older than that are not looked at [s].
        scale_x: What the way forward is multiplied by.
        scale_y: What the way sideways is multiplied by.
    """

    delay: float = 0.04
    tolerance: float = 0.002
    margin: float = 0.02
    cutoff: float = 5.0
    command_age: float = 0.3
    scale_x: float = 1.0
    scale_y: float = 1.0


@dataclass(frozen=True, slots=True)
class OdometryState:
    """Where the body is, in the frame in which it began.

    Attributes:
        x: Position of base_link [m].
        y: Position of base_link [m].
        height: Of base_link above the ground [m].
        rotation: From base_link to odom, (x, y, z, w); it began with yaw zero.
        velocity_x: Forward, in base_link turned level [m/s].
        velocity_y: To the left, in base_link turned level [m/s].
        distance: Way so far [m].
        standing: Feet that are taken to stand, in URDF order.
    """

    x: float
    y: float
    height: float
    rotation: Quaternion
    velocity_x: float
    velocity_y: float
    distance: float
    standing: tuple[bool, ...]

    @property
    def position_variance(self) -> float:
        """Variance of x and y [m²], which grows with the way."""
        return LEAST_VARIANCE + (DRIFT * self.distance) ** 2


class LegOdometry:
    """Adds up what the standing legs say."""

    def __init__(self, settings: OdometrySettings, foot_radius: float) -> None:
        """Begin at the origin, with the first update."""
        self._settings = settings
        self._radius = foot_radius
        # replaced as a whole: commands come from another thread than measurements
        self._commands: tuple[tuple[float, Array], ...] = ()
        self._last: tuple[float, FootPoses, Flags] | None = None
        self._yaw0: float | None = None
        self._place = np.zeros(2)
        self._held = np.zeros(2)  # [m/s] in the body turned level, raw
        self._smooth = np.zeros(2)
        self._distance = 0.0

    def command(self, time: float, feet: FootPoses) -> None:
        """Note where the feet were sent.

        Args:
            time: When [s].
            feet: Where.
        """
        self._commands = (*self._commands, (time, feet.position))[-KEPT_COMMANDS:]

    def update(self, time: float, feet: FootPoses, attitude: Quaternion) -> OdometryState:
        """Take a measurement.

        Args:
            time: When [s].
            feet: Where they are measured.
            attitude: From base_link to the world.
        """
        yaw = yaw_of(attitude)
        if self._yaw0 is None:
            self._yaw0 = yaw
        rotation = multiply(about_z(-self._yaw0), attitude)
        matrix = _matrix(rotation)
        standing = self._standing(time, feet.position, matrix)
        turned = FootPoses(feet.position @ matrix.T, matrix @ feet.rotation)
        self._integrate(time, turned, standing, yaw - self._yaw0)
        self._last = time, turned, standing
        return OdometryState(
            x=float(self._place[0]),
            y=float(self._place[1]),
            height=self._height(turned.position, standing),
            rotation=rotation,
            velocity_x=float(self._smooth[0]),
            velocity_y=float(self._smooth[1]),
            distance=self._distance,
            standing=tuple(map(bool, standing)),
        )

    def _standing(self, time: float, feet: Array, matrix: Array) -> Flags:
        settings, commands = self._settings, self._commands
        at = time - settings.delay
        recent = [f for t, f in commands if abs(t - at) <= settings.margin]
        if not recent:
            older = [f for t, f in commands if at - settings.command_age <= t <= at]
            recent = older[-1:] or [feet]
        standing = np.ones(len(feet), dtype=np.bool_)
        for commanded in recent:
            heights = commanded @ matrix[2]
            standing &= heights <= heights.min() + settings.tolerance
        return standing

    def _integrate(self, time: float, feet: FootPoses, standing: Flags, heading: float) -> None:
        if self._last is None:
            return
        last_time, last_feet, stood = self._last
        elapsed = time - last_time
        if not 0.0 < elapsed <= LONGEST_GAP:
            self._held, self._smooth = np.zeros(2), np.zeros(2)
            return
        cosine, sine = math.cos(heading), math.sin(heading)
        to_odom = np.array([[cosine, -sine], [sine, cosine]])
        both = standing & stood
        if both.any():
            moved = (self._rolled(last_feet, feet) - feet.position + last_feet.position)[both, :2]
            scale = np.array([self._settings.scale_x, self._settings.scale_y])
            self._held = (to_odom.T @ moved.mean(axis=0)) * scale / elapsed
        step = to_odom @ self._held * elapsed
        self._place = self._place + step
        self._distance += float(np.hypot(*step))
        share = low_pass_share(self._settings.cutoff, elapsed)
        self._smooth = self._smooth + share * (self._held - self._smooth)

    def _rolled(self, before: FootPoses, after: FootPoses) -> Array:
        """Return how far the centre of each foot has rolled over the ground [m], (4, 3)."""
        turn = after.rotation @ before.rotation.transpose(0, 2, 1)
        about_x, about_y = turn[:, 2, 1] - turn[:, 1, 2], turn[:, 0, 2] - turn[:, 2, 0]
        # angular step times the vector from the ground to the centre
        return np.stack([about_y, -about_x, np.zeros(len(turn))], axis=1) * (self._radius / 2)

    def _height(self, feet: Array, standing: Flags) -> float:
        heights = feet[standing, 2] if standing.any() else feet[:, 2]
        return float(-heights.mean()) + self._radius


def _matrix(rotation: Quaternion) -> Array:
    x, y, z, w = rotation
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
