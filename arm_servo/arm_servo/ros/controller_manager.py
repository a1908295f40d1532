# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The part of controller_manager that MoveIt and rqt ask: which controllers, and switch them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from controller_manager_msgs.msg import ControllerState
from controller_manager_msgs.srv import ListControllers, SwitchController
from rclpy.node import Node

from arm_model import RobotModel
from node_runner import ParameterReader


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
    """A controller as the manager shows it."""

    name: str  # its name
    kind: str  # its type
    update_rate: int  # its rate in [Hz]
    set_active: Callable[[bool], None]  # called when it is switched
    # command interfaces that it claims while active
    interfaces: Sequence[str] = field(default_factory=tuple)
    active: bool = True  # whether it is

    def state(self) -> ControllerState:
        """Return it as a message."""
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
