# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``ros2 run quad_bringup demo``: a simulated quadruped stands up, walks and lies down.

Publishes velocities on /cmd_vel, and compares them with the simulated motion and with /odom.
"""

from __future__ import annotations

import argparse
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
import itertools
import math
import sys
import time
from typing import Any, NamedTuple

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from rclpy.qos import qos_profile_sensor_data
from rich.console import RenderableType
from rich.text import Text
from sensor_msgs.msg import BatteryState, Imu

from process_supervisor import CallError, parse_with_ros, RosOptions, SupervisorError, USAGE_ERROR
from process_supervisor.demo import Demo, make_table, run_demo, signed
from process_supervisor.ros_options import seconds_from
from quad_controller import Gait, GaitParameters, Velocity
from quad_description.rotations import tilt_of, yaw_of

from .bringup import add_arguments, BringupError, session, Stack
from .mode_client import ModeClient

GROUND_TRUTH = 'fake_xgo/ground_truth'
"""Topic on which the simulated robot publishes where its body is."""
COMMAND_PERIOD = 0.1
"""Time in [s] between two velocity commands; the controller's time-out is 0.5 s."""
KEPT_SEGMENTS = 40
"""How many segments a demo without end remembers for its summary."""
FIND_TIMEOUT, MODE_TIMEOUT = 20.0, 15.0
"""Longest time in [s] for the nodes to find each other, and for a mode to be reached."""
USUAL_ROUND, MIN_DURATION = 20.0, 6.0
"""Duration of a round when the demo has no end, and the least in which every segment can show
something, in [s]."""
SETTLING, SETTLING_RATIO = 1.0, 0.4
"""Time of a segment that is not measured, since the robot takes up speed: in [s], at most as a
share."""
WINDOW = 1.0
"""Time in [s] over which the velocity of the moment is taken."""
LINEAR_TOLERANCE, TURN_TOLERANCE, RELATIVE_TOLERANCE = 0.04, 0.2, 0.5
"""Greatest difference of commanded and measured speed in [m/s] and [rad/s], and as a share of what
was commanded: a slow robot that stands has not walked."""
TILT_WARNING, TILT_LIMIT = math.radians(10.0), math.radians(15.0)
"""A tilt in [rad] that is shown in red, and one with which a body did not walk, it stumbled."""
MIN_RATE = 45.0
"""Joint commands per second below which the loop did not hold its 50 Hz."""

STANDSTILL = Velocity()
SEGMENTS = (
    ('walk', Velocity(x=0.2), 0.4),
    ('turn', Velocity(yaw=0.8), 0.25),
    ('strafe', Velocity(y=0.1), 0.25),
    ('stop', STANDSTILL, 0.1),
)
"""Segments of a round, with their share of its time; speeds that the XGO's trot is made for."""


class Track:
    """Integrates the motion of a body in its own frame, from its poses in a fixed one.

    Attributes:
        way: Displacement since the first pose.
        stamp: ROS time of the latest pose in [s]; NaN before the first.
    """

    def __init__(self) -> None:
        self.way, self.stamp = Velocity(), math.nan
        self.tilt = math.nan  # angle between the body's z axis and the vertical then in [rad]
        self.height = math.nan  # of the body then in [m]
        self._pose = (0.0, 0.0, 0.0)  # x, y, yaw
        self._recent: deque[tuple[float, Velocity]] = deque()

    def take(self, message: Odometry) -> None:
        """Add a pose; ignore one that is not newer than the last."""
        stamp = message.header.stamp.sec + 1e-9 * message.header.stamp.nanosec
        if stamp <= self.stamp:
            return
        at, rotation = message.pose.pose.position, _rotation(message.pose.pose.orientation)
        pose = (at.x, at.y, yaw_of(rotation))
        if not math.isnan(self.stamp):
            x, y, yaw = self._pose
            turned = math.remainder(pose[2] - yaw, math.tau)
            dx, dy = pose[0] - x, pose[1] - y
            cosine, sine = math.cos(yaw + 0.5 * turned), math.sin(yaw + 0.5 * turned)
            forward, left, turn = self.way
            self.way = Velocity(
                forward + cosine * dx + sine * dy, left - sine * dx + cosine * dy, turn + turned
            )
        self.stamp, self._pose = stamp, pose
        self.tilt, self.height = tilt_of(rotation), at.z
        self._recent.append((stamp, self.way))
        while self._recent[0][0] < stamp - WINDOW:
            self._recent.popleft()

    @property
    def velocity(self) -> Velocity | None:
        """Mean velocity of the last second; None without a pose."""
        return self.mean_since(*self._recent[0]) if self._recent else None

    def mean_since(self, stamp: float, way: Velocity) -> Velocity | None:
        """Return the mean velocity since an earlier displacement; None if no time passed."""
        time_passed = self.stamp - stamp
        if not time_passed > 0:
            return None
        return Velocity(
            *((now - then) / time_passed for now, then in zip(self.way, way, strict=True))
        )


class Segment(NamedTuple):
    """A part of the demo with one velocity, and its result."""

    name: str
    duration: float
    commanded: Velocity
    measured: Velocity | None  # of the simulated body; None without ground truth
    odometry: Velocity | None


class Walk(Demo[ModeClient]):
    """Runs the demo: stand up, walk, turn, strafe, stop, lie down."""

    # title, speeds (5), blank, body and loop (2), and one that is left free
    lines = 10

    def __init__(self, quad: Stack, ros: RosOptions, arguments: argparse.Namespace) -> None:
        commands = [
            f'ros2 topic hz {ros.resolve("joint_command")}',
            f'ros2 topic echo {ros.resolve("odom")}',
            f'ros2 run quad_hardware doctor --port {quad.port}{ros.hint}',
        ]
        super().__init__(quad.title, commands)
        self.namespace = ros.namespace
        self.duration: float | None = arguments.duration
        self.mode, self.share = 'policy', 1.0  # share of the velocities of a trot
        if arguments.policy is None:
            top_speed = GaitParameters().top_speed
            self.mode = 'walk'
            self.share = top_speed(Gait(arguments.gait)) / top_speed(Gait.TROT)
        self.truth, self.odometry = Track(), Track()
        self.commanded: Velocity | None = None
        self.fault = ''
        self.tilt = self.tilt_max = self.battery = math.nan
        self.segments: deque[Segment] = deque(maxlen=KEPT_SEGMENTS)
        self.loop: Mapping[str, float] = {}  # how the controller keeps its time [1/s], [s]

    def join(self, given_up: Callable[[], bool]) -> ModeClient:
        """Join the ROS graph: publish velocities, subscribe to all reports of the robot."""
        client = ModeClient('demo', given_up, self.namespace)
        node, sensor = client.node, qos_profile_sensor_data
        self._twist = node.create_publisher(Twist, 'cmd_vel', 1)
        node.create_timer(COMMAND_PERIOD, self._send)
        topics: Sequence[tuple[Any, str, Callable[[Any], None], Any]] = (
            (Odometry, GROUND_TRUTH, self.truth.take, sensor),
            (Odometry, 'odom', self.odometry.take, sensor),
            (Imu, 'imu', self._take_imu, sensor),
            (BatteryState, 'battery_state', self._take_battery, sensor),
            (DiagnosticArray, 'diagnostics', self._take_diagnostics, 50),
        )
        for kind, topic, callback, qos in topics:
            node.create_subscription(kind, topic, callback, qos)
        return client

    def perform(self) -> None:
        """Stand up, walk segment by segment, and lie down."""
        try:
            self.wait(lambda: not self._missing(), FIND_TIMEOUT, 'the topics')
        except CallError as error:
            if not (missing := self._missing()):
                raise
            raise CallError(f'not found in {FIND_TIMEOUT:g} s: {", ".join(missing)}') from error
        self._reach('stand', 'standing up')
        self.moving = True
        self.tilt_max = self.tilt
        self._reach(self.mode, self.mode)
        for name, velocity, duration in self._plan():
            if self.left:
                break
            self._go(name, velocity, duration)
        self._conclude()
        self._command(STANDSTILL)
        self._reach('lie', 'lying down')
        self._command(None)

    def stopping(self) -> None:
        """Stop commanding velocities."""
        self._command(None)

    def wait(self, condition: Callable[[], bool], timeout: float, what: str) -> None:
        """Wait for a condition; raise on a fault of the controller."""

        def reached() -> bool:
            if self._in_fault:
                self._conclude()
                raise CallError(f'the controller is in a fault: {self.fault}')
            return condition()

        super().wait(reached, timeout, what)

    def _plan(self) -> Iterator[tuple[str, Velocity, float]]:
        """Yield name, velocity and duration of each segment: one round, or endless rounds."""
        total = self.duration or USUAL_ROUND
        one_round = [
            (name, velocity.scaled(self.share), part * total) for name, velocity, part in SEGMENTS
        ]
        return itertools.cycle(one_round) if self.duration is None else iter(one_round)

    def _go(self, name: str, velocity: Velocity, duration: float) -> None:
        """Command a velocity, and measure the motion."""
        self.enter(name)
        self._command(velocity)
        begin = time.monotonic()
        tracks = (self.truth, self.odometry)
        self._wait_until(begin + min(SETTLING, SETTLING_RATIO * duration))
        before = [(track.stamp, track.way) for track in tracks]
        self._wait_until(begin + duration)
        if self.left:
            return  # cut short: that is no measurement
        measured, odometry = (
            track.mean_since(*then) for track, then in zip(tracks, before, strict=True)
        )
        self.segments.append(Segment(name, duration, velocity, measured, odometry))

    def _wait_until(self, end: float) -> None:
        self.wait(lambda: self.left or time.monotonic() >= end, math.inf, 'the time')

    def _reach(self, mode: str, phase: str) -> None:
        """Request a mode and wait until it is reached."""
        self.enter(phase)
        self.client.set_mode(mode, MODE_TIMEOUT)
        self.wait(lambda: self.state == mode, MODE_TIMEOUT, f'mode {mode}')

    def _command(self, velocity: Velocity | None) -> None:
        """Set the velocity to publish ten times a second; None stops publishing."""
        self.commanded = velocity
        self._send()

    def _missing(self) -> list[str]:
        """Return the topics that still lack a publisher or subscriber."""
        there = {
            'ground truth of the simulator': math.isfinite(self.truth.stamp),
            '/odom': math.isfinite(self.odometry.stamp),
            '/imu': math.isfinite(self.tilt),
            'a subscriber of /cmd_vel': self._twist.get_subscription_count() > 0,
        }
        return [name for name, is_there in there.items() if not is_there]

    @property
    def state(self) -> str:
        """State that the controller reports; empty before the first report."""
        return self.client.state if self.joined else ''

    @property
    def _in_fault(self) -> bool:
        return bool(self.fault) and self.state.endswith('fault')

    @property
    def rate(self) -> float:
        """Joint commands per second, as reported by the controller; NaN before a report."""
        return self.loop.get('rate', math.nan)

    def _jitter(self, percentile: str) -> float:
        """Return a percentile of the deviations from the loop period in [ms]."""
        return 1e3 * self.loop.get(f'jitter_{percentile}', math.nan)

    def progress(self) -> str:
        """Return the present progress."""
        if not self.state or math.isnan(self.rate):
            return 'waiting for the controller'
        return (
            f'{self.state}, commanded {velocity_text(self.commanded or STANDSTILL)}, '
            f'measured {velocity_text(self.truth.velocity or self.odometry.velocity)}, '
            f'tilt {math.degrees(self.tilt):.1f}°, {self._loop_text()}'
        )

    def _loop_text(self) -> str:
        jitter = f'{self._jitter("p50"):.2f}/{self._jitter("p99"):.2f} ms'
        return f'joint commands {self.rate:.1f} Hz, jitter p50/p99 {jitter}'

    def _conclude(self) -> None:
        """Write summary and problems, if anything was measured."""
        if not self.segments:
            return
        head = f'{"[m/s, rad/s]":<14}  {"commanded":^19}  {"in physics":^19}  {"by /odom":^19}'
        names = f'{"":<14}' + 3 * f'  {"ahead":>6} {"left":>6} {"turn":>5}'
        rows = [
            f'{each.name:<7}{each.duration:5.1f} s  {_columns(each.commanded)}  '
            f'{_columns(each.measured)}  {_columns(each.odometry)}'
            for each in self.segments
        ]
        tilt = f'{math.degrees(self.tilt_max):.1f}°'
        self.summary = [head, names, *rows, f'tilt at most {tilt}, {self._loop_text()}']
        problems = [text for each in self.segments if (text := wrong_speed(each))]
        if self._in_fault:
            problems.append(f'the controller is in a fault: {self.fault}')
        if not self.tilt_max <= TILT_LIMIT:
            limit = f'{math.degrees(TILT_LIMIT):.0f}°'
            problems.append(f'the body leaned by {tilt}, more than {limit}')
        if not self.rate >= MIN_RATE:
            problems.append(
                f'{self.rate:.1f} joint commands a second, less than {MIN_RATE:g}: '
                'is this machine too busy?'
            )
        self.problems = problems

    def table(self, width: int) -> Sequence[RenderableType]:
        """Build the table of velocities, body and loop."""
        del width  # it has the width of the narrowest terminal
        columns = ('commanded', 'in physics', 'by /odom')
        speeds = make_table(('velocity', 16, False), *((name, 16, True) for name in columns))
        velocities = (self.commanded or STANDSTILL, self.truth.velocity, self.odometry.velocity)
        for row, title in enumerate(('forward [m/s]', 'left [m/s]', 'turn [rad/s]')):
            cells = (signed(math.nan if each is None else each[row]) for each in velocities)
            speeds.add_row(Text(title, style='bold'), *map(Text, cells))
        return [speeds, Text(''), self._body_text(), self._loop_row()]

    def _body_text(self) -> Text:
        fault, state = self.fault if self._in_fault else '', self.state or 'unknown'
        return Text.assemble(
            ('body  ', 'bold'),
            f'height {self.truth.height:.3f} m   ',
            (f'tilt {math.degrees(self.tilt):.1f}°', 'bold red' * (self.tilt > TILT_WARNING)),
            f' (at most {math.degrees(self.tilt_max):.1f}°)   battery {self.battery:.0f} %   ',
            (fault or state, 'bold red' if fault else 'green'),
            no_wrap=True,
            overflow='ellipsis',
        )

    def _loop_row(self) -> Text:
        if math.isnan(self.rate):
            return Text('loop  waiting for the controller', style='dim')
        p50, p99 = map(self._jitter, ('p50', 'p99'))
        text = f'{self.rate:.1f} Hz   jitter p50 {p50:.2f} ms   p99 {p99:.2f} ms'
        return Text.assemble(('loop  ', 'bold'), text)

    def _send(self) -> None:
        if self.commanded is None:
            return
        twist = Twist()
        twist.linear.x, twist.linear.y, twist.angular.z = self.commanded
        self._twist.publish(twist)

    def _take_imu(self, message: Imu) -> None:
        self.tilt = tilt_of(_rotation(message.orientation))
        self.tilt_max = max(self.tilt, self.tilt_max)

    def _take_battery(self, message: BatteryState) -> None:
        self.battery = 100.0 * message.percentage

    def _take_diagnostics(self, message: DiagnosticArray) -> None:
        """Store the controller's errors, fault reason and loop statistics."""
        for status in message.status:
            if not status.name.startswith('controller_node'):
                continue
            if status.level == DiagnosticStatus.ERROR:
                self.fault = status.message
            if status.name.endswith('loop'):
                self.loop = {each.key: float(each.value) for each in status.values}


def _rotation(quaternion: Any) -> tuple[float, float, float, float]:  # noqa: ANN401
    return quaternion.x, quaternion.y, quaternion.z, quaternion.w


def wrong_speed(segment: Segment) -> str:
    """Return the deviation of a segment's motion as text; empty if within tolerance."""
    name, wanted = segment.name, segment.commanded
    speed = segment.measured or segment.odometry
    if speed is None:
        return f'{name}: no motion was measured, neither by ground truth nor by /odom'
    linear = math.hypot(speed.x - wanted.x, speed.y - wanted.y)
    bounds = (
        (linear, LINEAR_TOLERANCE, math.hypot(wanted.x, wanted.y)),
        (abs(speed.yaw - wanted.yaw), TURN_TOLERANCE, abs(wanted.yaw)),
    )
    if all(
        off <= (min(most, RELATIVE_TOLERANCE * size) if size else most)
        for off, most, size in bounds
    ):
        return ''
    return f'{name}: commanded {velocity_text(wanted)}, but moved {velocity_text(speed)}'


def velocity_text(velocity: Velocity | None) -> str:
    """Format a velocity: forward, left, turn."""
    if velocity is None:
        return 'unknown'
    forward, left, turn = _tidy(velocity)
    return f'{forward:+.3f} {left:+.3f} m/s {turn:+.2f} rad/s'


def _columns(velocity: Velocity | None) -> str:
    if velocity is None:
        return f'{"unknown":^19}'
    forward, left, turn = _tidy(velocity)
    return f'{forward:+6.3f} {left:+6.3f} {turn:+5.2f}'


def _tidy(velocity: Velocity) -> tuple[float, float, float]:
    """Round a number, and turn negative zero into zero."""
    forward, left, turn = velocity
    return round(forward, 3) + 0.0, round(left, 3) + 0.0, round(turn, 2) + 0.0


def main(argv: Sequence[str] | None = None) -> int:
    """Run the demo to its end or Ctrl-C; by default with the process's command line.

    Returns:
        0 on success, 1 on a failure, 2 if nothing was started.
    """
    parser = argparse.ArgumentParser(
        prog='ros2 run quad_bringup demo',
        description='Bring a simulated quadruped up, let it stand up, walk, turn, strafe, stop '
        'and lie down. In a terminal a live table shows what it does; elsewhere a line every few '
        'seconds. Ctrl-C lets it lie down and ends everything.',
        allow_abbrev=False,
    )
    add_arguments(parser)
    parser.add_argument(
        '--duration',
        metavar='S',
        type=seconds_from(MIN_DURATION),
        help=f'walk for so many seconds, at least {MIN_DURATION:g}, and end with a summary; the '
        'exit code is 0 when it moved as commanded (default: until Ctrl-C)',
    )
    arguments, ros = parse_with_ros(parser, sys.argv[1:] if argv is None else argv)
    try:
        with session(arguments, ros, None) as (quad, processes):
            endless = arguments.duration is None
            return run_demo(Walk(quad, ros, arguments), processes, endless=endless)
    except (BringupError, SupervisorError) as error:
        sys.stderr.write(f'{error}\n')
        return USAGE_ERROR
