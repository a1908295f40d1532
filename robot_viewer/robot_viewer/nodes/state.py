# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``ros2 run robot_viewer state``: may the robot be moved? One line, and an exit code."""

from __future__ import annotations

import sys
import threading
import time

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from urdf_reader import read_urdf

from node_runner import LATCHED, make_executor, refuse_misspelt, run_program

from ..robot_state import Level, robot_state, RobotState
from .watch import Watch

NAME = 'state'
LOOK_TIME, ANSWER_TIME = 3.0, 1.5
"""Longest time in [s] to look at a robot, and to wait for what its page says."""
HELP = """\
Prints in one line whether a robot may be moved: a word, the reason, and what to do. Where its page
runs it is the line of the page; else it is computed from what the robot sends meanwhile.

usage: ros2 run robot_viewer state [--ros-args -r __ns:=/NAMESPACE]

exit code: 0 it may be moved, 1 after an action (allow motion, enable), 2 a fault, 3 out of reach
or no robot
"""


class StateNode(Node):
    """Looks at a robot for a moment."""

    def __init__(self) -> None:
        super().__init__(NAME)
        refuse_misspelt(self)
        self._watch, self._robot = Watch(), ''
        self._watch.listen(begins=True)
        sensor = qos_profile_sensor_data
        self.create_subscription(String, 'robot_description', self._describe, LATCHED)
        self.create_subscription(JointState, 'joint_states', self._watch.take_joints, sensor)
        self.create_subscription(DiagnosticArray, 'diagnostics', self._watch.take_statuses, 10)

    def _describe(self, message: String) -> None:
        self._robot = read_urdf(message.data).name

    @property
    def state(self) -> RobotState:
        """What the page says of the robot, or else what is seen of it."""
        page = self._watch.answer
        if page is None:
            services = (name for name, _ in self.get_service_names_and_types())
            return robot_state(self._watch.seen(self._robot, services, publishes=True))
        values = page.values
        word, sentence = values.get('word', ''), values.get('sentence', page.message)
        return RobotState(word, Level(values.get('color', 'unknown')), sentence)

    def known(self, elapsed: float) -> bool:
        """Whether nothing more is waited for, after a time in [s]."""
        seen = bool(self._robot and self._watch.statuses and self._watch.joints_age is not None)
        return self._watch.answer is not None or (seen and elapsed > ANSWER_TIME)


def main() -> int:
    """Print the state.

    Returns:
        0 where the robot may be moved.
    """
    return run_program(NAME, _look, help_text=HELP)


def _look(stop: threading.Event) -> int:
    node, executor = StateNode(), make_executor()
    executor.add_node(node)
    begin = time.monotonic()
    while not stop.is_set() and not node.known(elapsed := time.monotonic() - begin):
        if elapsed > LOOK_TIME:
            break
        executor.spin_once(0.1)
    state = node.state
    sys.stdout.write(f'{state}\n')
    executor.shutdown()
    node.destroy_node()
    return state.level.exit_code
