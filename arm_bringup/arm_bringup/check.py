# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``ros2 run arm_bringup check``: what is missing or inconsistent in a robot folder."""

from __future__ import annotations

import argparse
from collections.abc import Collection, Iterable, Mapping, Sequence
import difflib
import sys
from typing import TYPE_CHECKING

import urdf_reader
from urdf_reader import Group, JointKind, KinematicTree, parse_srdf, read_urdf, SemanticDescription

from process_supervisor import RosOptions, Severity, USAGE_ERROR

from .groups import given_positions
from .motion_check import check_motion, error, Finding, warning
from .robots import (
    BringupError,
    DescriptionError,
    in_namespace_of_bus,
    read_bus,
    read_description,
    read_semantic,
    Robot,
    RobotError,
)
from .session import add_robot, locate, robots_epilog

if TYPE_CHECKING:
    from arm_canopen.config import AxisUnits

EXAMPLE_ACCELERATIONS = (2.0, 0.5)
"""Moderate initial limits of acceleration: rotary axis in [rad/s2], linear axis in [m/s2]."""


def srdf_command(robot: Robot) -> str:
    """Return the command that creates or completes the SRDF of a robot."""
    return f'ros2 run arm_planning srdf {robot.folder}/ --output {robot.semantic}'


def check_semantic(
    robot: Robot, tree: KinematicTree
) -> tuple[list[Finding], SemanticDescription | None]:
    """Compare the SRDF of a robot with its description; return findings and the SRDF.

    The SRDF is None if any finding is an error.
    """
    place = robot.semantic.name
    try:
        semantic = parse_srdf(read_semantic(robot))
    except (DescriptionError, urdf_reader.DescriptionError) as problem:
        return [error(place, str(problem), 'correct it: the arm has no group without')], None
    found = list(_groups(place, semantic, tree))
    if not semantic.groups:
        remedy = f'{srdf_command(robot)} adds groups from the chains of the description'
        found.append(error(place, 'it has no group', remedy))
    wrong = any(finding.severity is Severity.ERROR for finding in found)
    return found, None if wrong else semantic


def _groups(place: str, semantic: SemanticDescription, tree: KinematicTree) -> Iterable[Finding]:
    """Find names in groups that the description does not define."""
    joints = {joint.name for joint in tree.joints} | set(semantic.virtual)
    known = {'joint': sorted(joints), 'link': sorted(tree.links), 'group': list(semantic.groups)}
    named = {name: _named(group) for name, group in semantic.groups.items()}
    lost = {
        name: {kind: [each for each in names[kind] if each not in known[kind]] for kind in known}
        for name, names in named.items()
    }
    absent = [name for name in named if lost[name] == named[name]]
    if len(absent) == len(named):
        absent = []  # the SRDF belongs to another robot
    for name in absent:
        yield warning(
            f'{place}, group {name}',
            'the description has no joint or link of it: it is left out',
            'fine where the robot comes without, such as a gripper that is not mounted',
        )
    for name, kinds in lost.items():
        for kind, names in kinds.items():
            if names and name not in absent:
                yield error(
                    f'{place}, group {name}',
                    f'there is no {kind} {", ".join(map(repr, names))}',
                    f'name links and joints as the description does; {kind}s: '
                    f'{", ".join(known[kind])}',
                )


def _named(group: Group) -> Mapping[str, Sequence[str]]:
    """Return the names that a group contains, by kind, without duplicates."""
    links = [link for chain in group.chains for link in chain] + list(group.links)
    return {
        'joint': [*group.joints],
        'link': [*dict.fromkeys(links)],
        'group': [*group.subgroups],
    }


def check_robot(robot: Robot) -> list[Finding]:
    """Check all files of a robot folder; return the findings."""
    findings, drives = _bus(robot)
    try:
        urdf = read_description(robot)
        tree = read_urdf(urdf)
    except (DescriptionError, urdf_reader.DescriptionError) as problem:
        return [*findings, error(robot.description.name, str(problem), 'correct the description')]
    findings += _looks(robot, tree)
    if drives:
        findings += _names(robot, drives, tree)
    if robot.lacking:
        return [
            *findings,
            warning(
                f'{robot.name}/',
                f'lacks {robot.lacking} for trajectories and jogging',
                '\n'.join(_remedies(robot, drives, tree)),
            ),
        ]
    found, semantic = check_semantic(robot, tree)
    if semantic is None:
        return [*findings, *found]
    moving = [joint.name for joint in tree.joints if joint.independent]
    if not drives or set(drives) - set(moving):
        drives = dict.fromkeys(moving)  # wrong drive names are reported already
    return [*findings, *found, *check_motion(robot, urdf, tree, semantic, drives)]


def _looks(robot: Robot, tree: KinematicTree) -> Iterable[Finding]:
    """Find links that the web page would not show, or show grey; each problem once."""
    found: dict[str, str] = {}  # link by problem
    for shape in tree.visuals():
        if shape.note:
            found.setdefault(shape.note, shape.link)
        if shape.shape == 'mesh':
            try:
                urdf_reader.find_mesh(shape.attributes.get('filename', ''))
            except urdf_reader.MeshFileError as problem:
                found.setdefault(str(problem), shape.link)
    for what, link in found.items():
        yield warning(f'{robot.description.name}, link {link}', what, 'it moves all the same')


def _remedies(robot: Robot, drives: Collection[str], tree: KinematicTree) -> Iterable[str]:
    """Yield a remedy for each missing file."""
    if not robot.semantic.is_file():
        yield f'{srdf_command(robot)} makes the SRDF'
    if not robot.limits.is_file():
        yield (
            f'copy joint_limits.yaml of its MoveIt package; or write {robot.limits}, with '
            'accelerations of your arm (per second squared) in the place of these:'
        )
        yield 'joint_limits:'
        for joint in tree.joints:
            if joint.name in drives or (joint.independent and not drives):
                value = EXAMPLE_ACCELERATIONS[joint.kind is JointKind.PRISMATIC]
                yield (
                    f'  {joint.name}: {{has_acceleration_limits: true, max_acceleration: {value}}}'
                )


def _bus(robot: Robot) -> tuple[list[Finding], dict[str, AxisUnits | None]]:
    """Return the findings on bus.yml, and the unit settings of its drives by joint."""
    from arm_canopen.config import check_file

    report = check_file(robot.bus_config)
    findings = [
        make(f'{problem.file.name}:{problem.line}, {problem.key}', problem.message, problem.remedy)
        for make, problems in ((error, report.errors), (warning, report.warnings))
        for problem in problems
    ]
    if report.errors:
        return findings, {}
    try:
        bus = read_bus(robot)
        in_namespace_of_bus(RosOptions(), bus)
        given_positions(robot, bus.joints)
    except RobotError as problem:
        return [*findings, error('bus.yml', str(problem), 'see README of arm_bringup')], {}
    units = {axis.name: axis for axis in report.units}
    return findings, {joint: units.get(joint) for joint in bus.joints}


def _names(robot: Robot, drives: Collection[str], tree: KinematicTree) -> Iterable[Finding]:
    joints = {joint.name: joint for joint in tree.joints}
    moving = [joint.name for joint in tree.joints if joint.independent]
    idle = [name for name in moving if name not in drives]
    lost = [name for name in drives if name not in joints]
    for drive in lost:
        yield error(
            f'bus.yml, node {drive}',
            f'{robot.description.name} has no joint of this name',
            f'name the node as its joint{_meant(drive, idle)}; '
            f'joints without a drive: {", ".join(idle) or "none"}',
        )
    for drive in drives:
        if drive in joints and drive not in moving:
            mimic = joints[drive].mimic
            why = f'follows {mimic.source}' if mimic else f'is {joints[drive].kind.value}'
            yield error(
                f'bus.yml, node {drive}',
                f'joint {drive} of {robot.description.name} {why}, so it has no drive of its own',
                'take the node out, or the <mimic> of the joint',
            )
    if idle and not lost:
        yield warning(
            robot.description.name,
            f'bus.yml has no drive for {", ".join(idle)}: never moved, no position in'
            ' /joint_states, links behind without /tf',
            'fine where something else moves it; else add its node, or make the joint fixed',
        )
    elif idle:
        meant = [name + _meant(name, lost) for name in idle]
        yield warning(
            robot.description.name,
            f'bus.yml has no drive for {", ".join(meant)}',
            'name the node as the joint',
        )


def _meant(name: str, free: Collection[str]) -> str:
    close = difflib.get_close_matches(name, free, n=1)
    return f' (is {close[0]!r} meant?)' if close else ''


def main(argv: Sequence[str] | None = None) -> int:
    """Check a robot folder and print the findings.

    Returns:
        0 without errors (warnings are allowed), 1 with an error, 2 if the robot does not
        exist.
    """
    parser = argparse.ArgumentParser(
        prog='ros2 run arm_bringup check',
        description='Report what is missing or inconsistent in a robot folder: bus.yml, joint '
        'names in it, description, SRDF and limits; a start that is singular or in collision.',
        epilog=robots_epilog(),
        allow_abbrev=False,
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
    counts = f'{_counted(errors, "error")}, {_counted(warnings, "warning")}'
    result = counts if findings else 'nothing is wrong'
    sys.stdout.write(f'{robot.name}: {result}\n')
    return 1 if errors else 0


def _counted(number: int, noun: str) -> str:
    return f'{number} {noun}' if number == 1 else f'{number} {noun}s'
