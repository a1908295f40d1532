# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Services and homing action of an axis: commands, modes, homing with feedback, and scales."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Future
from dataclasses import dataclass, field
from functools import partial
import math
from pathlib import Path
import time
from typing import Any, TypeVar

from canopen_interfaces.srv import COTargetDouble
from std_msgs.msg import Float64

from arm_msgs.action import Home
from arm_msgs.srv import Move as MoveService
from arm_msgs.srv import ReadUnits
from canopen_core import DriveError
from canopen_core.standard import OperationMode
from node_runner.action_goals import Ending, GoalServer, ServedGoal

from ..cia402.axis import Axis
from ..cia402.commands import AxisCommands
from ..cia402.modes import Move
from ..cia402.sequences import HomingProgress
from ..config.model.drive import FactorGroup
from ..master.runner import NetworkThread
from ..master.scheduler import Promise
from .device_node import answer_message, answer_success, DeviceNode
from .joint_state_publisher import DriveJointStates
from .output_thread import OutputThread

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
    """Services of one axis, under ``~`` or, on a multi-axis device, under its channel name."""

    def __init__(
        self,
        node: DeviceNode,
        commands: AxisCommands,
        place: str,
        thread: NetworkThread,
        *,
        file: Path,
    ) -> None:
        """``place`` is the prefix of all names."""
        self._node = node
        self._commands = commands
        self._place = place
        self._thread = thread
        self._refusal = ''
        for name in commands.offered:
            self._offer(name, partial(commands.request, name))
        for name, mode in MODE_SERVICES.items():
            self._offer_mode(name, mode)
        node.offer(
            COTargetDouble,
            f'{place}/target',
            lambda request: self._deliver(lambda: commands.set_target(request.target)),
            partial(answer_success, node),
        )
        node.offer(MoveService, f'{place}/move', self._move, answer_message)
        node.create_subscription(Float64, f'{place}/target', self._stream, 10)
        node.offer(
            ReadUnits,
            f'{place}/read_units',
            lambda request: thread.run_coroutine(commands.axis.view.cache.factor_group),
            partial(answer_units, commands.axis, file),
        )
        self._home = HomeAction(node, commands, f'{place}/home', thread, node.output)

    def _offer(self, name: str, request: Callable[[], Promise[str]]) -> None:
        run = self._admitted(request)
        self._node.offer_trigger(f'{self._place}/{name}', lambda: self._thread.run(run))

    def _offer_mode(self, name: str, mode: OperationMode) -> None:
        commands = self._commands
        self._offer(name, lambda: commands.run(name, commands.select_mode(mode)))

    def _admitted(self, command: Callable[[], T]) -> Callable[[], T]:
        """Wrap a command so that the cycle thread checks ``admit`` once more before it."""

        def run() -> T:
            self._node.admit()
            return command()

        return run

    def _move(self, request: MoveService.Request) -> Future[str]:
        move = Move(
            request.target,
            relative=request.relative,
            immediate=not request.queue,
            blend=request.blend,
        )
        return self._deliver(lambda: self._commands.move(move))

    def _stream(self, message: Float64) -> None:
        stream = self._admitted(lambda: self._commands.stream_target(message.data))
        self._thread.call(stream).add_done_callback(self._note_refusal)

    def _note_refusal(self, future: Future[None]) -> None:
        """Log why a stream is refused; log again only when the reason changes."""
        error = future.exception()
        reason = '' if error is None else str(error)
        if reason and reason != self._refusal:
            self._node.output.post(
                lambda: self._node.get_logger().warning(f'{self._place}/target: {reason}')
            )
        self._refusal = reason

    def _deliver(self, command: Callable[[], str]) -> Future[str]:
        return self._thread.run(self._admitted(lambda: self._commands.deliver(command)))


FEEDBACK_PERIOD = 0.1  # [s]


@dataclass(slots=True, eq=False)
class _Homing(ServedGoal):
    """State of one homing goal, from its request to its result."""

    stop_count: Future[int]  # at its request
    phase: str = HomingProgress.ENABLING.value
    begin: float = field(default_factory=time.monotonic)
    timer: Any = None
    task: Promise[str] | None = None
    result: Any = None


class HomeAction:
    """Action ``~/home`` of one axis; a goal ends when the network thread has homed the axis."""

    def __init__(
        self,
        node: DeviceNode,
        commands: AxisCommands,
        name: str,
        thread: NetworkThread,
        output: OutputThread,
    ) -> None:
        """Create the action server; arguments as for :class:`AxisServices`."""
        self._node = node
        self._commands = commands
        self._thread = thread
        self._output = output
        self._server = GoalServer(
            node,
            Home,
            name,
            accept=lambda: _Homing(thread.call(lambda: commands.stop_count)),
            start=self._start,
            conclude=self._conclude,
            cancel=self._cancel,
            fail=self._fail,
        )

    def _start(self, homing: _Homing) -> None:
        # made and destroyed in the executor only: it may be about to run the timer
        homing.timer = self._node.create_timer(
            FEEDBACK_PERIOD, partial(self._publish_feedback, homing)
        )

        def notify(progress: HomingProgress) -> None:
            homing.phase = progress.value

        def run() -> Promise[str]:
            self._node.admit()
            if homing.stop_count.result() != self._commands.stop_count:
                raise DriveError(f'{self._commands.axis.name} was stopped before it was homed')
            method = homing.handle.request.method or None
            homing.task = self._commands.run('home', self._commands.home(method, notify))
            return homing.task

        def finished(future: Future[str]) -> None:
            self._output.post(partial(self._finish, homing, future))

        self._thread.run(run).add_done_callback(finished)

    def _cancel(self, homing: _Homing) -> None:
        def cancel() -> None:
            # only its own command; another one may run by now
            if homing.task is not None and not homing.task.done:
                self._commands.cancel('homing was cancelled')

        self._thread.call(cancel)

    def _publish_feedback(self, homing: _Homing) -> None:
        if not homing.has_ended:
            elapsed = time.monotonic() - homing.begin
            homing.handle.publish_feedback(
                Home.Feedback(phase=homing.phase, position=self._position(), elapsed=elapsed)
            )

    def _position(self) -> float:
        view = self._commands.axis.view
        return view.position if view.fresh else math.nan

    def _finish(self, homing: _Homing, future: Future[str]) -> None:
        error = future.exception()
        homing.result = Home.Result(
            success=error is None,
            message=future.result() if error is None else str(error),
            position=self._position(),
        )
        self._server.end(homing)

    def _conclude(self, homing: _Homing) -> tuple[Ending, Home.Result]:
        self._node.destroy_timer(homing.timer)
        ending = Ending.SUCCEEDED if homing.result.success else Ending.CANCELED
        return ending, homing.result

    def _fail(self, homing: _Homing, error: Exception) -> Home.Result:
        if homing.timer is not None:
            self._node.destroy_timer(homing.timer)
        message = f'{type(error).__name__}: {error}'
        return Home.Result(success=False, message=message, position=math.nan)


KEYS = (
    'scale_from_factor_group',
    'scale_pos_to_dev',
    'scale_pos_from_dev',
    'scale_vel_to_dev',
    'scale_vel_from_dev',
    'scale_eff_to_dev',
    'scale_eff_from_dev',
    'offset_pos_from_dev',
)
"""Keys of bus.yml; the fields of the response have the same names."""


def answer_units(
    drive: Axis, file: Path, response: ReadUnits.Response, future: Future[FactorGroup]
) -> ReadUnits.Response:
    """Fill in the scales of an axis, from the drive and from bus.yml."""
    error = future.exception()
    if error is not None:
        response.message = str(error)
        return response
    factors, config = future.result(), drive.node.config
    response.gear = factors.gear or 0.0
    response.factor_scale = factors.position_scale
    for key in KEYS:
        setattr(response, key, getattr(drive.view.units.config, key))
    response.bus_config = str(file)
    response.device = config.name
    response.channel = drive.config.channel if len(config.axes) > 1 else -1
    response.success = True  # last: an answer of which one part fails is sent, too
    return response


def offer_drive(
    node: DeviceNode, axes: Sequence[AxisCommands], thread: NetworkThread, file: Path
) -> DriveJointStates:
    """Create the services and topics of all axes of a drive; return its joint states."""
    for commands in axes:
        place = '~' if len(axes) == 1 else commands.axis.name
        AxisServices(node, commands, place, thread, file=file)
    return DriveJointStates(node, [commands.axis.view for commands in axes])
