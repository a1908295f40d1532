# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Grippers of a robot, opened and closed by their actions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from typing import Any

from rclpy.node import Node
from urdf_reader import KinematicTree

from node_runner.action_goals import GoalClient

from ..page.robot_scene import travel
from .calls import ActionCall
from .controllers import Controller, Report

SEND_GOAL = '/_action/send_goal'
SINGLE_TYPE = 'control_msgs/action/GripperCommand_SendGoal'
"""Of grippers of one joint."""


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
                self._report(f'{name}: its action is gone; what it moved may go on: STOP', True)
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
            self._report(f'{what}: its action is not there', True)
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

    def _done(self, what: str, result: Any, why: str) -> None:  # noqa: ANN401
        if why:
            self._report(f'{what}: {why}', True)
            return
        arrived = bool(result.reached_goal)
        how = 'done' if arrived else 'stalled: it holds something' if result.stalled else 'ended'
        self._report(f'{what}: {how}, at {result.position:.4f}', not (arrived or result.stalled))
