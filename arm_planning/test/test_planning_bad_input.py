# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Bad input over the real move_group: each is refused with MoveIt's code and with words."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from copy import deepcopy
import math
import re
from typing import Any

from action_msgs.msg import GoalStatus
from geometry_msgs.msg import Pose as PoseMessage
from geometry_msgs.msg import Quaternion
from isolation import reserve
from move_group_rig import (
    action_goal,
    joint_goal,
    JOINTS,
    motion_request,
    MoveGroupRig,
    panda_parameters,
    pose_goal,
    READY,
    robots,
)
from moveit_msgs.msg import (
    CollisionObject,
    Constraints,
    JointConstraint,
    MotionPlanRequest,
    MotionSequenceItem,
    OrientationConstraint,
    PlanningScene,
)
from moveit_msgs.srv import (
    ApplyPlanningScene,
    GetCartesianPath,
    GetMotionSequence,
    GetPositionFK,
    GetPositionIK,
)
from planning_messages import box, pose_at, tetrahedron
import pytest
from urdf_reader import expand_xacro

from arm_planning import PlanningCode

NAN = math.nan
MOVED = [0.4, *READY[1:]]
HAND = 'panda_link8'


def down(x: float, y: float, z: float) -> PoseMessage:
    """Return a pose that looks down."""
    pose = pose_at(x, y, z)
    pose.orientation.w, pose.orientation.x = 0.0, 1.0
    return pose


def in_front() -> Constraints:
    """Return a goal that can be reached."""
    return pose_goal(down(0.4, 0.1, 0.5), HAND, 'panda_link0')


def changed(goal: Constraints, change: Callable[[Any], None]) -> MotionPlanRequest:
    """Return a request for a goal after a change."""
    goal = deepcopy(goal)
    change(goal)
    return motion_request(goal)


def with_start(positions: list[float], names: list[str] | None = None) -> MotionPlanRequest:
    """Return a request from a state."""
    request = motion_request(joint_goal(MOVED))
    joints = [each.joint_name for each in joint_goal(MOVED).joint_constraints]
    request.start_state.joint_state.name = joints if names is None else names
    request.start_state.joint_state.position = positions
    return request


def within(request: MotionPlanRequest, **path: Any) -> MotionPlanRequest:
    """Return a request under path constraints."""
    request.path_constraints = Constraints(**path)
    return request


def set_nan_position(goal: Any) -> None:
    """Ask for no place."""
    goal.position_constraints[0].constraint_region.primitive_poses[0].position.y = NAN


def set_nan_turn(goal: Any) -> None:
    """Ask for no orientation."""
    goal.orientation_constraints[0].orientation.x = NAN


def set_zero_turn(goal: Any) -> None:
    """Leave the orientation at zeros, as a message of C does."""
    goal.orientation_constraints[0].orientation = Quaternion(w=0.0)


def set_link(goal: Any) -> None:
    """Ask for a link that there is not."""
    goal.position_constraints[0].link_name = goal.orientation_constraints[0].link_name = 'moon'


def set_two_links(goal: Any) -> None:
    """Ask for two links at once."""
    goal.orientation_constraints[0].link_name = 'panda_link7'


def set_frame(goal: Any) -> None:
    """Ask in a frame that there is not."""
    goal.position_constraints[0].header.frame_id = 'moon'


def contradict(goal: Any) -> None:
    """Ask for two places of a joint."""
    again = deepcopy(goal.joint_constraints[0])
    again.position += 0.5
    goal.joint_constraints.append(again)


def both(goal: Any) -> None:
    """Ask for joints and a pose."""
    goal.joint_constraints = joint_goal(MOVED).joint_constraints


def set_nan_joint(goal: Any) -> None:
    """Ask for no position of a joint."""
    goal.joint_constraints[2].position = NAN


def set_joint(goal: Any) -> None:
    """Ask for a joint that there is not."""
    goal.joint_constraints[2].joint_name = 'knee'


def set_flat_region(goal: Any) -> None:
    """Ask for a region of negative size."""
    goal.position_constraints[0].constraint_region.primitives[0].dimensions = [-0.1]


def level(tolerance: float = 0.1) -> OrientationConstraint:
    """Return that the hand looks up, which it does not."""
    turn = OrientationConstraint(link_name=HAND, weight=1.0)
    turn.header.frame_id = 'panda_link0'
    turn.orientation.w = 1.0
    turn.absolute_x_axis_tolerance = turn.absolute_y_axis_tolerance = tolerance
    turn.absolute_z_axis_tolerance = math.pi
    return turn


def near(joint: str, position: float) -> JointConstraint:
    """Return that a joint stays where it is."""
    return JointConstraint(
        joint_name=joint, position=position, tolerance_above=0.05, tolerance_below=0.05, weight=1.0
    )


JOINT, POSE, CODE = joint_goal(MOVED), in_front(), PlanningCode
FOLDED = [0.0, 1.7, 0.0, -2.9, 0.0, 1.57, 0.785]  # where the hand touches the base in [rad]


Refusal = tuple[str, MotionPlanRequest, PlanningCode, str]
"""Name of a bad request, the request, the code and words of the refusal."""


def bad_goals() -> Iterator[Refusal]:
    """Yield goals that are refused."""
    bad_goal = CODE.INVALID_GOAL_CONSTRAINTS
    yield 'empty group', motion_request(JOINT, ''), CODE.INVALID_GROUP_NAME, 'empty; groups: panda'
    yield 'unknown group', motion_request(JOINT, 'legs'), CODE.INVALID_GROUP_NAME, "'legs'.*panda"
    yield 'no goal', MotionPlanRequest(group_name='panda_arm'), bad_goal, 'no goal'
    yield 'empty goal', motion_request(Constraints()), bad_goal, '0 position'
    yield 'unknown link', changed(POSE, set_link), CODE.INVALID_LINK_NAME, 'moon'
    yield 'two links', changed(POSE, set_two_links), bad_goal, 'panda_link7'
    yield 'unknown frame', changed(POSE, set_frame), CODE.FRAME_TRANSFORM_FAILURE, "'moon'"
    yield 'nan position', changed(POSE, set_nan_position), bad_goal, 'nan.*finite'
    yield 'nan orientation', changed(POSE, set_nan_turn), bad_goal, 'orientation.*nan'
    yield 'zero orientation', changed(POSE, set_zero_turn), bad_goal, 'all zeros; give'
    yield 'negative region', changed(POSE, set_flat_region), bad_goal, '-0.1'
    yield 'nan joint', changed(JOINT, set_nan_joint), bad_goal, 'panda_joint3.*nan'
    yield 'unknown joint', changed(JOINT, set_joint), bad_goal, "'knee'"
    yield 'contradictory joints', changed(JOINT, contradict), bad_goal, 'panda_joint1 contradict'
    yield 'joints and a pose', changed(POSE, both), bad_goal, 'not both'
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
    bad_goal = CODE.INVALID_GOAL_CONSTRAINTS
    folded = with_start(FOLDED)
    yield 'start in contact', folded, CODE.START_STATE_IN_COLLISION, 'panda_link0 touches'
    touching = [a + 0.45 * (b - a) for a, b in zip(FOLDED, READY, strict=True)]  # 2.3 mm deep
    parting = with_start(touching)
    parting.planner_id, parting.goal_constraints = 'PTP', [joint_goal(READY)]
    yield 'PTP out of contact', parting, CODE.START_STATE_IN_COLLISION, 'panda_link0 touches'
    outside = with_start([4.0, *READY[1:]])
    yield 'start beyond a limit', outside, CODE.START_STATE_INVALID, 'panda_joint1'
    bad_state = CODE.INVALID_ROBOT_STATE
    yield 'start with nan', with_start([NAN, *READY[1:]]), bad_state, 'panda_joint1.*nan'
    yield 'start of another robot', with_start([0.0], ['knee']), bad_state, "'knee'"
    yield 'start with a number less', with_start(READY[1:]), bad_state, '7 names and 6'
    up = within(motion_request(JOINT), orientation_constraints=[level()])
    yield 'start against path', up, CODE.START_STATE_VIOLATES_PATH_CONSTRAINTS, HAND
    still = within(motion_request(JOINT), joint_constraints=[near('panda_joint1', 0.0)])
    yield 'goal against path', still, CODE.GOAL_VIOLATES_PATH_CONSTRAINTS, 'panda_joint1'
    two = [near('panda_joint1', 0.0), near('panda_joint1', 0.4)]
    contradictory = within(motion_request(JOINT), joint_constraints=two)
    yield 'contradictory path', contradictory, bad_goal, 'panda_joint1 contradict'
    none = within(motion_request(JOINT), orientation_constraints=[level(NAN)])
    yield 'nan path', none, bad_goal, 'nan'
    stomp = motion_request(JOINT, pipeline_id='stomp')
    yield 'unknown pipeline', stomp, CODE.PLANNING_FAILED, "'stomp'.*ompl"
    magic = motion_request(JOINT, planner_id='magic')
    yield 'unknown planner', magic, CODE.FAILURE, "'magic'.*RRTConnect"
    fast = motion_request(JOINT, max_velocity_scaling_factor=1.5)
    yield 'factor above 1', fast, CODE.FAILURE, 'is 1.5'
    none = motion_request(JOINT, max_acceleration_scaling_factor=NAN)
    yield 'factor nan', none, CODE.FAILURE, 'is nan'
    none = motion_request(JOINT, max_cartesian_speed=NAN)
    yield 'speed nan', none, bad_goal, 'max_cartesian_speed is nan'
    none = motion_request(JOINT)
    none.allowed_planning_time = NAN
    yield 'time nan', none, CODE.FAILURE, 'allowed_planning_time is nan'


BAD = {name: rest for name, *rest in (*bad_goals(), *bad_rest())}


@pytest.fixture(name='rig', scope='module')
def start(tmp_path_factory: pytest.TempPathFactory) -> Iterator[MoveGroupRig]:
    """Start move_group."""
    urdf = expand_xacro(robots() / 'panda' / 'panda.urdf.xacro')
    lifted = f'<child link="{JOINTS[6].replace("joint", "link")}"/>'
    assert urdf.count(lifted) == 1
    soft = '<safety_controller k_velocity="20" soft_lower_limit="-2.5" soft_upper_limit="2.5"/>'
    path = panda_parameters(
        tmp_path_factory.mktemp('robot'), robot_description=urdf.replace(lifted, lifted + soft)
    )
    with (
        reserve() as isolation,
        MoveGroupRig(isolation, '--ros-args', '--params-file', str(path)) as rig,
    ):
        yield rig


def check(code: Any, wanted: PlanningCode, words: str) -> None:
    """Make sure that a refusal has its code and words."""
    assert PlanningCode(code.val) is wanted, code
    assert code.source == 'move_group'
    assert re.search(words, code.message), code.message


@pytest.mark.parametrize('name', BAD)
def test_a_bad_request_is_refused_alike_by_service_and_action(
    rig: MoveGroupRig, name: str
) -> None:
    """No trajectory comes with it, and nothing is executed."""
    request, code, words = BAD[name]
    response = rig.plan(request)
    check(response.error_code, code, words)
    assert not response.trajectory.joint_trajectory.points
    status, result = rig.move(action_goal(request))
    assert status == GoalStatus.STATUS_ABORTED
    check(result.error_code, code, words)
    assert not result.planned_trajectory.joint_trajectory.points


INDUSTRIAL = ['unknown link', 'unknown frame', 'nan position', 'out of reach', 'start in contact']
INDUSTRIAL += ['contradictory joints', 'start with nan']


@pytest.mark.parametrize('name', INDUSTRIAL)
def test_pilz_pipeline_has_the_same_codes(rig: MoveGroupRig, name: str) -> None:
    """For PTP, and as an item of a sequence, which is named."""
    request, code, words = BAD[name]
    request = deepcopy(request)
    request.pipeline_id = 'pilz_industrial_motion_planner'
    request.planner_id = 'PTP'
    check(rig.plan(request).error_code, code, words)
    item = MotionSequenceItem(req=request)
    sequence = GetMotionSequence.Request()
    sequence.request.items = [item]
    answer = rig.client.call(GetMotionSequence, '/plan_sequence_path', sequence).response
    check(answer.error_code, code, words)


def scene(*things: CollisionObject) -> PlanningScene:
    """Return a change of the scene."""
    change = PlanningScene(is_diff=True)
    change.robot_state.is_diff = True
    change.world.collision_objects = list(things)
    return change


def flat_mesh() -> CollisionObject:
    """Return a mesh without volume."""
    thing = CollisionObject(id='sheet', operation=CollisionObject.ADD)
    mesh = tetrahedron(0.1)
    for each in mesh.vertices:
        each.z = 0.0
    thing.meshes, thing.mesh_poses = [mesh], [PoseMessage()]
    return thing


def unknown(operation: bytes) -> CollisionObject:
    """Return a change of an object that there is not."""
    return CollisionObject(id='ghost', operation=operation)


def nan_box() -> CollisionObject:
    """Return a box nowhere."""
    thing = box('nowhere', 0.5, 0.0, 0.5)
    thing.pose.position.x = NAN
    return thing


def negative_box() -> CollisionObject:
    """Return a box of no size."""
    return box('inside out', 0.5, 0.0, 0.5, edge=-0.1)


SCENES: dict[str, tuple[PlanningScene, PlanningCode, str]] = {
    'mesh without volume': (scene(flat_mesh()), CODE.FAILURE, "'sheet': .*no volume"),
    'removal of an unknown object': (
        scene(unknown(CollisionObject.REMOVE)), CODE.INVALID_OBJECT_NAME, "'ghost'"
    ),
    'move of an unknown object': (
        scene(unknown(CollisionObject.MOVE)), CODE.INVALID_OBJECT_NAME, "'ghost'"
    ),
    'object without shapes': (scene(unknown(CollisionObject.ADD)), CODE.FAILURE, "'ghost'.*shape"),
    'object at nan': (scene(nan_box()), CODE.FAILURE, "'nowhere'"),
    'negative box': (scene(negative_box()), CODE.FAILURE, '-0.1'),
}  # fmt: skip


@pytest.mark.parametrize('name', SCENES)
def test_a_bad_scene_is_refused_as_a_whole(rig: MoveGroupRig, name: str) -> None:
    """By apply_planning_scene with words in the log, and as the diff of a goal with its code."""
    change, code, words = SCENES[name]
    change = deepcopy(change)
    change.world.collision_objects.insert(0, box('good', 2.0, 0.0, 0.5))
    apply = ApplyPlanningScene.Request(scene=change)
    assert not rig.client.call(ApplyPlanningScene, '/apply_planning_scene', apply).success
    rig.process.wait_for(f'apply_planning_scene refused: {code.name}: .*{words}', 30.0)
    goal = action_goal(motion_request(JOINT), plan_only=True)
    goal.planning_options.planning_scene_diff = change
    _status, result = rig.move(goal)
    check(result.error_code, code, words)


def test_services_of_kinematics_refuse_alike(rig: MoveGroupRig) -> None:
    """compute_ik, compute_fk and compute_cartesian_path."""

    def ik(**fields: Any) -> Any:
        request = GetPositionIK.Request()
        asked = request.ik_request
        asked.group_name = 'panda_arm'
        asked.pose_stamped.pose = down(0.4, 0.1, 0.5)
        for name, value in fields.items():
            setattr(asked, name, value)
        return request

    nowhere = ik()
    nowhere.ik_request.pose_stamped.pose.position.x = NAN
    far = ik()
    far.ik_request.pose_stamped.pose.position.x = 3.0
    lost = ik()
    lost.ik_request.pose_stamped.header.frame_id = 'moon'
    for request, code, words in (
        (ik(group_name=''), CODE.INVALID_GROUP_NAME, 'group'),
        (ik(ik_link_name='moon'), CODE.INVALID_LINK_NAME, 'moon'),
        (ik(ik_link_names=['a', 'b']), CODE.INVALID_LINK_NAME, '2 ik_link_names'),
        (nowhere, CODE.INVALID_GOAL_CONSTRAINTS, 'finite|nan'),
        (far, CODE.NO_IK_SOLUTION, 'reach'),
        (lost, CODE.FRAME_TRANSFORM_FAILURE, 'moon'),
    ):
        answer = rig.client.call(GetPositionIK, '/compute_ik', request)
        check(answer.error_code, code, words)
    fk = GetPositionFK.Request(fk_link_names=['moon'])
    check(
        rig.client.call(GetPositionFK, '/compute_fk', fk).error_code,
        CODE.INVALID_LINK_NAME,
        'moon',
    )
    for fields, code, words in (
        ({'group_name': ''}, CODE.INVALID_GROUP_NAME, 'group'),
        ({'link_name': 'moon'}, CODE.INVALID_LINK_NAME, 'moon'),
        ({'max_step': 0.0}, CODE.INVALID_GOAL_CONSTRAINTS, 'max_step'),
        ({'waypoints': []}, CODE.INVALID_GOAL_CONSTRAINTS, 'no way-points'),
        ({'waypoints': [pose_at(NAN)]}, CODE.INVALID_GOAL_CONSTRAINTS, 'finite|nan'),
        ({'max_velocity_scaling_factor': 2.0}, CODE.FAILURE, 'is 2'),
    ):
        given: dict[str, Any] = {
            'group_name': 'panda_arm', 'max_step': 0.01, 'waypoints': [down(0.4, 0.1, 0.5)]
        } | fields  # fmt: skip
        path = GetCartesianPath.Request(**given)
        answer = rig.client.call(GetCartesianPath, '/compute_cartesian_path', path)
        check(answer.error_code, code, words)
        assert answer.fraction == -1.0


def test_the_node_goes_on_after_all_that(rig: MoveGroupRig) -> None:
    """A good request is planned."""
    assert rig.plan(motion_request(JOINT)).error_code.val == CODE.SUCCESS
    assert rig.process.is_running()
