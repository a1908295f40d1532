# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Trajectory controllers and grippers: monitor their joints and send them to targets."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from importlib import import_module
import math
import time
from typing import Any

from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile
from urdf_reader import KinematicTree

from node_runner.action_goals import GoalClient

from ..page.jog_panel import History, motion_time
from ..page.live import RELEASED_AFTER
from ..page.robot_scene import travel
from .interfaces import ActionCall, of_robot, Report
from .listening import Listening

STATE_TYPE = 'control_msgs/msg/JointTrajectoryControllerState'
STATE = '/controller_state'
COMMAND = '/joint_trajectory'
NEAR = 0.01  # distance in [rad] or [m] within which a joint has reached its target
SETTLING_TIMEOUT = 1.0  # time in [s] after a motion within which joints must arrive

SILENCE = 1.2
"""Pause in [s] before an empty trajectory marks the next one as a new request: a controller that
was stopped during a stream requires one second."""


@dataclass(slots=True)
class Controller:
    """State of one trajectory controller."""

    commands: Publisher  # its trajectory topic
    joints: tuple[str, ...] = ()  # empty before its first state message
    positions: dict[str, float] = field(default_factory=dict)  # measured, in [rad] or [m]
    references: dict[str, float] = field(default_factory=dict)  # set-points of the controller
    wanted: tuple[Mapping[str, float], float] | None = None
    """Pending targets, and the speed as a fraction of maximum velocity."""
    targets: Mapping[str, float] = field(default_factory=dict)
    """Targets of the current motion; empty without one."""
    ends: float = -math.inf  # steady time in [s] at which the motion ends
    sent: float = -math.inf  # steady time of the last trajectory in [s]
    aimed: tuple[Mapping[str, float], float] | None = None
    """Targets whose button is held, and their fraction of maximum velocity."""
    held_at: float = -math.inf  # steady time in [s] of the button's last heartbeat
    lets_go: bool = False  # stopped, or did not follow, and nothing sent since

    def end(self) -> None:
        """Send an empty trajectory, which ends the current one."""
        kind: Any = self.commands.msg_type
        self.commands.publish(kind())

    @property
    def busy(self) -> bool:
        """Whether its joints are moving to a target."""
        return bool(self.targets)

    @property
    def arrived(self) -> bool:
        """Whether its joints are at their targets."""
        return all(
            abs(self.positions.get(name, math.inf) - target) < NEAR
            for name, target in self.targets.items()
        )

    @property
    def places(self) -> dict[str, float]:
        """Positions for joints without a new target, by name.

        These are current targets, else set-points: measured positions would shift a joint by its
        following error. A joint far from its set-point keeps its measured position.
        """
        held = {
            name: self.references[name]
            for name, position in self.positions.items()
            if abs(self.references.get(name, math.inf) - position) < NEAR
        }
        return {**self.positions, **held, **self.targets}


class Controllers:
    """Trajectory controllers of the node's robot. Call in the node's thread.

    Commands are one-point trajectories on the topic: each replaces the previous one. A
    controller whose drives are disabled follows none.
    """

    def __init__(
        self, node: Node, listening: Listening, report: Report, ended: Callable[[], None]
    ) -> None:
        """Start empty; ``ended`` is called when all joints of a held button have arrived."""
        self._node, self._listening, self._report = node, listening, report
        self._ended = ended
        self.found: dict[str, Controller] = {}
        self.history = History()

    @property
    def busy(self) -> bool:
        """Whether joints are moving, or have pending targets."""
        return any(each.busy or each.wanted for each in self.found.values())

    def look(self, description: str) -> None:
        """Discover the robot's controllers in the ROS graph."""
        topics = dict(self._node.get_topic_names_and_types())
        named = [
            name.removesuffix(STATE)
            for name, kinds in topics.items()
            if STATE_TYPE in kinds and name.endswith(STATE)
        ]
        for name in of_robot(description, topics, named):
            if name not in self.found:
                self.found[name] = self._follow(name)

    def _follow(self, name: str) -> Controller:
        command = import_module('trajectory_msgs.msg').JointTrajectory
        state = import_module('control_msgs.msg').JointTrajectoryControllerState
        publisher = self._node.create_publisher(command, f'{name}{COMMAND}', QoSProfile(depth=2))
        controller = Controller(publisher)
        take = partial(self._take, controller)
        self._listening.add(state, f'{name}{STATE}', take)
        return controller

    def _take(self, controller: Controller, message: Any) -> None:  # noqa: ANN401
        controller.joints = tuple(message.joint_names)
        positions = dict(zip(controller.joints, message.feedback.positions, strict=False))
        targets = dict(zip(controller.joints, message.reference.positions, strict=False))
        controller.positions, controller.references = positions, targets
        self.history.add(targets, positions, time.monotonic())

    def aim(self, targets: Mapping[str, float], share: float, at: float) -> None:
        """Move only these joints to targets, as long as this is called repeatedly.

        ``share`` is the fraction of maximum velocity, ``at`` the heartbeat's steady time [s].
        """
        if time.monotonic() - at > RELEASED_AFTER:
            return  # this node was delayed; the button may be released
        for controller in self.found.values():
            own = {name: at for name, at in targets.items() if name in controller.joints}
            if own:
                controller.held_at = at
                if (own, share) != controller.aimed:
                    controller.wanted = controller.aimed = (own, share)

    def let_go(self) -> None:
        """Stop motions to targets after their button was released."""
        for controller in self.found.values():
            if controller.busy and not controller.arrived:
                controller.end()
                self._conclude(controller, 'target: let go, it stops', failed=False)
            controller.wanted = controller.aimed = None

    def stop(self) -> None:
        """Drop all pending and current targets after the robot was stopped."""
        for controller in self.found.values():
            controller.wanted = controller.aimed = None
            controller.targets, controller.lets_go = {}, True

    def advance(self, velocities: Mapping[str, float]) -> None:
        """Send pending targets, and report finished motions."""
        now = time.monotonic()
        if any(each.aimed and now - each.held_at > RELEASED_AFTER for each in self.found.values()):
            self.let_go()
        for controller in self.found.values():
            if controller.wanted is not None and controller.lets_go:
                if now - controller.sent > SILENCE:
                    controller.end()
                    controller.lets_go = False
            elif controller.wanted is not None and controller.positions:
                (targets, share), controller.wanted = controller.wanted, None
                controller.targets = {**controller.places, **targets}
                duration = motion_time(controller.positions, controller.targets, velocities, share)
                controller.ends = now + duration
                controller.sent = now
                controller.commands.publish(_trajectory(controller, duration))
            elif controller.busy and controller.arrived:
                self._conclude(controller, 'target: reached', failed=False)
                self._end_press()
            elif controller.busy and now > controller.ends + SETTLING_TIMEOUT:
                why = 'target: not reached; are the drives enabled? /rosout has the reason'
                self._conclude(controller, why, failed=True)
                controller.lets_go = True
                self._end_press()

    def _end_press(self) -> None:
        if not self.busy:  # unless joints of another controller are moving
            self._ended()

    def _conclude(self, controller: Controller, text: str, *, failed: bool) -> None:
        controller.targets = {}
        self._report(text, failed=failed)


def _trajectory(controller: Controller, duration: float) -> Any:  # noqa: ANN401
    messages = import_module('trajectory_msgs.msg')
    positions = [controller.targets[joint] for joint in controller.joints]
    rest = [0.0] * len(positions)
    point = messages.JointTrajectoryPoint(positions=positions, velocities=rest, accelerations=rest)
    seconds, nanoseconds = divmod(round(duration * 1e9), 10**9)
    point.time_from_start.sec, point.time_from_start.nanosec = seconds, nanoseconds
    return messages.JointTrajectory(joint_names=list(controller.joints), points=[point])


SEND_GOAL = '/_action/send_goal'
SINGLE_TYPE = 'control_msgs/action/GripperCommand_SendGoal'  # for grippers with one joint


@dataclass(frozen=True, slots=True)
class _Gripper:
    service: str
    client: GoalClient
    joint: str


class Grippers:
    """Grippers of the node's robot. Call in the node's thread."""

    def __init__(self, node: Node, report: Report) -> None:
        self._node, self._report = node, report
        self._found: dict[str, _Gripper] = {}
        self._calls: dict[str, ActionCall] = {}
        self._lost: list[ActionCall] = []  # servers left the graph; STOP cancels them, too
        self._ends: Mapping[str, tuple[float, float]] = {}

    @property
    def named(self) -> tuple[tuple[str, str], ...]:
        """Pairs of full controller name and joint."""
        return tuple((name, each.joint) for name, each in self._found.items())

    @property
    def busy(self) -> bool:
        """Whether the page is moving a gripper."""
        return any(not call.ended for call in self._calls.values())

    def describe(self, tree: KinematicTree) -> None:
        """Switch to another robot."""
        self._ends = {joint.name: travel(joint) for joint in tree.movable()}
        for name in [n for n, each in self._found.items() if each.joint not in self._ends]:
            if call := self._calls.pop(name, None):
                call.cancel()
            self._found.pop(name).client.destroy()

    def look(
        self, services: Mapping[str, Sequence[str]], controllers: Mapping[str, Controller]
    ) -> None:
        """Discover one-joint grippers; await no result from a server that is gone."""
        for name, gripper in self._found.items():
            call = self._calls.get(name)
            if gripper.service not in services and call is not None and not call.ended:
                self._lost.append(self._calls.pop(name))
                self._report(
                    f'{name}: its action is gone; what it moved may go on: STOP', failed=True
                )
        for service, kinds in services.items():
            action = service.removesuffix(SEND_GOAL)
            name = action.rpartition('/')[0]
            controller = controllers.get(name)
            if (
                SINGLE_TYPE in kinds
                and name not in self._found
                and controller is not None
                and len(controller.joints) == 1
                and controller.joints[0] in self._ends
            ):
                kind = import_module('control_msgs.action').GripperCommand
                client = GoalClient(self._node, kind, action)
                self._found[name] = _Gripper(service, client, controller.joints[0])

    def grip(self, name: str, position: float) -> None:
        """Move a gripper to a joint position in [m] or [rad]."""
        gripper = self._found.get(name)
        ends = (0.0, 0.0) if gripper is None else self._ends[gripper.joint]
        words = {ends[0]: 'close', ends[1]: 'open'}
        what = f'{name}: {words.get(position, f"to {position:.4f}")}'
        if gripper is None or not gripper.client.server_is_ready():
            self._report(f'{what}: its action is not there', failed=True)
            return
        goal = import_module('control_msgs.action').GripperCommand.Goal()
        goal.command.position = position
        self._calls[name] = ActionCall(gripper.client, goal, partial(self._done, what))

    def stop(self) -> None:
        """Cancel all running goals."""
        for call in (*self._calls.values(), *self._lost):
            call.cancel()
        self._calls.clear()
        self._lost.clear()

    def _done(self, what: str, _call: ActionCall, result: Any, why: str) -> None:  # noqa: ANN401
        if why:
            self._report(f'{what}: {why}', failed=True)
            return
        arrived = bool(result.reached_goal)
        how = 'done' if arrived else 'stalled: it holds something' if result.stalled else 'ended'
        self._report(
            f'{what}: {how}, at {result.position:.4f}', failed=not (arrived or result.stalled)
        )
