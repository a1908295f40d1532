# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The services of controller_manager that MoveIt and rqt use, and joint_state_broadcaster.

The manager lists and switches controllers; the broadcaster publishes ``joint_states`` and
``dynamic_joint_states``.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
import time

from control_msgs.msg import DynamicJointState, InterfaceValue
from controller_manager_msgs.msg import ControllerState
from controller_manager_msgs.srv import ListControllers, SwitchController
import numpy as np
from rclpy.duration import Duration
from rclpy.node import Node
from sensor_msgs.msg import JointState
from urdf_reader import Mimic

from arm_model import RobotModel
from node_runner import ParameterReader
from robot_primitives import JointSample, JointStateStore

from ..core.gateway import CommandGateway
from ..core.requests import Snapshot
from .trajectory_goals import RATE_RANGE


def declare_manager(node: Node, model: RobotModel) -> tuple[str, bool]:
    """Declare the trajectory controller's name, and whether joint states are published."""
    read = ParameterReader(node)
    return (
        read.text(
            'controller_name', f'{model.group}_controller', 'name of the trajectory controller'
        ),
        read.flag(
            'publish_joint_states',
            'publish /joint_states and /dynamic_joint_states; only where the drives run here',
            default=True,
        ),
    )


@dataclass(slots=True)
class Controller:
    """A controller as listed by the manager."""

    name: str  # its name
    kind: str  # its type
    update_rate: int  # its rate in [Hz]
    set_active: Callable[[bool], None]  # called when it is switched
    # command interfaces that it claims while active
    interfaces: Sequence[str] = field(default_factory=tuple)
    active: bool = True  # whether it is

    def state(self) -> ControllerState:
        """Return the controller as a message."""
        return ControllerState(
            name=self.name,
            state='active' if self.active else 'inactive',
            type=self.kind,
            update_rate=self.update_rate,
            claimed_interfaces=list(self.interfaces) if self.active else [],
            required_command_interfaces=list(self.interfaces),
        )


class ControllerManager:
    """``~/list_controllers`` and ``~/switch_controller``."""

    def __init__(self, node: Node, controllers: Sequence[Controller]) -> None:
        self._node = node
        self._controllers = {controller.name: controller for controller in controllers}
        node.create_service(ListControllers, '~/list_controllers', self._list)
        node.create_service(SwitchController, '~/switch_controller', self._switch)

    def _list(
        self, _: ListControllers.Request, response: ListControllers.Response
    ) -> ListControllers.Response:
        response.controller = [each.state() for each in self._controllers.values()]
        return response

    def _switch(
        self, request: SwitchController.Request, response: SwitchController.Response
    ) -> SwitchController.Response:
        on, off = list(request.activate_controllers), list(request.deactivate_controllers)
        problems = [
            f'no controller {name!r}; choose one of {", ".join(self._controllers)}'
            for name in (*on, *off)
            if name not in self._controllers
        ]
        problems += [f'{name} is to be both active and inactive' for name in on if name in off]
        # not set, it is 0, which upstream takes for best effort
        strict = request.strictness not in {0, SwitchController.Request.BEST_EFFORT}
        response.message = '; '.join(problems)
        response.ok = not problems or not strict
        if not response.ok:
            return response
        for names, active in ((off, False), (on, True)):
            for name in names:
                if name in self._controllers and not (active and name in off):
                    self._set(self._controllers[name], active=active)
        return response

    def _set(self, controller: Controller, *, active: bool) -> None:
        if controller.active is active:
            return
        controller.active = active
        controller.set_active(active)
        word = 'active' if active else 'inactive'
        self._node.get_logger().info(f'{controller.name} is {word}')


MAX_AGE = 0.5
"""Age in [s] from which a measured value is not published: as long as a drive may be silent."""


class JointSamples(JointStateStore):
    """Measured values of the arm's joints, of other drives, and of mimic joints."""

    def __init__(self, joints: Sequence[str], mimics: Mapping[str, Mimic]) -> None:
        super().__init__()
        self._order, self._mimics = list(joints), mimics

    def fresh(self, snapshot: Snapshot, now: float) -> dict[str, JointSample]:
        """Return the measured values that have not expired, the arm's joints first."""
        fresh = {
            name: sample
            for name, sample in (self._of_the_arm(snapshot) | dict(self.samples())).items()
            if now - sample.time <= MAX_AGE
        }
        for name, mimic in self._mimics.items():
            if mimic.source in fresh and name not in fresh:
                source = fresh[mimic.source]
                velocity = mimic.velocity(source.velocity)
                fresh[name] = JointSample(mimic.position(source.position), velocity, source.time)
        return fresh

    def _of_the_arm(self, snapshot: Snapshot) -> dict[str, JointSample]:
        measured = snapshot.measured
        if measured is None:
            return {}
        ages = np.zeros(len(self._order)) if snapshot.ages is None else snapshot.ages
        rows = zip(
            self._order,
            measured.position.tolist(),
            measured.velocity.tolist(),
            (snapshot.time - ages).tolist(),
            strict=True,
        )
        return {name: JointSample(*row) for name, *row in rows}


def declare_broadcaster(node: Node) -> tuple[str, float, bool]:
    """Declare frame and rate [Hz] of the messages, and whether dynamic ones are published."""
    read = ParameterReader(node)
    return (
        read.text('frame_id', 'base_link', 'frame of the messages'),
        read.number('update_rate', 50.0, RATE_RANGE, 'rate of the messages [Hz]'),
        read.flag(
            'publish_dynamic_joint_states', 'publish /dynamic_joint_states too', default=True
        ),
    )


class JointStateBroadcaster:
    """Publishes the drives' measurements, stamped with the time of the oldest one."""

    def __init__(
        self,
        node: Node,
        gateway: CommandGateway,
        # drives that are no joints of the arm; they publish ``<drive>/joint_states``
        others: Sequence[str],
        mimics: Mapping[str, Mimic],  # joints that follow one that has a drive
        *,
        active: bool,
    ) -> None:
        self.active = active
        self._node, self._gateway = node, gateway
        self._frame, self.rate, self._is_dynamic = declare_broadcaster(node)
        self._samples = JointSamples(gateway.model.joints, mimics)
        self._states = node.create_publisher(JointState, 'joint_states', 10)
        self._dynamic = node.create_publisher(DynamicJointState, 'dynamic_joint_states', 10)
        for name in others:
            topic = f'{name}/joint_states'
            node.create_subscription(JointState, topic, self._receive, 10)
        node.create_timer(1.0 / self.rate, self._publish)

    def entry(self) -> Controller:
        """Return the broadcaster as the manager lists it."""
        kind = 'joint_state_broadcaster/JointStateBroadcaster'
        rate = round(self.rate)
        return Controller(self._node.get_name(), kind, rate, self.set_active, active=self.active)

    def set_active(self, active: bool) -> None:  # a callback of the manager
        """Start or stop publishing."""
        self.active = active

    def _receive(self, message: JointState) -> None:
        now = time.monotonic()
        self._samples.receive(message.name, message.position, message.velocity, now)

    def _publish(self) -> None:
        now = time.monotonic()
        samples = self._samples.fresh(self._gateway.snapshot, now)
        if not samples or not self.active:
            return
        rows = list(samples.values())
        message = JointState(
            name=list(samples),
            position=[row.position for row in rows],
            velocity=[row.velocity for row in rows],
        )
        age = Duration(nanoseconds=round((now - min(row.time for row in rows)) * 1e9))
        message.header.stamp = (self._node.get_clock().now() - age).to_msg()
        message.header.frame_id = self._frame
        self._states.publish(message)
        if self._is_dynamic and self._dynamic.get_subscription_count():
            values = [
                InterfaceValue(
                    interface_names=['position', 'velocity'], values=[row.position, row.velocity]
                )
                for row in rows
            ]
            dynamic = DynamicJointState(joint_names=list(samples), interface_values=values)
            dynamic.header = message.header
            self._dynamic.publish(dynamic)
