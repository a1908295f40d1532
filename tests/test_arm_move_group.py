# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""move_group on a simulated Panda, with the calls that clients of MoveIt make."""

from __future__ import annotations

from copy import deepcopy
import re
import shlex
from typing import Any, TYPE_CHECKING

from action_msgs.msg import GoalStatus
from geometry_msgs.msg import Pose, PoseStamped
from moveit_msgs.action import ExecuteTrajectory, MoveGroup, MoveGroupSequence
from moveit_msgs.msg import (
    CollisionObject,
    Constraints,
    JointConstraint,
    MotionSequenceItem,
    MotionSequenceRequest,
    MoveItErrorCodes,
    OrientationConstraint,
    PlanningScene,
    PositionConstraint,
    RobotTrajectory,
)
from moveit_msgs.srv import ApplyPlanningScene, GetMotionSequence, GetPositionFK
from planning_messages import panda
from planning_scenes import distances
from processes import executable
import pytest
from readme_examples import CHECKOUT
from sensor_msgs.msg import JointState
from shape_msgs.msg import SolidPrimitive
from simulated_arm import JOINTS, MovingArm, READY, robot_parameters
from std_msgs.msg import String
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from arm_model import frozen
from arm_model.ros import apply_planning_scene, scene_change, seconds
from node_runner import LATCHED

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from isolation import Isolation

pytestmark = pytest.mark.scenario

TURNED = [1.2, *READY[1:]]


def test_clients_of_moveit_plan_and_execute(isolation: Isolation, tmp_path: Path) -> None:
    """Plans, execution, cancel and what appears on the way, on the simulated drives."""
    with MovingArm(isolation, tmp_path) as arm:
        group = arm.run(
            executable('arm_planning', 'move_group'),
            *('--ros-args', '--params-file', str(robot_parameters(tmp_path))),
            # a busy computer is no failure
            *('-p', 'trajectory_execution.allowed_goal_duration_margin:=20.0'),
        )
        group.wait_until_ready()
        semantic = arm.client.listen(String, '/robot_description_semantic', LATCHED)
        arm.client.spin_until(lambda: bool(semantic), 10.0, 'robot_description_semantic')
        assert 'panda_arm' in semantic[0].data
        arm.follow()
        _back_to_ready(arm)
        _moves_by_the_command_of_the_readme(arm)
        _back_to_ready(arm)
        _executes(arm)
        _cancels_and_stops(arm)
        _back_to_ready(arm)
        _follows_sequences(arm)
        _cancels_a_move(arm)
        _back_to_ready(arm)
        _stops_in_front_of_what_appears(arm)
        _back_to_ready(arm)
        _plans_anew_around_what_appears(arm)
        _cancels_before_it_is_planned_anew(arm)
        _names_the_drive_that_fails(arm)


def goal_constraints(positions: Sequence[float]) -> Constraints:
    """Return a goal as MoveGroupInterface::setJointValueTarget makes it."""
    return Constraints(
        joint_constraints=[
            JointConstraint(
                joint_name=name,
                position=position,
                tolerance_above=1e-4,
                tolerance_below=1e-4,
                weight=1.0,
            )
            for name, position in zip(JOINTS, positions, strict=True)
        ]
    )


def move_goal(positions: Sequence[float], *, plan_only: bool = False) -> MoveGroup.Goal:
    """Return a goal as MoveGroupInterface::move makes it: of the present state and scene."""
    goal = MoveGroup.Goal()
    request = goal.request
    request.group_name = 'panda_arm'
    request.num_planning_attempts = 1
    request.allowed_planning_time = 5.0
    request.max_velocity_scaling_factor = request.max_acceleration_scaling_factor = 1.0
    request.start_state.is_diff = True
    request.goal_constraints = [goal_constraints(positions)]
    goal.planning_options.plan_only = plan_only
    goal.planning_options.planning_scene_diff.is_diff = True
    goal.planning_options.planning_scene_diff.robot_state.is_diff = True
    return goal


class ActionRun:
    """A goal of an action."""

    def __init__(self, arm: MovingArm, kind: Any, name: str, goal: Any) -> None:
        self.states: list[str] = []
        self._client = arm.client
        client = arm.client.action(kind, name)
        arm.client.spin_until(client.server_is_ready, 20.0, f'the action {name}')
        sent = client.send_goal_async(goal, lambda each: self.states.append(each.feedback.state))
        arm.client.spin_until(sent.done, 10.0, 'acceptance')
        self._handle = sent.result()
        assert self._handle.accepted
        self._result = self._handle.get_result_async()

    def wait_for_motion(self) -> None:
        """Wait until it is executed; it must not end before."""
        self._client.spin_until(
            lambda: 'MONITOR' in self.states or self._result.done(), 10.0, 'execution'
        )
        assert not self._result.done(), self._result.result().result.error_code

    def cancel(self) -> None:
        """Ask for its end."""
        self._client.spin_until(self._handle.cancel_goal_async().done, 10.0, 'answer to cancel')

    def wait(self) -> tuple[int, Any]:
        """Return status and result."""
        self._client.spin_until(self._result.done, 30.0, 'result')
        return self._result.result().status, self._result.result().result


def move(arm: MovingArm, goal: MoveGroup.Goal) -> ActionRun:
    """Send a goal of move_action."""
    return ActionRun(arm, MoveGroup, '/move_action', goal)


def _box(name: str, x: float, y: float, z: float) -> CollisionObject:
    thing = CollisionObject(id=name, operation=CollisionObject.ADD)
    thing.header.frame_id = 'panda_link0'
    thing.primitives = [SolidPrimitive(type=SolidPrimitive.BOX, dimensions=[0.2, 0.2, 0.2])]
    place = Pose()
    place.position.x, place.position.y, place.position.z = x, y, z
    thing.primitive_poses = [place]
    return thing


def _moves_by_the_command_of_the_readme(arm: MovingArm) -> None:
    """As it is printed; joints that it leaves out stay."""
    text = (CHECKOUT / 'arm_planning' / 'README.md').read_text()
    blocks = re.findall(r'```bash\n(ros2 action send_goal .*?)```', text, re.DOTALL)
    (command,) = map(shlex.split, blocks)
    sent = arm.run(*command)
    assert sent.wait(60.0) == 0, sent.output
    assert 'Goal finished with status: SUCCEEDED' in sent.output
    states = arm.client.listen(JointState, '/joint_states')
    arm.client.spin_until(lambda: bool(states), 10.0, 'joint states')
    places = dict(zip(states[-1].name, states[-1].position, strict=True))
    assert [places[name] for name in JOINTS] == pytest.approx([0.8, *READY[1:]], abs=1e-2)


def _trajectory(positions: Sequence[float], seconds: int) -> RobotTrajectory:
    """Return a straight motion from READY."""
    trajectory = JointTrajectory(joint_names=list(JOINTS))
    rest = [0.0] * len(JOINTS)
    for place, time in ((READY, 0), (positions, seconds)):
        point = JointTrajectoryPoint(positions=place, velocities=rest)
        point.time_from_start.sec = time
        trajectory.points.append(point)
    return RobotTrajectory(joint_trajectory=trajectory)


def execute(arm: MovingArm, trajectory: RobotTrajectory) -> ActionRun:
    """Send a goal of execute_trajectory."""
    goal = ExecuteTrajectory.Goal(trajectory=trajectory)
    return ActionRun(arm, ExecuteTrajectory, '/execute_trajectory', goal)


def _executes(arm: MovingArm) -> None:
    """There and back: MoveGroupInterface::execute."""
    there = [-0.2, *READY[1:]]
    back = _trajectory(there, 2)
    back.joint_trajectory.points[0].positions = there
    back.joint_trajectory.points[1].positions = READY
    for trajectory in (_trajectory(there, 2), back):
        run = execute(arm, trajectory)
        status, result = run.wait()
        assert (status, result.error_code.val) == (GoalStatus.STATUS_SUCCEEDED, 1), result
        assert run.states == ['MONITOR', 'IDLE']


def _cancels_and_stops(arm: MovingArm) -> None:
    """A cancel, and 'stop' of RViz' panel; the arm stops on the path."""
    run = execute(arm, _trajectory([-1.0, *READY[1:]], 8))
    run.wait_for_motion()
    publisher = arm.client.node.create_publisher(String, '/trajectory_execution_event', 10)
    arm.client.spin_until(lambda: bool(publisher.get_subscription_count()), 10.0, 'a listener')
    busy = execute(arm, _trajectory(READY, 2)).wait()[1].error_code
    assert busy.val == MoveItErrorCodes.CONTROL_FAILED
    assert 'another execution' in busy.message
    run.cancel()
    status, result = run.wait()
    assert (status, result.error_code.val) == (
        GoalStatus.STATUS_CANCELED,
        MoveItErrorCodes.PREEMPTED,
    ), result.error_code
    _back_to_ready(arm)
    run = execute(arm, _trajectory([-1.0, *READY[1:]], 8))
    run.wait_for_motion()
    publisher.publish(String(data='stop'))
    status, result = run.wait()
    assert (status, result.error_code.val) == (
        GoalStatus.STATUS_ABORTED,
        MoveItErrorCodes.PREEMPTED,
    ), result.error_code


def _back_to_ready(arm: MovingArm) -> None:
    arm.reach(READY, 3.0)


def _sequence(arm: MovingArm, *radii: float) -> MotionSequenceRequest:
    """Return LIN around a corner, and PTP back to READY."""
    fk = GetPositionFK.Request(fk_link_names=['panda_link8'])
    here = arm.client.call(GetPositionFK, '/compute_fk', fk).pose_stamped[0]
    sequence = MotionSequenceRequest()
    for (x, z), radius in zip(((0.05, 0.0), (0.05, -0.08)), radii, strict=True):
        corner = deepcopy(here)
        corner.pose.position.x += x
        corner.pose.position.z += z
        request = move_goal(READY).request
        request.planner_id, request.max_velocity_scaling_factor = 'LIN', 0.5
        request.goal_constraints = [_pose_constraints(corner)]
        sequence.items.append(MotionSequenceItem(req=request, blend_radius=radius))
    back = move_goal(READY).request
    back.planner_id = 'PTP'
    sequence.items.append(MotionSequenceItem(req=back))
    return sequence


def _pose_constraints(at: PoseStamped) -> Constraints:
    """Return a pose of the tip as MoveGroupInterface::setPoseTarget makes it."""
    sphere = SolidPrimitive(type=SolidPrimitive.SPHERE, dimensions=[1e-3])
    place = PositionConstraint(header=at.header, link_name='panda_link8', weight=1.0)
    place.constraint_region.primitives = [sphere]
    place.constraint_region.primitive_poses = [at.pose]
    turn = OrientationConstraint(header=at.header, link_name='panda_link8', weight=1.0)
    turn.orientation = at.pose.orientation
    turn.absolute_x_axis_tolerance = turn.absolute_y_axis_tolerance = 1e-2
    turn.absolute_z_axis_tolerance = 1e-2
    return Constraints(position_constraints=[place], orientation_constraints=[turn])


def _follows_sequences(arm: MovingArm) -> None:
    """Pilz' plan_sequence_path and sequence_move_group, with a blend."""
    asked = GetMotionSequence.Request(request=_sequence(arm, 0.02, 0.0))
    planned = arm.client.call(GetMotionSequence, '/plan_sequence_path', asked).response
    assert planned.error_code.val == MoveItErrorCodes.SUCCESS, planned.error_code.message
    (trajectory,) = planned.planned_trajectories
    ends = trajectory.joint_trajectory.points[0], trajectory.joint_trajectory.points[-1]
    assert all(list(end.positions) == pytest.approx(READY, abs=0.01) for end in ends)
    depth = _depth(arm)
    goal = MoveGroupSequence.Goal(request=asked.request)
    run = ActionRun(arm, MoveGroupSequence, '/sequence_move_group', goal)
    status, result = run.wait()
    code = result.response.error_code
    assert (status, code.val) == (GoalStatus.STATUS_SUCCEEDED, 1), code
    assert len(result.response.planned_trajectories) == 1
    assert run.states == ['PLANNING', 'MONITOR', 'IDLE']
    assert depth() == pytest.approx(0.08, abs=0.01)


def _depth(arm: MovingArm) -> Callable[[], float]:
    """Return what shows how far the tip has been below where it is now [m]."""
    states = arm.client.listen(JointState, '/joint_states')
    arm.client.spin_until(lambda: bool(states), 10.0, 'joint states')
    model = panda().model('panda_arm')

    def height(state: JointState) -> float:
        places = dict(zip(state.name, state.position, strict=True))
        positions = frozen([places[name] for name in model.joints])
        return float(model.kinematics.link_pose('panda_link8', positions).position[2])

    return lambda: height(states[0]) - min(map(height, states))


def _cancels_a_move(arm: MovingArm) -> None:
    """In the middle of its execution; what was planned is in the result."""
    away = move_goal([-0.8, *READY[1:]])
    away.request.max_velocity_scaling_factor = 0.2
    run = move(arm, away)
    run.wait_for_motion()
    run.cancel()
    status, result = run.wait()
    assert (status, result.error_code.val) == (
        GoalStatus.STATUS_CANCELED,
        MoveItErrorCodes.PREEMPTED,
    ), result.error_code
    assert result.planned_trajectory.joint_trajectory.points


def _visitor(arm: MovingArm, turn: float, size: float) -> CollisionObject:
    """Return a box where the hand is when joint 1 has turned from READY."""
    state = GetPositionFK.Request(fk_link_names=['panda_hand'])
    state.robot_state.joint_state.name = list(JOINTS)
    state.robot_state.joint_state.position = [turn, *READY[1:]]
    at = arm.client.call(GetPositionFK, '/compute_fk', state).pose_stamped[0].pose.position
    box = _box('visitor', at.x, at.y, at.z)
    box.primitives[0].dimensions = [size] * 3
    return box


def _goes(arm: MovingArm, name: str) -> None:
    """Take an object away."""
    _change(arm, CollisionObject(id=name, operation=CollisionObject.REMOVE))


def _change(arm: MovingArm, thing: CollisionObject) -> None:
    """Change one object of the scene."""
    change = PlanningScene(is_diff=True)
    change.robot_state.is_diff = True
    change.world.collision_objects = [thing]
    apply = ApplyPlanningScene.Request(scene=change)
    assert arm.client.call(ApplyPlanningScene, '/apply_planning_scene', apply).success


class Observer:
    """Looks on from beside move_group: where the joints were, and whether they touched a box."""

    def __init__(self, arm: MovingArm) -> None:
        self._client = arm.client
        self._states = arm.client.listen(JointState, '/joint_states')

    def wait_for_turn(self) -> None:
        """Wait until joint 1 has turned a little."""
        self._client.spin_until(
            lambda: bool(self._states) and self._states[-1].position[0] < -0.05, 10.0, 'motion'
        )

    def saw_no_contact(self, visitor: CollisionObject) -> None:
        """Check all states that have come."""
        robot = panda()
        home = robot.positions({})
        scene = apply_planning_scene(robot.scene, scene_change(visitor), home)
        for state in self._states:
            places = dict(zip(state.name, state.position, strict=True))
            (measured,) = distances(scene, robot.positions(places)).tolist()
            pairs = zip(scene.pairs, measured, strict=True)
            assert not [pair for pair, distance in pairs if distance < 0.0], places


def _stops_in_front_of_what_appears(arm: MovingArm) -> None:
    """A trajectory on its way ends on its path, with the name of the box."""
    visitor, observer = _visitor(arm, -0.9, size=0.1), Observer(arm)
    run = execute(arm, _trajectory([-0.9, *READY[1:]], 12))
    observer.wait_for_turn()
    _change(arm, visitor)
    status, result = run.wait()
    assert status == GoalStatus.STATUS_ABORTED
    invalidated = MoveItErrorCodes.MOTION_PLAN_INVALIDATED_BY_ENVIRONMENT_CHANGE
    assert result.error_code.val == invalidated, result.error_code
    assert 'visitor' in result.error_code.message
    observer.saw_no_contact(visitor)
    _goes(arm, 'visitor')


def _plans_anew_around_what_appears(arm: MovingArm) -> None:
    """With replan, a move that is blocked on its way goes around."""
    visitor, observer = _visitor(arm, -0.65, size=0.06), Observer(arm)
    goal = move_goal([-1.2, *READY[1:]])
    goal.request.max_velocity_scaling_factor = 0.05  # a busy machine is late with the box
    goal.planning_options.replan = True
    goal.planning_options.replan_delay = 0.1
    run = move(arm, goal)
    observer.wait_for_turn()
    _change(arm, visitor)
    status, result = run.wait()
    assert (status, result.error_code.val) == (GoalStatus.STATUS_SUCCEEDED, 1), result.error_code
    assert run.states.count('PLANNING') > 1
    observer.saw_no_contact(visitor)


def _cancels_before_it_is_planned_anew(arm: MovingArm) -> None:
    """The answer does not wait for the delay; nothing stands for a plan that was given up."""
    visitor, goal = _visitor(arm, -0.1, size=0.06), move_goal(READY)
    goal.request.max_velocity_scaling_factor = 0.1
    goal.planning_options.replan = True
    goal.planning_options.replan_delay = 1000.0
    run = move(arm, goal)
    run.wait_for_motion()
    states = arm.client.listen(JointState, '/joint_states')
    _change(arm, visitor)
    arm.client.spin_until(lambda: _stands(states), 20.0, 'the stop')
    run.cancel()
    status, result = run.wait()
    assert (status, result.error_code.val) == (
        GoalStatus.STATUS_CANCELED,
        MoveItErrorCodes.PREEMPTED,
    ), result.error_code
    assert not result.planned_trajectory.joint_trajectory.points


def _names_the_drive_that_fails(arm: MovingArm) -> None:
    """The client reads which one it is; nothing is planned anew."""
    _goes(arm, 'visitor')
    goal, states = move_goal(TURNED), arm.client.listen(JointState, '/joint_states')
    goal.request.max_velocity_scaling_factor = 0.1
    goal.planning_options.replan = True
    run = move(arm, goal)
    run.wait_for_motion()
    begin = len(states)

    def turned() -> bool:
        return len(states) > begin and states[-1].position[0] > states[begin].position[0] + 0.05

    arm.client.spin_until(turned, 10.0, 'motion')
    arm.inject('panda_joint4', 'over_current')
    status, result = run.wait()
    assert status == GoalStatus.STATUS_ABORTED
    assert result.error_code.val == MoveItErrorCodes.CONTROL_FAILED, result.error_code
    assert 'panda_joint4 is faulted: 0x2310' in result.error_code.message
    assert 'panda_joint3' not in result.error_code.message
    assert run.states.count('PLANNING') == 1


def _stands(states: Sequence[JointState]) -> bool:
    """Return whether no joint has moved for half a second."""
    if not states:
        return False
    last = states[-1]
    now = seconds(last.header.stamp)
    since = [state for state in states if 0.5 < now - seconds(state.header.stamp) < 1.0]
    return bool(since) and all(
        abs(place - before) < 1e-3
        for state in since
        for place, before in zip(last.position, state.position, strict=True)
    )
