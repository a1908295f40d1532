# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The board's own trot, which the registers VX, VY and VYAW ask for.

The vendor's firmware has one; this is a plain trot of ours with legs measured from the URDF, so
that clients of the register protocol see the robot walk. It is not that of quad_controller.

Leg frame: origin in the roll axis of the hip, axes as base_link's.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
import math
from xml.etree import ElementTree as ET

from quad_description import LEGS

from ..plant.state import Vector

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
    """How the body stands over its feet, and what a host changed of it.

    Attributes:
        shift: Of the body [m].
        height: From hip to foot [m].
        attitude: Roll, pitch, yaw of the body over the ground [rad].
        feet: Feet that a host moved, from where they stand [m], by leg.
    """

    shift: tuple[float, float] = (0.0, 0.0)
    height: float = HEIGHT
    attitude: Vector = (0.0, 0.0, 0.0)
    feet: dict[str, Vector] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Leg:
    """Lengths of a leg [m].

    Attributes:
        name: fl, fr, bl or br.
        side: 1 left, -1 right.
        hip: Roll axis in base_link.
        ahead: Thigh joint ahead of the hip.
        beside: Plane of the foot beside the roll axis, outward.
        thigh: Length.
        calf: Length.
        zero: Angle of the calf, forward from straight down, at position 0 [rad].
    """

    name: str
    side: int
    hip: Vector
    ahead: float
    beside: float
    thigh: float
    calf: float
    zero: float

    def solve(self, foot: Vector) -> dict[str, float]:
        """Return joint positions [rad] that bring the foot there [m]; too far is stretched."""
        x, y, z = foot
        lateral = self.side * self.beside
        depth = -math.sqrt(max(y * y + z * z - lateral * lateral, 1e-9))
        roll = math.remainder(math.atan2(z, y) - math.atan2(depth, lateral), 2 * math.pi)
        x -= self.ahead
        cosine = (x * x + depth * depth - self.thigh**2 - self.calf**2) / (
            2 * self.thigh * self.calf
        )
        knee = -math.acos(min(max(cosine, -1.0), 1.0))
        pitch = math.atan2(-x, -depth) - math.atan2(
            self.calf * math.sin(knee), self.thigh + self.calf * math.cos(knee)
        )
        positions = (-self.side * roll, pitch, knee + self.zero)
        names = (f'{self.name}_{joint}_joint' for joint in ('hip', 'thigh', 'calf'))
        return dict(zip(names, positions, strict=True))


def measure_legs(urdf: str) -> tuple[Leg, ...]:
    """Measure the legs of a URDF in the order of its legs."""
    root = ET.fromstring(urdf)  # noqa: S314  a robot's own description, not from the network
    return tuple(_measure_leg(root, name) for name in LEGS)


def _measure_leg(root: ET.Element, name: str) -> Leg:
    hip, thigh, calf, foot = (
        _origin(root, f'{name}_{part}_joint') for part in ('hip', 'thigh', 'calf', 'foot')
    )
    side = 1 if hip[1] > 0 else -1
    return Leg(
        name=name,
        side=side,
        hip=hip,
        ahead=thigh[0],
        beside=side * (thigh[1] + calf[1] + foot[1]),
        thigh=math.hypot(calf[0], calf[2]),
        calf=math.hypot(foot[0], foot[2]),
        zero=math.atan2(foot[0], -foot[2]),
    )


def _origin(root: ET.Element, joint: str) -> Vector:
    element = root.find(f"joint[@name='{joint}']/origin")
    words = ('0', '0', '0') if element is None else element.get('xyz', '0 0 0').split()
    x, y, z = map(float, words)
    return x, y, z


class Walker:
    """Stands or trots; one call of :meth:`step` for every set of targets.

    Attributes:
        stance: How it stands; a host may change it.
        command: Wanted speed ahead [m/s], to the left [m/s] and turning [rad/s].
        marking_time: Trots on the spot.
        lift: Of a foot [m].
    """

    def __init__(self, urdf: str) -> None:
        """Measure the legs.

        Args:
            urdf: The robot.
        """
        self._legs = measure_legs(urdf)
        self._middle = sum(leg.hip[0] for leg in self._legs) / len(self._legs)
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
        positions: dict[str, float] = {}
        for leg in self._legs:
            positions |= leg.solve(self._foot(leg))
        return positions

    def _foot(self, leg: Leg) -> Vector:
        """Where the foot is to be, in the leg frame."""
        stance = self.stance
        dx, dy, dz = stance.feet.get(leg.name, (0.0, 0.0, 0.0))
        ahead, aside = FOOT_AHEAD + dx, leg.side * leg.beside + dy
        # the place under the hip, seen from the middle between the legs
        x, y = leg.hip[0] - self._middle + ahead, leg.hip[1] + aside
        vx, vy, turn = self._speed
        forward, left, up = _stride(
            (self._phase + DIAGONAL[leg.name]) % 1.0, vx - turn * y, vy + turn * x
        )
        ground = (
            x + forward - stance.shift[0],
            y + left - stance.shift[1],
            -stance.height + dz + up * self.lift * self._stride,
        )
        bx, by, bz = _turned_back(ground, stance.attitude)
        return bx - leg.hip[0] + self._middle, by - leg.hip[1], bz


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


def _turned_back(point: Vector, attitude: Vector) -> Vector:
    """Return a point of the ground as the body sees it that is turned by roll, pitch and yaw."""
    x, y, z = point
    roll, pitch, yaw = attitude
    cos, sin = math.cos(yaw), math.sin(yaw)
    x, y = cos * x + sin * y, -sin * x + cos * y
    cos, sin = math.cos(pitch), math.sin(pitch)
    x, z = cos * x - sin * z, sin * x + cos * z
    cos, sin = math.cos(roll), math.sin(roll)
    return x, cos * y + sin * z, -sin * y + cos * z
