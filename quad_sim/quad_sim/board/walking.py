# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The board's own trot, which the registers VX, VY and VYAW request.

The vendor's firmware has one; this is a plain trot of ours with the legs of the URDF, so
that clients of the register protocol see the robot walk. It is not that of quad_controller.

"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
import math

from quad_description import LegGeometry, LEGS, quadruped
from quad_description.rotations import conjugate, from_rpy, rotate, Vector

PERIOD = 0.28  # [s] of a stride; longer ones lose speed and roll
DUTY = 0.55  # share of a stride that a foot is on the ground
LIFT = 0.020  # [m]
HEIGHT = 0.085  # [m] from hip to foot
FOOT_AHEAD = -0.024  # [m] foot ahead of the hip: below the centre of mass
DIAGONAL = {'fl': 0.0, 'fr': 0.5, 'bl': 0.5, 'br': 0.0}
ACCELERATION = (1.0, 1.0, 4.0)  # [m/s2], [m/s2], [rad/s2]
STILL = 1e-3


@dataclass(slots=True)
class Stance:
    """How the body stands over its feet, and what a host changed of it."""

    shift: tuple[float, float] = (0.0, 0.0)  # of the body [m]
    height: float = HEIGHT  # from hip to foot [m]
    attitude: Vector = (0.0, 0.0, 0.0)  # roll, pitch, yaw of the body over the ground [rad]
    # feet that a host moved, from where they stand [m], by leg
    feet: dict[str, Vector] = field(default_factory=dict)


class Walker:
    """Stands or trots; one call of :meth:`step` for every set of targets.

    Attributes:
        stance: How it stands; a host may change it.
        command: Wanted speed ahead [m/s], to the left [m/s] and turning [rad/s].
        marking_time: Trots on the spot.
        lift: Of a foot [m].
    """

    def __init__(self, urdf: str) -> None:
        """Stand, as after switching on."""
        self._robot = quadruped(urdf)
        self.reset()

    def reset(self) -> None:
        """Stand, as after switching on."""
        self.stance = Stance()
        self.command: Vector = (0.0, 0.0, 0.0)
        self.marking_time = False
        self.lift = LIFT
        self._speed: Vector = (0.0, 0.0, 0.0)
        self._phase = 0.0
        self._stride = 0.0  # share of the lift, for a soft start and end

    @property
    def walking(self) -> bool:
        """Whether feet leave the ground, or soon will."""
        wanted = self.marking_time or any(self.command)
        return wanted or self._stride > STILL or any(abs(v) > STILL for v in self._speed)

    def step(self, duration: float) -> Mapping[str, float]:
        """Return the joint positions [rad] after a time [s]."""
        self._speed = tuple(  # type: ignore[assignment]
            now + min(max(wanted - now, -limit * duration), limit * duration)
            for now, wanted, limit in zip(self._speed, self.command, ACCELERATION, strict=True)
        )
        wanted = 1.0 if self.marking_time or any(self.command) else 0.0
        moving = 1.0 if any(abs(v) > 10 * STILL for v in self._speed) else wanted
        self._stride += min(max(moving - self._stride, -duration / PERIOD), duration / PERIOD)
        if self.walking:
            self._phase = (self._phase + duration / PERIOD) % 1.0
        else:
            self._phase = self._stride = 0.0
        robot = self._robot
        feet = [self._foot(name, leg) for name, leg in zip(LEGS, robot.legs, strict=True)]
        return {
            joint: angle
            for leg, solution in zip(robot.legs, robot.solve(feet), strict=True)
            for joint, angle in zip(leg.joints, solution.angles, strict=True)
        }

    def _foot(self, name: str, leg: LegGeometry) -> Vector:
        """Where the foot is to be, in base_link."""
        stance, (middle, _, hip_height) = self.stance, self._robot.hip_centre
        dx, dy, dz = stance.feet.get(name, (0.0, 0.0, 0.0))
        # the place under the hip, seen from the middle between the legs
        x = leg.hip[0] - middle + FOOT_AHEAD + dx
        y = leg.hip[1] + leg.offset_y + dy
        vx, vy, turn = self._speed
        forward, left, up = _stride(
            (self._phase + DIAGONAL[name]) % 1.0, vx - turn * y, vy + turn * x
        )
        ground = (
            x + forward - stance.shift[0],
            y + left - stance.shift[1],
            -stance.height + dz + up * self.lift * self._stride,
        )
        to_body = conjugate(from_rpy(*stance.attitude))
        x, y, z = rotate(to_body, ground)
        return middle + x, y, hip_height + z


def _stride(phase: float, vx: float, vy: float) -> Vector:
    """Return where a foot is in its stride: ahead [m], to the left [m], share of the lift."""
    half = 0.5 * DUTY * PERIOD
    if phase < DUTY:
        time = half * (1.0 - 2.0 * phase / DUTY)
        return time * vx, time * vy, 0.0
    k = (phase - DUTY) / (1.0 - DUTY)
    # Hermite from -half to half whose ends move backward as the ground does
    slope = -(1.0 - DUTY) * PERIOD
    time = half * (-4 * k**3 + 6 * k**2 - 1) + slope * (2 * k**3 - 3 * k**2 + k)
    return time * vx, time * vy, 0.5 * (1.0 - math.cos(2.0 * math.pi * k))
