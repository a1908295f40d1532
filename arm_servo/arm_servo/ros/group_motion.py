# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The groups of a robot that are moved: the motion core of each, and the nodes that command it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar

from rclpy.node import Node

from arm_model import ModelError, RobotModel
from arm_model.ros import GroupModels, same_robot
from node_runner import ParameterReader

from ..core.gateway import CommandGateway
from ..core.requests import StopRequest
from ..core.set_point import Source
from ..core.settings import CoreSettings
from .controller_manager import Controller, trajectory_entry
from .gripper.controller import GripperController
from .gripper.parameters import declare_gripper
from .servo.node import Servo
from .servo.parameters import declare_servo, PREFIX, ServoParameters
from .trajectory.controller import TrajectoryController
from .trajectory.parameters import declare_check, declare_trajectory, TrajectoryParameters


@dataclass(frozen=True, slots=True)
class Offers:
    """What is offered for an arm; one of it at least."""

    jogging: bool = True  # servo_node
    trajectories: bool = True  # the trajectory controller


class Drives(Protocol):
    """The drives of a group under a core of their own."""

    @property
    def gateway(self) -> CommandGateway:
        """Commands to the core."""

    def prepare(self) -> bool:
        """Get back drives that were taken away, for the motion that follows.

        Returns:
            Whether there were any.
        """
        ...


AnyDrives = TypeVar('AnyDrives', bound=Drives)
MakeDrives = Callable[[Node, RobotModel, CoreSettings], AnyDrives]
"""Builds the core of a group over its drives; its first node may say how."""
MakeNode = Callable[[str], Node]  # makes the node of a name


class ArmMotion(Generic[AnyDrives]):
    """An arm: a trajectory controller and a servo, or one of both.

    Attributes:
        drives: Its drives.
        nodes: Its nodes.
    """

    def __init__(
        self,
        model: RobotModel,
        controller: Node | None,
        servo: Node | None,
        make_drives: MakeDrives[AnyDrives],
    ) -> None:
        """Offer what there are nodes for.

        Args:
            controller: Node of the trajectory controller; None for none.
            servo: Node of the servo, with the robot declared; None for none.

        Raises:
            ParameterError: A parameter is misspelt, of another kind or out of its range.
            ModelError: The parameters do not fit the arm.
        """
        self.nodes: Sequence[Node] = [node for node in (controller, servo) if node is not None]
        trajectory = (
            None
            if controller is None
            else declare_trajectory(controller, model.joints, model.limits)
        )
        jogging = None if servo is None else declare_servo(servo, model)
        check = trajectory.check if trajectory is not None else _check_of_servo(servo)
        self.drives = drives = make_drives(
            self.nodes[0], model, _settings(trajectory, jogging, check=check)
        )
        if servo is not None and jogging is not None:
            self._servo = Servo(servo, drives.gateway, jogging, drives.prepare)
        self._controller: TrajectoryController | None = None
        if controller is not None and trajectory is not None:
            self._controller = TrajectoryController(
                controller, drives.gateway, trajectory, drives.prepare
            )

    def entries(self, period: float) -> list[Controller]:
        """Return the trajectory controller, if there is one, as the manager shows it."""
        if self._controller is None:
            return []
        return [_entry(self.nodes[0], self.drives, period, self._controller.set_active)]


def _check_of_servo(servo: Node | None) -> bool:
    """Declare on a servo that is alone whether displacements are checked for collisions."""
    return servo is None or declare_check(ParameterReader(servo, PREFIX))


def _settings(
    trajectory: TrajectoryParameters | None, jogging: ServoParameters | None, *, check: bool
) -> CoreSettings:
    default = CoreSettings()
    return CoreSettings(
        default.servo if jogging is None else jogging.settings,
        default.execution if trajectory is None else trajectory.execution,
        default.timeout if jogging is None else jogging.timeout,
        default.clearance if jogging is None else jogging.clearance,
        check_self_collision=check,
    )


class ToolMotion(Generic[AnyDrives]):
    """An end effector: a gripper and a trajectory controller on one node.

    Its links may touch, as a gripper holds something, unless ``check_self_collision`` is set.

    Attributes:
        drives: Its drives.
        nodes: Its node.
        checks: Whether its motions are checked for collision.
    """

    def __init__(
        self, model: RobotModel, controller: Node, make_drives: MakeDrives[AnyDrives]
    ) -> None:
        """Offer both.

        Raises:
            ParameterError: A parameter is misspelt, of another kind or out of its range.
            ModelError: The core cannot move it.
        """
        trajectory = declare_trajectory(controller, model.joints, checks=False)
        gripper = declare_gripper(controller)
        settings = CoreSettings(
            execution=trajectory.execution, clearance=None, check_self_collision=trajectory.check
        )
        self.checks = trajectory.check
        self.nodes: Sequence[Node] = (controller,)
        self.drives = drives = make_drives(controller, model, settings)
        self._controller = TrajectoryController(
            controller, drives.gateway, trajectory, drives.prepare
        )
        self._gripper = GripperController(
            controller, drives.gateway, gripper, self._controller.check_active, drives.prepare
        )

    def entries(self, period: float) -> list[Controller]:
        """Return the controller as the manager shows it."""
        return [_entry(self.nodes[0], self.drives, period, self._set_active)]

    def _set_active(self, active: bool) -> None:  # a callback of the manager
        self._controller.set_active(active)
        if not active:
            stop = StopRequest('the controller was deactivated', (Source.TARGET,))
            self.drives.gateway.command(stop)


@dataclass(frozen=True, slots=True)
class RobotMotion(Generic[AnyDrives]):
    """The groups of a robot that are moved, each by itself."""

    arms: Sequence[ArmMotion[AnyDrives]]  # the arms, the main one first
    tools: Sequence[ToolMotion[AnyDrives]]  # the end effectors

    @classmethod
    def build(
        cls,
        models: GroupModels,
        main: str,
        make_node: MakeNode,
        offers: Offers,
        make_drives: MakeDrives[AnyDrives],
    ) -> RobotMotion[AnyDrives]:
        """Make the nodes and cores of all groups; nothing moves yet.

        Args:
            main: Name of the main arm's trajectory controller; that of another group is
                ``<group>_controller``.
            make_drives: Builds the cores.

        Raises:
            ParameterError: A parameter is misspelt, of another kind or out of its range.
            ModelError: The parameters do not fit a group, or two controllers have one name.
        """
        first, *others = models.arms
        names = [f'{model.group}_controller' for model in (*others, *models.tools)]
        if main in names:  # each goal would reach both
            raise ModelError(
                f'controller_name {main}: another group of this robot has a controller of that'
                ' name; choose another one, or let it be named after its group'
            )

        def arm(model: RobotModel, controller: str, servo: str) -> ArmMotion[AnyDrives]:
            trajectories = make_node(controller) if offers.trajectories else None
            jogging = make_node(servo) if offers.jogging else None
            if jogging is not None:
                same_robot(jogging, model)
            return ArmMotion(model, trajectories, jogging, make_drives)

        arms = [arm(first, main, 'servo_node')]
        arms += [
            arm(model, f'{model.group}_controller', f'{model.group}_servo_node')
            for model in others
        ]
        tools = [
            ToolMotion(model, make_node(f'{model.group}_controller'), make_drives)
            for model in models.tools
        ]
        return cls(arms, tools)

    @property
    def drives(self) -> list[AnyDrives]:
        """The drives of each group, the main arm's first."""
        return [group.drives for group in self._groups]

    @property
    def nodes(self) -> list[Node]:
        """The nodes of all groups."""
        return [node for group in self._groups for node in group.nodes]

    @property
    def checked(self) -> list[CommandGateway]:
        """Commands to the cores of the groups that are checked for collision."""
        tools = [tool.drives.gateway for tool in self.tools if tool.checks]
        return [*(arm.drives.gateway for arm in self.arms), *tools]

    @property
    def unchecked(self) -> list[CommandGateway]:
        """The same of the other groups, which the checked ones may meet."""
        return [tool.drives.gateway for tool in self.tools if not tool.checks]

    def entries(self, period: float) -> list[Controller]:
        """Return the controllers as the manager shows them."""
        return [entry for group in self._groups for entry in group.entries(period)]

    @property
    def _groups(self) -> Sequence[ArmMotion[AnyDrives] | ToolMotion[AnyDrives]]:
        return (*self.arms, *self.tools)


def _entry(
    node: Node, drives: Drives, period: float, set_active: Callable[[bool], None]
) -> Controller:
    joints = drives.gateway.model.joints
    return trajectory_entry(node.get_name(), joints, period, set_active)
