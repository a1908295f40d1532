# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Cartesian paths: dense enough, on their lines, and how far they lead; services of kinematics.

Refusals: test_planning_bad_input.
"""

from __future__ import annotations

from functools import cache
from typing import Any

from geometry_msgs.msg import PoseStamped
from hypothesis import given, settings
from hypothesis import strategies as st
from model_robots import chain_texts, ready, robot, ROBOTS
from move_group_rig import HAND, JOINTS, MoveGroupRig, pose_goal, READY
from moveit_msgs import msg
import numpy as np
from planning_messages import box, panda
from planning_scenes import broken_limits
import pytest

from arm_model import Array, frozen, ORIGIN, Pose, RobotModel
from arm_planning import PlanningCode
from arm_planning.cartesian import cartesian_path, JumpThresholds
from arm_planning.link_kinematics import LinkKinematics
from arm_planning.ros.scene import pose_message
from arm_planning.ros.trajectories import path_of


@cache
def tip(name: str) -> LinkKinematics:
    """Return the kinematics of a robot's tip."""
    return LinkKinematics(robot(name))


def tip_at(name: str, *way: float) -> Pose:
    """Return the pose of the tip at the ready pose, moved."""
    pose = tip(name).pose(ready(name))
    return Pose(pose.rotation, pose.position + np.array(way))


@pytest.mark.parametrize('name', ROBOTS)
@settings(max_examples=15, deadline=None)
@given(side=st.floats(0.01, 0.08), step=st.floats(0.002, 0.03))
def test_way_points_are_passed_in_steps(name: str, side: float, step: float) -> None:
    """The link goes around a corner in steps that are no longer than asked for."""
    corner, end = tip_at(name, 0.0, side, 0.0), tip_at(name, 0.0, side, -side)
    found = cartesian_path(robot(name), ready(name), [corner, end], step)
    assert found.fraction == 1.0
    assert not found.reason
    places = [tip(name).pose(row) for row in found.positions]
    ways = np.array([place.position for place in places])
    longest = np.linalg.norm(np.diff(ways, axis=0), axis=1).max()
    assert longest <= step + 1e-9  # [m] inverse kinematics is no more exact
    assert places[-1].position == pytest.approx(end.position, abs=1e-8)
    assert np.linalg.norm(ways - corner.position, axis=1).min() < 1e-8
    assert np.abs(ways[:, 0] - corner.position[0]).max() < 1e-8
    for place in places:
        assert place.rotation == pytest.approx(corner.rotation, abs=1e-8)


@pytest.mark.parametrize('name', ROBOTS)
def test_the_fraction_ends_where_the_reach_does(name: str) -> None:
    """Out of reach: all places but the last are met, and the reason is said; none is enough."""
    found = cartesian_path(robot(name), ready(name), [tip_at(name, 0.0, 4.0, 0.0)], 0.02)
    assert 0.01 < found.fraction < 0.9
    assert 'no joint positions' in found.reason
    way = tip(name).pose(found.positions[-1]).position - tip_at(name, 0.0, 0.0, 0.0).position
    assert way == pytest.approx([0.0, 4.0 * found.fraction, 0.0], abs=1e-8)
    still = cartesian_path(robot(name), ready(name), [tip_at(name, 0.0, 0.0, 0.0)], 0.02)
    assert still.fraction == 1.0
    assert still.positions == pytest.approx(np.tile(ready(name), (len(still.positions), 1)))


def test_jumps_end_a_path() -> None:
    """By the step of a joint that turns or slides, or by the mean step."""
    model, start, goal = robot('prbt'), ready('prbt'), tip_at('prbt', 0.0, 0.1, 0.0)
    steps = np.abs(np.diff(cartesian_path(model, start, [goal], 0.005).positions, axis=0))
    limit = float(steps[: len(steps) // 2].max()) * 0.999
    cut = cartesian_path(model, start, [goal], 0.005, jumps=JumpThresholds(revolute=limit))
    assert cut.fraction < 0.5
    assert 'would jump by' in cut.reason
    assert np.abs(np.diff(cut.positions, axis=0)).max(initial=0.0) <= limit
    lengths = np.linalg.norm(steps, axis=1)
    factor = float(lengths[0] / lengths.mean()) * 0.999
    for jumps, fraction in (
        (JumpThresholds(2.0, 1.0, 1e-9), 1.0),  # nothing slides
        (JumpThresholds(factor), 0.0),
    ):
        assert cartesian_path(model, start, [goal], 0.005, jumps=jumps).fraction == fraction
    model = RobotModel(*chain_texts('pzyyzxz'))
    start = frozen([0.1, 0.3, 0.4, 0.5, 0.3, 0.4, 0.2])
    pose = LinkKinematics(model).pose(start)
    goal = Pose(pose.rotation, pose.position + np.array([0.05, 0.0, 0.0]))
    assert cartesian_path(model, start, [goal], 0.01).fraction == 1.0
    cut = cartesian_path(model, start, [goal], 0.01, jumps=JumpThresholds(prismatic=1e-4))
    assert cut.fraction == 0.0
    assert 'j1 would jump' in cut.reason


BASE = 'panda_link0'
MODEL = panda().model('panda_arm')
TIP = MODEL.kinematics.link_pose(HAND, frozen(READY))


def moved(*way: float) -> Pose:
    """Return the pose of the tip, moved."""
    return Pose(TIP.rotation, frozen(TIP.position + np.array(way)))


def solved(response: Any) -> Pose:
    """Return where the tip is in a solution."""
    assert response.error_code.val == msg.MoveItErrorCodes.SUCCESS, response.error_code
    state = response.solution.joint_state
    assert set(state.name) == set(panda().joints)
    place = dict(zip(state.name, state.position, strict=True))
    return MODEL.kinematics.link_pose(HAND, frozen([place[name] for name in JOINTS]))


def test_a_solution_has_the_pose(rig: MoveGroupRig) -> None:
    """Of the tip, and of a link that is named alone or in the lists; in the frame of a link."""
    wanted = moved(0.05, 0.1, -0.05)
    pose = pose_message(wanted)
    stamped = PoseStamped(pose=pose)
    stamped.header.frame_id = BASE
    listed: dict[str, Any] = {'ik_link_names': [HAND], 'pose_stamped_vector': [stamped]}
    for fields in ({}, {'ik_link_name': HAND}, listed):
        found = solved(rig.ik(pose, BASE, **fields))
        assert found.position == pytest.approx(wanted.position, abs=1e-6)
        assert found.rotation == pytest.approx(wanted.rotation, abs=1e-6)
    above = pose_message(Pose(ORIGIN.rotation, frozen([0.0, 0.0, -0.05])))
    found = solved(rig.ik(above, HAND))
    assert found.position == pytest.approx(TIP.position - 0.05 * TIP.rotation[:, 2], abs=1e-6)


def joint_constraint(position: float, tolerance: float = 0.2, number: int = 1) -> msg.Constraints:
    """Return a constraint of a joint."""
    limits = msg.JointConstraint(joint_name=f'panda_joint{number}', position=position)
    limits.tolerance_above = limits.tolerance_below = tolerance
    return msg.Constraints(joint_constraints=[limits])


def region(y: float) -> msg.Constraints:
    """Return a constraint of the tip to a ball beside where it is."""
    place = pose_goal(pose_message(moved(0.0, y, 0.0)), HAND, BASE).position_constraints[0]
    place.constraint_region.primitives[0].dimensions = [0.02]
    return msg.Constraints(position_constraints=[place])


def test_solutions_heed_constraints_and_avoid_collisions(rig: MoveGroupRig) -> None:
    """Of joints and places, and where it is asked a box about the goal, by its name."""
    at = pose_message(TIP)
    crate = box('crate', *TIP.position.tolist(), edge=0.1)
    for heeded, violated, words in (
        # the place of the wrist alone says where the elbow is
        (joint_constraint(0.0), joint_constraint(-1.0, number=4), 'panda_joint4 is at'),
        (region(0.0), region(0.3), 'outside of its region'),
    ):
        solved(rig.ik(at, BASE, constraints=heeded))
        refused = rig.ik(at, BASE, constraints=violated).error_code
        assert refused.val == PlanningCode.NO_IK_SOLUTION
        assert words in refused.message
    rig.add(crate)
    solved(rig.ik(at, BASE))
    refused = rig.ik(at, BASE, avoid_collisions=True).error_code
    assert refused.val == PlanningCode.NO_IK_SOLUTION
    assert 'crate' in refused.message


def places_of(response: Any) -> tuple[Array, Array]:
    """Return times and places of the tip at the points of a solution."""
    points = response.solution.joint_trajectory.points
    times = [each.time_from_start.sec + 1e-9 * each.time_from_start.nanosec for each in points]
    rows = [frozen(each.positions) for each in points]
    tip = [MODEL.kinematics.link_pose(HAND, row).position for row in rows]
    return np.array(times), np.array(tip)


def path(rig: MoveGroupRig, *poses: Pose, **fields: Any) -> Any:
    """Return the response for a path through poses of the tip."""
    return rig.cartesian_path(*map(pose_message, poses), **fields)


def test_a_path_goes_around_a_corner(rig: MoveGroupRig) -> None:
    """Along both lines, from rest to rest within the limits of the joints."""
    corner, end = moved(0.0, 0.1, 0.0), moved(0.0, 0.1, -0.1)
    response = path(rig, corner, end)
    assert (response.fraction, response.error_code.val, response.error_code.message) == (1, 1, '')
    assert set(response.start_state.joint_state.name) == set(panda().joints)
    _times, tip = places_of(response)
    assert tip[0] == pytest.approx(TIP.position, abs=1e-6)
    assert tip[-1] == pytest.approx(end.position, abs=1e-6)
    away = tip - corner.position
    off = np.minimum(np.hypot(away[:, 0], away[:, 2]), np.hypot(away[:, 0], away[:, 1]))
    assert off.max() < 0.25 * 0.01  # of max_step: the corner is passed on a smooth curve
    distance = np.linalg.norm(away, axis=1)
    assert off[distance > 0.03].max() < 2e-4
    assert distance.min() < 2e-3
    followed = path_of(response.solution.joint_trajectory)
    assert broken_limits(followed, MODEL.limits, 1e-3) == []
    for at in (0.0, followed.duration):
        assert np.abs(followed.at(at).velocity).max() < 1e-6


def test_a_path_is_slower_by_its_factors_and_its_speed(rig: MoveGroupRig) -> None:
    """Scaling factors of the joints, and max_cartesian_speed of the tip."""
    end = moved(0.0, 0.2, 0.0)

    def lasts(**fields: Any) -> float:
        return float(places_of(path(rig, end, **fields))[0][-1])

    assert lasts(max_velocity_scaling_factor=0.1) > 1.5 * lasts()
    assert lasts(max_cartesian_speed=0.05) > 4.0  # [s] 0.2 m at 0.05 m/s


def test_a_path_ends_in_front_of_what_it_must_not_touch(rig: MoveGroupRig) -> None:
    """The fraction says how far, the message why; without avoid_collisions it goes on."""
    end = moved(0.0, 0.2, 0.0)
    held = path(rig, end, path_constraints=joint_constraint(0.0, 0.02))
    assert 0.0 < held.fraction < 1.0
    rig.add(box('crate', *moved(0.0, 0.25, 0.0).position.tolist(), edge=0.1))
    assert path(rig, end).fraction == 1.0
    blocked = path(rig, end, avoid_collisions=True)
    assert blocked.error_code.val == msg.MoveItErrorCodes.SUCCESS
    assert 0.0 < blocked.fraction < 1.0
    assert 'crate' in blocked.error_code.message
    _, tip = places_of(blocked)
    assert tip[-1][1] == pytest.approx(0.2 * blocked.fraction + TIP.position[1], abs=1e-6)
    rig.add(box('post', *moved(0.15, 0.0, 0.0).position.tolist(), edge=0.06))
    passed = path(rig, moved(0.3, 0.0, 0.0), avoid_collisions=True, max_step=0.5)
    assert passed.fraction == 0.0, 'the post is between two places of one step'
    assert 'post' in passed.error_code.message
