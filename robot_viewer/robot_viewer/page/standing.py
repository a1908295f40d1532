# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""How a robot stands: its feet, what they span, its attitude; no browser, no ROS."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from html import escape
import math

from urdf_reader import KinematicTree, Quaternion, rotate, Vector

FOOT = '_foot'
"""How the names of the links of feet end."""
LEAST_FEET = 3
SOURCES: Mapping[str, str] = {
    'commanded_height': 'estimated by where they were sent; nothing senses it',
    'measured_height': 'estimated by joints and attitude; nothing senses it',
    'physics': 'true: the simulation knows',
}
"""In words what quad_msgs/FootContacts has as source."""


@dataclass(frozen=True, slots=True)
class Contacts:
    """Which feet are on the ground, as it was published.

    Attributes:
        feet: Their links.
        source: How that is known.
    """

    feet: frozenset[str]
    source: str

    def html(self, found: Support) -> str:
        """Return it in words."""
        names = ', '.join(sorted(foot.removesuffix(FOOT) for foot in self.feet)) or 'none'
        source = SOURCES.get(self.source, self.source or 'nobody says how that is known')
        margin = found.margin
        if margin is None:  # the line stays in its place
            stable = 'centre of mass unknown: the description has no masses'
            if len(found.corners) < LEAST_FEET:
                stable = 'no support polygon'
        else:
            inside = 'inside' if margin >= 0.0 else 'outside'
            stable = f'centre of mass {abs(margin) * 1e3:.0f} mm {inside} the support'
        return (
            f'<div style="margin:0.3em 1em"><div>feet on the ground: {escape(names)}</div>'
            f'<div>{stable}</div><div style="opacity:0.7">{escape(source)}</div></div>'
        )


@dataclass(frozen=True, slots=True)
class Support:
    """What the feet on the ground span, in the root link in [m].

    Attributes:
        corners: On the ground below the feet, all round the robot; fewer than three span nothing.
        centre: Of mass; None where the description has no masses.
        below: The place on the ground below it.
        margin: How far that is inside of the corners; below zero outside, None without a span.
    """

    corners: tuple[Vector, ...]
    centre: Vector | None
    below: Vector | None
    margin: float | None


def feet_of(tree: KinematicTree) -> tuple[str, ...]:
    """Return the links of the feet; none where there are too few to stand on."""
    feet = tuple(link for link in tree.links if link.endswith(FOOT))
    return feet if len(feet) >= LEAST_FEET else ()


def foot_radius(tree: KinematicTree, foot: str) -> float:
    """Return the radius of a foot that is a ball in [m]; 0 for others."""
    balls = (s for s in tree.collisions() if s.link == foot and s.shape == 'sphere')
    return next((ball.lengths('radius')[0] for ball in balls), 0.0)


def support(
    places: Mapping[str, Vector],
    on_ground: Collection[str],
    attitude: Quaternion,
    centre: Vector | None,
    radius: float = 0.0,
) -> Support:
    """Return what the feet on the ground span, and where the centre of mass is over it.

    Args:
        places: Of all feet in the root link in [m].
        on_ground: Those that are on the ground.
        attitude: Of the root link in a level frame.
        centre: Of mass, in the root link in [m].
        radius: Of the feet in [m].
    """
    x, y, z, w = attitude
    back = (-x, -y, -z, w)
    levelled = {foot: rotate(attitude, places[foot]) for foot in on_ground if foot in places}
    corners = [
        (px, py, pz - radius)
        for px, py, pz in sorted(levelled.values(), key=lambda at: math.atan2(at[1], at[0]))
    ]
    if centre is None or not corners:
        return Support(tuple(rotate(back, corner) for corner in corners), centre, None, None)
    over_x, over_y, _ = rotate(attitude, centre)
    ground = sum(corner[2] for corner in corners) / len(corners)
    return Support(
        tuple(rotate(back, corner) for corner in corners),
        centre,
        rotate(back, (over_x, over_y, ground)),
        _margin(corners, over_x, over_y) if len(corners) >= LEAST_FEET else None,
    )


def _margin(corners: Sequence[Vector], x: float, y: float) -> float:
    """Return how far a place is inside of corners that go round counterclockwise [m]."""
    sides = zip(corners, (*corners[1:], corners[0]), strict=True)
    return min(
        ((bx - ax) * (y - ay) - (by - ay) * (x - ax)) / (math.hypot(bx - ax, by - ay) or 1.0)
        for (ax, ay, _), (bx, by, _) in sides
    )


def roll_pitch(attitude: Quaternion) -> tuple[float, float]:
    """Return roll and pitch in [rad], positive with the right side and the nose down."""
    x, y, z, w = attitude
    sine = max(-1.0, min(1.0, 2.0 * (w * y - z * x)))
    return math.atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y)), math.asin(sine)


def horizon_html(attitude: Quaternion | None, battery: str) -> str:
    """Return an artificial horizon with its numbers, and the battery.

    Args:
        attitude: Of the body in a level frame; None where nothing measures it.
        battery: In words; empty where nothing does.
    """
    parts = []
    if attitude is not None:
        roll, pitch = (math.degrees(angle) for angle in roll_pitch(attitude))
        # one pixel is a degree; what is seen ahead rises when the nose goes down
        parts.append(
            '<svg viewBox="-40 -40 80 80" width="110" height="110" style="border-radius:50%">'
            f'<g transform="rotate({-roll:.1f}) translate(0 {-pitch:.1f})">'
            '<rect x="-90" y="-180" width="180" height="180" fill="#74c0fc"/>'
            '<rect x="-90" y="0" width="180" height="180" fill="#b08968"/>'
            '<line x1="-90" x2="90" stroke="#fff" stroke-width="1.5"/></g>'
            '<path d="M-24 0h16l8 7 8-7h16" fill="none" stroke="#212529" stroke-width="2.5"/>'
            '</svg>'
            f'<div>roll {roll:+.1f}°, pitch {pitch:+.1f}°</div>'
        )
    if battery:
        parts.append(f'<div>battery {escape(battery)}</div>')
    return f'<div style="margin:0.3em 1em">{"".join(parts)}</div>'


def battery_text(percentage: float, voltage: float) -> str:
    """Return the charge of a battery in words; what is not measured is left out.

    Args:
        percentage: From 0 to 1, or NaN.
        voltage: In [V], or NaN or 0.
    """
    parts = []
    if math.isfinite(percentage):
        parts.append(f'{100.0 * percentage:.0f} %')
    if math.isfinite(voltage) and voltage > 0.0:
        parts.append(f'{voltage:.1f} V')
    return ', '.join(parts)
