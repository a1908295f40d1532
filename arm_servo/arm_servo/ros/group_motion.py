# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Motion cores of a robot's moving groups, and the nodes that command them.

The nodes refuse misspelt parameters. Two programs must not move one arm; the log reports an
error if they do.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from rclpy.node import Node

from arm_model import ModelError, RobotModel
from arm_model.ros import GroupModels, same_robot
from node_runner import ParameterReader, refuse_misspelt

from ..controllers.controller import Source
from ..core.gateway import CommandGateway
from ..core.preparation import CoreSettings
from .controller_manager import Controller
from .gripper import GripperController, GripperParameters
from .servo import Servo
from .servo_commands import declare_servo, PREFIX
from .trajectory import TrajectoryController
from .trajectory_goals import declare_check, declare_trajectory

TRAJECTORY_KIND = 'joint_trajectory_controller/JointTrajectoryController'


@dataclass(frozen=True, slots=True)
class Offers:
    """Interfaces to offer for an arm; at least one."""

    jogging: bool = True  # servo_node
    trajectories: bool = True  # the trajectory controller


MakeGateway = Callable[[Node, RobotModel, CoreSettings], CommandGateway]
"""Builds the core of a group for its drives; parameters of the given node may configure it."""

MakeNode = Callable[[str], Node]  # makes the node of a name


@dataclass(frozen=True, slots=True)
class MovedGroup:
    """A moving group of a robot, its core, and the nodes that command it."""

    nodes: Sequence[Node]
    gateway: CommandGateway  # commands to the core
    set_active: Callable[[bool], None] | None  # switches the trajectory controller, if any
    is_checked: bool = True  # whether the group is checked for collision

    def entries(self, period: float) -> list[Controller]:
        """Return the entry of the trajectory controller, if any, for MoveIt and rqt."""
        if self.set_active is None:
            return []
        interfaces = [f'{joint}/position' for joint in self.gateway.model.joints]
        rate = round(1.0 / period) if period else 0
        name = self.nodes[0].get_name()
        return [Controller(name, TRAJECTORY_KIND, rate, self.set_active, interfaces)]


def build_arm(
    model: RobotModel, controller: Node | None, servo: Node | None, make_gateway: MakeGateway
) -> MovedGroup:
    """Offer a trajectory controller, a servo, or both for an arm.

    Args:
        controller: Node of the trajectory controller; None for none.
        servo: Node of the servo, with the robot declared; None for none.

    Raises:
        ParameterError: A parameter is misspelt, of another kind or out of its range.
        ModelError: The parameters do not fit the arm.
    """
    nodes = [node for node in (controller, servo) if node is not None]
    trajectory = (
        None if controller is None else declare_trajectory(controller, model.joints, model.limits)
    )
    jogging = None if servo is None else declare_servo(servo, model)
    if trajectory is not None:
        check = trajectory.check
    else:  # of a servo that is alone: whether displacements are checked for collisions
        check = servo is None or declare_check(ParameterReader(servo, PREFIX))
    default = CoreSettings()
    settings = CoreSettings(
        default.servo if jogging is None else jogging.settings,
        default.execution if trajectory is None else trajectory.execution,
        default.clearance if jogging is None else jogging.clearance,
        check_self_collision=check,
    )
    gateway = make_gateway(nodes[0], model, settings)
    if servo is not None and jogging is not None:
        Servo(servo, gateway, jogging)
    if controller is None or trajectory is None:
        return MovedGroup(nodes, gateway, None)
    following = TrajectoryController(controller, gateway, trajectory)
    return MovedGroup(nodes, gateway, following.set_active)


def build_tool(model: RobotModel, node: Node, make_gateway: MakeGateway) -> MovedGroup:
    """Offer a gripper and a trajectory controller of an end effector on one node.

    Its links may touch, as when gripping, unless ``check_self_collision`` is set.

    Raises:
        ParameterError: A parameter is misspelt, of another kind or out of its range.
        ModelError: The core cannot move it.
    """
    trajectory = declare_trajectory(node, model.joints, checks=False)
    gripper = ParameterReader(node).settings(GripperParameters)
    settings = CoreSettings(
        execution=trajectory.execution, clearance=None, check_self_collision=trajectory.check
    )
    gateway = make_gateway(node, model, settings)
    controller = TrajectoryController(
        node, gateway, trajectory, (Source.TRAJECTORY, Source.TARGET)
    )
    GripperController(node, gateway, gripper, controller.check_active)
    return MovedGroup((node,), gateway, controller.set_active, is_checked=trajectory.check)


def build_groups(
    models: GroupModels, main: str, make_node: MakeNode, offers: Offers, make_gateway: MakeGateway
) -> list[MovedGroup]:
    """Create the nodes and cores of all groups, the main arm first, without moving.

    Args:
        main: Name of the main arm's trajectory controller; the other groups use
            ``<group>_controller``.

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

    def arm(model: RobotModel, controller: str, servo: str) -> MovedGroup:
        trajectories = make_node(controller) if offers.trajectories else None
        jogging = make_node(servo) if offers.jogging else None
        if jogging is not None:
            same_robot(jogging, model)
        return build_arm(model, trajectories, jogging, make_gateway)

    return [
        arm(first, main, 'servo_node'),
        *(arm(each, f'{each.group}_controller', f'{each.group}_servo_node') for each in others),
        *(
            build_tool(each, make_node(f'{each.group}_controller'), make_gateway)
            for each in models.tools
        ),
    ]


def by_check(groups: Sequence[MovedGroup]) -> tuple[list[CommandGateway], list[CommandGateway]]:
    """Return the gateways of the collision-checked groups, and of the other groups."""
    checked, others = (
        [each.gateway for each in groups if each.is_checked is wanted] for wanted in (True, False)
    )
    return checked, others


OF_OTHERS = (
    *('publish_robot_description', 'publish_robot_description_semantic'),
    *('robot_description_name', 'publish_dynamic_joint_states'),
    *(
        f'moveit_servo.{name}'
        for name in (
            *('check_octomap_collisions', 'command_out_topic', 'command_out_type', 'joint_topic'),
            *('publish_joint_accelerations', 'scene_collision_proximity_threshold'),
        )
    ),
)
"""Parameters that have no effect on some nodes, but resemble parameters that have."""

OF_PROGRAM = {'backend', 'jogging', 'trajectories'}  # read by motion_node before its nodes


def check_names(nodes: Sequence[Node]) -> None:
    """Refuse misspelt parameters of a program's nodes; log unknown parameters once.

    MoveIt and ros2_control configurations contain many unknown parameters, which do no harm.

    Raises:
        ParameterError: An unknown name resembles a declared one.
    """
    unknown = {name for node in nodes for name in refuse_misspelt(node, OF_OTHERS)} - OF_PROGRAM
    unused = [name for name in unknown if not any(node.has_parameter(name) for node in nodes)]
    if unused:
        names = ', '.join(sorted(unused))
        nodes[0].get_logger().info(f'parameters without effect here: {names}')


WATCH_PERIOD = 1.0  # time between two checks of the graph in [s]
OWN_SERVICE = 'pause'  # service that the trajectory controller of this package has, and no other


def watch_other_programs(nodes: Sequence[Node], outputs: Sequence[str] = ()) -> None:
    """Log an error whenever another program that moves the same arm appears."""
    known: set[str] = set()

    def look() -> None:
        conflicts = {*same_names(nodes)}.union(
            *(_around_output(nodes[0], output) for output in outputs)
        )
        for conflict in sorted(conflicts - known):
            nodes[0].get_logger().error(conflict)
        known.clear()
        known.update(conflicts)

    nodes[0].create_timer(WATCH_PERIOD, look)


def same_names(nodes: Sequence[Node]) -> list[str]:
    """Return a problem for each of these nodes whose name another node uses, too."""
    graph = [
        f'{namespace.rstrip("/")}/{name}'
        for name, namespace in nodes[0].get_node_names_and_namespaces()
    ]
    own = [node.get_fully_qualified_name() for node in nodes]
    return [
        f'another program has a node {name}, too: clients reach both, and both move the arm. End'
        ' one of them, or give one a namespace (-r __ns:=/NAME)'
        for name in own
        if graph.count(name) > own.count(name)
    ]


def _around_output(node: Node, output: str) -> list[str]:
    """Return problems with other publishers or with the subscribers of a set-point topic."""
    topic = node.resolve_topic_name(output)
    publishers = node.get_publishers_info_by_topic(topic)
    conflicts = []
    if len(publishers) > 1:
        names = sorted(
            {f'{info.node_namespace.rstrip("/")}/{info.node_name}' for info in publishers}
        )
        conflicts.append(
            f'{len(publishers)} publishers of set-points on {topic} ({", ".join(names)}): the arm'
            ' cannot follow both. End one of them'
        )
    services = {name for name, _ in node.get_service_names_and_types()}
    for info in node.get_subscriptions_info_by_topic(topic):
        receiver = f'{info.node_namespace.rstrip("/")}/{info.node_name}'
        if f'{receiver}/{OWN_SERVICE}' in services:
            conflicts.append(
                f'{receiver} takes the set-points on {topic}, and is a trajectory controller of'
                ' arm_servo: each of them would be a trajectory that comes to rest. Run'
                ' motion_node with backend:=topics in the place of both programs'
            )
    return conflicts
