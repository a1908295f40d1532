# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The calls of MoveIt's clients in their order, against the real move_group.

Each test is what one client does, with its fields, QoS and expectations: MoveGroupInterface and
PlanningSceneInterface of C++, RViz' MotionPlanning panel, and Python clients in the manner of
pymoveit2, which have a node of their own and no robot model.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import deepcopy
import math
from typing import Any

from action_msgs.msg import GoalStatus
from geometry_msgs.msg import Point, Quaternion
from geometry_msgs.msg import Pose as PoseMessage
from move_group_rig import (
    action_goal,
    change,
    HAND,
    joint_goal,
    JOINTS,
    motion_request,
    MoveGroupRig,
    pose_goal,
    READY,
)
from moveit_msgs import msg
from moveit_msgs.action import ExecuteTrajectory, MoveGroup
from moveit_msgs.srv import (
    GetMotionSequence,
    QueryPlannerInterfaces,
)
import numpy as np
from planning_messages import box, panda, pose_at, tetrahedron
import pytest
from sensor_msgs.msg import JointState
from shape_msgs.msg import Mesh, MeshTriangle, SolidPrimitive
from std_msgs.msg import String
from std_srvs.srv import Empty

from arm_model import combined, frozen, inverse, Pose
from arm_model.ros import pose_of
from arm_planning import Planner
from arm_planning.ros.scene import pose_message
from node_runner import LATCHED

BASE = 'panda_link0'
MOVED = [0.4, *READY[1:]]
SUCCESS = msg.MoveItErrorCodes.SUCCESS


def interface_request(goal: Any) -> msg.MotionPlanRequest:
    """Return a request as MoveGroupInterface::constructMotionPlanRequest fills it."""
    request = motion_request(goal)
    request.allowed_planning_time = 5.0
    request.max_velocity_scaling_factor = request.max_acceleration_scaling_factor = 0.1
    corners = request.workspace_parameters
    corners.header.frame_id = BASE
    corners.min_corner.x = corners.min_corner.y = corners.min_corner.z = -1.0
    corners.max_corner.x = corners.max_corner.y = corners.max_corner.z = 1.0
    return request


def turned_pose(x: float, y: float, z: float, axis: tuple[float, float, float]) -> PoseMessage:
    """Return a pose that is a quarter turn about an axis."""
    half = math.sqrt(0.5)
    turn = Quaternion(w=half, **dict(zip('xyz', (half * each for each in axis), strict=True)))
    return PoseMessage(position=Point(x=x, y=y, z=z), orientation=turn)


def placed(message: PoseMessage) -> Pose:
    """Return a pose of a message."""
    return pose_of(message.position, message.orientation, 'pose')


def at(rig: MoveGroupRig) -> list[float]:
    """Return where the joints are in [rad]."""
    return [rig.positions[name] for name in JOINTS]


def test_move_group_interface(rig: MoveGroupRig) -> None:
    """Constructor, setJointValueTarget, plan, execute, setPoseTarget, move, a Cartesian path."""
    # the constructor waits for these two, and sends nothing to the others yet
    for kind, name in ((MoveGroup, '/move_action'), (ExecuteTrajectory, '/execute_trajectory')):
        rig.client.spin_until(rig.client.action(kind, name).server_is_ready, 20.0, name)
    # plan(): look_around and replan are off
    goal = action_goal(interface_request(joint_goal(MOVED)), plan_only=True)
    received: list[Any] = []
    result = rig.send(MoveGroup, '/move_action', goal, received.append).get_result_async()
    rig.client.spin_until(result.done, 60.0, 'plan')
    assert result.result().status == GoalStatus.STATUS_SUCCEEDED
    plan = result.result().result
    # the interface takes the trajectory, its start and the time from the result
    assert (plan.error_code.val, plan.error_code.source) == (SUCCESS, 'move_group')
    assert plan.planning_time > 0.0
    assert list(plan.trajectory_start.joint_state.name)[:7] == JOINTS
    assert list(plan.trajectory_start.joint_state.position)[:7] == pytest.approx(READY)
    trajectory = plan.planned_trajectory.joint_trajectory
    assert (list(trajectory.joint_names), trajectory.header.frame_id) == (JOINTS, BASE)
    assert not plan.executed_trajectory.joint_trajectory.points
    # the first one may leave before the server has found the client's subscription
    assert [each.feedback.state for each in received] in (['PLANNING', 'IDLE'], ['IDLE'])
    assert not rig.followed
    # execute()
    planned = ExecuteTrajectory.Goal(trajectory=plan.planned_trajectory)
    status, executed = rig.run(ExecuteTrajectory, '/execute_trajectory', planned)
    assert (status, executed.error_code.val) == (GoalStatus.STATUS_SUCCEEDED, SUCCESS)
    assert at(rig) == pytest.approx(MOVED, abs=1e-3)
    # setPoseTarget() and move(): the frame of the model
    rig.settle()
    pose = rig.fk()
    pose.position.z += 0.1
    _status, moved = rig.move(action_goal(interface_request(pose_goal(pose, HAND, BASE))))
    assert moved.error_code.val == SUCCESS, moved.error_code
    assert moved.executed_trajectory.joint_trajectory.points
    rig.settle()
    assert rig.fk().position.z == pytest.approx(pose.position.z, abs=2e-3)
    # computeCartesianPath()
    down = rig.fk()
    down.position.z -= 0.1
    answer = rig.cartesian_path(down, avoid_collisions=True)
    assert (answer.error_code.val, answer.fraction) == (SUCCESS, 1.0), answer.error_code
    assert list(answer.start_state.joint_state.position)[:7] == pytest.approx(at(rig))


def test_a_start_just_beyond_a_limit_is_on_it(rig: MoveGroupRig) -> None:
    """A drive may stand off by some of what it was sent to."""
    rig.positions['panda_joint1'] = 2.8978  # of 2.8973
    rig.settle()
    _status, result = rig.move(action_goal(motion_request(joint_goal([2.5, *READY[1:]]))))
    assert result.error_code.val == SUCCESS, result.error_code


def test_a_motion_of_days_is_planned(rig: MoveGroupRig) -> None:
    """Slower by a million times, in points that a message can hold."""
    request = motion_request(joint_goal(MOVED), max_velocity_scaling_factor=1e-6)
    points = rig.plan(request).trajectory.joint_trajectory.points
    assert points[-1].time_from_start.sec > 1e5
    assert list(points[-1].positions) == pytest.approx(MOVED, abs=1e-6)
    assert len(points) < 10_000


def test_the_pipeline_of_pilz_plans_ptp_where_no_planner_is_named(rig: MoveGroupRig) -> None:
    """As it is with the planner's name, and not by the search of the other pipeline."""
    pilz = {'pipeline_id': 'pilz_industrial_motion_planner'}
    plans = [
        rig.plan(motion_request(joint_goal(MOVED), **more)).trajectory.joint_trajectory.points
        for more in (pilz, {**pilz, 'planner_id': 'PTP'}, {'planner_id': 'RRTConnect'})
    ]
    unnamed, named, searched = (
        [(*p.positions, p.time_from_start) for p in each] for each in plans
    )
    assert unnamed == named != searched


def test_a_goal_of_an_orientation_alone(rig: MoveGroupRig) -> None:
    """The position is free where it cannot stay; of a position alone: what is held, below."""
    back = Quaternion(y=-math.sin(1.2), w=math.cos(1.2))
    goal = pose_goal(PoseMessage(orientation=back), HAND, BASE)
    goal.position_constraints = []
    stretched = [0.0, 0.9, 0.0, -0.5, 0.0, 1.4, 0.785]
    request = motion_request(goal)
    request.start_state.joint_state = JointState(name=JOINTS, position=stretched)
    response = rig.plan(request)
    assert response.error_code.val == SUCCESS, response.error_code
    end = response.trajectory.joint_trajectory.points[-1].positions
    planner = Planner(panda().model('panda_arm'))
    wanted = placed(PoseMessage(orientation=back)).rotation
    assert planner.fk(frozen(end), HAND).rotation == pytest.approx(wanted, abs=2e-3)


def test_a_circle_leads_through_its_point(rig: MoveGroupRig) -> None:
    """As Pilz' planner has it in the path constraints."""
    goal, middle = rig.fk(), rig.fk()
    goal.position.y += 0.2
    middle.position.y, middle.position.z = middle.position.y + 0.1, middle.position.z - 0.05
    circle = pose_goal(middle, HAND, BASE)
    circle.name, circle.orientation_constraints = 'interim', []
    names = {'pipeline_id': 'pilz_industrial_motion_planner', 'planner_id': 'CIRC'}
    request = motion_request(pose_goal(goal, HAND, BASE), path_constraints=circle, **names)
    response = rig.plan(request)
    assert response.error_code.val == SUCCESS, response.error_code
    fk = Planner(panda().model('panda_arm')).fk
    rows = [frozen(each.positions) for each in response.trajectory.joint_trajectory.points]
    way = np.array([fk(row, HAND).position for row in rows])
    assert np.linalg.norm(way - placed(middle).position, axis=1).min() < 0.02


def test_planning_scene_interface(rig: MoveGroupRig) -> None:
    """applyCollisionObjects, getKnownObjectNames, getObjects, attach by topic, detach, remove."""

    def names() -> set[str]:
        found = rig.scene(msg.PlanningSceneComponents.WORLD_OBJECT_NAMES)
        assert found.is_diff  # an answer with parts only is a change
        assert not any(each.primitives for each in found.world.collision_objects)
        return {each.id for each in found.world.collision_objects}

    rig.add(box('cup', 0.5, 0.3, 0.3, edge=0.05))
    assert names() == {'cup'}
    geometry = rig.scene(msg.PlanningSceneComponents.WORLD_OBJECT_GEOMETRY)
    assert geometry.world.collision_objects[0].primitives[0].dimensions[0] == 0.05
    # MoveGroupInterface::attachObject publishes with depth 1, the id only
    publisher = rig.publisher(msg.AttachedCollisionObject, '/attached_collision_object')
    attach = msg.AttachedCollisionObject(link_name=HAND, touch_links=['panda_hand'])
    attach.object.id, attach.object.operation = 'cup', msg.CollisionObject.ADD
    publisher.publish(attach)

    def attached() -> set[str]:
        found = rig.scene(msg.PlanningSceneComponents.ROBOT_STATE_ATTACHED_OBJECTS)
        return {each.object.id for each in found.robot_state.attached_collision_objects}

    rig.client.spin_until(lambda: attached() == {'cup'} and not names(), 30.0, 'the attached cup')
    place = rig.fk('cup').position
    assert (place.x, place.y, place.z) == pytest.approx((0.5, 0.3, 0.3))
    attach.object.operation = msg.CollisionObject.REMOVE
    publisher.publish(attach)
    rig.client.spin_until(lambda: names() == {'cup'} and not attached(), 30.0, 'the cup laid down')
    rig.add(msg.CollisionObject(id='cup', operation=msg.CollisionObject.REMOVE))
    assert names() == set()


def test_rviz_motion_planning_panel(rig: MoveGroupRig) -> None:
    """It may start late: latched SRDF, whole scene by service, then changes; plan, stop."""
    semantic = rig.client.listen(String, '/robot_description_semantic', LATCHED)
    rig.client.spin_until(lambda: bool(semantic), 20.0, 'the SRDF')
    assert '<group name="panda_arm">' in semantic[0].data
    # its monitor listens with the system's default, which is volatile, and asks for the rest
    monitored = rig.client.listen(msg.PlanningScene, '/monitored_planning_scene', 100)
    displayed = rig.client.listen(msg.DisplayTrajectory, '/display_planned_path', 2)
    whole = rig.scene((1 << 10) - 1)
    assert not whole.is_diff
    frame = whole.robot_state.joint_state.header.frame_id
    assert (whole.robot_model_name, frame) == ('panda', BASE)
    assert whole.allowed_collision_matrix.entry_names
    described = rig.client.call(
        QueryPlannerInterfaces, '/query_planner_interface', QueryPlannerInterfaces.Request()
    ).planner_interfaces
    assert {each.pipeline_id for each in described} >= {'ompl', 'pilz_industrial_motion_planner'}
    assert all(each.name and each.planner_ids for each in described)
    # Publish Scene; another node's monitor sees it
    publisher = rig.publisher(msg.PlanningScene, '/planning_scene')
    whole.world.collision_objects = [box('crate', 0.0, 0.8, 0.2, edge=0.2)]
    publisher.publish(whole)

    def shown() -> list[str]:
        return [each.id for each in monitored[-1].world.collision_objects] if monitored else []

    rig.client.spin_until(lambda: shown() == ['crate'], 30.0, 'the scene with the crate')
    # Plan with what the panel has in its start state, then Execute
    asked = interface_request(joint_goal(MOVED))
    asked.start_state = deepcopy(whole.robot_state)
    asked.pipeline_id, asked.planner_id = 'ompl', 'RRTConnectkConfigDefault'
    _status, plan = rig.move(action_goal(asked, plan_only=True))
    assert plan.error_code.val == SUCCESS, plan.error_code
    rig.client.spin_until(lambda: bool(displayed), 30.0, 'the planned path')
    assert displayed[-1].model_id == 'panda'
    assert displayed[-1].trajectory[0] == plan.planned_trajectory
    # Stop, with nothing on its way, and Clear octomap
    rig.publisher(String, '/trajectory_execution_event').publish(String(data='stop'))
    rig.client.call(Empty, '/clear_octomap', Empty.Request())
    publisher.publish(msg.PlanningScene())
    rig.client.spin_until(lambda: not shown(), 30.0, 'the scene without it')


def test_python_clients_without_a_robot_model(rig: MoveGroupRig) -> None:
    """As pymoveit2: services for plan and kinematics, the action to execute, objects by topic."""
    # the start is the whole joint state as it was received; factors of 0 are its default
    request = motion_request(joint_goal(MOVED), num_planning_attempts=5)
    request.workspace_parameters.header.frame_id = BASE
    here = JointState(name=JOINTS, position=READY, velocity=[0.0] * 7)
    request.start_state = msg.RobotState(joint_state=here)
    plan = rig.plan(request)
    assert plan.error_code.val == SUCCESS, plan.error_code
    assert plan.group_name == 'panda_arm'
    goal = ExecuteTrajectory.Goal()
    goal.trajectory.joint_trajectory = plan.trajectory.joint_trajectory
    status, done = rig.run(ExecuteTrajectory, '/execute_trajectory', goal)
    assert (status, done.error_code.val) == (GoalStatus.STATUS_SUCCEEDED, SUCCESS)
    rig.settle()
    # compute_fk and compute_ik there and back, with a state for the start
    pose = rig.fk()
    start = msg.RobotState(joint_state=JointState(name=JOINTS, position=READY))
    solved = rig.ik(pose, BASE, avoid_collisions=True, robot_state=start)
    assert solved.error_code.val == SUCCESS, solved.error_code
    found = rig.fk(HAND, solved.solution).position
    assert placed(PoseMessage(position=found)).position == pytest.approx(
        placed(pose).position, abs=1e-4
    )
    # allow_collisions(): the scene is read, its matrix widened, and sent back as a whole
    publisher = rig.publisher(msg.CollisionObject, '/collision_object')
    place = rig.fk().position
    publisher.publish(box('tool', place.x, place.y, place.z, edge=0.05))
    rig.client.spin_until(lambda: rig.objects() == ['tool'], 30.0, 'the tool')
    blocked = rig.plan(motion_request(joint_goal(READY)))
    assert blocked.error_code.val == msg.MoveItErrorCodes.START_STATE_IN_COLLISION
    whole = rig.scene()
    matrix = whole.allowed_collision_matrix
    matrix.default_entry_names = [*matrix.default_entry_names, 'tool']
    matrix.default_entry_values = [*matrix.default_entry_values, True]
    assert rig.apply(whole)
    allowed = rig.plan(motion_request(joint_goal(READY)))
    assert allowed.error_code.val == SUCCESS, allowed.error_code
    # clear_all_collision_objects(): one message without an id
    publisher.publish(msg.CollisionObject(operation=msg.CollisionObject.REMOVE))
    rig.client.spin_until(lambda: not rig.objects(), 30.0, 'an empty scene')


@pytest.mark.parametrize('name', ['tool', 'tool/tip'])
@pytest.mark.parametrize('turned', [True, False], ids=['a pose', 'a position only'])
def test_goals_and_path_constraints_of_what_is_held(
    rig: MoveGroupRig, name: str, turned: bool
) -> None:
    """A body that is turned in the hand, and its subframe, come to the place that is wanted."""
    held = box('tool', edge=0.02)
    held.header.frame_id, held.pose = HAND, turned_pose(0.1, 0.02, 0.1, axis=(0.0, 1.0, 0.0))
    held.subframe_names = ['tip']
    held.subframe_poses = [turned_pose(0.05, 0.0, 0.03, axis=(0.0, 0.0, 1.0))]
    scene = change()
    scene.robot_state.attached_collision_objects = [
        msg.AttachedCollisionObject(link_name=HAND, object=held, touch_links=['panda_link7'])
    ]
    assert rig.apply(scene)
    in_hand = placed(held.pose)
    if name == 'tool/tip':
        in_hand = combined(in_hand, placed(held.subframe_poses[0]))

    def place_of(joints: list[float]) -> Pose:
        where = panda().positions(dict(zip(JOINTS, joints, strict=True)))
        return combined(panda().kinematics.link_pose(HAND, where), in_hand)

    begin = place_of(READY)
    wanted = pose_message(Pose(begin.rotation, np.add(begin.position, [0.0, 0.06, 0.08])))
    goal = pose_goal(wanted, name, BASE)
    request = interface_request(goal)
    kept = deepcopy(goal.position_constraints[0])
    slab = SolidPrimitive(type=SolidPrimitive.BOX, dimensions=[0.04, 0.2, 0.3])
    kept.constraint_region.primitives = [slab]
    kept.constraint_region.primitive_poses = [pose_at(*begin.position.tolist())]
    request.path_constraints.position_constraints = [kept]
    if not turned:
        goal.orientation_constraints = []
    _status, moved = rig.move(action_goal(request))
    assert moved.error_code.val == SUCCESS, moved.error_code
    for point in moved.planned_trajectory.joint_trajectory.points:
        off = place_of(list(point.positions)).position - begin.position
        assert (np.abs(off) <= [0.02 + 1e-6, 0.1 + 1e-6, 0.15 + 1e-6]).all()
    way = (place_of(at(rig)).position - begin.position).tolist()
    assert way == pytest.approx([0.0, 0.06, 0.08], abs=1e-3)
    if turned:
        assert place_of(at(rig)).rotation == pytest.approx(begin.rotation, abs=2e-3)
    kept.constraint_region.primitive_poses[0].position.x += 0.1
    refused = rig.plan(request).error_code
    assert refused.val == msg.MoveItErrorCodes.START_STATE_VIOLATES_PATH_CONSTRAINTS, refused


def test_a_matrix_that_is_read_and_sent_back_changes_nothing_more(rig: MoveGroupRig) -> None:
    """Defaults stay defaults, the upper triangle counts, REMOVE forgets what a name may touch."""
    place, touching = rig.fk().position, msg.MoveItErrorCodes.START_STATE_IN_COLLISION

    def cup(operation: bytes) -> None:
        rig.add(box('cup', place.x, place.y, place.z, edge=0.05, operation=operation))

    def outcome(matrix: Any) -> int:
        assert rig.apply(allowed_collision_matrix=matrix)
        return int(rig.plan(motion_request(joint_goal(READY))).error_code.val)

    cup(msg.CollisionObject.ADD)
    matrix = rig.scene().allowed_collision_matrix
    names = list(matrix.entry_names)
    assert outcome(matrix) == touching
    matrix.default_entry_names, matrix.default_entry_values = ['cup'], [True]
    assert outcome(matrix) == SUCCESS
    read = rig.scene().allowed_collision_matrix
    assert (list(read.default_entry_names), list(read.default_entry_values)) == (['cup'], [True])
    assert outcome(read) == SUCCESS
    kept = [number for number, name in enumerate(read.entry_names) if name != 'cup']
    read.entry_names = [read.entry_names[number] for number in kept]
    rows = [[read.entry_values[row].enabled[each] for each in kept] for row in kept]
    read.entry_values = [msg.AllowedCollisionEntry(enabled=row) for row in rows]
    read.default_entry_values = [False]
    assert list(read.entry_names) == names
    assert outcome(read) == touching
    read.default_entry_names, read.default_entry_values = [], []
    for is_upper in (True, False):
        filled = deepcopy(read)
        filled.entry_names = [*names, 'cup']
        for row in filled.entry_values:
            row.enabled = [*row.enabled, is_upper]
        last = [*([not is_upper] * len(names)), False]
        filled.entry_values.append(msg.AllowedCollisionEntry(enabled=last))
        for _ in range(2):  # the second one says nothing new
            assert outcome(filled) == (SUCCESS if is_upper else touching)
        cup(msg.CollisionObject.REMOVE)
        cup(msg.CollisionObject.ADD)
        found = rig.scene().allowed_collision_matrix
        assert found == read
        assert outcome(found) == touching


def test_controllers_get_hulls_once_for_each_change(rig: MoveGroupRig) -> None:
    """Of a mesh of many vertices few corners around all; nothing where only the robot moves."""
    monitored = rig.client.listen(msg.PlanningScene, '/monitored_planning_scene', LATCHED)
    collisions = rig.client.listen(msg.PlanningScene, '/collision_scene', LATCHED)
    draw = np.random.default_rng(0).normal(size=(3000, 3))
    points = 0.2 * draw / np.linalg.norm(draw, axis=1, keepdims=True)
    rig.add(in_base('rock', mesh(points.tolist(), np.arange(3000).reshape(-1, 3).tolist())))

    def rocks(scenes: list[msg.PlanningScene]) -> list[Mesh]:
        return [each.meshes[0] for each in scenes[-1].world.collision_objects] if scenes else []

    rig.client.spin_until(lambda: bool(rocks(collisions) and rocks(monitored)), 30.0, 'the rock')
    assert len(rocks(monitored)[0].vertices) == 3000
    hull = np.array([(each.x, each.y, each.z) for each in rocks(collisions)[0].vertices])
    assert len(hull) <= 300
    directions = np.random.default_rng(1).normal(size=(200, 3))
    assert ((hull @ directions.T).max(axis=0) >= (points @ directions.T).max(axis=0) - 1e-9).all()
    before, shown = len(collisions), len(monitored)
    rig.positions[JOINTS[0]] += 0.2
    rig.client.spin_until(lambda: len(monitored) > shown, 30.0, 'the robot at rest elsewhere')
    rig.add(msg.CollisionObject(operation=msg.CollisionObject.REMOVE))
    rig.client.spin_until(lambda: not rocks(collisions), 30.0, 'the scene without the rock')
    assert len(collisions) == before + 1


def mesh(corners: Sequence[Sequence[float]], faces: Sequence[Sequence[int]]) -> Mesh:
    """Return a mesh."""
    vertices = [Point(x=x, y=y, z=z) for x, y, z in corners]
    return Mesh(vertices=vertices, triangles=[MeshTriangle(vertex_indices=each) for each in faces])


def in_base(name: str, shape: Mesh) -> msg.CollisionObject:
    """Return an object of a mesh, beside the arm."""
    thing = msg.CollisionObject(id=name, pose=pose_at(-0.5, 0.9), meshes=[shape])
    thing.header.frame_id = BASE
    return thing


def test_a_concave_object_is_named_in_the_answers(rig: MoveGroupRig) -> None:
    """That it counts as its hull; a convex one is not."""
    outline = [(0.0, 0.0), (0.6, 0.0), (0.6, 0.2), (0.2, 0.2), (0.2, 0.6), (0.0, 0.6)]
    faces = [(0, 2, 1), (0, 3, 2), (0, 4, 3), (0, 5, 4)]
    faces += [(8, 6, 7), (9, 6, 8), (10, 6, 9), (11, 6, 10)]
    for one, other in zip(range(6), (1, 2, 3, 4, 5, 0), strict=True):
        faces += [(one, other, 6 + other), (one, 6 + other, 6 + one)]
    corner = in_base('corner', mesh([(x, y, z) for z in (0.0, 0.2) for x, y in outline], faces))
    rig.add(corner)
    note = "object 'corner' counts as the convex hull of its mesh, of which it fills 71 %"
    rig.process.wait_for(note, 30.0)
    goal = action_goal(interface_request(joint_goal(MOVED)), plan_only=True)
    assert note in rig.move(goal)[1].error_code.message
    # the tip is in the corner, which is empty
    place = rig.fk().position
    corner.pose = pose_at(place.x - 0.35, place.y - 0.35, place.z - 0.1)
    rig.add(corner)
    refused = rig.move(goal)[1].error_code
    assert refused.val == msg.MoveItErrorCodes.START_STATE_IN_COLLISION
    assert note in refused.message
    rig.add(in_base('corner', tetrahedron(0.2)))
    answer = rig.move(goal)[1].error_code
    assert (answer.val, answer.message) == (SUCCESS, '')


def test_a_world_replaces_and_a_scene_of_a_goal_changes(rig: MoveGroupRig) -> None:
    """Whatever the scene of a goal says in is_diff; an empty one changes nothing."""
    rig.add(box('old', 0.0, 0.9, 0.2))
    publisher = rig.publisher(msg.PlanningSceneWorld, '/planning_scene_world')
    world = msg.PlanningSceneWorld(collision_objects=[box('new', 0.0, -0.9, 0.2)])
    publisher.publish(world)
    rig.client.spin_until(lambda: rig.objects() == ['new'], 30.0, 'the world that was published')
    goal = action_goal(interface_request(joint_goal(MOVED)), plan_only=True)
    goal.planning_options.planning_scene_diff = msg.PlanningScene()
    assert rig.move(goal)[1].error_code.val == SUCCESS
    place = rig.fk().position
    at_tip = box('part', place.x, place.y, place.z, edge=0.05)
    goal.planning_options.planning_scene_diff.world.collision_objects = [at_tip]
    assert rig.move(goal)[1].error_code.val == msg.MoveItErrorCodes.START_STATE_IN_COLLISION
    assert rig.objects() == ['new']
    publisher.publish(msg.PlanningSceneWorld())
    rig.client.spin_until(lambda: not rig.objects(), 30.0, 'an empty world')


def test_items_of_a_sequence_begin_where_the_one_before_ends(rig: MoveGroupRig) -> None:
    """Joints that a goal leaves out, and poses in the frame of the hand."""
    lifted = PoseMessage(position=Point(z=-0.05), orientation=Quaternion(w=1.0))
    goals = [joint_goal([0.4], JOINTS[:1]), joint_goal([0.2], JOINTS[-1:])]
    requests = [motion_request(each, planner_id='PTP') for each in goals]
    requests.append(motion_request(pose_goal(lifted, HAND, HAND), planner_id='LIN'))
    asked = GetMotionSequence.Request()
    asked.request.items = [msg.MotionSequenceItem(req=each) for each in requests]
    answer = rig.client.call(GetMotionSequence, '/plan_sequence_path', asked).response
    assert answer.error_code.val == SUCCESS, answer.error_code
    end = answer.planned_trajectories[0].joint_trajectory.points[-1].positions
    before = frozen([0.4, *READY[1:-1], 0.2])
    fk = Planner(panda().model('panda_arm')).fk
    up = combined(inverse(fk(before, HAND)), fk(frozen(end), HAND))
    assert up.position == pytest.approx([0.0, 0.0, -0.05], abs=1e-3)
    assert up.rotation == pytest.approx(np.eye(3), abs=1e-2)
