# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""hardware_node as a process, on a pseudo-terminal with a robot behind it."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import deque
from contextlib import ExitStack
from pathlib import Path
from typing import Any, TYPE_CHECKING

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from isolation import Isolation
from nav_msgs.msg import Odometry
from processes import executable, RunningProcess
from rclpy.qos import qos_profile_sensor_data
from ros_client import RosClient
from sensor_msgs.msg import BatteryState, Imu, JointState
from tf2_msgs.msg import TFMessage

from quad_hardware.nodes.hardware_node import COMMAND_QOS
from quad_hardware.protocol import Protocol, V2
from quad_msgs.msg import FootContacts, JointCommand
from quad_pty_peer import Behaviour, PtyPeer

if TYPE_CHECKING:
    from typing_extensions import Self

TIMEOUT = 20.0  # [s]
TOPICS = {
    '/joint_states': JointState,
    '/imu': Imu,
    '/odom': Odometry,
    '/foot_contacts': FootContacts,
    '/battery_state': BatteryState,
    '/diagnostics': DiagnosticArray,
    '/tf': TFMessage,
    '/fake_xgo/ground_truth': Odometry,
    '/fake_xgo/foot_contacts': FootContacts,
}


class Rig(ABC):
    """The node, a robot and a client.

    Attributes:
        node: Process of the node.
        client: A node of the test.
        received: Messages by topic.
    """

    def __init__(self, isolation: Isolation, port: Path, *arguments: str) -> None:
        self._env, self._stack = isolation.env, ExitStack()
        try:
            self._add_robot(self._stack, port)
            self.client = self._stack.enter_context(RosClient(isolation.domain_id))
            self.received: dict[str, list[Any]] = {
                topic: self.client.listen(kind, topic, qos_profile_sensor_data)
                for topic, kind in TOPICS.items()
            }
            self._commands = self.client.node.create_publisher(
                JointCommand, '/joint_command', COMMAND_QOS
            )
            self._command = [
                executable('quad_hardware', 'hardware_node'),
                '--ros-args',
                *('-p', f'port:={port}'),
                *('-p', 'diagnostics_period:=0.2'),
                *('-p', 'joints_checked:=true'),
                *arguments,
            ]
            self.node = self.start()
            self.node.wait_for('running: reports arrive', TIMEOUT)
            self.wait_until_ready()
        except BaseException:
            self._stack.close()
            raise

    @abstractmethod
    def _add_robot(self, stack: ExitStack, port: Path) -> None:
        """Start a robot that ends with the rig."""

    def start(self, *arguments: str) -> RunningProcess:
        """Start the node; it ends with the rig."""
        command = [*self._command, *arguments]
        return self._stack.enter_context(RunningProcess(command, self._env))

    def restart(self, *arguments: str) -> None:
        """End the node, and start it again."""
        assert self.node.stop() == 0
        self.node = self.start(*arguments)
        self.node.wait_for('running: reports arrive', TIMEOUT)
        self.received['/joint_states'].clear()
        self.wait_until_ready()

    def wait_until_ready(self) -> None:
        """Wait until the node reports and receives commands."""
        self.receive('/joint_states')
        matched = self._commands.get_subscription_count
        self.client.spin_until(lambda: matched() > 0, TIMEOUT, 'subscriber of commands')

    def receive(self, topic: str, count: int = 1) -> Any:
        """Wait for new messages of a topic; return the last."""
        messages = self.received[topic]
        until = len(messages) + count
        self.client.spin_until(lambda: len(messages) >= until, TIMEOUT, f'{topic} {count} times')
        return messages[-1]

    def receive_position(self, angle: float) -> None:
        """Wait for joint states with all legs at an angle [rad]."""
        states, first = self.received['/joint_states'], len(self.received['/joint_states'])

        def is_there() -> bool:
            legs = states[-1].position[:12] if len(states) > first else ()
            return bool(legs) and all(abs(position - angle) < 0.02 for position in legs)

        self.client.spin_until(is_there, TIMEOUT, f'joints at {angle:.2f} rad')

    def command(self, positions: list[float], **others: list[float]) -> None:
        """Publish a joint command."""
        self._commands.publish(JointCommand(position=positions, **others))

    def stream(self, positions: list[float], duration: float) -> None:
        """Publish a joint command 50 times a second, as a controller does."""
        self._stream([positions] * round(duration / 0.02))

    def swing(self, steps: int) -> None:
        """Publish commands of a trot, 50 times a second, that break off in a step."""
        commands = []
        for tick in range(1, 7 * steps + 5):  # between two steps all feet stand
            up = 0.3 if tick // 7 % 2 else -0.3
            thighs = (0.6 + up, 0.6 - up, 0.6 - up, 0.6 + up)
            commands.append([angle for thigh in thighs for angle in (0.0, thigh, -0.3)])
        self._stream(commands)

    def _stream(self, commands: list[list[float]]) -> None:
        rest = deque(commands)

        def send() -> None:
            if rest:
                self.command(rest.popleft())

        timer = self.client.node.create_timer(0.02, send)
        self.client.spin_until(lambda: not rest, TIMEOUT, 'stream of commands')
        self.client.node.destroy_timer(timer)

    def status(self, name: str) -> DiagnosticStatus:
        """Return the newest diagnostic of a name."""
        array = self.received['/diagnostics'][-1] if self.received['/diagnostics'] else None
        found = [s for s in array.status if s.name.endswith(name)] if array else []
        return found[0] if found else DiagnosticStatus()

    def wait_for_status(self, name: str, level: bytes, text: str) -> DiagnosticStatus:
        """Wait until a diagnostic has a level and says something."""
        self.client.spin_until(
            lambda: self.status(name).level == level and text in self.status(name).message,
            TIMEOUT,
            f'{text!r} of {name}; the last was {self.status(name).message!r}',
        )
        return self.status(name)

    def __enter__(self) -> Self:
        """Use it in a with statement."""
        return self

    def __exit__(self, *_error: object) -> None:
        """End everything."""
        self._stack.close()


class NodeRig(Rig):
    """The node with a robot without physics, which lives in the process of the test.

    Attributes:
        peer: The robot.
    """

    def __init__(
        self, isolation: Isolation, folder: Path, *arguments: str, protocol: Protocol = V2
    ) -> None:
        """Plug the robot in, start the node and listen."""
        self._protocol = protocol
        super().__init__(isolation, folder / 'port', *arguments)

    def _add_robot(self, stack: ExitStack, port: Path) -> None:
        self.peer = stack.enter_context(PtyPeer(port, self._protocol))

    def begin_anew(self) -> None:
        """Put the robot to zero, without faults, and forget what was received."""
        self.peer.behaviour = Behaviour()
        before = len(self.peer.commands)

        def is_commanded() -> bool:  # after a way down, commands begin where the legs are
            self.command(list(self.receive('/joint_states', 10).position))
            self.receive('/joint_states', 3)
            return len(self.peer.commands) > before

        def is_quiet() -> bool:  # on a busy machine commands are still on their way
            sent = len(self.peer.commands)
            self.receive('/joint_states', 10)
            return len(self.peer.commands) == sent

        self.client.spin_until(is_commanded, TIMEOUT, 'the last command')
        self.client.spin_until(is_quiet, TIMEOUT, 'the end of commands')
        self.peer.angles.update(dict.fromkeys(self.peer.angles, 0.0))
        self.peer.commands.clear()
        for messages in self.received.values():
            messages.clear()
        self.wait_until_ready()

    def largest_step(self) -> float:
        """Farthest that a servo target moved between two commands [deg]."""
        steps = [0.0]
        for before, after in zip(self.peer.commands, self.peer.commands[1:], strict=False):
            steps += [abs(after[motor] - before[motor]) for motor in after if motor in before]
        return max(steps)
