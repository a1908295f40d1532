# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``ros2 run quad_controller controller_node``: velocities in, joint commands out."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from datetime import datetime, timezone
from functools import cache, partial
from pathlib import Path
import sys
import threading
import time
from typing import Any, TypeVar

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import Pose, Twist, TwistStamped
from nav_msgs.msg import Odometry
from rcl_interfaces.msg import SetParametersResult
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import HistoryPolicy, qos_profile_sensor_data, QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import BatteryState, Imu, JointState
from std_msgs.msg import Float64, String
from std_srvs.srv import Trigger

from message_templates import FastPublisher, FastReader, MessageTemplate, stamp_of
from node_runner import (
    create_deferred_service,
    destroyed_when_refused,
    LATCHED,
    notify_ready,
    raise_thread_priority,
    run_program,
    settle_process_memory,
    spin,
)
from quad_description import DescriptionError
from quad_msgs.msg import FootContacts, JointCommand
from quad_msgs.srv import LoadPolicy, SetMode

from ..exceptions import PolicyError, QuadControllerError
from ..gait.generator import GaitGenerator
from ..gait.velocity import Velocity
from ..policy.contract.model import Source
from ..policy.load import find_policy, load_policy, LoadedPolicy
from ..policy.runner import PolicyRunner
from ..recording import PolicyRun
from ..states.controller import Controller
from ..states.machine import NO_POLICY
from ..states.modes import Answer, EventKind, Fault, Output
from . import messages
from .control_loop import ControlLoop
from .messages import OtherTypeSubscription, Recorder
from .parameters import changed_gait, declare_parameters

COMMAND_QOS = QoSProfile(
    reliability=ReliabilityPolicy.RELIABLE, history=HistoryPolicy.KEEP_LAST, depth=1
)
REQUEST_QOS = 1  # only the newest velocity and pose count
SWITCH_INTERVAL = 0.0005  # [s] how long one thread may keep another one from the interpreter
ESTIMATE_WAIT = 1.0  # [s] for the first message, when a policy that needs it is loaded
ESTIMATES = {'odom': Odometry, 'foot_contacts': FootContacts}
TYPE_PERIOD = 1.0  # [s] between two looks for another type on cmd_vel
STAMPED = 'geometry_msgs/msg/TwistStamped'  # what Nav2 and ros2_control publish
STAMPED_WARN_PERIOD = 60.0  # [s] between two errors that it cannot be received
GAIT_WORDS = {'', 'gait'}  # instead of a policy's path
WARN_PERIOD = 2.0  # [s] between two warnings of the same kind
# [s] by which a measurement may be older, or of a later time, than now; beyond, clocks differ
MAX_AGE, MAX_AHEAD = 10.0, 0.05

Reply = TypeVar('Reply', SetMode.Response, Trigger.Response)


class ControllerNode(Node):
    """Subscribes to the robot's state and to commands, and publishes joint commands."""

    @destroyed_when_refused
    def __init__(self, stop: threading.Event) -> None:
        """Declare parameters, topics and services; :meth:`begin` starts the loop.

        Args:
            stop: Set when the loop has ended with an unexpected error.

        Raises:
            ParameterError: A parameter is misspelt or of the wrong type.
            QuadControllerError: Parameters or the robot description do not fit.
        """
        super().__init__('controller_node')
        self._settings = settings = declare_parameters(self)
        self._report = self.create_publisher(String, '~/policy', LATCHED)
        self._loader = ThreadPoolExecutor(1, thread_name_prefix='load_policy')
        policy, refusal = self._load_first_policy()
        self._controller = Controller(
            settings.robot,
            settings.tuning,
            settings.states,
            policy=policy,
            policy_refusal=refusal,
            dry_run=settings.policy_dry_run,
            first_gait=settings.gait,
            arm_pose=settings.arm_pose,
        )
        self._loop = ControlLoop(
            self._controller,
            settings.states.period,
            self._publish,
            self._give_up,
            self._record if settings.record else None,
        )
        self._recorder = self._make_recorder() if settings.record else None
        self._joint_states = FastReader(JointState, 'position', 'velocity')
        self._imu = FastReader(Imu, *messages.IMU_NUMBERS)
        self._rotation_of = cache(settings.robot.rotation_of)
        self._joints = messages.JointReader(settings.robot)
        self._filter = messages.CommandFilter(
            settings.robot, others_move=bool(settings.arm_pose or policy is not None)
        )
        self._targets = self._controller.fallback_positions
        self._unreported: tuple[str, ...] = ()
        self._title = ''
        self._ready = False
        self._stop, self.failure = stop, ''  # why the loop ended, empty as long as it runs
        self._commands, self._shadow = (
            FastPublisher(self.create_publisher(JointCommand, topic, COMMAND_QOS))
            for topic in ('joint_command', 'joint_command_shadow')
        )
        self._state = self.create_publisher(String, '~/state', LATCHED)
        self._diagnostics = self.create_publisher(DiagnosticArray, 'diagnostics', 10)
        self._subscribe()
        self._stamped: OtherTypeSubscription | None = None
        self._seen: set[str] = set()  # topics of estimates
        self._other_clocks: set[str] = set()  # topics whose stamps were of no use
        self._arrived = {topic: threading.Event() for topic in ESTIMATES}
        if policy is not None:
            self._see_estimates(_estimates_for(policy))
        controller = self._controller
        for kind, name, ask in (
            (SetMode, 'set_mode', lambda request: controller.set_mode(request.mode)),
            (Trigger, 'stop', lambda _: controller.stop()),
            (Trigger, '~/clear_fault', lambda _: controller.clear_fault()),
        ):
            self.create_service(kind, name, partial(self._answer, name.strip('~/'), ask))
        create_deferred_service(
            self,
            LoadPolicy,
            '~/load_policy',
            lambda request: self._loader.submit(self._take_load_request, request),
        )
        self._gait = settings.tuning
        self.add_on_set_parameters_callback(self._tune)
        self.create_timer(settings.diagnostics_period, self._publish_diagnostics)
        self._types = self.create_timer(TYPE_PERIOD, self._check_for_stamped)
        robot = settings.robot
        self.get_logger().info(
            f'{len(robot.names)} joints, {robot.mass:.2f} kg; waiting for joint_states'
        )

    def begin(self) -> None:
        """Start the control loop."""
        if self._recorder is not None:
            self.get_logger().info(f'records to {self._recorder.folder}')
        priority = self._settings.thread_priority
        self._loop.start(lambda: raise_thread_priority(self, priority, 'the control loop'))

    def end(self) -> None:
        """Stop sending commands; the servos hold their last targets."""
        self._loader.shutdown(cancel_futures=True)
        if self._stamped is not None:
            self._stamped.close()
        self._loop.stop()
        if (recorder := self._recorder) is not None:
            recorder.close()
            words = f'recorded to {recorder.folder}; {recorder.lost} steps lost'
            self.get_logger().info(f'{words}; {recorder.failure}' if recorder.failure else words)

    def _make_recorder(self) -> Recorder:
        """Begin a recording."""
        settings, now = self._settings, datetime.now(tz=timezone.utc)
        folder = Path(settings.record).expanduser() / now.strftime('quad_%Y%m%d_%H%M%S_%f')
        names = ','.join(settings.robot.names)
        run = PolicyRun(settings.policy, settings.policy_options, settings.states.period)
        recorder = Recorder(folder, {'joint_names': names, **run.about})
        if problem := run.keep_contract(folder):
            self.get_logger().warning(f'record: {problem}; replay_policy needs --contract')
        return recorder

    def _record(self, output: Output, dt: float, computing: float, latency: float | None) -> None:
        if self._recorder is not None:
            stamp = self.get_clock().now().nanoseconds
            self._recorder.offer(output, stamp, dt, computing, latency)

    def _load_first_policy(self) -> tuple[PolicyRunner | None, str]:
        """Load the initial policy; on failure, return None and the reason."""
        if not self._settings.policy:
            return None, NO_POLICY
        try:
            loaded = self._load_policy(self._settings.policy)
        except PolicyError as error:
            self._report.publish(String(data=str(error)))
            return None, f'the policy was refused at the start: {error.reason}'
        self._report.publish(String(data=str(loaded)))
        return loaded.runner, ''

    def _load_policy(self, text: str) -> LoadedPolicy:
        """Load and check a policy by path or name; log the table in either case."""
        settings = self._settings
        gait = GaitGenerator(settings.robot, settings.tuning)
        try:
            loaded = load_policy(
                find_policy(text),
                settings.robot,
                gait.stand_targets,
                settings.policy_options,
                settings.states.period,
            )
        except PolicyError as error:
            self.get_logger().error(str(error))
            raise
        self.get_logger().info(str(loaded))
        return loaded

    def _wait_for_estimates(self, policy: PolicyRunner) -> None:
        """Subscribe to a policy's inputs and wait; not in the executor thread."""
        topics = [t for t in _estimates_for(policy) if not self._arrived[t].is_set()]
        if self.executor is None or not topics:
            return
        self.executor.create_task(self._see_estimates, topics)
        if all(self._arrived[topic].wait(ESTIMATE_WAIT) for topic in topics):
            time.sleep(2.0 * self._settings.states.period)  # the controller takes it with a step

    def _see_estimates(self, topics: Sequence[str]) -> None:
        """Subscribe to estimates, only if a policy needs them: messages cost time."""
        sensor = qos_profile_sensor_data
        takers = {'odom': self._take_odometry, 'foot_contacts': self._take_contacts}
        for topic in set(topics) - self._seen:
            self._seen.add(topic)
            self.create_subscription(ESTIMATES[topic], topic, takers[topic], sensor)

    def _subscribe(self) -> None:
        sensor = qos_profile_sensor_data
        for kind, topic, take in (
            (JointState, 'joint_states', self._take_joints),
            (Imu, 'imu', self._take_imu),
        ):
            self.create_subscription(kind, topic, take, sensor, raw=True)
        self.create_subscription(BatteryState, 'battery_state', self._take_battery, sensor)
        self.create_subscription(String, 'servo_problem', self._take_servo_problem, LATCHED)
        self.create_subscription(
            Float64, 'joint_velocity_error', self._take_velocity_error, LATCHED
        )
        self.create_subscription(Twist, 'cmd_vel', self._take_twist, REQUEST_QOS)
        self.create_subscription(
            TwistStamped, 'cmd_vel_stamped', self._take_stamped_twist, REQUEST_QOS
        )
        self.create_subscription(Pose, 'body_pose', self._take_pose, REQUEST_QOS)

    # --- in: callbacks of the executor

    def _take_joints(self, data: bytes) -> None:
        message, numbers = self._joint_states.read(data)
        try:
            joints = self._joints.read(message, numbers, self._targets)
            self._loop.offer(joints=joints, joints_age=self._age('/joint_states', data))
        except ValueError as error:
            self._refuse(Fault.JOINTS, str(error))
            return
        if self._joints.unreported != self._unreported:
            self._unreported = self._joints.unreported
            names = ', '.join(self._unreported) or 'none'
            self.get_logger().info(
                f'joints that are not measured, which are left where they are: {names}'
            )

    def _take_imu(self, data: bytes) -> None:
        try:
            imu = messages.imu_sample(*self._imu.read(data), self._rotation_of)
            self._loop.offer(imu=imu, imu_age=self._age('/imu', data))
        except ValueError as error:
            self._refuse(Fault.IMU, str(error))

    def _age(self, topic: str, data: bytes) -> float:
        """Return the age of a measurement [s] by its stamp; 0 if that is unusable."""
        stamp = stamp_of(data)
        age = (self.get_clock().now().nanoseconds - stamp) / messages.NS
        if -MAX_AHEAD <= age <= MAX_AGE:
            return max(age, 0.0)
        if topic not in self._other_clocks:
            self._other_clocks.add(topic)
            differ = f'the clocks of {topic} and of this computer differ by {age:.1f} s'
            why = differ if stamp else f'{topic} has no header.stamp'
            self.get_logger().warning(f'{why}; ages count from arrival')
        return 0.0

    def _take_odometry(self, message: Odometry) -> None:
        linear = message.twist.twist.linear
        self._loop.offer(linear_velocity=(linear.x, linear.y, linear.z))
        self._arrived['odom'].set()

    def _take_contacts(self, message: FootContacts) -> None:
        try:
            self._loop.offer(foot_contacts=messages.foot_contacts(message))
        except ValueError as error:
            self.get_logger().warning(str(error), throttle_duration_sec=WARN_PERIOD)
            return
        self._arrived['foot_contacts'].set()

    def _refuse(self, what: Fault, reason: str) -> None:
        with self._loop.lock:
            self._controller.refuse(what, reason)
        self.get_logger().warning(reason, throttle_duration_sec=WARN_PERIOD)

    def _take_battery(self, message: BatteryState) -> None:
        self._loop.offer(battery=message.percentage)

    def _take_servo_problem(self, message: String) -> None:
        self._loop.offer(servo_problem=message.data)

    def _take_velocity_error(self, message: Float64) -> None:
        self._joints.velocity_error = message.data

    def _take_twist(self, message: Twist) -> None:
        velocity = Velocity(message.linear.x, message.linear.y, message.angular.z)
        with self._loop.lock:
            answer = self._controller.set_velocity(velocity)
        self._complain(answer)

    def _take_stamped_twist(self, message: TwistStamped) -> None:
        # its age counts from its arrival: clocks of two machines need not agree
        self._take_twist(message.twist)

    def _check_for_stamped(self) -> None:
        """Subscribe to TwistStamped on cmd_vel as soon as it has a publisher."""
        topic = self.resolve_topic_name('cmd_vel')
        kinds = {info.topic_type for info in self.get_publishers_info_by_topic(topic)}
        if STAMPED in kinds:
            self._types.cancel()
            self._loader.submit(self._receive_stamped, topic)

    def _receive_stamped(self, topic: str) -> None:
        """Subscribe to TwistStamped in the loader thread: a participant starts slowly."""
        try:
            self._stamped = OtherTypeSubscription(
                self, TwistStamped, topic, self._take_stamped_twist, REQUEST_QOS
            )
        except Exception as error:  # noqa: BLE001  whatever it is, Twist is served
            self.get_logger().error(
                f'{topic} comes as TwistStamped, which cannot be received: '
                f'{type(error).__name__}: {error}; trying again',
                throttle_duration_sec=STAMPED_WARN_PERIOD,
            )
            self._types.reset()
        else:
            self.get_logger().info(f'{topic} comes as TwistStamped, too')

    def _take_pose(self, message: Pose) -> None:
        with self._loop.lock:
            answer = self._controller.set_body_pose(messages.body_pose(message))
        self._complain(answer)

    def _complain(self, answer: Answer) -> None:
        if not answer.accepted:
            self.get_logger().warning(answer.message, throttle_duration_sec=WARN_PERIOD)

    def _answer(
        self, name: str, ask: Callable[[Any], Answer], request: object, response: Reply
    ) -> Reply:
        with self._loop.lock:
            answer = ask(request)
        response.success, response.message = answer.accepted, answer.message
        what = f'mode {request.mode!r}' if isinstance(request, SetMode.Request) else name
        self.get_logger().info(f'{what}: {answer.message}')
        return response

    def _take_load_request(self, request: LoadPolicy.Request) -> LoadPolicy.Response:
        """Load a policy and follow it; runs in the loader thread."""
        answer = self._follow(request.path)
        self.get_logger().info(f'load_policy {request.path!r}: {answer.message}')
        return LoadPolicy.Response(success=answer.accepted, message=answer.message)

    def _follow(self, path: str) -> Answer:
        if path in GAIT_WORDS:
            with self._loop.lock:
                answer = self._controller.follow(None)
            if answer.accepted:
                self._report.publish(String(data=NO_POLICY))
            return answer
        with self._loop.lock:
            if refusal := self._controller.swap_refusal():
                return Answer(False, refusal)
        try:
            loaded = self._load_policy(path)
        except PolicyError as error:
            return Answer(False, f'the policy was refused: {error.reason}')
        self._wait_for_estimates(loaded.runner)
        with self._loop.lock:
            answer = self._controller.follow(loaded.runner)
            self._filter.others_move |= answer.accepted
        if not answer.accepted:
            return answer
        self._report.publish(String(data=str(loaded)))
        return Answer(True, f'{answer.message}; sha256 {loaded.digest}')

    def _tune(self, parameters: list[Parameter]) -> SetParametersResult:
        """Apply new gait parameters; return why they are rejected, if they are."""
        values = {parameter.name: parameter.value for parameter in parameters}
        try:
            gait = changed_gait(self._gait, values)
            if gait is None:
                return SetParametersResult(successful=True)
            with self._loop.lock:
                answer = self._controller.retune(gait)
        except (QuadControllerError, DescriptionError) as error:
            return SetParametersResult(successful=False, reason=str(error))
        if answer.accepted:
            self._gait = gait
        return SetParametersResult(successful=answer.accepted, reason=answer.message)

    # --- out: in the thread of the loop

    def _publish(self, output: Output) -> None:
        logger = self.get_logger()
        if output.targets is not None:
            now = self.get_clock().now().nanoseconds
            self._targets = output.targets
            sent = self._filter.select(output.targets, output.title, self._joints.unreported)
            for publisher, targets in ((self._commands, sent), (self._shadow, output.shadow)):
                if targets:
                    form = MessageTemplate(messages.joint_command, len(targets))
                    publisher.publish(form, now, targets)
        if output.ready and not self._ready:
            self._ready = True
            logger.info('ready: joints and attitude are known; set_mode makes the robot move')
            notify_ready()
        for event in output.events:
            # each place of the code has one severity (rclpy)
            if event.kind is EventKind.REPEATED:
                logger.warning(event.text, throttle_duration_sec=WARN_PERIOD)
            elif event.kind is EventKind.WARNING:
                logger.warning(event.text)
            elif event.kind is EventKind.TROUBLE:
                logger.error(event.text)
            else:
                logger.info(event.text)
        if output.title != self._title:
            self._title = output.title
            self._state.publish(String(data=output.title))
            self._publish_diagnostics()

    def _publish_diagnostics(self) -> None:
        name = self.get_name()
        with self._loop.lock:
            status = self._controller.status
        array = DiagnosticArray()
        array.header.stamp = self.get_clock().now().to_msg()
        array.status = [
            messages.state_diagnostic(name, status),
            messages.loop_diagnostic(name, self._loop.figures()),
        ]
        if self._recorder is not None:
            recording = messages.recorder_diagnostic(name, self._recorder)
            array.status = [*array.status, recording]
        self._diagnostics.publish(array)

    def _give_up(self, error: Exception) -> None:
        """Log why the loop ended and end the process; the servos hold."""
        self.failure = f'{type(error).__name__}: {error}'
        self.get_logger().fatal(f'the control loop ended by a defect: {self.failure}')
        self._stop.set()


def _estimates_for(policy: PolicyRunner) -> list[str]:
    """Return the estimate topics that a policy needs."""
    needs = {'odom': Source.LINEAR_VELOCITY, 'foot_contacts': Source.FOOT_CONTACTS}
    return [topic for topic, source in needs.items() if policy.contract.needs(source)]


def main() -> int:
    """Run until Ctrl-C; return the exit code."""
    return run_program('controller_node', _serve, QuadControllerError, DescriptionError)


def _serve(stop: threading.Event) -> int:
    sys.setswitchinterval(SWITCH_INTERVAL)
    node = ControllerNode(stop)
    settle_process_memory(node)
    node.begin()
    try:
        spin([node], stop)
    finally:
        node.end()
        node.destroy_node()
    return 1 if node.failure else 0


if __name__ == '__main__':
    sys.exit(main())
