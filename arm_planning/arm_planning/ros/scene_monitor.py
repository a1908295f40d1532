# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The shared scene on a node: MoveIt's topics and services to read and change it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
import math
import time
from typing import Any

from moveit_msgs.msg import (
    AttachedCollisionObject,
    CollisionObject,
    PlanningScene,
    PlanningSceneWorld,
)
from moveit_msgs.msg import RobotState as StateMessage
from moveit_msgs.srv import ApplyPlanningScene, GetPlanningScene
import numpy as np
from rclpy.node import Node
from sensor_msgs.msg import JointState
from std_srvs.srv import Empty

from arm_model import Array, combined, Pose
from arm_model.ros import scene_change, TfListener
from node_runner import LATCHED
from robot_primitives import JointStateStore

from ..exceptions import coded, PlanningCode, PlanningError
from .background import as_refusal
from .robot_groups import RobotGroups
from .scene import (
    ALL_COMPONENTS,
    attached_messages,
    collision_message,
    scene_message,
    SceneSnapshot,
)
from .scene_changes import apply_scene
from .trajectories import joints_of, state_message

DEPTH = 100  # messages of changes that may wait: each of them counts
NO_OCTOMAP = 'OcTree'  # id of an octomap without data: it takes the place of the present one
STATE_TIMEOUT = 1.0  # age at which joint states count no more in [s]

SPEED_PERIOD, REST_SPEED = 0.05, 0.02
"""Time in [s] over which joint speeds are measured, and speed in [rad/s] that counts as rest."""

REST_PERIOD, REST_TOLERANCE = 0.25, 1e-3
"""Time in [s] in which the joints of a robot at rest move less than this in [rad] or [m]."""


class SceneMonitor:
    """The scene and the joint positions; runs in the executor of its node.

    Attributes:
        snapshot: The scene; a value that any thread may keep.
        on_change: Called after each change of the scene.
    """

    def __init__(self, node: Node, robot: RobotGroups, frame_prefix: str = '') -> None:
        """Offer topics and services; the prefix precedes the robot's link names in TF."""
        self.robot = robot
        self._tf = TfListener(node, robot.kinematics, frame_prefix, on_demand=True)
        self.snapshot = SceneSnapshot(
            robot.scene,
            name=f'{robot.name} scene',
            world_frames=robot.world_frames,
            outer_frames=self._outer_frame,
        )
        self._node = node
        self._states = JointStateStore(robot.all_joints)
        self._before = self._mark = self._states.samples()  # from which speeds are measured
        self._marked = -math.inf
        self._refused: dict[str, str] = {}  # what was refused last, by topic or service
        self.on_change: Callable[[], None] = lambda: None
        # first: a controller that has found it does not read the meshes of the other one
        self._collisions = node.create_publisher(PlanningScene, 'collision_scene', LATCHED)
        self._published = node.create_publisher(PlanningScene, 'monitored_planning_scene', LATCHED)
        node.create_subscription(JointState, 'joint_states', self._take_joints, 1)
        for kind, topic, as_scene in (
            (PlanningScene, 'planning_scene', lambda scene: scene),
            (PlanningSceneWorld, 'planning_scene_world', _world),
            (CollisionObject, 'collision_object', scene_change),
            (AttachedCollisionObject, 'attached_collision_object', scene_change),
        ):
            change = partial(self._take_change, topic, as_scene)
            node.create_subscription(kind, topic, change, DEPTH)
        node.create_service(GetPlanningScene, 'get_planning_scene', self._get)
        node.create_service(ApplyPlanningScene, 'apply_planning_scene', self._apply)
        node.create_service(Empty, 'clear_octomap', self._clear_octomap)
        self._shown = self._seen = self.positions()
        self._publish_change()
        node.create_timer(REST_PERIOD, self._publish_rest)

    def received(self, joints: Sequence[str]) -> Mapping[str, float]:
        """Return joint positions in [rad], by joint; refuse unknown or outdated ones."""
        for joint in joints:
            if joint not in self.robot.all_joints:
                known = ', '.join(self.robot.all_joints)
                raise PlanningError(
                    PlanningCode.CONTROL_FAILED, f'no joint {joint!r}; joints: {known}'
                )
        self._check_received(joints)
        places = self._places()
        return {joint: places[joint] for joint in joints}

    def is_moving(self, group: str) -> bool:
        """Whether a joint of a group moves, such as after a jog; False if that is unknown."""
        joints = self.robot.group_joints().get(group, ())
        fresh = self._states.samples(time.monotonic() - STATE_TIMEOUT)
        known = [each for each in joints if each in fresh and each in self._before]
        return any(
            abs(fresh[each].position - self._before[each].position)
            > REST_SPEED * (fresh[each].time - self._before[each].time)
            for each in known
        )

    def positions(self, message: Any = None) -> Array:  # noqa: ANN401  # messages have no type
        """Return the positions of all joints in [rad]; a moveit_msgs/RobotState has precedence."""
        given = {} if message is None else joints_of(message, self.robot.all_joints)
        return self.robot.positions({**self._places(), **given})

    def start(self, state: Any, group: str = '') -> tuple[SceneSnapshot, Array]:  # noqa: ANN401
        """Return the scene in which a request begins, and the positions of all joints in [rad].

        Joints missing in the moveit_msgs/RobotState keep their present positions, which must be
        known for joints of the group. Its attached bodies are added to the scene.
        """
        positions = self.positions(state)
        if group:
            self._check_received(self.robot.model(group).joints, state.joint_state.name)
        if not state.attached_collision_objects:
            return self.snapshot, positions
        bodies = scene_change(*state.attached_collision_objects)
        return apply_scene(self.snapshot, bodies, positions), positions

    def state(self, positions: Array | None = None) -> StateMessage:
        """Return all joint positions as a moveit_msgs/RobotState, with attached bodies."""
        places = self.positions() if positions is None else positions
        message = state_message(self.robot.joints, places, self.snapshot.root)
        message.joint_state.header.stamp = self._node.get_clock().now().to_msg()
        message.attached_collision_objects = attached_messages(self.snapshot)
        return message

    def _check_received(self, joints: Sequence[str], given: Sequence[str] | None = None) -> None:
        """Refuse joints that are not given, and were never received or are too old."""
        now, samples = time.monotonic(), self._states.samples()
        other = '' if given is None else ', or give the start state'
        for joint in joints:
            age = now - samples[joint].time if joint in samples else math.inf
            if joint not in (given or ()) and age > STATE_TIMEOUT:
                topic = self._node.resolve_topic_name('joint_states')
                since = f'{age:.1f} s old' if math.isfinite(age) else 'not received yet'
                raise PlanningError(
                    PlanningCode.ROBOT_STATE_STALE,
                    f'joint {joint}: its position on {topic} is {since}; start what publishes it'
                    f'{other}',
                )

    def _outer_frame(self, frame: str, positions: Array) -> Pose:
        """Return the pose of a TF frame in the root link, via the first link connected to it."""
        kinematics = self.robot.kinematics
        link = self._tf.link(frame)
        if link is not None:
            return kinematics.link_pose(link, positions)
        with coded(PlanningCode.FRAME_TRANSFORM_FAILURE):
            link, pose = self._tf.connected(frame, kinematics.root, *kinematics.frames)
        return combined(kinematics.link_pose(link, positions), pose)

    def _clear_octomap(self, _request: Empty.Request, response: Empty.Response) -> Empty.Response:
        scene = scene_change()
        scene.world.octomap.octomap.id = NO_OCTOMAP
        self._change('clear_octomap', scene)
        return response

    def _places(self) -> dict[str, float]:
        return {name: each.position for name, each in self._states.samples().items()}

    def _take_joints(self, message: JointState) -> None:
        now = time.monotonic()
        self._states.receive(message.name, message.position, [], now)
        if now - self._marked >= SPEED_PERIOD:
            self._before, self._mark = self._mark, self._states.samples()
            self._marked = now

    def _take_change(self, topic: str, as_scene: Any, message: Any) -> None:  # noqa: ANN401
        self._change(topic, as_scene(message))

    def _change(self, source: str, scene: PlanningScene) -> bool:
        """Apply a scene; log a refusal, once if it repeats, and leave the scene as it is."""
        known = self.snapshot.notes
        try:
            self.snapshot = apply_scene(self.snapshot, scene, self.positions())
        except Exception as error:  # noqa: BLE001  # a message must not end the program
            refusal = as_refusal(error)
            text = f'{source} refused: {refusal.code.name}: {refusal}'
            if self._refused.get(source) != text:
                self._node.get_logger().warning(text)
            self._refused[source] = text
            return False
        self._refused.pop(source, None)
        for note in self.snapshot.notes:
            if note not in known:
                self._node.get_logger().warning(note)
        self._publish_change()
        self.on_change()
        return True

    def _publish_rest(self) -> None:
        """Publish the scene when the robot has come to rest elsewhere, for viewers.

        Unlike MoveIt, do not publish while it moves: programs that read the scene in a cycle
        would be busy with it.
        """
        here, before = self.positions(), self._seen
        self._seen = here
        if _near(here, before) and not _near(here, self._shown):
            self._publish()

    def _publish_change(self) -> None:
        self._collisions.publish(collision_message(self.snapshot, self.robot.name))
        self._publish()

    def _publish(self) -> None:
        self._shown = self.positions()
        self._published.publish(scene_message(self.snapshot, self.robot.name, self.state()))

    def _get(
        self, request: GetPlanningScene.Request, response: GetPlanningScene.Response
    ) -> GetPlanningScene.Response:
        components = request.components.components or ALL_COMPONENTS
        response.scene = scene_message(self.snapshot, self.robot.name, self.state(), components)
        return response

    def _apply(
        self, request: ApplyPlanningScene.Request, response: ApplyPlanningScene.Response
    ) -> ApplyPlanningScene.Response:
        self._refused.pop('apply_planning_scene', None)  # the log has the reason of each answer
        response.success = self._change('apply_planning_scene', request.scene)
        return response


def _world(message: PlanningSceneWorld) -> PlanningScene:
    """Return a change that replaces all objects of the world, and the octomap."""
    scene = scene_change(
        CollisionObject(operation=CollisionObject.REMOVE), *message.collision_objects
    )
    scene.world.octomap = message.octomap
    if not message.octomap.octomap.data:
        scene.world.octomap.octomap.id = NO_OCTOMAP
    return scene


def _near(one: Array, other: Array) -> bool:
    return bool(np.abs(one - other).max(initial=0.0) < REST_TOLERANCE)
