# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""How a robot stands: its feet, what they span, its attitude; no browser, no ROS.

Nobody senses the contacts of the feet: those are taken to stand that are the lowest, as they hang
below the body by joints and attitude.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape
import math

from urdf_reader import KinematicTree, Quaternion, rotate, Transform, Vector

from ..link_poses import link_pose

FOOT = '_foot'
"""How the names of the links of feet end."""
LEAST_FEET = 3
DOWN_TOLERANCE = 0.008
"""How far above the lowest foot one stands in [m]."""


def feet_of(tree: KinematicTree) -> tuple[str, ...]:
    """Return the links of the feet; none where there are too few to stand on.

    Args:
        tree: The robot.
    """
    feet = tuple(link for link in tree.links if link.endswith(FOOT))
    return feet if len(feet) >= LEAST_FEET else ()


def feet_places(
    tree: KinematicTree, feet: Sequence[str], positions: Mapping[str, float]
) -> dict[str, Vector]:
    """Return where feet are in the root link in [m].

    Args:
        tree: The robot.
        feet: Their links.
        positions: Of the joints in [rad].
    """
    return {foot: link_pose(tree, foot, positions).translation for foot in feet}


def standing(places: Mapping[str, Vector], attitude: Quaternion) -> tuple[str, ...]:
    """Return the feet that stand, all round the robot.

    Args:
        places: Of the feet in the root link in [m].
        attitude: Of the root link in a level frame.
    """
    heights = {foot: rotate(attitude, place)[2] for foot, place in places.items()}
    lowest = min(heights.values(), default=0.0)
    down = [foot for foot, height in heights.items() if height - lowest <= DOWN_TOLERANCE]
    return tuple(sorted(down, key=lambda foot: math.atan2(places[foot][1], places[foot][0])))


def roll_pitch(attitude: Quaternion) -> tuple[float, float]:
    """Return roll and pitch in [rad], positive with the right side and the nose down.

    Args:
        attitude: Of the root link in a level frame.
    """
    x, y, z, w = attitude
    sine = max(-1.0, min(1.0, 2.0 * (w * y - z * x)))
    return math.atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y)), math.asin(sine)


def level(attitude: Quaternion) -> Transform:
    """Return the pose of a level frame in the root link.

    Args:
        attitude: Of the root link in a level frame.
    """
    x, y, z, w = attitude
    return Transform(rotation=(-x, -y, -z, w))


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
