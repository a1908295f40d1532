# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Findings of ``check.py``, and the checks that need kinematics.

Each problem is a :class:`Finding`. This module checks limits, poses and the
start pose of an arm.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
import difflib
import textwrap
from typing import Any, TYPE_CHECKING

from urdf_reader import DescriptionError, find_group, KinematicTree, SemanticDescription

from process_supervisor import parameters_by_node, Severity, StartError

from .groups import choose_groups, controller_names, MovedGroups
from .robots import read_semantic, Robot, RobotError, SETTINGS

if TYPE_CHECKING:
    from arm_canopen.config import AxisUnits
    from arm_model import JointLimits, RobotModel


@dataclass(frozen=True, slots=True)
class Finding:
    """One problem in a robot folder."""

    # ERROR: the robot does not run, or not as described; WARNING: unexpected behaviour is likely
    severity: Severity
    place: str  # file, and what in it
    problem: str  # what is wrong
    remedy: str  # what to do

    def __str__(self) -> str:
        """Format the finding in two or more lines."""
        remedy = textwrap.indent(self.remedy, '    ')
        return f'{self.severity.value}: {self.place}: {self.problem}\n{remedy}'


def error(place: str, problem: str, remedy: str) -> Finding:
    """Return a finding of severity ERROR."""
    return Finding(Severity.ERROR, place, problem, remedy)


def warning(place: str, problem: str, remedy: str) -> Finding:
    """Return a finding of severity WARNING."""
    return Finding(Severity.WARNING, place, problem, remedy)


LONGER = 5.0  # stopping distance, as a multiple of that within the limits, that gives a warning
START = 'ready'  # pose of the SRDF from which an arm starts
SINGULAR = 0.05
"""Least singular value of the Jacobian (lengths divided by the reach) in a good start pose."""
CLEARANCE = 0.01  # least distance between links at the start in [m]
MARGIN = 0.02  # share of the range of a joint that a good start leaves on either side


def check_motion(
    robot: Robot,
    urdf: str,
    tree: KinematicTree,
    semantic: SemanticDescription,
    drives: Mapping[str, AxisUnits | None],
) -> list[Finding]:
    """Check the files for trajectories and jogging; SRDF and limits must exist.

    ``drives`` maps each joint with a drive to the drive's settings, or None if unknown.
    """
    try:
        from arm_model import LimitsError, load_limits, ModelError, RobotModel
        from arm_servo import check_arm
    except ImportError as problem:
        return [
            warning(
                robot.semantic.name,
                f'motion is not checked: {problem}',
                'make build builds arm_servo and gets what it needs; then source env.sh',
            )
        ]
    try:
        limits = load_limits(robot.limits)
        groups = choose_groups(robot, semantic, tree, drives)
    except LimitsError as problem:
        return [error(robot.limits.name, str(problem), 'write it as robots/gp110/limits.yaml is')]
    except RobotError as problem:
        return [error(robot.semantic.name, str(problem), f'see {SETTINGS} in README')]
    findings = [*_limits(robot, limits, tree), *_not_executed(robot, groups, semantic, tree)]
    text, notes, models = read_semantic(robot), {}, {}
    arms = {name: find_group(tree, semantic, name).joints for name in groups.arms}
    for group in groups.names:
        tip = robot.tip_link if group == groups.names[0] else ''
        is_arm = group in arms
        others = {name: joints for name, joints in arms.items() if is_arm and name != group}
        try:
            model = RobotModel(urdf, text, limits, group, tip or None, moved_by_others=others)
            check_arm(model)
        except LimitsError as problem:
            remedy = (
                f'give each joint of the group numbers above 0, none wider than in '
                f'{robot.description.name}: max_velocity, max_acceleration and max_jerk'
            )
            findings.append(error(robot.limits.name, str(problem), remedy))
            continue
        except ModelError as problem:
            remedy = 'choose another group or tip_link, or correct the file'
            place = f'{robot.semantic.name} with {robot.description.name}'
            findings.append(error(place, str(problem), remedy))
            continue
        notes.update(dict.fromkeys(model.notes if is_arm else model.notes_beside_contact))
        models[group] = model
        findings += check_drives(robot.limits.name, drives, model.limits)
        if is_arm:
            notes.update(dict.fromkeys(filter(None, [model.assumption(drives)])))
            findings += _start(robot, model)
        findings += _poses(robot, model)
    findings += [warning(*_note(robot, note)) for note in notes]
    return findings + list(_controllers(robot, groups, models))


def _not_executed(
    robot: Robot, groups: MovedGroups, semantic: SemanticDescription, tree: KinematicTree
) -> Iterable[Finding]:
    """Find groups whose plans are not executed, as a larger group with their joints moves."""
    moved = {joint: arm for arm in groups.arms for joint in find_group(tree, semantic, arm).joints}
    others = [] if robot.groups else [arm for arm in semantic.arms if arm not in groups.names]
    for name in others:
        try:
            joints = find_group(tree, semantic, name).joints
        except DescriptionError:  # reported with the names of the SRDF
            continue
        whole = {moved[joint] for joint in joints if joint in moved}
        if whole:
            yield warning(
                robot.semantic.name,
                f'group {name} shares joints with {min(whole)}, which is moved: plans for {name} '
                'are not executed',
                f'plan for {min(whole)}; or name the groups to move in {SETTINGS}, as group: '
                f'[{name}, ...]',
            )


def _note(robot: Robot, note: str) -> tuple[str, str, str]:
    """Return place, problem and remedy for a note of the model on skipped or defaulted data."""
    if 'limits file' in note or 'any file' in note:
        return robot.limits.name, note, 'write the limits where you know them'
    if 'disable_collisions' in note:
        return robot.semantic.name, note, 'add disable_collisions for these pairs'
    if 'SRDF' in note:
        return robot.semantic.name, note, 'correct the pose, or leave it out'
    if 'is not installed' in note:
        remedy = f'or give the folder of the package in {SETTINGS} (packages: {{NAME: FOLDER}})'
        return robot.description.name, note, remedy
    if 'collisions are checked with' in note or 'collision with each other' in note:
        return robot.semantic.name, note, 'nothing, where they cannot meet'
    return robot.description.name, note, 'see README of arm_model: what it reads'


def _limits(robot: Robot, limits: Mapping[str, Any], tree: KinematicTree) -> Iterable[Finding]:
    """Find limits for joints that the description lacks; misspelt names are errors."""
    joints = {joint.name for joint in tree.joints}
    idle = [joint.name for joint in tree.movable() if joint.name not in limits]
    for name in limits:
        if name not in joints:
            close = difflib.get_close_matches(name, idle, n=1)
            make, meant = (error, f'; is {close[0]!r} meant?') if close else (warning, '')
            problem = f'{robot.description.name} has no joint {name!r}{meant}'
            without = ', '.join(idle) or 'none'
            remedy = f'take it out, or name it as the joint; joints without limits: {without}'
            yield make(robot.limits.name, problem, remedy)


def _found_start(robot: Robot, model: RobotModel) -> Finding:
    """Return a finding that proposes a start pose for an arm whose SRDF has none."""
    from arm_model import ModelError, start_pose

    known = ', '.join(model.poses) or 'none'
    problem = f'group {model.group} has no pose {START!r} to start from; poses: {known}'
    try:
        start = start_pose(model)
    except ModelError as refused:
        return error(robot.semantic.name, f'{problem}; {refused}', 'correct it, then add the pose')
    joints = ' '.join(
        f'<joint name="{name}" value="{place:g}"/>'
        for name, place in zip(model.joints, start, strict=True)
    )
    return warning(
        robot.semantic.name,
        f'{problem}; it starts from a good one of them, or one that was searched for',
        f'add <group_state name="{START}" group="{model.group}">{joints}</group_state>',
    )


def _start(robot: Robot, model: RobotModel) -> Iterable[Finding]:
    import numpy as np

    place = f'{robot.semantic.name}, group {model.group}, pose {START!r}'
    if START not in model.poses:
        yield _found_start(robot, model)
        return
    start = model.poses[START]
    jacobian = np.array(model.jacobian(start))
    jacobian[:3] /= model.reach
    least = float(np.linalg.svd(jacobian, compute_uv=False)[min(jacobian.shape) - 1])
    if least < SINGULAR:
        yield error(
            place,
            f'it is singular (least singular value {least:.4f}): some directions cannot be jogged',
            'bend the elbow and the wrist, by 90 degrees for instance',
        )
    room = np.minimum(start - model.limits.lower, model.limits.upper - start)
    tight = room < MARGIN * (model.limits.upper - model.limits.lower)
    if at_end := [name for name, each in zip(model.joints, tight, strict=True) if each]:
        yield warning(
            place,
            f'{", ".join(at_end)} at the end of the range: can be jogged in one direction only',
            'start from further inside',
        )
    clearance = model.clearance(start)
    if clearance < CLEARANCE:
        pair = model.nearest(start, CLEARANCE, 1)[0].links
        if clearance > 0.0:  # some links of an arm are this near in every pose
            problem = f'{pair[0]} and {pair[1]} are {1e3 * clearance:.0f} mm apart'
            yield warning(place, problem, 'fine where they are never much further apart')
            return
        problem = f'{pair[0]} and {pair[1]} collide, by {-1e3 * clearance:.0f} mm'
        remedy = 'move them apart, or disable the pair in the SRDF if they can never meet'
        yield error(place, problem, remedy)


def _poses(robot: Robot, model: RobotModel) -> Iterable[Finding]:
    """Find poses in collision, except the start pose."""
    for name, positions in model.poses.items():
        for each in model.nearest(positions, 0.0, 1) if name != START else ():
            place = f'{robot.semantic.name}, group {model.group}, pose {name!r}'
            depth = f'{-1e3 * each.distance:.0f} mm'
            problem = f'{" and ".join(each.links)} collide, by {depth}: no motion goes there'
            remedy = 'correct the pose, or disable the pair in the SRDF if they can never meet'
            yield warning(place, problem, remedy)


def _controllers(
    robot: Robot, groups: MovedGroups, models: Mapping[str, RobotModel]
) -> Iterable[Finding]:
    from arm_model.ros import GroupModels
    from arm_servo import check_parameters

    if not robot.controllers.is_file() or len(models) < len(groups.names):
        return  # problems of a group are reported already
    place = robot.controllers.name
    moved = GroupModels(
        *([models[name] for name in names] for names in (groups.arms, groups.tools))
    )
    try:
        table = parameters_by_node(robot.controllers)
        names = controller_names(robot, groups)
        constraints = {
            name: table.get(name, {}).get('ros__parameters', {}).get('constraints', {}).items()
            for name in names.values()
        }
        refused = check_parameters(moved, table)
    except (StartError, RobotError, AttributeError, TypeError) as problem:
        yield error(place, f'not a parameter file: {problem}', 'see robots/gp110/controllers.yaml')
        return
    main = names[groups.names[0]]
    if main not in table:
        known = ', '.join(table)
        yield warning(place, f'no parameters of {main!r}; nodes: {known}', f'name one {main}')
    if main in [name for group, name in names.items() if group != groups.names[0]]:
        yield error(
            f'{place}, controller_manager',
            f'controller_name {main} is the name of the controller of another group, too',
            f'choose another one, or leave it out: {groups.names[0]}_controller',
        )
    for group, name in names.items():
        for joint, values in constraints[name]:
            if isinstance(values, dict) and joint not in models[group].joints:
                yield error(
                    f'{place}, {name}, constraints',
                    f'group {group} has no joint {joint!r}',
                    f'joints: {", ".join(models[group].joints)}',
                )
    for node, reason in refused:
        remedy = 'correct it: the node would end with these words; see the README of arm_servo'
        yield error(f'{place}, {node}', reason, remedy)


def check_drives(
    place: str, drives: Mapping[str, AxisUnits | None], limits: JointLimits
) -> Iterable[Finding]:
    """Check speed limit and decelerations of each drive; skip drives with unknown settings."""
    from canopen_core.standard import Index

    rows = zip(limits.names, limits.velocity, limits.acceleration, strict=True)
    for name, velocity, acceleration in rows:
        drive = drives.get(name)
        motion = drive.motion if drive is not None else {}
        greatest = motion.get(Index.MAX_PROFILE_VELOCITY)
        if greatest and velocity > greatest:
            yield warning(
                place,
                f'{name} may have {velocity:.4g} per second, and its drive takes up to '
                f'{greatest:.4g} (0x607F in bus.yml or the EDS): the arm is not led then',
                'lower its max_velocity, or raise 0x607F in the sdo list of bus.yml',
            )
        ramps = [
            (motion[index], index)
            for index in (Index.PROFILE_DECELERATION, Index.QUICK_STOP_DECELERATION)
            if motion.get(index)
        ]
        deceleration, index = min(ramps, default=(acceleration, None))
        if index is not None and LONGER * deceleration < acceleration:
            speed = min(velocity, greatest or velocity)
            yield warning(
                place,
                f'{name}: halted at full speed its drive goes on for '
                f'{speed**2 / (2.0 * deceleration):.3g} (0x{index:04X} is {deceleration:.3g} per '
                f's2), within its limits it would be {speed**2 / (2.0 * acceleration):.3g}',
                f'raise 0x{index:04X} in the sdo list of bus.yml to about {acceleration:.3g} '
                'per s2, in units of the drive',
            )
