# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Nodes under test: a servo that listens, action servers without DDS, the listener to scenes."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import Future
from contextlib import contextmanager
from types import SimpleNamespace
from typing import Any

from builtin_interfaces.msg import Time
from control_msgs.msg import JointJog
from geometry_msgs.msg import TwistStamped
from isolation import Isolation
from moveit_msgs.msg import PlanningScene, ServoStatus
from moveit_msgs.srv import ServoCommandType
import pytest
import rclpy
from rclpy.context import Context
from rclpy.node import Node
from ros_client import RosClient
from servo_commands import Drives, SteppedWorker
from std_srvs.srv import SetBool

from arm_servo.ros.scene_listener import SceneListener
from node_runner import action_goals, LATCHED


class _Server:
    """What GoalServer uses of rclpy's server."""

    def __init__(self, node: GoalNode, *_: object, **callbacks: Any) -> None:
        node.servers.append(self)
        self.receive = callbacks['receive']
        self.begin = callbacks['handle_accepted_callback']
        self.cancel = callbacks['cancel_callback']
        self._execute = callbacks['execute_callback']

    def notify_execute(self, handle: Any, _: object) -> None:
        """Answer at once."""
        handle.result = self._execute(handle)


@contextmanager
def ros_node(isolation: Isolation, name: str) -> Iterator[Any]:
    """Make a node whose messages the test hands over."""
    context = Context()
    rclpy.init(context=context, domain_id=isolation.domain_id)
    node: Any = Node(name, context=context, enable_rosout=False)
    try:
        yield node
    finally:
        for waitable in list(node.waitables):
            waitable.destroy()
        node.destroy_node()
        rclpy.shutdown(context=context)


class GoalNode:
    """What action servers use of a node."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(action_goals, '_Server', _Server)
        self.servers: list[Any] = []  # its action servers
        self.logged: list[str] = []  # its log messages
        self._timers: list[Callable[[], None]] = []

    def get_logger(self) -> Any:
        """Return what takes log messages."""
        return SimpleNamespace(error=self.logged.append, warning=self.logged.append)

    def get_clock(self) -> Any:
        """Return a clock that stands still."""
        return SimpleNamespace(now=lambda: SimpleNamespace(to_msg=Time))

    def create_timer(self, _: float, callback: Callable[[], None]) -> None:
        """Note what :meth:`watch` calls."""
        self._timers.append(callback)

    def watch(self) -> None:
        """Let all timers expire once."""
        for callback in self._timers:
            callback()

    def send(self, request: object, meanwhile: Callable[[], object] = lambda: None) -> Any:
        """Send a goal to the first server; its handle gets ``ending`` and ``result``.

        Args:
            meanwhile: Called between its request and its acceptance.
        """
        handle = SimpleNamespace(request=request, ending='', result=None)
        handle.goal_id = SimpleNamespace(uuid=id(handle).to_bytes(16, 'big'))
        handle.is_cancel_requested = False
        handle.publish_feedback = handle._update_state = lambda _: None
        for name, ending in (('succeed', 'succeeded'), ('abort', 'aborted'), ('canceled',) * 2):
            setattr(handle, name, lambda ending=ending: setattr(handle, 'ending', ending))
        self.servers[0].receive(handle.goal_id.uuid)
        meanwhile()
        self.servers[0].begin(handle)
        return handle

    def cancel(self, handle: Any) -> None:
        """Cancel a goal as a client."""
        handle.is_cancel_requested = True
        self.servers[0].cancel(handle)


class Listener:
    """The listener without ROS, whose scenes are built when the test says so."""

    def __init__(self, *drives: Drives) -> None:
        self.drives = drives  # the drives of each arm
        self.errors: list[str] = []  # what was logged as an error
        self.warnings: list[str] = []  # what was warned of
        self.publishers = 0  # of scenes for controllers
        self.durability = LATCHED.durability  # of the publisher of another move_group
        # of get_planning_scene, to be given by the test; None where it is not offered
        self.answers: list[Future[Any]] | None = None
        logger = SimpleNamespace(
            error=lambda text, **_: self.errors.append(text),
            warning=lambda text, **_: self.warnings.append(text),
        )
        node: Any = SimpleNamespace(
            get_logger=lambda: logger,
            create_subscription=lambda *_, **__: None,
            create_timer=lambda *_: None,
            create_client=lambda *_: SimpleNamespace(
                service_is_ready=lambda: self.answers is not None, call_async=self._call
            ),
            count_publishers=lambda _topic: self.publishers,
            get_publishers_info_by_topic=lambda _topic: [
                SimpleNamespace(qos_profile=SimpleNamespace(durability=self.durability))
            ],
        )
        self._now = 0.0
        self._worker = SteppedWorker()
        gateways = [each.gateway for each in drives]
        # the listener
        self.made = SceneListener(node, gateways, worker=self._worker, clock=lambda: self._now)

    def _call(self, _: object) -> Future[Any]:
        assert self.answers is not None
        self.answers.append(Future())
        return self.answers[-1]

    def take(self, message: PlanningScene) -> None:
        """Deliver a message; nothing is built yet."""
        self.made._take(message)

    def run(self, seconds: float = 0.1) -> None:
        """Advance the time, and build what can be built."""
        self._now += seconds
        self.made._look()
        while self._worker.run():
            pass
        for each in self.drives:
            if each.attachments:
                each.run()


TIMEOUT = 30.0  # [s] of a test on a busy machine

Twist = tuple[str, tuple[float, ...]]


class ServoListener:
    """Listens like a servo node, in a domain of its own."""

    def __init__(self, client: RosClient, urdf: str, srdf: str) -> None:
        self.client = client  # the node behind it, whose name is servo_node
        node = client.node
        node.declare_parameter('robot_description', urdf)
        node.declare_parameter('robot_description_semantic', srdf)
        node.declare_parameter('moveit_servo.command_in_type', 'speed_units')
        node.declare_parameter('moveit_servo.scale.linear', 0.2)
        self.twists: list[TwistStamped] = []  # commands for the tool
        self.jogs: list[JointJog] = []  # commands for joints
        self.types: list[int] = []  # what the command type was switched to
        self.pauses: list[bool] = []  # what pause_servo was asked for
        node.create_subscription(TwistStamped, '~/delta_twist_cmds', self.twists.append, 10)
        node.create_subscription(JointJog, '~/delta_joint_cmds', self.jogs.append, 10)
        node.create_service(ServoCommandType, '~/switch_command_type', self._switch)
        node.create_service(SetBool, '~/pause_servo', self._pause)
        self._status = node.create_publisher(ServoStatus, '~/status', 10)

    def say(self, code: int, message: str) -> None:
        """Publish a status."""
        self._status.publish(ServoStatus(code=code, message=message))

    @property
    def received(self) -> list[Twist]:
        """Frame and numbers of each twist."""
        return [(each.header.frame_id, _numbers(each)) for each in self.twists]

    def _switch(self, request: Any, response: Any) -> Any:
        self.types.append(request.command_type)
        response.success = True
        return response

    def _pause(self, request: Any, response: Any) -> Any:
        self.pauses.append(request.data)
        response.success, response.message = True, 'done'
        return response


def _numbers(message: TwistStamped) -> tuple[float, ...]:
    linear, angular = message.twist.linear, message.twist.angular
    values = (linear.x, linear.y, linear.z, angular.x, angular.y, angular.z)
    return tuple(round(value, 6) for value in values)
