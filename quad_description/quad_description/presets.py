# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""URDF and poses of the presets in model/robot.yaml; the joints of a URDF.

``ros2 run quad_description urdf`` prints the URDF for other tools.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import Enum
from functools import lru_cache
import math
import os
from pathlib import Path
import re
import signal
import sys
from typing import Any, Final, NoReturn

from urdf_reader import DescriptionError, JointKind, KinematicTree, read_urdf
from urdf_reader import Joint as UrdfJoint
import yaml

LEGS: Final = ('fl', 'fr', 'bl', 'br')
"""Front left, front right, back left, back right: the order of the legs everywhere."""


class PresetError(DescriptionError):
    """The preset is unknown.

    Scenarios: a misspelt name, a preset of another robot.
    """


MODEL = Path(__file__).parent / 'model'
"""Folder with the xacro files and their numbers."""


@lru_cache(maxsize=1)
def robot_numbers() -> dict[str, Any]:
    """Return the data of robot.yaml; one shared copy, do not modify it."""
    with (MODEL / 'robot.yaml').open(encoding='utf-8') as file:
        numbers: dict[str, Any] = yaml.safe_load(file)
    return numbers


PRESETS: Final[tuple[str, ...]] = tuple(sorted(robot_numbers()['presets']))
"""Names of the robots that there are."""

TRUNK_MASS_RANGE: Final = (0.05, 5.0)  # [kg] what the legs could carry, with room to spare


@lru_cache(maxsize=16)
def robot_urdf(
    preset: str = 'lite',
    arm: bool = False,
    trunk_mass: float | None = None,
    *,
    base_footprint: bool = True,
) -> str:
    """Generate the URDF of a robot.

    Args:
        preset: One of :data:`PRESETS`.
        arm: Add the arm and gripper on its back.
        trunk_mass: Mass of the trunk in [kg], for a robot with a payload; by default the preset's.
        base_footprint: Add that frame on a floating joint, for robot_state_publisher.

    Returns:
        The URDF as XML text.

    Raises:
        PresetError: The preset is unknown.
        DescriptionError: The mass of the trunk is invalid.
    """
    if preset not in PRESETS:
        raise PresetError(f'unknown preset {preset!r}; choose one of {", ".join(PRESETS)}')
    lowest, highest = TRUNK_MASS_RANGE
    if trunk_mass is not None and not (
        math.isfinite(trunk_mass) and lowest <= trunk_mass <= highest
    ):
        raise DescriptionError(
            f'trunk_mass {trunk_mass} kg is not {lowest} to {highest} kg; '
            "leave it out for the preset's own"
        )
    return _expand(
        {
            'preset': preset,
            'arm': str(bool(arm)).lower(),
            'trunk_mass': repr(float(trunk_mass or 0.0)),
            'base_footprint': str(base_footprint).lower(),
        }
    )


def preset_of(urdf: str) -> str:
    """Return the preset that a URDF was generated from, by its robot name; empty if none."""
    found = re.search(r'<robot [^>]*name="xgo_(\w+)"', urdf)
    return found[1] if found and found[1] in PRESETS else ''


def _expand(arguments: dict[str, str]) -> str:
    import xacro

    path = MODEL / 'quadruped.urdf.xacro'
    document = xacro.process_file(str(path), mappings=arguments)
    # the root without the comment before it, which names the path on this machine
    urdf: str = document.documentElement.toprettyxml(indent='  ')
    return urdf.rstrip()


STREAM_TIMEOUT: Final = 0.5
"""A pause [s] that ends a stream of joint commands: a robot that it leaves with a foot in the air
is laid down by the hardware node, so the next stream has to begin where the joints are then."""

_LEG_JOINTS = ('hip', 'thigh', 'calf')
_ARM_JOINTS = ('yaw', 'thigh', 'calf')
_GRIPPER = 'hand_right_joint'


class Pose(Enum):
    """Poses defined in robot.yaml."""

    STAND = 'stand'
    LIE = 'lie'


def pose_positions(pose: Pose, arm: bool = False) -> dict[str, float]:
    """Return the joint positions of a pose [rad], of the gripper [m], in the order of the URDF."""
    numbers: dict[str, Any] = robot_numbers()['poses'][pose.value]
    positions = {
        f'{leg}_{joint}_joint': float(value)
        for leg in LEGS
        for joint, value in zip(_LEG_JOINTS, numbers['leg'], strict=True)
    }
    if arm:
        for joint, value in zip(_ARM_JOINTS, numbers['arm'], strict=True):
            positions[f'arm_{joint}_joint'] = float(value)
        positions[_GRIPPER] = 0.0
    return positions


@dataclass(frozen=True, slots=True)
class JointLimits:
    """Position, velocity and effort limits of a joint."""

    lower: float = -math.inf  # smallest position in [rad] or [m]
    upper: float = math.inf  # largest position in [rad] or [m]
    velocity: float = math.inf  # largest speed in [rad/s] or [m/s]
    effort: float = math.inf  # largest torque in [N m] or force in [N]

    def clamp(self, position: float) -> float:
        """Return the nearest position within the range."""
        return min(max(position, self.lower), self.upper)


@dataclass(frozen=True, slots=True)
class Joint:
    """A joint with its own motor."""

    name: str  # name in the URDF
    limits: JointLimits  # its range


def movable_joints(urdf: str | KinematicTree) -> tuple[Joint, ...]:
    """Return the joints with a motor, in the order of the URDF; excludes mimic joints.

    Raises:
        DescriptionError: The URDF is invalid, or a joint has no usable limits.
    """
    tree = read_urdf(urdf) if isinstance(urdf, str) else urdf
    return tuple(Joint(joint.name, limits_of(joint)) for joint in tree.joints if joint.independent)


def limits_of(joint: UrdfJoint) -> JointLimits:
    """Return the limits of a movable joint.

    Raises:
        DescriptionError: The limits are missing or not finite.
    """
    given = joint.limit or {}
    if missing := [key for key in ('velocity', 'effort') if key not in given]:
        raise DescriptionError(
            f'joint {joint.name}: a {joint.kind.value} joint needs <limit .../> with '
            f'{" and ".join(missing)}'
        )
    span = joint.range
    try:
        effort = float(given['effort'])
    except ValueError as error:
        raise DescriptionError(f'joint {joint.name}: <limit> is not usable: {error}') from error
    ends = () if joint.kind is JointKind.CONTINUOUS else (span.lower, span.upper)
    if not all(map(math.isfinite, (*ends, span.velocity, effort))):
        raise DescriptionError(f'joint {joint.name}: <limit> has a number that is not finite')
    return JointLimits(span.lower, span.upper, span.velocity, effort)


INTERRUPTED = 130  # exit code of a program that Ctrl-C ended


def run_command(run: Callable[[Sequence[str]], int]) -> NoReturn:
    """Run a program with the process's arguments, and exit with its exit code."""
    interrupted = False

    def interrupt(_number: int, _frame: object) -> None:
        nonlocal interrupted
        interrupted = True
        raise KeyboardInterrupt

    # a script's shell starts background jobs with SIGINT ignored
    signal.signal(signal.SIGINT, interrupt)
    try:
        sys.exit(run(sys.argv[1:]))
    except KeyboardInterrupt:
        sys.exit(INTERRUPTED)
    except Exception:
        if not interrupted:
            raise
        # MuJoCo made an error of its own of it, and Python would end by the signal
        os._exit(INTERRUPTED)


def run(argv: Sequence[str] | None = None) -> int:
    """Print the URDF that the arguments request; return the exit code."""
    parser = argparse.ArgumentParser(
        description='Print the URDF of the quadruped.', allow_abbrev=False
    )
    parser.add_argument('--preset', default='lite', choices=PRESETS, help='the robot')
    parser.add_argument('--arm', action='store_true', help='with the arm on its back')
    parser.add_argument(
        '--trunk-mass', type=float, metavar='KG', help="mass of the trunk instead of the preset's"
    )
    parser.add_argument(
        '--base-footprint',
        action='store_true',
        help='with that frame on a floating joint, as /robot_description has it',
    )
    options = parser.parse_args(argv)
    try:
        urdf = robot_urdf(
            options.preset,
            options.arm,
            options.trunk_mass,
            base_footprint=options.base_footprint,
        )
    except DescriptionError as error:
        sys.stderr.write(f'urdf: {error}\n')
        return 2
    sys.stdout.write(urdf + '\n')
    return 0


def main() -> None:
    """Entry point."""
    sys.exit(run())


if __name__ == '__main__':
    main()
