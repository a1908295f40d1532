# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Where the body has walked to, from the legs that stand: heading from the attitude.

There are no contact switches. A foot is taken to stand where its *commanded* height was the
lowest, a servo's lag ago; without commands, where its measured height is. Heights are those above
the ground that the feet were sent to, which may slope. The body moves opposite
to the feet that stood at both ends of a period; without any the last velocity is held. The feet
are balls that roll on the ground while the leg swings over them: their centres go a little way
along, which is more than a tenth of the way (radius over height of the hip).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
import math
from operator import itemgetter

from quad_description import ContactSource, FootPose, MAX_TILT, OdometryState
from quad_description.rotations import (
    about_z,
    conjugate,
    multiply,
    Quaternion,
    rotate,
    tilt_of,
    Vector,
    yaw_of,
)

from .filters import low_pass_share

Flags = tuple[bool, ...]

MAX_GAP = 0.2  # [s] more than that cannot be bridged: the body may have been carried
KEPT_COMMANDS = 32
GROUND_TIME = 1.0  # [s] in which every foot stands, whatever the gait
MIN_DEVIATION = 0.01  # [m] of the position, however short the way was
DRIFT = 0.07  # share of the way that is the standard deviation of the position
GAP_SPEED = 0.3  # [m/s] at which a robot that is not seen may have gone on
FALL_DEVIATION = 0.1  # [m] by which a body that falls or rolls may have gone
YAW_DRIFT = 1.5e-4  # [rad/s] half a degree a minute; ours: no page says how the IMU drifts
REST = (0.0, 0.0)
_Z = itemgetter(2)


SCALES = (0.1, 10.0)
"""What a scale of odometry may be; beyond, a way was given in another unit."""


@dataclass(frozen=True, slots=True)
class OdometrySettings:
    """How the legs are read."""

    # by which the servos follow their commands [s]: 0.02 until they have them, 0.04 of lag
    delay: float = 0.06
    # height above the lowest foot up to which a foot is taken to stand [m]
    tolerance: float = 0.002
    margin: float = 0.02  # before and after a swing in which a foot does not count [s]
    cutoff: float = 5.0  # of the low-pass of the velocity that is published [Hz]
    command_age: float = 0.3  # commands older than that are not looked at [s]
    scale_x: float = 1.0  # what the way forward is multiplied by
    scale_y: float = 1.0  # what the way sideways is multiplied by


class LegOdometry:
    """Adds up what the standing legs say."""

    def __init__(
        self, settings: OdometrySettings, foot_radius: float, lying_height: float = 0.0
    ) -> None:
        """Begin at the origin.

        Args:
            lying_height: Of base_link above the feet [m], up to which the belly carries it.
        """
        self._settings, self._lying_height = settings, lying_height
        self._radius = foot_radius
        # replaced as a whole: commands come from another thread than measurements
        self._commands: tuple[tuple[float, Sequence[Vector]], ...] = ()
        self._ground: Vector | None = None  # its normal in the body, where that is known
        self._last: tuple[float, Sequence[FootPose], Flags] | None = None
        self._yaw0: float | None = None
        self._heading = 0.0  # [rad] of the last update
        self._keeps_heading = False
        self._place = self._held = self._smooth = REST  # the velocities in the body turned level
        self._distance = self._gaps = 0.0  # way [m], variance by gaps [m²]
        self._began_at: float | None = None
        self._fallen = False
        self._stepped_at = -math.inf  # when a foot was last in the air [s]

    def command(self, time: float, feet: Sequence[Vector]) -> None:
        """Note where the feet were sent.

        Args:
            time: When [s].
            feet: Their centres in base_link [m].
        """
        self._commands = (*self._commands, (time, feet))[-KEPT_COMMANDS:]
        lately = [places for t, places in self._commands if time - t <= GROUND_TIME]
        self._ground = ground_normal(lately, self._settings.tolerance)

    def keep_heading(self) -> None:
        """Go on with the last heading: the next attitude counts its yaw from elsewhere."""
        self._keeps_heading = True

    def update(self, time: float, feet: Sequence[FootPose], attitude: Quaternion) -> OdometryState:
        """Add a measurement.

        Args:
            time: When [s].
        """
        yaw = yaw_of(attitude)
        if self._yaw0 is None or self._keeps_heading:
            self._yaw0 = yaw - self._heading
            self._keeps_heading = False
        self._heading = yaw - self._yaw0
        rotation = multiply(about_z(-self._yaw0), attitude)
        standing, source = self._standing(time, feet, rotation)
        if self._began_at is None:
            self._began_at = time
        if not all(standing):
            self._stepped_at = time
        turned = [
            FootPose(rotate(rotation, foot.position), multiply(rotation, foot.rotation))
            for foot in feet
        ]
        height = self._height(turned, standing)
        fallen = tilt_of(rotation) > MAX_TILT
        if fallen and not self._fallen:
            self._gaps += FALL_DEVIATION**2
        self._fallen = fallen
        elapsed = 0.0 if self._last is None else time - self._last[0]
        if elapsed > MAX_GAP:  # lying or not, it may have been carried, or have gone on
            self._gaps += (GAP_SPEED * elapsed) ** 2
        if fallen or height <= self._lying_height or not 0.0 < elapsed <= MAX_GAP:
            self._held = self._smooth = REST  # the feet may move, and carry nothing
        else:
            self._integrate(time, elapsed, turned, standing)
        self._last = time, turned, standing
        return OdometryState(
            *self._place,
            height,
            rotation,
            *self._smooth,
            self._distance,
            standing,
            source,
            MIN_DEVIATION**2 + (DRIFT * self._distance) ** 2 + self._gaps,
            (YAW_DRIFT * (time - self._began_at)) ** 2,
        )

    def _standing(
        self, time: float, feet: Sequence[FootPose], rotation: Quaternion
    ) -> tuple[Flags, ContactSource]:
        source = ContactSource.COMMANDED_HEIGHT
        settings, commands, ground = self._settings, self._commands, self._ground
        at = time - settings.delay
        recent = [places for t, places in commands if abs(t - at) <= settings.margin]
        if not recent:
            recent = [p for t, p in commands if at - settings.command_age <= t <= at][-1:]
        if not recent:
            recent, ground = [[foot.position for foot in feet]], None
            source = ContactSource.MEASURED_HEIGHT
        x, y, z = ground or rotate(conjugate(rotation), (0.0, 0.0, 1.0))
        standing = (True,) * len(feet)
        for places in recent:
            heights = [x * px + y * py + z * pz for px, py, pz in places]
            highest = min(heights) + settings.tolerance
            standing = tuple(
                stands and height <= highest
                for stands, height in zip(standing, heights, strict=True)
            )
        return standing, source

    def _integrate(
        self, time: float, elapsed: float, feet: Sequence[FootPose], standing: Flags
    ) -> None:
        if self._last is None:
            return
        _, last_feet, stood = self._last
        cosine, sine = math.cos(self._heading), math.sin(self._heading)
        pairs = zip(last_feet, feet, standing, stood, strict=True)
        ways = [self._way(last, foot) for last, foot, *both in pairs if all(both)]
        if ways:
            x, y = (sum(way) / len(ways) / elapsed for way in zip(*ways, strict=True))
            self._held = (
                (cosine * x + sine * y) * self._settings.scale_x,
                (cosine * y - sine * x) * self._settings.scale_y,
            )
        ahead, left = self._held[0] * elapsed, self._held[1] * elapsed
        self._place = (
            self._place[0] + cosine * ahead - sine * left,
            self._place[1] + sine * ahead + cosine * left,
        )
        # a body over feet that stay comes back: it goes nowhere, and noise is no way
        if time - self._stepped_at <= GROUND_TIME:
            self._distance += math.hypot(ahead, left)
        share = low_pass_share(self._settings.cutoff, elapsed)
        (x, y), (held_x, held_y) = self._smooth, self._held
        self._smooth = x + share * (held_x - x), y + share * (held_y - y)

    def _way(self, before: FootPose, after: FootPose) -> tuple[float, float]:
        """Return how far the body has gone over a foot that stands [m]."""
        x, y, _, w = multiply(after.rotation, conjugate(before.rotation))
        # the foot has rolled by the angular step times the vector from the ground to its centre
        rolled = 2.0 * w * self._radius
        return (
            rolled * y - after.position[0] + before.position[0],
            -rolled * x - after.position[1] + before.position[1],
        )

    def _height(self, feet: Sequence[FootPose], standing: Flags) -> float:
        heights = [foot.position[2] for foot, stands in zip(feet, standing, strict=True) if stands]
        heights = heights or [foot.position[2] for foot in feet]
        return self._radius - sum(heights) / len(heights)


def ground_normal(commands: Sequence[Sequence[Vector]], tolerance: float) -> Vector | None:
    """Return the unit normal of the ground in the body, from where the feet were sent lately.

    None when their lowest places are not in a plane: a foot was in the air all the time.

    Args:
        commands: Feet in base_link, in the order of the legs [m]; one at least.
        tolerance: How far from a plane they may be [m].
    """
    fl, fr, bl, br = (min(places, key=_Z) for places in zip(*commands, strict=True))
    # across both diagonals
    ax, ay, az = fl[0] - br[0], fl[1] - br[1], fl[2] - br[2]
    bx, by, bz = fr[0] - bl[0], fr[1] - bl[1], fr[2] - bl[2]
    x, y, z = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    length = math.copysign(math.sqrt(x * x + y * y + z * z), z)
    if length == 0.0:
        return None
    x, y, z = x / length, y / length, z / length
    between = x * (fl[0] - fr[0]) + y * (fl[1] - fr[1]) + z * (fl[2] - fr[2])
    return (x, y, z) if abs(between) <= tolerance else None
