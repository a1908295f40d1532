# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import Twist, TwistStamped
from isolation import Isolation
from processes import executable, RunningProcess
import pytest
from ros_client import RosClient
from std_msgs.msg import Bool

pytestmark = pytest.mark.scenario
TEST_TIMEOUT = 30.0  # [s] of a test on a busy machine
CONFIG = Path(__file__).parents[1] / 'config' / 'twist_mux.yaml'


@pytest.fixture
def client(isolation: Isolation) -> Iterator[RosClient]:
    """Join the test's domain."""
    with RosClient(isolation.domain_id) as client:
        yield client


def mux(isolation: Isolation, *arguments: str) -> RunningProcess:
    """Start the node."""
    program = executable('quad_teleop', 'twist_mux')
    return RunningProcess([program, '--ros-args', *arguments], isolation.env)


def publisher(client: RosClient, message_type: Any, topic: str) -> Any:
    """Publish to the node, as soon as it listens."""
    publisher = client.node.create_publisher(message_type, topic, 1)
    client.spin_until(
        lambda: publisher.get_subscription_count() > 0, TEST_TIMEOUT, f'subscriber of {topic}'
    )
    return publisher


def wait_for(client: RosClient, received: list[Any], x: float) -> None:
    """Wait until the last velocity that came out is this one."""
    client.spin_until(
        lambda: bool(received) and received[-1].linear.x == x, TEST_TIMEOUT, f'x = {x}'
    )


def forward(x: float) -> Twist:
    """Make a velocity."""
    message = Twist()
    message.linear.x = x
    return message


def locked(messages: list[Any]) -> bool:
    """Return whether the lock is in the newest diagnostics."""
    if not messages:
        return False
    values = {entry.key: entry.value for entry in messages[-1].status[0].values}
    return bool(values['lock e_stop'][:6] == 'locked' and values['current priority'] == '255')


def test_priorities_locks_and_silence(isolation: Isolation, client: RosClient) -> None:
    """The shipped file: keyboard over planner, a lock over both, and a zero after silence."""
    with mux(isolation, '--params-file', str(CONFIG), '-r', 'cmd_vel_out:=cmd_vel') as process:
        process.wait_for('lock e_stop')
        received = client.listen(Twist, 'cmd_vel')
        navigation = publisher(client, Twist, 'nav_vel')
        keyboard = publisher(client, Twist, 'key_vel')
        stop = publisher(client, Bool, 'e_stop')
        count = client.node.count_publishers
        client.spin_until(lambda: count('cmd_vel') > 0, TEST_TIMEOUT, 'output')

        navigation.publish(forward(0.25))
        wait_for(client, received, 0.25)
        keyboard.publish(forward(0.125))
        wait_for(client, received, 0.125)
        wait_for(client, received, 0.0)  # both fell silent
        assert len(received) == 3

        keyboard.publish(forward(0.125))
        wait_for(client, received, 0.125)
        stop.publish(Bool(data=True))
        wait_for(client, received, 0.0)
        keyboard.publish(forward(0.5))
        messages = client.listen(DiagnosticArray, '/diagnostics')
        client.spin_until(lambda: locked(messages), TEST_TIMEOUT, 'lock in the diagnostics')
        assert received[-1].linear.x == 0.0
        stop.publish(Bool(data=False))
        client.spin_until(
            lambda: (keyboard.publish(forward(0.5)), received[-1].linear.x == 0.5)[1],
            TEST_TIMEOUT,
            'keyboard after the lock',
        )
        assert process.stop() == 0


def test_stamped_in_and_out(isolation: Isolation, client: RosClient) -> None:
    """With use_stamped the messages pass as they are, header too; the zero has a time."""
    with mux(isolation, '-p', 'use_stamped:=true'):
        received = client.listen(TwistStamped, 'cmd_vel_out')
        keyboard = publisher(client, TwistStamped, 'key_vel')
        count = client.node.count_publishers
        client.spin_until(lambda: count('cmd_vel_out') > 0, TEST_TIMEOUT, 'output')
        message = TwistStamped(twist=forward(0.5))
        message.header.frame_id = 'base_link'

        def passes() -> bool:
            """Publish; the multiplexer may not know this listener yet."""
            keyboard.publish(message)
            return bool(received)

        client.spin_until(passes, TEST_TIMEOUT, 'velocity')
        client.spin_until(lambda: received[-1].twist == Twist(), TEST_TIMEOUT, 'zero')
    assert received[0] == message
    assert received[-1].header.stamp.sec > 0
