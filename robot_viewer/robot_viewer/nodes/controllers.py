# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Trajectory controllers and grippers: what their joints do, and sending them to a target."""

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
NEAR = 0.01  # how near to its target in [rad] or [m] a joint has reached it
SETTLING_TIMEOUT = 1.0  # time in [s] after the end of a motion at which it is looked at

SILENCE = 1.2
"""Time in [s] without a trajectory before an empty one says that what follows is a new request: a
controller that was stopped in a stream wants a second."""


@dataclass(slots=True)
class Controller:
    """A controller that was found."""

    commands: Publisher  # where it takes trajectories
    joints: tuple[str, ...] = ()  # its joints, once it has named them
    positions: dict[str, float] = field(default_factory=dict)  # where they are in [rad] or [m]
    references: dict[str, float] = field(default_factory=dict)  # where the controller holds them
    wanted: tuple[Mapping[str, float], float] | None = None
    """Targets that were not sent yet, and the share of the greatest velocity."""
    targets: Mapping[str, float] = field(default_factory=dict)
    """Where the joints are on their way to; empty when they are not."""
    ends: float = -math.inf  # steady time at which they are there in [s]
    sent: float = -math.inf  # steady time of the last trajectory in [s]
    aimed: tuple[Mapping[str, float], float] | None = None
    """Targets whose button is held, and their share of the greatest velocity."""
    held_at: float = -math.inf  # steady time at which it was seen to be held in [s]
    lets_go: bool = False  # the robot was stopped, or did not follow, and nothing was sent since

    def end(self) -> None:
        """Send an empty trajectory, which ends what went before."""
        kind: Any = self.commands.msg_type
        self.commands.publish(kind())

    @property
    def busy(self) -> bool:
        """Whether its joints are on their way."""
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
        """Where joints stay that are not sent anywhere, or go on to.

        It is the reference, or each target elsewhere would move a joint on by its following error.
        A joint that is far from it is not held there: it stays where it is.
        """
        held = {
            name: self.references[name]
            for name, position in self.positions.items()
            if abs(self.references.get(name, math.inf) - position) < NEAR
        }
        return {**self.positions, **held, **self.targets}


class Controllers:
    """Those of the robot of a node; everything in the thread of the node.

    Commands are trajectories of one point, on the topic: a later one takes over from the one
    before, and a controller whose drives are not enabled follows none.
    """

    def __init__(
        self, node: Node, listening: Listening, report: Report, ended: Callable[[], None]
    ) -> None:
        """Find none yet; ``ended`` is called when all joints of a held button are done."""
        self._node, self._listening, self._report = node, listening, report
        self._ended = ended
        self.found: dict[str, Controller] = {}
        self.history = History()

    @property
    def busy(self) -> bool:
        """Whether joints are on their way, or about to be."""
        return any(each.busy or each.wanted for each in self.found.values())

    def look(self, description: str) -> None:
        """Find the controllers that there are."""
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
        """Send joints to targets, and no other joint, as long as this is called again.

        ``share`` is that of the greatest velocity, ``at`` when the button was seen to be held.
        """
        if time.monotonic() - at > RELEASED_AFTER:
            return  # this node was held up; the button may be let go
        for controller in self.found.values():
            own = {name: at for name, at in targets.items() if name in controller.joints}
            if own:
                controller.held_at = at
                if (own, share) != controller.aimed:
                    controller.wanted = controller.aimed = (own, share)

    def let_go(self) -> None:
        """Stop what is on its way to a target: its button was let go."""
        for controller in self.found.values():
            if controller.busy and not controller.arrived:
                controller.end()
                self._conclude(controller, 'target: let go, it stops', failed=False)
            controller.wanted = controller.aimed = None

    def stop(self) -> None:
        """Send nothing that was not sent yet, and wait for nothing: the robot was stopped."""
        for controller in self.found.values():
            controller.wanted = controller.aimed = None
            controller.targets, controller.lets_go = {}, True

    def advance(self, velocities: Mapping[str, float]) -> None:
        """Send what is wanted, and report what was reached."""
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
        if not self.busy:  # the joints of another controller go on
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
SINGLE_TYPE = 'control_msgs/action/GripperCommand_SendGoal'  # of grippers of one joint


@dataclass(frozen=True, slots=True)
class _Gripper:
    service: str
    client: GoalClient
    joint: str


class Grippers:
    """Those of the robot of a node; everything in the thread of the node."""

    def __init__(self, node: Node, report: Report) -> None:
        self._node, self._report = node, report
        self._found: dict[str, _Gripper] = {}
        self._calls: dict[str, ActionCall] = {}
        self._lost: list[ActionCall] = []  # the graph misses their servers; STOP cancels them, too
        self._ends: Mapping[str, tuple[float, float]] = {}

    @property
    def named(self) -> tuple[tuple[str, str], ...]:
        """Full names of their controllers, each with its joint."""
        return tuple((name, each.joint) for name, each in self._found.items())

    @property
    def busy(self) -> bool:
        """Whether one is opened or closed by the page."""
        return any(not call.ended for call in self._calls.values())

    def describe(self, tree: KinematicTree) -> None:
        """Use another robot."""
        self._ends = {joint.name: travel(joint) for joint in tree.movable()}
        for name in [n for n, each in self._found.items() if each.joint not in self._ends]:
            if call := self._calls.pop(name, None):
                call.cancel()
            self._found.pop(name).client.destroy()

    def look(
        self, services: Mapping[str, Sequence[str]], controllers: Mapping[str, Controller]
    ) -> None:
        """Find those of one joint; expect no result of a server that is gone."""
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
        """Move one to a position of its joint in [m] or [rad]."""
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
        """Cancel what is on its way."""
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
