# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The demo's ROS client: what any client of MoveIt does, and an observer of the joint states."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from control_msgs.action import GripperCommand
from geometry_msgs.msg import Point, PoseStamped, Quaternion
from geometry_msgs.msg import Pose as PoseMessage
from moveit_msgs.action import MoveGroup
from moveit_msgs.msg import (
    AttachedCollisionObject,
    Constraints,
    DisplayTrajectory,
    JointConstraint,
    MoveItErrorCodes,
    OrientationConstraint,
    PlanningScene,
    PositionConstraint,
    RobotState,
)
from moveit_msgs.msg import CollisionObject as ObjectMessage
from moveit_msgs.srv import ApplyPlanningScene, GetPositionIK
from rclpy.action.client import ActionClient
from sensor_msgs.msg import JointState
from shape_msgs.msg import SolidPrimitive

from arm_model import Box, CollisionObject, frozen, Pose, rotation_of
from arm_planning import PlanningCode
from node_runner import LATCHED
from process_supervisor import CallError

from ..client import ActionRun, ANSWER_TIMEOUT, ArmClient
from .figures import PlanFigures
from .observer import Observer
from .orders import DisplayedPath, DisplayedScene, MotionEnd, MotionOrder, SceneChange
from .tool import quaternion

PLANNING_TIME = 5.0
"""Longest time for planning in [s], as MoveGroupInterface asks for."""
IK_TIMEOUT = 0.5
"""Longest time for inverse kinematics in [s]."""
JOINT_TOLERANCE, POSITION_TOLERANCE, TURN_TOLERANCE = 1e-4, 1e-4, 1e-3
"""Tolerances of goals as MoveGroupInterface has them in [rad], [m] and [rad]."""


class PlanClient(ArmClient):
    """A node of its own; use it in one thread.

    Attributes:
        observer: Who measures at the joint states that come.
        paths: All of /display_planned_path so far.
        scene: The last of /monitored_planning_scene.
    """

    def __init__(
        self, given_up: Callable[[], bool], observer: Observer, root: str, namespace: str = ''
    ) -> None:
        """Join the ROS graph.

        Args:
            given_up: True when nothing shall be waited for any more.
            observer: Who measures.
            root: The root link of the robot, in which poses are.
            namespace: That of the arm.
        """
        super().__init__(given_up, namespace)
        self.figures = PlanFigures()
        self.observer, self._root = observer, root
        self.paths: list[DisplayedPath] = []
        self.scene = DisplayedScene()
        node = self.node
        self._move = ActionClient(node, MoveGroup, 'move_action')
        self._grippers: dict[str, ActionClient] = {}
        self._apply = node.create_client(ApplyPlanningScene, 'apply_planning_scene')
        self._ik = node.create_client(GetPositionIK, 'compute_ik')
        node.create_subscription(JointState, 'joint_states', self._see, 50)
        node.create_subscription(
            DisplayTrajectory, 'display_planned_path', self._take_path, LATCHED
        )
        node.create_subscription(
            PlanningScene, 'monitored_planning_scene', self._take_scene, LATCHED
        )

    def show(self, words: str, planning_time: float) -> None:
        """Have something shown beside the drives.

        Args:
            words: What was asked for, or answered.
            planning_time: Time of the last planning in [s].
        """
        if isinstance(self.figures, PlanFigures):
            self.figures = replace(self.figures, words=words, planning_time=planning_time)

    def change(self, change: SceneChange) -> None:
        """Change the scene, as PlanningSceneInterface does.

        Args:
            change: The change.

        Raises:
            CallError: It was refused, or nobody answers.
        """
        diff = PlanningScene(is_diff=True)
        diff.robot_state.is_diff = True
        diff.world.collision_objects = [self._object(each) for each in change.add] + [
            ObjectMessage(id=name, operation=ObjectMessage.REMOVE) for name in change.remove
        ]
        for body, operation in (
            (change.attach, ObjectMessage.ADD),
            (change.detach, ObjectMessage.REMOVE),
        ):
            if body is not None:
                named = ObjectMessage(id=body.object.name, operation=operation)
                diff.robot_state.attached_collision_objects.append(
                    AttachedCollisionObject(
                        link_name=body.link, object=named, touch_links=sorted(body.touch_links)
                    )
                )
        request = ApplyPlanningScene.Request(scene=diff)
        if not self._answer(self._apply, request, 'apply_planning_scene').success:
            raise CallError('apply_planning_scene: refused; the log of move_group says why')

    def ik(
        self, group: str, link: str, pose: Pose, seed: Mapping[str, float], *, free: bool
    ) -> Mapping[str, float]:
        """Return joint positions for a pose of a link.

        Args:
            group: The group.
            link: The link.
            pose: Where it is to be in the root link.
            seed: Positions in [rad] or [m] of which they are wanted near.
            free: Whether nothing may touch.

        Raises:
            CallError: There are none, or nobody answers.
        """
        request = GetPositionIK.Request()
        wanted = request.ik_request
        wanted.group_name, wanted.ik_link_name, wanted.avoid_collisions = group, link, free
        wanted.pose_stamped = PoseStamped(pose=pose_message(pose))
        wanted.pose_stamped.header.frame_id = self._root
        wanted.robot_state = RobotState(is_diff=True)
        wanted.robot_state.joint_state.name = list(seed)
        wanted.robot_state.joint_state.position = list(seed.values())
        wanted.timeout.nanosec = round(1e9 * IK_TIMEOUT)
        answer = self._answer(self._ik, request, 'compute_ik')
        if answer.error_code.val != MoveItErrorCodes.SUCCESS:
            code = answer.error_code
            raise CallError(f'compute_ik: {code_name(code.val)}: {code.message}')
        state = answer.solution.joint_state
        places = dict(zip(state.name, state.position, strict=True))
        return {name: places[name] for name in seed}

    def send(self, order: MotionOrder) -> SentMotion:
        """Send a goal to move_action, as MoveGroupInterface::move does.

        Args:
            order: The motion.

        Raises:
            CallError: It was not accepted, or nobody answers.
        """
        goal = MoveGroup.Goal()
        request, options = goal.request, goal.planning_options
        request.group_name, request.planner_id = order.group, order.planner_id
        request.num_planning_attempts, request.allowed_planning_time = 1, PLANNING_TIME
        request.max_velocity_scaling_factor = order.speed
        request.max_acceleration_scaling_factor = order.speed
        request.start_state.is_diff = True
        request.goal_constraints = [self._goal(order)]
        options.planning_scene_diff.is_diff = True
        options.planning_scene_diff.robot_state.is_diff = True
        options.replan = order.replan
        return SentMotion(ActionRun(self, self._move, goal, 'move_action'))

    def grip(self, controller: str, position: float) -> None:
        """Move a gripper, and wait until it is there.

        Args:
            controller: Its controller.
            position: Where to in [m] or [rad].

        Raises:
            CallError: It did not get there, or nobody answers.
        """
        name = f'{controller}/gripper_cmd'
        if name not in self._grippers:
            self._grippers[name] = ActionClient(self.node, GripperCommand, name)
        action = self._grippers[name]
        goal = GripperCommand.Goal()
        goal.command.position = position
        run = ActionRun(self, action, goal, name)
        self.wait_until(lambda: run.done, ANSWER_TIMEOUT, f'the end of {name}')
        if not run.result.reached_goal:
            raise CallError(f'{name}: {position:.4f} was not reached: {run.result.position:.4f}')

    def _answer(self, client: Any, request: Any, name: str) -> Any:  # noqa: ANN401
        self.wait_until(client.service_is_ready, ANSWER_TIMEOUT, f'the service {name}')
        self.wait_until_known([name], ANSWER_TIMEOUT)
        future = client.call_async(request)
        self.wait_until(future.done, ANSWER_TIMEOUT, f'the answer of {name}')
        return future.result()

    def _goal(self, order: MotionOrder) -> Constraints:
        constraints = Constraints(
            joint_constraints=[
                JointConstraint(
                    joint_name=name,
                    position=position,
                    tolerance_above=JOINT_TOLERANCE,
                    tolerance_below=JOINT_TOLERANCE,
                    weight=1.0,
                )
                for name, position in order.joints.items()
            ]
        )
        if order.pose is not None:
            at = pose_message(order.pose)
            place = PositionConstraint(link_name=order.link, weight=1.0)
            place.header.frame_id = self._root
            place.constraint_region.primitives = [
                SolidPrimitive(type=SolidPrimitive.SPHERE, dimensions=[POSITION_TOLERANCE])
            ]
            place.constraint_region.primitive_poses = [at]
            turn = OrientationConstraint(link_name=order.link, weight=1.0)
            turn.header.frame_id = self._root
            turn.orientation = at.orientation
            turn.absolute_x_axis_tolerance = TURN_TOLERANCE
            turn.absolute_y_axis_tolerance = TURN_TOLERANCE
            turn.absolute_z_axis_tolerance = TURN_TOLERANCE
            constraints.position_constraints = [place]
            constraints.orientation_constraints = [turn]
        return constraints

    def _object(self, thing: CollisionObject) -> ObjectMessage:
        message = ObjectMessage(id=thing.name, operation=ObjectMessage.ADD)
        message.header.frame_id = self._root
        message.pose = pose_message(thing.pose)
        for placed in thing.shapes:
            if not isinstance(placed.shape, Box):
                raise TypeError(f'{thing.name}: the demo puts boxes into the scene only')
            shape = placed.shape
            message.primitives.append(
                SolidPrimitive(type=SolidPrimitive.BOX, dimensions=[shape.x, shape.y, shape.z])
            )
            message.primitive_poses.append(pose_message(placed.pose))
        return message

    def _see(self, message: JointState) -> None:
        self.observer.see(dict(zip(message.name, message.position, strict=False)))
        if isinstance(self.figures, PlanFigures):
            seen = self.observer
            self.figures = replace(self.figures, clearance=seen.room, nearest=seen.nearest)

    def _take_path(self, message: DisplayTrajectory) -> None:
        state = message.trajectory_start.joint_state
        start = dict(zip(state.name, state.position, strict=True))
        for each in message.trajectory:
            trajectory = each.joint_trajectory
            rows = [list(point.positions) for point in trajectory.points]
            names = list(trajectory.joint_names)
            self.paths.append(DisplayedPath(message.model_id, start, names, rows))

    def _take_scene(self, message: PlanningScene) -> None:
        state = message.robot_state
        self.scene = DisplayedScene(
            {each.id: pose_of(each.pose) for each in message.world.collision_objects},
            {each.object.id: each.link_name for each in state.attached_collision_objects},
            dict(zip(state.joint_state.name, state.joint_state.position, strict=True)),
        )


@dataclass(frozen=True, slots=True)
class SentMotion:
    """A goal of move_action on its way."""

    run: ActionRun

    @property
    def executing(self) -> bool:
        """Whether it is planned, and begins."""
        return 'MONITOR' in self._states

    @property
    def done(self) -> bool:
        """Whether it has ended."""
        return self.run.done

    def cancel(self) -> None:
        """Ask for its end."""
        self.run.cancel()

    def end(self) -> MotionEnd:
        """Return how it ended; once it is done."""
        result = self.run.result
        code = result.error_code
        plans = self._states.count('PLANNING')
        return MotionEnd(code_name(code.val), code.message, result.planning_time, plans)

    @property
    def _states(self) -> Sequence[str]:
        return [each.state for each in self.run.feedback]


def code_name(value: int) -> str:
    """Return the name of one of MoveIt's codes.

    Args:
        value: The code.
    """
    try:
        return PlanningCode(value).name
    except ValueError:
        return str(value)


def pose_message(pose: Pose) -> PoseMessage:
    """Return a pose as a geometry_msgs/Pose.

    Args:
        pose: The pose.
    """
    x, y, z = pose.position.tolist()
    turn = dict(zip('xyzw', quaternion(pose), strict=True))
    return PoseMessage(position=Point(x=x, y=y, z=z), orientation=Quaternion(**turn))


def pose_of(message: Any) -> Pose:  # noqa: ANN401  # messages have no type
    """Return a geometry_msgs/Pose as a pose.

    Args:
        message: The message.
    """
    place, turn = message.position, message.orientation
    return Pose(
        frozen(rotation_of([turn.x, turn.y, turn.z, turn.w])), frozen([place.x, place.y, place.z])
    )
