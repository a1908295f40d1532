# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``ros2 run quad_hardware hardware_node``: ROS interface of a robot on its serial port."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Future
import math
import sys
import threading

from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.node import Node
from rclpy.qos import HistoryPolicy, QoSProfile, ReliabilityPolicy
from std_srvs.srv import SetBool

from message_templates import FastReader
from node_runner import (
    create_deferred_service,
    destroyed_when_refused,
    log_as,
    notify_ready,
    raise_thread_priority,
    run_program,
    settle_process_memory,
    spin,
)
from quad_msgs.msg import JointCommand

from ..exceptions import CommandError, HardwareError
from ..joints import NOMINAL_PERIOD
from ..link import LinkState
from ..serial_robot import LINK, SerialRobot
from .diagnostics import command_diagnostic
from .parameters import declare_parameters
from .robot_topics import log_link, RobotTopics, WARN_PERIOD

COMMAND_QOS = QoSProfile(
    reliability=ReliabilityPolicy.RELIABLE, history=HistoryPolicy.KEEP_LAST, depth=1
)
SWITCH_INTERVAL = 0.0005  # [s] how long one thread may keep another one from the interpreter


class HardwareNode(Node):
    """Publishes the robot's reports and sends it the commands on ``/joint_command``.

    The driver's thread publishes reports, so that nothing delays them; a callback checks commands
    and passes them to that thread.
    """

    @destroyed_when_refused
    def __init__(self) -> None:
        """Declare parameters, topics and the driver; :meth:`begin` opens the port.

        Raises:
            ParameterError: A parameter is misspelt or of the wrong type.
            HardwareError: Parameters or the URDF are invalid.
        """
        super().__init__('hardware_node')
        self._settings = settings = declare_parameters(self)
        self._robot = robot = SerialRobot(settings.robot)
        self._topics = RobotTopics(self, self._robot, settings.frames, settings.deviations)
        robot.on_state, robot.on_change = self._topics.publish, self._link_changed
        robot.on_refusal, robot.on_warning = self._report_refused, self._warn
        self._damage = ''
        self._reader = FastReader(JointCommand, 'position', 'velocity', 'effort')
        self.create_subscription(JointCommand, 'joint_command', self._take, COMMAND_QOS, raw=True)
        create_deferred_service(self, SetBool, '~/torque', self._set_torque)
        self._torque_off_requests: list[Future[SetBool.Response]] = []  # to be answered
        self.create_timer(settings.diagnostics_period, self._diagnose)
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        timeout = self._robot.timeout
        self._silence = self.create_timer(timeout, self._miss_commands, clock=steady)
        self._descent = self.create_timer(NOMINAL_PERIOD, self._go_down, clock=steady)
        self._torque_timer = self.create_timer(
            NOMINAL_PERIOD, self._check_torque_off, clock=steady
        )
        for timer in (self._silence, self._descent, self._torque_timer):
            timer.cancel()
        count, path = len(self._robot.names), settings.robot.link.path
        self.get_logger().info(f'{count} joints; looking for the robot on {path}')

    def begin(self) -> None:
        """Start looking for the robot."""
        priority = self._settings.thread_priority
        self._robot.start(lambda: raise_thread_priority(self, priority, 'the serial driver'))

    def end(self) -> None:
        """Close the port; the servos hold their last targets."""
        for future in self._torque_off_requests:
            future.cancel()
        self._robot.end(self.get_logger().error)

    def _report_refused(self, reason: str) -> None:
        self.get_logger().warning(f'report refused: {reason}', throttle_duration_sec=WARN_PERIOD)

    def _link_changed(self, state: LinkState, detail: str) -> None:
        """Log a change of the link; runs in the driver's thread."""
        if state is LinkState.RUNNING:
            notify_ready()
        log_link(self, state, detail)

    def _take(self, data: bytes) -> None:
        message, numbers = self._reader.read(data)
        positions = numbers[: len(message.position)]
        try:
            _check_rest(message, numbers[len(positions) :])
        except CommandError as error:
            self._robot.refuse(error)
            return
        if self._robot.command(positions):
            self._descent.cancel()
            self._silence.reset()

    def _miss_commands(self) -> None:
        """Bring the robot down if missing commands are a hazard, or log why not."""
        if self._robot.is_commanded:
            return  # a command came while the timer's event waited for the executor
        loss = self._robot.miss_commands()
        if loss is None:
            return  # the timer calls again
        self._silence.cancel()
        if loss:
            self.get_logger().error(loss)
            self._descent.reset()

    def _go_down(self) -> None:
        self._robot.go_down()
        if not self._robot.goes_down:
            self._descent.cancel()

    def _warn(self, reason: str) -> None:
        self.get_logger().warning(reason, throttle_duration_sec=WARN_PERIOD)

    def _set_torque(self, request: SetBool.Request) -> Future[SetBool.Response]:
        """Switch torque off, or on at the servos' present angles.

        Torque off is answered once later reports show whether the servos released.
        """
        on, future = bool(request.data), Future[SetBool.Response]()
        if not self._robot.set_torque(on=on):
            detail = self._robot.status().detail
            future.set_result(SetBool.Response(success=False, message=detail))
        elif on:
            self._answer_torque_off(False, 'torque was switched on again meanwhile')
            self.get_logger().info('the servos hold')
            future.set_result(SetBool.Response(success=True, message='the servos hold'))
        else:
            self._torque_off_requests.append(future)
            self._torque_timer.reset()
        return future

    def _check_torque_off(self) -> None:
        """Answer pending torque-off requests once reports show the result."""
        found = self._robot.check_torque_off()
        if found is not None:
            self._answer_torque_off(found.succeeded, found.value)

    def _answer_torque_off(self, success: bool, message: str) -> None:
        self._torque_timer.cancel()
        futures, self._torque_off_requests = self._torque_off_requests, []
        if futures:
            self.get_logger().info(f'torque off: {message}')
        for future in futures:
            future.set_result(SetBool.Response(success=success, message=message))

    def _diagnose(self) -> None:
        name, port = self.get_name(), self._settings.robot.link.path
        commands = command_diagnostic(name, port, self._robot.counters)
        self._topics.publish_diagnostics(name, port, self._recording, commands)
        before, self._damage = self._damage, self._topics.link.damage
        if self._damage and not before:
            self._robot.fault(LINK, self._damage)

    def _recording(self, subject: str) -> str:
        """Return the last black box file, or that of a subject; empty before one."""
        box = self._robot.black_box
        path = None if box is None else box.recording_of(subject) if subject else box.last
        return '' if path is None else str(path)


def _check_rest(message: JointCommand, rest: Sequence[float]) -> None:
    """Reject velocities and efforts of wrong length or with non-finite numbers."""
    for name, values in (('velocity', message.velocity), ('effort', message.effort)):
        if values and len(values) != len(message.position):
            raise CommandError(
                f'{len(values)} values of {name} for {len(message.position)} positions; '
                'leave them out or give one for each'
            )
    if not all(map(math.isfinite, rest)):
        raise CommandError('velocity or effort has a number that is not finite')


def main() -> int:
    """Run until Ctrl-C; return the exit code."""
    return run_program('hardware_node', _serve, HardwareError)


def _serve(stop: threading.Event) -> None:
    sys.setswitchinterval(SWITCH_INTERVAL)
    node = HardwareNode()
    log_as(node)
    settle_process_memory(node)
    node.begin()
    try:
        spin([node], stop)
    finally:
        node.end()
        node.destroy_node()


if __name__ == '__main__':
    sys.exit(main())
