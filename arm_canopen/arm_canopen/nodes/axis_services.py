# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Services, topic and action by which one axis of a drive is commanded."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Future
from functools import partial
from typing import TypeVar

from canopen_interfaces.srv import COTargetDouble
from std_msgs.msg import Float64

from arm_msgs.srv import Move as MoveService
from canopen_core.standard import OperationMode

from ..cia402.commands import AxisCommands
from ..cia402.modes import Move
from ..master.runner import NetworkThread
from ..master.scheduler import Promise
from .device_node import DeviceNode
from .home_action import HomeAction
from .joint_states import DriveJointStates
from .units_service import BusFile, UnitsService

T = TypeVar('T')

MODE_SERVICES: dict[str, OperationMode] = {
    'position_mode': OperationMode.PROFILE_POSITION,
    'vl_velocity_mode': OperationMode.VELOCITY,
    'velocity_mode': OperationMode.PROFILE_VELOCITY,
    'torque_mode': OperationMode.PROFILE_TORQUE,
    'interpolated_position_mode': OperationMode.INTERPOLATED_POSITION,
    'cyclic_position_mode': OperationMode.CYCLIC_POSITION,
    'cyclic_velocity_mode': OperationMode.CYCLIC_VELOCITY,
    'cyclic_torque_mode': OperationMode.CYCLIC_TORQUE,
}
"""Services and the modes that they select; ros2_canopen has all but the second."""


class AxisServices:
    """What one axis offers, below ``~`` or, of several axes, below the name of its channel."""

    def __init__(
        self,
        node: DeviceNode,
        commands: AxisCommands,
        place: str,
        thread: NetworkThread,
    ) -> None:
        """``place`` is what the names begin with."""
        self._node = node
        self._commands = commands
        self._place = place
        self._thread = thread
        self._refusal = ''
        for name in commands.offered:
            self._offer(name, partial(commands.request, name))
        for name, mode in MODE_SERVICES.items():
            self._offer_mode(name, mode)
        node.offer(COTargetDouble, f'{place}/target', self._set_target, self._answer_target)
        node.offer(MoveService, f'{place}/move', self._move, self._answer_move)
        node.create_subscription(Float64, f'{place}/target', self._stream, 10)
        self._home = HomeAction(node, commands, f'{place}/home', thread, node.output)

    def _offer(self, name: str, request: Callable[[], Promise[str]]) -> None:
        run = self._admitted(request)
        self._node.offer_trigger(f'{self._place}/{name}', lambda: self._thread.run(run))

    def _offer_mode(self, name: str, mode: OperationMode) -> None:
        commands = self._commands
        self._offer(name, lambda: commands.run(name, commands.select_mode(mode)))

    def _admitted(self, command: Callable[[], T]) -> Callable[[], T]:
        """Return the command with ``admit`` checked once more, in the thread of the cycle."""

        def run() -> T:
            self._node.admit()
            return command()

        return run

    def _set_target(self, request: COTargetDouble.Request) -> Future[str]:
        return self._deliver(lambda: self._commands.set_target(request.target))

    def _answer_target(
        self, response: COTargetDouble.Response, future: Future[str]
    ) -> COTargetDouble.Response:
        error = future.exception()
        response.success = error is None
        if error is not None:
            self._node.get_logger().warning(f'target: {error}')
        return response

    def _move(self, request: MoveService.Request) -> Future[str]:
        move = Move(
            request.target,
            relative=request.relative,
            immediate=not request.queue,
            blend=request.blend,
        )
        return self._deliver(lambda: self._commands.move(move))

    def _answer_move(
        self, response: MoveService.Response, future: Future[str]
    ) -> MoveService.Response:
        error = future.exception()
        response.success = error is None
        response.message = future.result() if error is None else str(error)
        return response

    def _stream(self, message: Float64) -> None:
        stream = self._admitted(lambda: self._commands.stream_target(message.data))
        self._thread.call(stream).add_done_callback(self._note_refusal)

    def _note_refusal(self, future: Future[None]) -> None:
        """Log why a stream is refused, once until the reason changes."""
        error = future.exception()
        reason = '' if error is None else str(error)
        if reason and reason != self._refusal:
            self._node.output.post(
                lambda: self._node.get_logger().warning(f'{self._place}/target: {reason}')
            )
        self._refusal = reason

    def _deliver(self, command: Callable[[], str]) -> Future[str]:
        return self._thread.run(self._admitted(lambda: self._commands.deliver(command)))


def offer_drive(
    node: DeviceNode, axes: Sequence[AxisCommands], thread: NetworkThread, file: BusFile
) -> DriveJointStates:
    """Offer services and topics of a drive with one axis or several; return its joint states."""
    for commands in axes:
        place = '~' if len(axes) == 1 else commands.axis.name
        AxisServices(node, commands, place, thread)
        UnitsService(node, commands.axis, place, thread, file)
    return DriveJointStates(node, [commands.axis.view for commands in axes])
