# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``ros2 run arm_bringup check``: what is missing or inconsistent in a robot folder."""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Sequence
import difflib
import sys

from process_supervisor import USAGE_ERROR

from .description import joint_limits, read_description
from .exceptions import BringupError, DescriptionError, RobotError
from .findings import error, Finding, Severity, warning
from .motion_check import check_motion
from .robots import Robot
from .session import add_robot, locate, read_drives, robots_epilog


def check_robot(robot: Robot) -> list[Finding]:
    """Look at everything in a robot folder.

    Args:
        robot: The robot; its bus.yml and its description exist.

    Returns:
        What is wrong; empty when all is well.
    """
    findings: list[Finding] = []
    drives, joints, urdf = [], [], ''
    try:
        drives = [joint for drive in read_drives(robot) for joint in drive.joints]
    except RobotError as problem:
        tool = 'ros2 run canopen_tools canopen check'
        findings.append(error('bus.yml', str(problem), f'{tool} {robot.bus_config} tells more'))
    try:
        urdf = read_description(robot)
        joints = list(joint_limits(urdf))
    except DescriptionError as problem:
        findings.append(error(robot.description.name, str(problem), 'mend the description'))
    if drives and joints:
        findings += _names(robot, drives, joints)
    if urdf and joints:
        findings += _motion(robot, urdf, joints)
    return findings


def _names(robot: Robot, drives: Sequence[str], joints: Sequence[str]) -> Iterable[Finding]:
    for drive in drives:
        if drive not in joints:
            yield error(
                f'bus.yml, node {drive}',
                f'{robot.description.name} has no joint of this name',
                f'name the node as its joint{_meant(drive, joints)}; joints: {", ".join(joints)}',
            )
    for joint in joints:
        if joint not in drives:
            yield warning(
                f'{robot.description.name}, joint {joint}',
                'no drive of bus.yml has this name, so it never moves',
                f'name its node {joint!r}{_meant(joint, drives)}, or make the joint fixed',
            )


def _meant(name: str, names: Sequence[str]) -> str:
    close = difflib.get_close_matches(name, names, n=1)
    return f' (is {close[0]!r} meant?)' if close else ''


def _motion(robot: Robot, urdf: str, joints: Sequence[str]) -> list[Finding]:
    if robot.lacking:
        return [
            warning(
                f'{robot.name}/',
                f'lacks {robot.lacking} for trajectories and jogging',
                'write them as in robots/gp110/: the group to move, and the limits of its joints',
            )
        ]
    return check_motion(robot, urdf, joints)


def main(argv: Sequence[str] | None = None) -> int:
    """Check a robot folder and say what is wrong.

    Args:
        argv: Arguments without the program's name; None takes those of the process.

    Returns:
        0 when nothing is wrong or warned of only, 1 when there is an error, 2 when there is no
        such robot.
    """
    parser = argparse.ArgumentParser(
        prog='ros2 run arm_bringup check',
        description='Tell what is missing or inconsistent in a robot folder: joint names in '
        'bus.yml, description, SRDF and limits; a start that is singular or in collision.',
        epilog=robots_epilog(),
    )
    add_robot(parser)
    try:
        robot = locate(parser.parse_args(argv))
    except BringupError as problem:
        sys.stderr.write(f'{problem}\n')
        return USAGE_ERROR
    findings = check_robot(robot)
    for finding in findings:
        sys.stdout.write(f'{finding}\n')
    errors = sum(finding.severity is Severity.ERROR for finding in findings)
    warnings = len(findings) - errors
    result = f'{errors} errors, {warnings} warnings' if findings else 'nothing is wrong'
    sys.stdout.write(f'{robot.name}: {result}\n')
    return 1 if errors else 0
