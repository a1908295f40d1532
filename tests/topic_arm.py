# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""An arm whose drives listen to topics, and the program that commands it."""

from __future__ import annotations

from contextlib import ExitStack
from functools import partial
import threading
from typing import TYPE_CHECKING

from processes import executable, RunningProcess
from ros_client import RosClient
from sensor_msgs.msg import JointState
from simulated_arm import CONTROLLER, JOINTS, READY, robot_parameters
from std_msgs.msg import Float64MultiArray
from trajectory_msgs.msg import JointTrajectory

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from isolation import Isolation
    from typing_extensions import Self

LIFETIME = 600.0
"""Longest time in [s] that the drives run."""

PATIENT = {'joint_state_timeout': '3.0', 'following_delay': '0.8'}
"""How late joint states may be in [s]: on a busy machine the drives wait for the processor."""

PANDA = {'/forward_position_controller/commands': JOINTS}
"""Joints of the topics on which set-points of the Panda arrive."""

KEPT = 1000
"""How many set-points wait for the drives: one that a busy machine loses looks like a jump."""

RECEIVED_STATES = 10
"""Joint states that a subscriber has received before the arm counts as there."""


def standalone(folder: Path, program: str, *arguments: str, semantic: str = '') -> list[str]:
    """Return the command of a program of arm_servo.

    Args:
        folder: Where its parameter file goes.
        program: Its name.
        *arguments: Further parameters, as ``name:=value``.
        semantic: What is to stand in the SRDF besides.
    """
    parameters = ['--params-file', str(robot_parameters(folder, semantic))]
    prefix = 'moveit_servo.' if program == 'servo_node' else ''
    late = [f'{prefix}{name}:={value}' for name, value in PATIENT.items()]
    given = [part for argument in (*late, *arguments) for part in ('-p', argument)]
    return [executable('arm_servo', program), '--ros-args', *parameters, *given]


class TopicArm:
    """Drives that follow set-points and publish joint states, and their program."""

    def __init__(
        self,
        isolation: Isolation,
        command: Sequence[str],
        ready: str,
        *,
        topics: Mapping[str, Sequence[str]] = PANDA,
        start: Sequence[float] = READY,
    ) -> None:
        """Start the program, and wait until it says that it is ready.

        Args:
            isolation: Of the test.
            command: Starts the program.
            ready: What it says then.
            topics: The joints of each topic of arrays.
            start: Where all of them are at first, in the order of topics, in [rad] or [m].
        """
        self.moves = True  # whether it goes to its set-points
        self.joints = [name for names in topics.values() for name in names]  # names of its joints
        self.at = list(start)  # where they are in [rad] or [m]
        self.arrays: list[list[float]] = []  # set-points as arrays so far
        self.trajectories: list[JointTrajectory] = []  # set-points as trajectories so far
        self.publishes = True  # whether it publishes where it is
        self._received = 0
        self._stopped = threading.Event()
        with ExitStack() as stack:
            self._start(isolation, stack, topics)
            self.process = stack.enter_context(RunningProcess(command, isolation.env))
            self.process.wait_for(ready)
            self.client.spin_until(
                lambda: self._received > RECEIVED_STATES, 60.0, 'subscriber of /joint_states'
            )
            self._stack = stack.pop_all()

    def _start(
        self, isolation: Isolation, stack: ExitStack, topics: Mapping[str, Sequence[str]]
    ) -> None:
        self.client = stack.enter_context(RosClient(isolation.domain_id))
        self._drives = stack.enter_context(RosClient(isolation.domain_id, 'drives'))
        node = self._drives.node
        self._states = node.create_publisher(JointState, '/joint_states', 10)
        for topic, names in topics.items():
            take = partial(self._take_array, self.joints.index(names[0]))
            node.create_subscription(Float64MultiArray, topic, take, KEPT)
        node.create_subscription(
            JointTrajectory, f'{CONTROLLER}/joint_trajectory', self._take_trajectory, 10
        )
        node.create_timer(0.02, self._speak)
        self._thread = threading.Thread(target=self._run, name='drives')
        self._thread.start()
        stack.callback(self._stop)

    def _run(self) -> None:
        """Run on while the test waits for something, as drives do."""
        self._drives.spin_until(self._stopped.is_set, LIFETIME, 'end of the test')

    def _stop(self) -> None:
        self._stopped.set()
        self._thread.join()

    def _speak(self) -> None:
        if not self.publishes:
            return
        self._states.publish(JointState(name=self.joints, position=self.at))
        self._received += self._states.get_subscription_count() > 0

    def _take_array(self, first: int, message: Float64MultiArray) -> None:
        places = list(message.data)
        self.arrays.append(places)
        if self.moves:
            self.at[first : first + len(places)] = places

    def _take_trajectory(self, message: JointTrajectory) -> None:
        assert list(message.joint_names) == JOINTS
        self.at = list(message.points[0].positions)
        self.trajectories.append(message)

    def __enter__(self) -> Self:
        """Use it in a with statement."""
        return self

    def __exit__(self, *_: object) -> None:
        """Stop the program."""
        self._stack.close()
