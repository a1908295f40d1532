# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``ros2 run quad_hardware hardware_node``: the robot on its serial port as ROS topics."""

from __future__ import annotations

from collections.abc import Sequence
import gc
import math
import sys
import threading
import time

from diagnostic_msgs.msg import DiagnosticArray
from nav_msgs.msg import Odometry
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.node import Node
from rclpy.qos import HistoryPolicy, QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import BatteryState, Imu, JointState
from std_srvs.srv import SetBool
from tf2_msgs.msg import TFMessage

from node_runner import destroyed_when_refused, run_program, spin
from node_runner.wire import Reader, Stream
from quad_msgs.msg import JointCommand

from ..estimation import Estimate, Estimator, OdometryState
from ..estimation.gravity import tilt_of
from ..exceptions import CommandError, HardwareError
from ..joints import Command, CommandLimiter, CommandLoss
from ..joints.command import NOMINAL_PERIOD
from ..link import Driver, LinkState, RobotState, STALE_TIME
from . import messages
from .diagnostics import (
    command_diagnostic,
    CommandCounters,
    LinkDiagnostic,
    robot_diagnostic,
)
from .parameters import declare_parameters

COMMAND_QOS = QoSProfile(
    reliability=ReliabilityPolicy.RELIABLE, history=HistoryPolicy.KEEP_LAST, depth=1
)
SENSOR_DEPTH = 10  # reliable, which best-effort subscribers can hear as well
SWITCH_INTERVAL = 0.0005  # [s] how long one thread may keep another one from the interpreter
WARN_PERIOD = 2.0  # [s] between two warnings of the same kind


class HardwareNode(Node):
    """Publishes what the robot reports, and sends it what ``/joint_command`` asks for.

    Reports are published in the driver's thread, so that nothing delays them; commands are
    checked in a callback and handed to that thread.
    """

    @destroyed_when_refused
    def __init__(self) -> None:
        """Declare parameters, topics and the driver; :meth:`begin` opens the port.

        Raises:
            ParameterError: A parameter is misspelt or of the wrong kind.
            HardwareError: Parameters or the URDF do not make sense.
        """
        super().__init__('hardware_node')
        self._settings = settings = declare_parameters(self)
        self._joints = settings.joints
        self._limiter = CommandLimiter(settings.joints, settings.limiter)
        self._loss = CommandLoss(settings.joints, settings.command_loss)
        self._estimator = Estimator(settings.urdf, settings.joints, settings.estimator)
        self._driver = Driver(settings.link, self._report, self._link_changed)
        self._latest: tuple[RobotState, Estimate] | None = None  # while the link is running
        self._counters = CommandCounters()
        self._last_targets: tuple[float, ...] = ()
        self._limp = False
        self._joint_states = Stream(
            self.create_publisher(JointState, 'joint_states', SENSOR_DEPTH)
        )
        self._imu = Stream(self.create_publisher(Imu, 'imu', SENSOR_DEPTH))
        self._odom = Stream(self.create_publisher(Odometry, 'odom', SENSOR_DEPTH))
        self._battery = self.create_publisher(BatteryState, 'battery_state', SENSOR_DEPTH)
        self._tf = Stream(self.create_publisher(TFMessage, '/tf', 100))
        self._link = LinkDiagnostic()
        self._diagnostics = self.create_publisher(DiagnosticArray, 'diagnostics', SENSOR_DEPTH)
        self._reader = Reader(JointCommand, 'position', 'velocity', 'effort')
        self.create_subscription(JointCommand, 'joint_command', self._take, COMMAND_QOS, raw=True)
        self.create_service(SetBool, '~/torque', self._set_torque)
        self.create_timer(settings.diagnostics_period, self._diagnose)
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self._silence = self.create_timer(self._loss.timeout, self._miss_commands, clock=steady)
        self._descent = self.create_timer(NOMINAL_PERIOD, self._go_down, clock=steady)
        for timer in (self._silence, self._descent):
            timer.cancel()
        count = len(self._joints.names)
        self.get_logger().info(f'{count} joints; looking for the robot on {settings.link.path}')

    def begin(self) -> None:
        """Start looking for the robot."""
        self._driver.start()

    def end(self) -> None:
        """Close the port; the servos hold their last target, at rest."""
        if self._loss.in_motion:
            self._miss_commands()
        while self._loss.goes_down:
            self._go_down()
            time.sleep(NOMINAL_PERIOD)
        self._driver.stop()

    def _report(self, state: RobotState) -> str:
        """Publish a report; return why it cannot be. Runs in the thread of the driver."""
        estimate = self._estimator.update(state)
        if estimate is None:
            self.get_logger().warning(
                f'report refused: {self._estimator.refusal}',
                throttle_duration_sec=WARN_PERIOD,
            )
            return self._estimator.refusal
        self._latest = state, estimate
        settings, stamp = self._settings, self._stamp(estimate.time)
        # what a controller waits for comes first
        self._joint_states.publish(
            messages.JointStates(tuple(estimate.positions)),
            self._stamp(estimate.joints_time),
            messages.joint_numbers(estimate),
        )
        way = self._estimator.walk(estimate)
        if estimate.attitude is None or way is None:
            self.get_logger().error(
                f'no /imu, /odom and transforms: {self._estimator.health().imu_problem}; the '
                'joints are published, and the robot can lie down',
                throttle_duration_sec=WARN_PERIOD,
            )
            return ''
        self._imu.publish(
            messages.imu_form(estimate, settings.deviations, settings.frames.imu),
            stamp,
            messages.imu_numbers(estimate, estimate.attitude),
        )
        self._publish_odometry(estimate, way, stamp)
        return ''

    def _publish_odometry(self, estimate: Estimate, way: OdometryState, stamp: int) -> None:
        """Publish where the body is."""
        deviations, frames = self._settings.deviations, self._settings.frames
        self._odom.publish(
            messages.odometry_form(estimate, deviations, frames),
            stamp,
            messages.odometry_numbers(estimate, way, frames),
        )
        if frames.publish:
            self._tf.publish(
                messages.transforms_form(frames), stamp, messages.transforms_numbers(way, frames)
            )

    def _stamp(self, monotonic: float) -> int:
        """Return a moment of the monotonic clock on the clock of ROS [ns]."""
        age = round((time.monotonic() - monotonic) * 1e9)
        return max(self.get_clock().now().nanoseconds - age, 0)

    def _link_changed(self, state: LinkState, detail: str) -> None:
        """Say how the link is; runs in the thread of the driver."""
        if state is not LinkState.RUNNING:
            self._latest = None  # the robot may be moved while nobody sees it
            self._limiter.reset()
        if state in {LinkState.REFUSED, LinkState.FAILED}:
            self.get_logger().error(f'{state.value}: {detail}')
        elif state in {LinkState.STALE, LinkState.CONNECTING}:
            self.get_logger().warning(f'{state.value}: {detail}')
        elif state is LinkState.STOPPED:
            self.get_logger().debug(detail)
        else:
            self.get_logger().info(f'{state.value}: {detail}')

    def _take(self, data: bytes) -> None:
        self._counters.received += 1
        now = time.monotonic()
        message, numbers = self._reader.read(data)
        positions = numbers[: len(message.position)]
        try:
            self._check_rest(message, numbers[len(positions) :])
            self._limiter.check(positions)
            command = self._send(positions, now)
        except CommandError as error:
            self._counters.refused += 1
            self._trouble(f'joint command refused: {error}')
            return
        if command is not None:
            self._loss.commanded(command.targets, now)
            self._counters.loss = ''
            self._descent.cancel()
            self._silence.reset()

    def _send(self, positions: Sequence[float], now: float) -> Command | None:
        """Send what may be sent of some positions [rad]; None for nothing.

        Raises:
            CommandError: It is no command.
        """
        place = self._place(now)
        if not place:
            self._drop(self._driver.status().detail)
            return None
        measured = [place.get(name) for name in self._joints.names]
        command = self._limiter.step(positions, measured, now)
        if self._limp:
            self._drop('the servos are without torque; call ~/torque with true')
        elif self._driver.command(self._joints.angles(command.targets)):
            self._estimator.command(now, command.targets)
            self._count(command)
            return command
        else:
            self._drop(self._driver.status().detail)
        return None

    def _miss_commands(self) -> None:
        """Bring the robot down when its commands broke off in motion, or say why not."""
        self._silence.cancel()
        if not self._loss.in_motion:
            return
        now = time.monotonic()
        reason = self._loss.begin(self._place(now), self._tilt(), now)
        does = f'holds as it is, for {reason}' if reason else 'lies down'
        self._counters.loss = (
            f'joint commands broke off while the legs moved: the robot {does}; '
            'is the controller running?'
        )
        self.get_logger().error(self._counters.loss)
        if not reason:
            self._descent.reset()

    def _go_down(self) -> None:
        now = time.monotonic()
        positions = self._loss.step(now)
        if positions is None:
            self._descent.cancel()
            return
        if self._send(positions, now) is None:
            self._loss.forget()

    def _tilt(self) -> float | None:
        """Return how far the body leans [rad]; None when nobody knows."""
        attitude = self._latest[1].attitude if self._latest is not None else None
        return None if attitude is None else tilt_of(attitude)

    def _place(self, now: float) -> dict[str, float]:
        """Return where the joints are [rad], [m]; empty when the robot was not seen lately."""
        latest = self._latest
        if latest is None or now - latest[0].arrival > STALE_TIME:
            return {}
        return latest[1].positions

    def _drop(self, reason: str) -> None:
        self._limiter.reset()
        self._loss.forget()
        self._last_targets = ()
        self._counters.unsent += 1
        self._trouble(f'joint command not sent: {reason}')

    def _set_torque(
        self, request: SetBool.Request, response: SetBool.Response
    ) -> SetBool.Response:
        """Let the servos go, or have them hold where they are."""
        on = bool(request.data)
        positions = self._place(time.monotonic())
        if on and positions:  # a servo that wakes goes to its last target
            self._driver.command(self._joints.angles_at(positions))
        response.success = self._driver.torque(on=on)
        if not response.success:
            response.message = self._driver.status().detail
            return response
        self._limp = not on
        self._limiter.reset()
        self._loss.forget()
        response.message = 'the servos hold' if on else 'the servos are without torque'
        self.get_logger().info(response.message)
        return response

    def _check_rest(self, message: JointCommand, rest: Sequence[float]) -> None:
        """Refuse velocities and efforts that do not fit the positions; servos take neither."""
        for name, values in (('velocity', message.velocity), ('effort', message.effort)):
            if values and len(values) != len(message.position):
                raise CommandError(
                    f'{len(values)} values of {name} for {len(message.position)} positions; '
                    'leave them out or give one for each'
                )
        if not all(map(math.isfinite, rest)):
            raise CommandError('velocity or effort holds what is no finite number')

    def _count(self, command: Command) -> None:
        counters, legs = self._counters, self._joints.leg_count
        pairs = zip(self._last_targets[:legs], command.targets[:legs], strict=False)
        step = max((abs(after - before) for before, after in pairs), default=0.0)
        counters.largest_step = max(counters.largest_step, step)
        self._last_targets = command.targets
        counters.slowed += bool(command.slowed)
        if command.unseen:
            self._trouble(
                f'nobody measures where {", ".join(command.unseen)} is: it goes to its first '
                'target at the lowest speed'
            )
        if command.clamped:
            counters.clamped += 1
        beyond = {
            'beyond limits, taken to them': set(command.clamped) - set(command.outside),
            'found beyond limits, moved only towards them': command.outside,
        }
        if told := [f'{what}: {", ".join(sorted(who))}' for what, who in beyond.items() if who]:
            self._trouble('; '.join(told))

    def _trouble(self, reason: str) -> None:
        self._counters.reason, self._counters.troubled = reason, True
        self.get_logger().warning(reason, throttle_duration_sec=WARN_PERIOD)

    def _diagnose(self) -> None:
        name, port, latest = self.get_name(), self._settings.link.path, self._latest
        now = self.get_clock().now().to_msg()
        array = DiagnosticArray()
        array.header.stamp = now
        array.status = [
            self._link.describe(name, port, self._driver.status()),
            command_diagnostic(name, port, self._counters),
        ]
        if latest is not None:
            state, _ = latest
            health = self._estimator.health()
            checked = self._settings.estimator.mounting.checked
            array.status.append(
                robot_diagnostic(name, port, state, health, mounting_checked=checked)
            )
            self._battery.publish(messages.battery(health.battery, now))
        self._diagnostics.publish(array)


def main() -> int:
    """Run until Ctrl-C; return the exit code."""
    return run_program('hardware_node', _serve, HardwareError)


def _serve(stop: threading.Event) -> None:
    sys.setswitchinterval(SWITCH_INTERVAL)
    node = HardwareNode()
    node.begin()
    gc.freeze()  # what is there now is there to stay, and need not be looked through
    try:
        spin([node], stop)
    finally:
        node.end()
        node.destroy_node()


if __name__ == '__main__':
    sys.exit(main())
