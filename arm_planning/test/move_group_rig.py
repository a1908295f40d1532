# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The program move_group beside a robot whose joints are where trajectories end."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
import json
from pathlib import Path
import shutil
import time
from typing import Any, TYPE_CHECKING

from ament_index_python.packages import get_package_share_directory
from control_msgs.action import FollowJointTrajectory, GripperCommand
from geometry_msgs.msg import Pose as PoseMessage
from moveit_msgs import msg, srv
from moveit_msgs.action import MoveGroup
from processes import executable, RunningProcess
from rclpy.action.server import ActionServer, CancelResponse
from ros_client import RosClient
from sensor_msgs.msg import JointState
from shape_msgs.msg import SolidPrimitive
from urdf_reader import expand_xacro

if TYPE_CHECKING:
    from isolation import Isolation
    from typing_extensions import Self

TIMEOUT = 60.0  # longest time for an answer in [s]

JOINTS = [f'panda_joint{number}' for number in range(1, 8)]
HAND = 'panda_link8'
READY = [0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785]
PACKAGES = Path(__file__).parent / 'moveit_packages'
SEMANTICS = {'panda': ('panda_hand/panda_hand.srdf', 'panda_link0')}
SEMANTICS |= {'prbt': ('prbt/prbt.srdf', 'prbt_base_link')}
"""SRDF of arm_bringup and root link of the robot of each package."""


def robots() -> Path:
    """Return the folder of robots of arm_bringup."""
    return Path(get_package_share_directory('arm_bringup')) / 'robots'


def moveit_package(name: str, folder: Path) -> Path:
    """Write a package as the Setup Assistant writes it, with a virtual joint in its SRDF."""
    path = folder / f'{name}_moveit_config'
    shutil.copytree(PACKAGES / name, path)
    source, root = SEMANTICS[name]
    world = 'name="virtual_joint" type="fixed" parent_frame="world"'
    virtual = f'<virtual_joint {world} child_link="{root}"/></robot>'
    srdf = (robots() / source).read_text(encoding='utf-8').replace('</robot>', virtual)
    (path / 'config' / f'{name}.srdf').write_text(srdf, encoding='utf-8')
    return path


def panda_parameters(folder: Path, joint_limits: Path | None = None) -> Path:
    """Write what describes the Panda, with soft limits of its last joint, as a parameter file."""
    panda = robots() / 'panda'
    last = '<child link="panda_link7"/>'
    soft = '<safety_controller k_velocity="20" soft_lower_limit="-2.5" soft_upper_limit="2.5"/>'
    urdf = expand_xacro(panda / 'panda.urdf.xacro')
    assert urdf.count(last) == 1
    srdf = (panda / 'panda.srdf').read_text(encoding='utf-8')
    limits = joint_limits or panda / 'limits.yaml'
    return parameter_file(folder, urdf.replace(last, last + soft), srdf, limits)


def parameter_file(folder: Path, urdf: str, srdf: str, limits: Path) -> Path:
    """Write what describes a robot as a parameter file."""
    values = {'robot_description': urdf, 'robot_description_semantic': srdf}
    path = folder / 'robot.json'  # JSON is YAML
    parameters = {**values, 'joint_limits': str(limits)}
    path.write_text(json.dumps({'/**': {'ros__parameters': parameters}}), encoding='utf-8')
    return path


class MoveGroupRig:
    """move_group, joint states, and controllers that are where they were sent at once.

    Attributes:
        client: The node of the test, which is the robot too.
        process: move_group.
        positions: Where the joints are in [rad], by name.
        followed: Goals of controllers so far.
        held: Goals that wait until the test calls their execute().
    """

    def __init__(
        self, isolation: Isolation, *arguments: str, positions: Mapping[str, float] | None = None
    ) -> None:
        """Start it.

        Args:
            positions: Of the joints in [rad]; by default the Panda's ready.
        """
        self._begin = dict(positions or zip(JOINTS, READY, strict=True))
        self.positions = dict(self._begin)
        self.followed: list[Any] = []
        self.held: list[Any] = []
        self._published = 0.0
        self.client = RosClient(isolation.domain_id)
        node = self.client.node
        self._states = node.create_publisher(JointState, '/joint_states', 10)
        node.create_timer(0.02, self._publish)
        command = [executable('arm_planning', 'move_group'), *arguments]
        self.process = RunningProcess(command, isolation.env)
        try:
            self.process.wait_until_ready(TIMEOUT)
            self._wait_for_states()
        except BaseException:
            self.__exit__(*[None] * 3)
            raise

    def _wait_for_states(self) -> None:
        """Wait until move_group has received joint states: it shows others than by default."""
        positions = self.positions
        self.positions = {name: position + 0.01 for name, position in positions.items()}
        self.settle()
        self.positions = positions
        self.settle()

    def settle(self) -> None:
        """Wait until move_group has received where the robot is."""
        deadline = time.monotonic() + TIMEOUT
        while time.monotonic() < deadline:
            state = self.scene(msg.PlanningSceneComponents.ROBOT_STATE).robot_state.joint_state
            places = dict(zip(state.name, state.position, strict=True))
            if all(abs(places[name] - at) < 1e-9 for name, at in self.positions.items()):
                return
            self.client.spin_for(0.02)  # joint states are published
        raise TimeoutError('move_group does not receive where the robot is')

    def _serve(self, kind: Any, name: str, follow: Callable[[Any], Any], holds: bool) -> Any:
        callbacks: dict[str, Any] = {
            'handle_accepted_callback': self.held.append if holds else lambda each: each.execute(),
            'cancel_callback': lambda _: CancelResponse.ACCEPT,
        }
        return ActionServer(self.client.node, kind, name, follow, **callbacks)  # type: ignore[no-untyped-call]

    def serve_arm(self, name: str, *, holds: bool = False) -> Any:
        """Offer a trajectory controller; one that holds leaves its goals in :attr:`held`."""
        action = f'/{name}/follow_joint_trajectory'
        return self._serve(FollowJointTrajectory, action, self._follow, holds)

    def serve_gripper(self, name: str, joint: str, *, holds: bool = False) -> Any:
        """Offer a gripper of one joint."""

        def grip(handle: Any) -> GripperCommand.Result:
            self.followed.append(handle.request)
            self.positions[joint] = handle.request.command.position
            handle.succeed()
            return GripperCommand.Result(reached_goal=True)

        return self._serve(GripperCommand, f'/{name}/gripper_cmd', grip, holds)

    def _follow(self, handle: Any) -> FollowJointTrajectory.Result:
        if handle.is_cancel_requested:
            handle.canceled()
            return FollowJointTrajectory.Result()
        trajectory = handle.request.trajectory
        self.followed.append(handle.request)
        end = trajectory.points[-1].positions
        self.positions |= dict(zip(trajectory.joint_names, end, strict=True))
        handle.succeed()
        return FollowJointTrajectory.Result()

    def _publish(self) -> None:
        state = JointState(name=list(self.positions), position=list(self.positions.values()))
        state.header.stamp = self.client.node.get_clock().now().to_msg()
        self._states.publish(state)
        self._published = time.monotonic()

    def _refresh(self) -> None:
        """Publish joint states for a while where the test has computed: they are too old then."""
        if time.monotonic() - self._published > 0.3:
            self.client.spin_for(0.2)

    def reset(self) -> None:
        """Bring the robot to where it began, and empty the scene."""
        self.positions.clear()
        self.positions.update(self._begin)
        self.followed.clear()
        self.held.clear()
        assert self.apply(msg.PlanningScene())
        self.settle()

    def apply(self, scene: msg.PlanningScene | None = None, **parts: Any) -> bool:
        """Apply a scene, or a change of its parts; return whether it was accepted."""
        asked = srv.ApplyPlanningScene.Request(scene=change(**parts) if scene is None else scene)
        return bool(
            self.client.call(srv.ApplyPlanningScene, '/apply_planning_scene', asked).success
        )

    def add(self, *things: msg.CollisionObject) -> None:
        """Add objects to the world, or change what they name."""
        assert self.apply(world=msg.PlanningSceneWorld(collision_objects=list(things)))

    def scene(self, components: int = 0) -> msg.PlanningScene:
        """Return the scene, whole or the parts of moveit_msgs/PlanningSceneComponents."""
        asked = srv.GetPlanningScene.Request()
        asked.components.components = components
        return self.client.call(srv.GetPlanningScene, '/get_planning_scene', asked).scene

    def objects(self) -> list[str]:
        """Return the names of the objects of the world."""
        return [each.id for each in self.scene().world.collision_objects]

    def publisher(self, kind: Any, topic: str) -> Any:
        """Return a publisher to which move_group listens."""
        publisher = self.client.node.create_publisher(kind, topic, 1)
        self.client.spin_until(lambda: publisher.get_subscription_count() > 0, TIMEOUT, topic)
        return publisher

    def fk(self, frame: str = HAND, state: Any = None) -> PoseMessage:
        """Return where a link or body is in the root link, by compute_fk."""
        asked = srv.GetPositionFK.Request(fk_link_names=[frame])
        if state is not None:
            asked.robot_state = state
        return self.client.call(srv.GetPositionFK, '/compute_fk', asked).pose_stamped[0].pose

    def ik(self, pose: PoseMessage, frame: str = '', **fields: Any) -> Any:
        """Return the response of compute_ik for a pose of the Panda's hand."""
        asked = srv.GetPositionIK.Request()
        asked.ik_request = msg.PositionIKRequest(**{'group_name': 'panda_arm'} | fields)
        asked.ik_request.pose_stamped.pose = pose
        asked.ik_request.pose_stamped.header.frame_id = frame
        return self.client.call(srv.GetPositionIK, '/compute_ik', asked)

    def cartesian_path(self, *waypoints: PoseMessage, **fields: Any) -> Any:
        """Return the response of compute_cartesian_path for poses of the Panda's hand."""
        given = {'group_name': 'panda_arm', 'link_name': HAND, 'max_step': 0.01} | fields
        asked = srv.GetCartesianPath.Request(waypoints=list(waypoints), **given)
        asked.start_state.is_diff = True
        return self.client.call(srv.GetCartesianPath, '/compute_cartesian_path', asked)

    def plan(self, request: msg.MotionPlanRequest) -> Any:
        """Return the moveit_msgs/MotionPlanResponse of plan_kinematic_path."""
        self._refresh()
        asked = srv.GetMotionPlan.Request(motion_plan_request=request)
        answer = self.client.call(srv.GetMotionPlan, '/plan_kinematic_path', asked, TIMEOUT)
        return answer.motion_plan_response

    def run(self, kind: Any, name: str, goal: Any) -> tuple[int, Any]:
        """Send a goal of an action; return status and result."""
        handle = self.send(kind, name, goal)
        result = handle.get_result_async()
        self.client.spin_until(result.done, TIMEOUT, 'result')
        return result.result().status, result.result().result

    def send(self, kind: Any, name: str, goal: Any, feedback: Any = None) -> Any:
        """Send a goal of an action; return its handle."""
        self._refresh()
        caller: Any = self.client.action(kind, name)
        self.client.spin_until(caller.server_is_ready, TIMEOUT, name)
        sent = caller.send_goal_async(goal, feedback)
        self.client.spin_until(sent.done, TIMEOUT, 'acceptance')
        return sent.result()

    def move(self, goal: MoveGroup.Goal) -> tuple[int, Any]:
        """Send a goal of move_action; return status and result."""
        return self.run(MoveGroup, '/move_action', goal)

    def __enter__(self) -> Self:
        """Use it in a with statement."""
        return self

    def __exit__(self, *exception: object) -> None:
        """End it."""
        self.process.__exit__(*exception)  # type: ignore[arg-type]
        self.client.__exit__(*exception)


def change(**parts: Any) -> msg.PlanningScene:
    """Return a change of parts of the scene."""
    scene = msg.PlanningScene(is_diff=True, **parts)
    scene.robot_state.is_diff = True
    return scene


def joint_goal(positions: Sequence[float], joints: Sequence[str] = JOINTS) -> msg.Constraints:
    """Return a goal of joints, as MoveGroupInterface makes it."""
    within = {'tolerance_above': 1e-4, 'tolerance_below': 1e-4, 'weight': 1.0}
    return msg.Constraints(
        joint_constraints=[
            msg.JointConstraint(joint_name=name, position=position, **within)
            for name, position in zip(joints, positions, strict=True)
        ]
    )


def pose_goal(pose: PoseMessage, link: str, frame: str) -> msg.Constraints:
    """Return a goal of a pose, as MoveGroupInterface makes it."""
    place = msg.PositionConstraint(link_name=link, weight=1.0)
    ball = SolidPrimitive(type=SolidPrimitive.SPHERE, dimensions=[1e-4])
    place.constraint_region.primitives = [ball]
    place.constraint_region.primitive_poses = [PoseMessage(position=pose.position)]
    turn = msg.OrientationConstraint(link_name=link, orientation=pose.orientation, weight=1.0)
    turn.absolute_x_axis_tolerance = turn.absolute_y_axis_tolerance = 1e-3
    turn.absolute_z_axis_tolerance = 1e-3
    place.header.frame_id = turn.header.frame_id = frame
    return msg.Constraints(position_constraints=[place], orientation_constraints=[turn])


def motion_request(
    goal: msg.Constraints, group: str = 'panda_arm', **others: Any
) -> msg.MotionPlanRequest:
    """Return a request from where the robot is."""
    fields: dict[str, Any] = {'num_planning_attempts': 1, 'allowed_planning_time': 10.0}
    request = msg.MotionPlanRequest(group_name=group, goal_constraints=[goal], **fields | others)
    request.start_state.is_diff = True
    return request


def action_goal(request: msg.MotionPlanRequest, *, plan_only: bool = False) -> MoveGroup.Goal:
    """Return a goal of move_action, as MoveGroupInterface makes it."""
    goal = MoveGroup.Goal(request=request)
    goal.planning_options.plan_only = plan_only
    goal.planning_options.planning_scene_diff = change()
    return goal
