# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Bad input over the real move_group: each is refused with MoveIt's code and with words."""

from __future__ import annotations

from collections.abc import Iterator
from copy import deepcopy
import math
import re
from typing import Any

from action_msgs.msg import GoalStatus
from geometry_msgs.msg import Pose as PoseMessage
from geometry_msgs.msg import Quaternion
from move_group_rig import (
    action_goal,
    change,
    HAND,
    joint_goal,
    motion_request,
    MoveGroupRig,
    pose_goal,
    READY,
)
from moveit_msgs import msg
from moveit_msgs.srv import GetMotionSequence, GetPositionFK
from planning_messages import box, pose_at, tetrahedron
import pytest
from shape_msgs.msg import Mesh as MeshMessage
from shape_msgs.msg import SolidPrimitive
from std_msgs.msg import Header

from arm_planning import PlanningCode

NAN = math.nan
MOVED = [0.4, *READY[1:]]


def down(x: float, y: float, z: float) -> PoseMessage:
    """Return a pose that looks down."""
    pose = pose_at(x, y, z)
    pose.orientation.w, pose.orientation.x = 0.0, 1.0
    return pose


def near(joint: str, position: float) -> msg.JointConstraint:
    """Return that a joint stays where it is."""
    (message,) = joint_goal([position], [joint]).joint_constraints
    message.tolerance_above = message.tolerance_below = 0.05
    return message


def in_front() -> msg.Constraints:
    """Return a goal that can be reached."""
    return pose_goal(down(0.4, 0.1, 0.5), HAND, 'panda_link0')


def changed(goal: msg.Constraints, *changes: tuple[str, Any]) -> msg.MotionPlanRequest:
    """Return a request for a goal after changes of fields, which are named by their paths."""
    goal = deepcopy(goal)
    for path, value in changes:
        *parts, last = path.split('.')
        part: Any = goal
        for each in parts:
            part = part[int(each)] if each.isdigit() else getattr(part, each)
        setattr(part, last, value)
    return motion_request(goal)


def with_start(positions: list[float], names: list[str] | None = None) -> msg.MotionPlanRequest:
    """Return a request from a state."""
    request = motion_request(joint_goal(MOVED))
    joints = [each.joint_name for each in joint_goal(MOVED).joint_constraints]
    request.start_state.joint_state.name = joints if names is None else names
    request.start_state.joint_state.position = positions
    return request


def up(tolerance: float = 0.1) -> msg.OrientationConstraint:
    """Return that the hand looks up, which it does not."""
    (turn,) = pose_goal(PoseMessage(), HAND, 'panda_link0').orientation_constraints
    turn.absolute_x_axis_tolerance = turn.absolute_y_axis_tolerance = tolerance
    turn.absolute_z_axis_tolerance = math.pi
    return turn


JOINT, POSE, CODE = joint_goal(MOVED), in_front(), PlanningCode
PLACE, TURN = 'position_constraints.0', 'orientation_constraints.0'
REGION = f'{PLACE}.constraint_region'
TWICE = [*JOINT.joint_constraints, near('panda_joint1', MOVED[0] + 0.5)]
FOLDED = [0.0, 1.7, 0.0, -2.9, 0.0, 1.57, 0.785]  # where the hand touches the base in [rad]


Refusal = tuple[str, msg.MotionPlanRequest, PlanningCode, str]
"""Name of a bad request, the request, the code and words of the refusal."""


def bad_goals() -> Iterator[Refusal]:
    """Yield goals that are refused."""
    bad_goal = CODE.INVALID_GOAL_CONSTRAINTS
    yield 'empty group', motion_request(JOINT, ''), CODE.INVALID_GROUP_NAME, 'empty; groups: panda'
    yield 'unknown group', motion_request(JOINT, 'legs'), CODE.INVALID_GROUP_NAME, "'legs'.*panda"
    yield 'no goal', msg.MotionPlanRequest(group_name='panda_arm'), bad_goal, 'no goal'
    yield 'empty goal', motion_request(msg.Constraints()), bad_goal, '0 position'
    moon = (f'{PLACE}.link_name', 'moon'), (f'{TURN}.link_name', 'moon')
    yield 'unknown link', changed(POSE, *moon), CODE.INVALID_LINK_NAME, 'moon'
    for name, goal, path, value, words in (
        ('two links', POSE, f'{TURN}.link_name', 'panda_link7', 'panda_link7'),
        ('nan position', POSE, f'{REGION}.primitive_poses.0.position.y', NAN, 'nan.*finite'),
        ('nan orientation', POSE, f'{TURN}.orientation.x', NAN, 'orientation.*nan'),
        ('zero orientation', POSE, f'{TURN}.orientation', Quaternion(w=0.0), 'all zeros; give'),
        ('negative region', POSE, f'{REGION}.primitives.0.dimensions', [-0.1], '-0.1'),
        ('nan joint', JOINT, 'joint_constraints.2.position', NAN, 'panda_joint3.*nan'),
        ('unknown joint', JOINT, 'joint_constraints.2.joint_name', 'knee', "'knee'"),
        ('contradictory joints', JOINT, 'joint_constraints', TWICE, 'panda_joint1 contradict'),
        ('joints and a pose', POSE, 'joint_constraints', JOINT.joint_constraints, 'not both'),
    ):
        yield name, changed(goal, (path, value)), bad_goal, words
    lost = changed(POSE, (f'{PLACE}.header.frame_id', 'moon'))
    yield 'unknown frame', lost, CODE.FRAME_TRANSFORM_FAILURE, "'moon'"
    far = pose_goal(down(3.0, 0.0, 0.5), HAND, 'panda_link0')
    yield 'out of reach', motion_request(far), CODE.NO_IK_SOLUTION, 'reach'
    beyond = joint_goal([3.5, *READY[1:]])
    yield 'beyond a limit', motion_request(beyond), CODE.GOAL_STATE_INVALID, 'panda_joint1'
    stopped = joint_goal([*READY[:6], 2.7])
    yield 'beyond a soft limit', motion_request(stopped), CODE.GOAL_STATE_INVALID, '-2.5.*2.5'
    folded = motion_request(joint_goal(FOLDED))
    yield 'goal in contact', folded, CODE.GOAL_IN_COLLISION, 'panda_link0 touches'


def bad_rest() -> Iterator[Refusal]:
    """Yield what is wrong with the rest of a request."""
    bad_goal, bad_state = CODE.INVALID_GOAL_CONSTRAINTS, CODE.INVALID_ROBOT_STATE
    in_contact = CODE.START_STATE_IN_COLLISION
    yield 'start in contact', with_start(FOLDED), in_contact, 'panda_link0 touches'
    touching = [a + 0.45 * (b - a) for a, b in zip(FOLDED, READY, strict=True)]  # 2.3 mm deep
    parting = with_start(touching)
    parting.planner_id, parting.goal_constraints = 'PTP', [joint_goal(READY)]
    yield 'PTP out of contact', parting, in_contact, 'panda_link0 touches'
    outside = with_start([4.0, *READY[1:]])
    yield 'start beyond a limit', outside, CODE.START_STATE_INVALID, 'panda_joint1'
    yield 'start with nan', with_start([NAN, *READY[1:]]), bad_state, 'panda_joint1.*nan'
    yield 'start of another robot', with_start([0.0], ['knee']), bad_state, "'knee'"
    yield 'start with a number less', with_start(READY[1:]), bad_state, '7 names and 6'
    two = [near('panda_joint1', 0.0), near('panda_joint1', 0.4)]
    against, level = CODE.START_STATE_VIOLATES_PATH_CONSTRAINTS, [up()]
    for name, path, code, words in (
        ('start against path', msg.Constraints(orientation_constraints=level), against, HAND),
        ('goal against path', msg.Constraints(joint_constraints=two[:1]),
         CODE.GOAL_VIOLATES_PATH_CONSTRAINTS, 'panda_joint1'),
        ('contradictory path', msg.Constraints(joint_constraints=two), bad_goal, '1 contradict'),
        ('nan path', msg.Constraints(orientation_constraints=[up(NAN)]), bad_goal, 'nan'),
    ):  # fmt: skip
        yield name, motion_request(JOINT, path_constraints=path), code, words
    for name, field, value, code, words in (
        ('unknown pipeline', 'pipeline_id', 'stomp', CODE.PLANNING_FAILED, "'stomp'.*ompl"),
        ('unknown planner', 'planner_id', 'magic', CODE.FAILURE, "'magic'.*RRTConnect"),
        ('factor above 1', 'max_velocity_scaling_factor', 1.5, CODE.FAILURE, 'is 1.5'),
        ('factor nan', 'max_acceleration_scaling_factor', NAN, CODE.FAILURE, 'is nan'),
        ('speed nan', 'max_cartesian_speed', NAN, bad_goal, 'max_cartesian_speed is nan'),
        ('time nan', 'allowed_planning_time', NAN, CODE.FAILURE, 'allowed_planning_time is nan'),
    ):
        request = motion_request(JOINT)
        setattr(request, field, value)
        yield name, request, code, words


BAD = {name: rest for name, *rest in (*bad_goals(), *bad_rest())}
INDUSTRIAL = ['unknown link', 'unknown frame', 'nan position', 'out of reach', 'start in contact']
INDUSTRIAL += ['contradictory joints', 'start with nan']


def check(code: Any, wanted: PlanningCode, words: str) -> None:
    """Make sure that a refusal has its code and words."""
    assert PlanningCode(code.val) is wanted, code
    assert code.source == 'move_group'
    assert re.search(words, code.message), code.message


@pytest.mark.parametrize('name', BAD)
def test_a_bad_request_is_refused_alike_by_service_and_action(
    rig: MoveGroupRig, name: str
) -> None:
    """No trajectory comes with it."""
    request, code, words = BAD[name]
    response = rig.plan(request)
    check(response.error_code, code, words)
    assert not response.trajectory.joint_trajectory.points
    goal = action_goal(request)
    goal.planning_options.plan_only = True  # else the start that it names does not count
    status, result = rig.move(goal)
    assert status == GoalStatus.STATUS_ABORTED
    check(result.error_code, code, words)
    assert not result.planned_trajectory.joint_trajectory.points
    if name not in INDUSTRIAL:
        return
    # the pipeline of Pilz has the same codes: for PTP, and as an item of a sequence
    request = deepcopy(request)
    request.pipeline_id, request.planner_id = 'pilz_industrial_motion_planner', 'PTP'
    check(rig.plan(request).error_code, code, words)
    sequence = GetMotionSequence.Request()
    sequence.request.items = [msg.MotionSequenceItem(req=request)]
    answer = rig.client.call(GetMotionSequence, '/plan_sequence_path', sequence).response
    check(answer.error_code, code, words)


def mesh(z: float, corner: int = 3) -> MeshMessage:
    """Return a tetrahedron of another height, whose last triangle names another corner."""
    message = tetrahedron(0.1)
    message.vertices[3].z = z
    message.triangles[3].vertex_indices = [1, 2, corner]
    return message


def in_world(thing: msg.CollisionObject) -> msg.PlanningScene:
    """Return a change of an object in the world."""
    return change(world=msg.PlanningSceneWorld(collision_objects=[thing]))


def crate(**fields: Any) -> msg.PlanningScene:
    """Return a change that adds a box with other fields."""
    thing = box('crate', 0.5, 0.0, 0.5)
    for name, value in fields.items():
        setattr(thing, name, value)
    return in_world(thing)


def ghost(operation: bytes) -> msg.PlanningScene:
    """Return a change of an object that there is not."""
    return in_world(msg.CollisionObject(id='ghost', operation=operation))


def attached(link: str, *touched: str, bare: bool = False) -> msg.PlanningScene:
    """Return a change that attaches a box, or what is in the world."""
    thing = msg.CollisionObject(id='held') if bare else box('held', 0.5, 0.0, 0.5)
    scene = change()
    scene.robot_state.attached_collision_objects = [
        msg.AttachedCollisionObject(link_name=link, object=thing, touch_links=touched)
    ]
    return scene


def twice() -> msg.PlanningScene:
    """Return a change that attaches a box and adds it to the world."""
    scene = attached(HAND)
    scene.world.collision_objects = [box('held', 0.0, 0.5, 0.5)]
    return scene


def padded(link: str, padding: float) -> msg.PlanningScene:
    """Return a change of the padding of a link."""
    return change(link_padding=[msg.LinkPadding(link_name=link, padding=padding)])


LONG = PoseMessage(orientation=Quaternion(w=2.0))
FLAT = SolidPrimitive(type=SolidPrimitive.BOX, dimensions=[0.1, 0.1])
ROWLESS = msg.AllowedCollisionMatrix(entry_names=['a', 'b'])
NO_OBJECT, NO_LINK, OTHER = CODE.INVALID_OBJECT_NAME, CODE.INVALID_LINK_NAME, CODE.FAILURE
SCENES: dict[str, tuple[msg.PlanningScene, PlanningCode, str]] = {
    'empty mesh': (crate(meshes=[MeshMessage()]), OTHER, "'crate': .*no volume"),
    'flat mesh': (crate(meshes=[mesh(0.0)]), OTHER, "'crate': .*flat"),
    'unknown corner': (crate(meshes=[mesh(0.1, 9)]), OTHER, 'vertex 9'),
    'prism': (crate(primitives=[SolidPrimitive(type=5)]), OTHER, 'prism'),
    'nan pose': (crate(pose=pose_at(NAN)), OTHER, "'crate'.*nan"),
    'negative box': (crate(primitives=box('', edge=-0.1).primitives), OTHER, '-0.1'),
    'half a subframe': (crate(subframe_names=['tip']), OTHER, 'subframes'),
    'unknown operation': (crate(operation=b'\x07'), OTHER, 'operation 7'),
    'unknown frame': (crate(header=Header(frame_id='x')), CODE.FRAME_TRANSFORM_FAILURE, "'x'"),
    'no unit quaternion': (crate(pose=LONG), OTHER, 'length is 2'),
    'box of two edges': (crate(primitives=[FLAT]), OTHER, '3 dimensions'),
    'unknown primitive': (crate(primitives=[SolidPrimitive(type=9)]), OTHER, 'no primitive 9'),
    'two poses of a box': (crate(primitive_poses=[pose_at(0.0)] * 2), OTHER, '1 primitive shapes'),
    'no name': (crate(id=''), NO_OBJECT, 'name'),
    'name of a link': (crate(id='panda_link3'), NO_OBJECT, 'link'),
    'no shape': (ghost(msg.CollisionObject.ADD), OTHER, "'ghost'.*shape"),
    'removal of an unknown object': (ghost(msg.CollisionObject.REMOVE), NO_OBJECT, "'ghost'"),
    'move of an unknown object': (ghost(msg.CollisionObject.MOVE), NO_OBJECT, "'ghost'"),
    'attached unknown object': (attached(HAND, bare=True), NO_OBJECT, 'no object'),
    'attached to an unknown link': (attached('claw'), NO_LINK, "'claw'"),
    'touching an unknown link': (attached(HAND, 'claw'), NO_LINK, "'claw'"),
    'attached and in the world': (twice(), NO_OBJECT, 'attached to panda_link8'),
    'padding of an unknown link': (padded('claw', 0.1), NO_LINK, "'claw'"),
    'negative padding': (padded(HAND, -0.1), OTHER, '-0.1'),
    'scale of zero': (change(link_scale=[msg.LinkScale(link_name=HAND)]), OTHER, 'scale'),
    'matrix without rows': (change(allowed_collision_matrix=ROWLESS), OTHER, 'entry_values'),
}  # fmt: skip


@pytest.mark.parametrize('name', SCENES)
def test_a_bad_scene_is_refused_as_a_whole(rig: MoveGroupRig, name: str) -> None:
    """By apply_planning_scene with words in the log, and as the diff of a goal with its code."""
    wrong, code, words = deepcopy(SCENES[name])
    good = box('good', 2.0, 0.0, 0.5)
    wrong.world.collision_objects = [good, *wrong.world.collision_objects]
    refused = f'apply_planning_scene refused: {code.name}: .*{words}'
    earlier = sum(re.search(refused, line) is not None for line in rig.process.lines)
    assert not rig.apply(wrong)
    assert not rig.objects()
    rig.process.wait_for(refused, 30.0, count=earlier + 1)
    goal = action_goal(motion_request(JOINT), plan_only=True)
    goal.planning_options.planning_scene_diff = wrong
    _status, result = rig.move(goal)
    check(result.error_code, code, words)


def test_services_of_kinematics_refuse_alike(rig: MoveGroupRig) -> None:
    """compute_ik, compute_fk and compute_cartesian_path; the node goes on after that."""
    good, bad_goal = down(0.4, 0.1, 0.5), CODE.INVALID_GOAL_CONSTRAINTS
    poses: list[tuple[PoseMessage, dict[str, Any], PlanningCode, str]] = [
        (good, {'group_name': ''}, CODE.INVALID_GROUP_NAME, 'group'),
        (good, {'ik_link_name': 'moon'}, NO_LINK, 'moon'),
        (good, {'ik_link_names': ['a', 'b']}, NO_LINK, '2 ik_link_names'),
        (down(NAN, 0.1, 0.5), {}, bad_goal, 'finite|nan'),
        (down(3.0, 0.1, 0.5), {}, CODE.NO_IK_SOLUTION, 'reach'),
        (good, {'frame': 'moon'}, CODE.FRAME_TRANSFORM_FAILURE, 'moon'),
    ]
    for pose, fields, code, words in poses:
        check(rig.ik(pose, **fields).error_code, code, words)
    fk = GetPositionFK.Request(fk_link_names=['moon'])
    check(rig.client.call(GetPositionFK, '/compute_fk', fk).error_code, NO_LINK, 'moon')
    paths: list[tuple[list[PoseMessage], dict[str, Any], PlanningCode, str]] = [
        ([good], {'group_name': ''}, CODE.INVALID_GROUP_NAME, 'group'),
        ([good], {'link_name': 'moon'}, NO_LINK, 'moon'),
        ([good], {'max_step': 0.0}, bad_goal, 'max_step'),
        ([good], {'max_step': 1e-9}, bad_goal, 'give a greater step'),
        ([good], {'jump_threshold': -1.0}, bad_goal, 'relative jump threshold'),
        ([], {}, bad_goal, 'no way-points'),
        ([pose_at(NAN)], {}, bad_goal, 'finite|nan'),
        ([good], {'max_velocity_scaling_factor': 2.0}, OTHER, 'is 2'),
    ]
    for way, fields, code, words in paths:
        answer = rig.cartesian_path(*way, **fields)
        check(answer.error_code, code, words)
        assert answer.fraction == -1.0
    assert rig.plan(motion_request(JOINT)).error_code.val == CODE.SUCCESS
