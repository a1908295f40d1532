# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The other end of the teleop nodes: receives velocities and poses, and answers set_mode."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import Pose, Twist, TwistStamped
from ros_client import RosClient
from std_srvs.srv import Trigger

from quad_msgs.srv import SetMode

STILL = (0.0, 0.0, 0.0)
TEST_TIMEOUT = 30.0  # [s] of a test on a busy machine


def _answer(message: str) -> Callable[[Any, Any], Any]:
    return lambda _, __: Trigger.Response(success=True, message=message)


class Robot:
    """Listens like a controller, in a domain of its own.

    Attributes:
        client: The node behind it.
        twists: Velocities of /cmd_vel.
        stamped: Velocities of /cmd_vel_stamped.
        poses: Poses of /body_pose.
        modes: What /set_mode was asked for.
    """

    def __init__(self, client: RosClient) -> None:
        """Subscribe, and offer the services."""
        self.client = client
        self.twists: list[Twist] = client.listen(Twist, 'cmd_vel')
        self.stamped: list[TwistStamped] = client.listen(TwistStamped, 'cmd_vel_stamped')
        self.poses: list[Pose] = client.listen(Pose, 'body_pose')
        self.modes: list[str] = []
        client.node.create_service(SetMode, 'set_mode', self._set_mode)
        clear, stop = _answer('all is well'), _answer('nothing walks: relax')
        client.node.create_service(Trigger, 'controller_node/clear_fault', clear)
        client.node.create_service(Trigger, 'stop', stop)
        self._diagnostics = client.node.create_publisher(DiagnosticArray, '/diagnostics', 10)

    @property
    def velocities(self) -> list[tuple[float, float, float]]:
        """What was received on /cmd_vel: x, y [m/s] and yaw [rad/s]."""
        return [(each.linear.x, each.linear.y, each.angular.z) for each in self.twists]

    def wait_for(self, velocity: tuple[float, float, float], *, after: int = 0) -> int:
        """Wait until a velocity is received; return how many messages there are then."""
        wanted = tuple(round(part, 6) for part in velocity)

        def received() -> bool:
            found = self.velocities[after:]
            return any(tuple(round(part, 6) for part in each) == wanted for each in found)

        self.client.spin_until(received, TEST_TIMEOUT, f'velocity {velocity} on /cmd_vel')
        return len(self.twists)

    def wait_until_stopped(self) -> None:
        """Wait for a zero."""
        self.client.spin_until(
            lambda: bool(self.twists) and self.velocities[-1] == STILL, TEST_TIMEOUT, 'zero'
        )

    def wait_until_silent(self) -> int:
        """Wait for the zeros at the end of a motion; after them nothing may come.

        Returns:
            How many messages there are then.
        """
        self.client.spin_until(lambda: self.velocities[-3:] == [STILL] * 3, TEST_TIMEOUT, 'zeros')
        count = len(self.twists)
        self.listen_for(0.5)
        assert len(self.twists) == count, 'an idle teleop is silent'
        return count

    def wait_until_linked(self) -> None:
        """Wait until a teleop publishes here."""
        count = self.client.node.count_publishers
        self.client.spin_until(lambda: count('cmd_vel') > 0, TEST_TIMEOUT, 'publisher of /cmd_vel')

    def listen_for(self, duration: float) -> None:
        """Listen for a time, for what must not come."""
        clock = self.client.node.get_clock()
        end = clock.now().nanoseconds + int(duration * 1e9)
        self.client.spin_until(lambda: clock.now().nanoseconds > end, TEST_TIMEOUT, 'end')

    def fall_over(self) -> None:
        """Report a fault, as the controller does."""
        status = DiagnosticStatus(
            level=DiagnosticStatus.ERROR,
            name='controller_node: state',
            message='it fell over',
            values=[KeyValue(key='state', value='fault')],
        )
        self._diagnostics.publish(DiagnosticArray(status=[status]))

    def _set_mode(self, request: Any, response: Any) -> Any:
        self.modes.append(request.mode)
        response.success = request.mode != 'lie'
        response.message = request.mode if response.success else 'stays in stand: it is too high'
        return response
