# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The quadruped's processes one by one, so that a test can kill any of them, and its cable.

A listener on the serial cable has what the bridge sends to the servos, as the wire has it.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from functools import partial
import itertools
import math
import os
from pathlib import Path
import random
import re
import select
import signal
import termios
import threading
import time
import tty
from typing import TYPE_CHECKING

from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from processes import RunningProcess
from rclpy.qos import qos_profile_sensor_data
from ros_client import RosClient
from sensor_msgs.msg import JointState
from std_msgs.msg import String

from node_runner import LATCHED
from process_supervisor import find_executable, write_parameters
from quad_bringup.bringup import quad_processes, Stack
from quad_bringup.walk import GROUND_TRUTH
from quad_controller import Velocity
from quad_description import movable_joints, robot_urdf
from quad_description.rotations import tilt_of
from quad_hardware.protocol import Code, Frame, HOST_KINDS, Kind, ROBOT_KINDS, StreamParser, V2
from quad_msgs.srv import SetMode

if TYPE_CHECKING:
    from isolation import Isolation
    from typing_extensions import Self


PERIOD = 0.02
"""Time between two commands in [s]."""
POLL = 0.05
"""Longest time in [s] after which the line looks whether it is cut, or has another baud rate."""
SPEEDS = slice(4, 6)
"""Input and output speed in what tcgetattr returns."""


@dataclass(frozen=True)
class Target:
    """A servo command on the wire."""

    time: float  # steady time of its arrival in [s]
    angles: dict[int, float]  # angles in [deg] by motor id


class SerialTap:
    """Sits between the bridge and the robot's port; the bridge opens :attr:`link`."""

    def __init__(self, link: Path, robot: Path) -> None:
        """Connect the ends.

        Args:
            link: Where the bridge shall find its end.
            robot: The robot's port.
        """
        self.link = link  # path of the bridge's end
        # what the bridge sent to the servos so far (the protocol that pushes states)
        self.targets: list[Target] = []
        # steady times in [s] at which the robot's states had come in
        self.reports: list[float] = []
        # share of the bytes, of both directions, in which a bit is inverted from now on
        self.noise = 0.0
        self._chance = random.Random(0)
        self._host, self._pushed = (StreamParser(V2, k) for k in (HOST_KINDS, ROBOT_KINDS))
        self._robot = os.open(robot, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        self._bridge, self._far = os.openpty()
        for end in (self._robot, self._far):
            tty.setraw(end)
        os.set_blocking(self._bridge, False)
        link.symlink_to(os.ttyname(self._far))
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._run, name='tap')
        self._thread.start()

    @property
    def thread_id(self) -> int:
        """The system's id of the thread that passes the bytes on."""
        return self._thread.native_id or 0

    def seed(self, number: int) -> None:
        """Say which bytes the noise hits."""
        self._chance.seed(number)

    def forget(self) -> None:
        """Begin anew with nothing seen."""
        self.targets, self.reports = [], []

    def largest_step(self, since: float = 0.0) -> float:
        """Return the largest change of a servo's target between two commands in [deg].

        Args:
            since: Steady time in [s] from which on steps count.
        """
        return max(self._steps(since), default=0.0)

    def longest_silence(self, since: float) -> float:
        """Return the longest time in [s] in which the bridge received no state of the robot.

        Args:
            since: Steady time in [s] at which the first silence begins at the earliest.
        """
        arrivals = (report for report in list(self.reports) if report > since)
        times = [since, *arrivals, time.monotonic()]
        return max(after - before for before, after in itertools.pairwise(times))

    def _steps(self, since: float) -> Iterator[float]:
        for before, after in itertools.pairwise(list(self.targets)):
            if after.time >= since:
                # a busy bridge sends the newest command instead of one that still waits
                periods = 2 if 1.5 < (after.time - before.time) / PERIOD < 2.5 else 1
                for motor in before.angles.keys() & after.angles.keys():
                    yield abs(after.angles[motor] - before.angles[motor]) / periods

    def __enter__(self) -> Self:
        """Use it in a with statement."""
        return self

    def __exit__(self, *_: object) -> None:
        """Pull the cable."""
        self._closing.set()
        self._thread.join()
        for end in (self._robot, self._bridge, self._far):
            os.close(end)
        self.link.unlink()

    def _run(self) -> None:
        while not self._closing.is_set():
            self._pass_speed_on()
            ready, _, _ = select.select([self._robot, self._bridge], [], [], POLL)
            if self._bridge in ready:
                data = _receive(self._bridge)
                for frame in self._host.feed(data):
                    self._take(frame)
                _send(self._robot, self._disturbed(data))
            if self._robot in ready:
                data = _receive(self._robot)
                frames = self._pushed.feed(data)
                self.reports += [time.monotonic() for each in frames if each.kind is Kind.PUSH]
                _send(self._bridge, self._disturbed(data))

    def _disturbed(self, data: bytes) -> bytes:
        if not (noise := self.noise):
            return data
        chance = self._chance
        return bytes(b ^ 1 << chance.randrange(8) if chance.random() < noise else b for b in data)

    def _pass_speed_on(self) -> None:
        wanted, there = termios.tcgetattr(self._far), termios.tcgetattr(self._robot)
        if wanted[SPEEDS] != there[SPEEDS]:
            there[SPEEDS] = wanted[SPEEDS]
            termios.tcsetattr(self._robot, termios.TCSANOW, there)

    def _take(self, frame: Frame) -> None:
        if frame.address == Code.SERVOS:
            fields = V2.functions[Code.SERVOS].unpack(frame.payload)
            motors = (round(motor) for motor in fields['motor'])
            angles = dict(zip(motors, fields['angle'], strict=True))
            self.targets.append(Target(time.monotonic(), angles))


def _receive(end: int) -> bytes:
    """Read from a line; what was announced may be flushed away by a change of speed."""
    with suppress(BlockingIOError):
        return os.read(end, 4096)
    return b''


def _send(end: int, data: bytes) -> None:
    """Write to a line; what is not read is dropped."""
    with suppress(BlockingIOError):
        os.write(end, data)


AHEAD = Velocity(x=0.2)
"""The demo's velocity."""
TIMEOUT = 20.0
"""Longest time in [s] for a mode to be accepted."""
ANSWER = 1.0
"""Longest time in [s] for one answer."""
STARTING = 60.0
"""Longest time in [s] for a process to be ready on a busy machine."""
LATE = re.compile('fault, (pause|joint states: none|attitude: none)')
"""Faults of a controller that did not run, or did not receive the reports of the robot."""
STALLS = 5
"""How often a busy machine may keep the controller from running while the robot stands up."""
UPRIGHT = math.radians(15.0)
"""Tilt in [rad] of a robot that stands or walks."""
LEANING = math.radians(20.0)
"""The same of one whose legs were stopped anywhere in a trot and hold: two feet are in the air. At
0.2 m/s it leans by up to 17.1 degrees, at 0.1 m/s by 18.7; test_gait_physics tries all phases."""


class SimulatedQuad:
    """Simulated robot, serial tap, bridge, controller and a client.

    Attributes:
        client: A ROS node of the test.
        tap: What is on the wire, if there is one.
        processes: The processes by name: fake_xgo, hardware, controller.
        joints: Messages of /joint_states.
        states: Messages of the controller on its state.
        truth: Messages of the simulator on where the body is.
    """

    def __init__(self, isolation: Isolation, folder: Path, *, tapped: bool = True) -> None:
        """Start everything and wait until it is ready; without a tap, the cable can be pulled."""
        urdf = robot_urdf()
        self.names = [joint.name for joint in movable_joints(urdf)]
        self._isolation = isolation
        self._folder = folder
        parameters = folder / 'parameters.yaml'
        write_parameters(parameters, urdf)
        robot = Stack(str(folder / 'robot'), simulate=True, protocol='v2')
        port = folder / ('tapped' if tapped else 'robot')
        bridge = Stack(str(port), simulate=True, protocol='v2')
        specs = [
            quad_processes(robot, parameters, find_executable)[0],
            *quad_processes(bridge, parameters, find_executable)[1:3],
        ]
        self._specs = {spec.name: spec for spec in specs}
        self.processes: dict[str, RunningProcess] = {}
        self._stack = ExitStack()
        try:
            self.client = self._stack.enter_context(RosClient(isolation.domain_id))
            sensor = qos_profile_sensor_data
            self.joints = self.client.listen(JointState, '/joint_states', sensor)
            self._velocity = self.client.node.create_publisher(Twist, '/cmd_vel', 1)
            self._modes = self.client.node.create_client(SetMode, '/set_mode')
            self.states = self.client.listen(String, '/controller_node/state', LATCHED)
            self.truth = self.client.listen(Odometry, GROUND_TRUTH, sensor)
            self.start('fake_xgo')
            if tapped:
                self.tap = SerialTap(folder / 'tapped', folder / 'robot')
                self._stack.enter_context(self.tap)
            for name in ('hardware', 'controller'):
                self.start(name)
            self.client.spin_until(lambda: bool(self.truth), TIMEOUT, 'ground truth')
        except BaseException:
            self._stack.close()
            raise

    def start(self, name: str) -> RunningProcess:
        """Start a process, once more after it was killed, and wait until it is ready."""
        if name == 'controller':
            self.states.clear()  # what one that was killed said last is not its successor's
        spec = self._specs[name]
        environment = {**self._isolation.env, **spec.environment}
        process = self._stack.enter_context(RunningProcess(spec.argv, environment))
        self.processes[name] = process
        process.wait_until_ready(STARTING)
        return process

    def start_ended(self) -> None:
        """Start anew what a test has killed, and continue what it has stopped."""
        for name, process in [*self.processes.items()]:
            if process.is_running():
                process.signal(signal.SIGCONT)
            else:
                self.start(name)

    def set_mode(self, mode: str) -> None:
        """Ask for a mode until it is accepted: what it needs may not be received yet."""
        words = 'no answer'
        deadline = time.monotonic() + TIMEOUT
        while time.monotonic() < deadline:
            # a killed controller is in the graph for a while: the request may be for it
            future = self._modes.call_async(SetMode.Request(mode=mode))
            with suppress(AssertionError):
                self.client.spin_until(future.done, ANSWER, 'answer')
                if future.result().success:
                    return
                words = future.result().message
        raise AssertionError(f'mode {mode}: {words}')

    def clear_fault(self) -> None:
        """Ask the controller to forget its fault, until what it misses is back."""

        def cleared() -> bool:
            try:
                return bool(self.client.trigger('/controller_node/clear_fault', 5.0).success)
            except AssertionError:  # DDS loses answers to a client that a new server does not know
                return False

        self.client.spin_until(cleared, TIMEOUT, 'clear fault')

    def spin(self, seconds: float) -> None:
        """Serve callbacks until the robot's clock has gone on by so many seconds."""
        begin = self._now()
        self.client.spin_until(lambda: self._now() >= begin + seconds, 60.0, 'robot time')

    def _now(self) -> float:
        stamp = self.truth[-1].header.stamp
        return float(stamp.sec + 1e-9 * stamp.nanosec)

    @property
    def state(self) -> str:
        """State of the controller, as it says it."""
        return str(self.states[-1].data) if self.states else ''

    @property
    def tilt(self) -> float:
        """How far the body is from upright in [rad]."""
        turn = self.truth[-1].pose.pose.orientation
        return tilt_of((turn.x, turn.y, turn.z, turn.w))

    def stand(self) -> None:
        """Make it stand up, and wait until it does, as :meth:`reach`."""
        self.reach('stand')

    def reach(self, mode: str) -> None:
        """Request a mode, and wait until it is reached.

        A busy machine keeps the controller from running, or reports from arriving, and that is
        a fault, as it should be: then it is asked once more.

        Raises:
            AssertionError: It is not, or another fault stops it on its way.
        """
        for _ in range(STALLS):
            self.set_mode(mode)
            asked = len(self.states)
            self.client.spin_until(partial(self._has_ended, mode, asked), TIMEOUT, mode)
            if self.state != 'fault' or not LATE.search(self._last_fault):
                break
            self.clear_fault()
        last = self.processes['controller'].lines[-1]
        assert self.state == mode, f'no {mode}, but {self.state}: {last}'

    def _has_ended(self, mode: str, since: int) -> bool:
        """Whether a mode is reached, or a fault has come since a number of states."""
        return self.state == mode or any(s.data == 'fault' for s in self.states[since:])

    @property
    def stalled(self) -> bool:
        """Whether it is in fault, as the controller itself did not run for a while."""
        return self.state == 'fault' and 'fault, pause' in self._last_fault

    @property
    def _last_fault(self) -> str:
        """What the controller said of its last fault."""
        lines = [line for line in self.processes['controller'].lines if 'fault, ' in line]
        return lines[-1] if lines else ''

    def walk(self, seconds: float, velocity: Velocity = AHEAD) -> None:
        """Command a velocity, ten times a second, for so long."""
        twist = Twist()
        twist.linear.x, twist.linear.y = velocity.x, velocity.y
        twist.angular.z = velocity.yaw
        for _ in range(round(10 * seconds)):
            self._velocity.publish(twist)
            self.spin(0.1)

    def __enter__(self) -> Self:
        """Use it in a with statement."""
        return self

    def __exit__(self, *_: object) -> None:
        """Stop all processes, the last started first."""
        self._stack.close()
