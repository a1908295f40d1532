# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""ROS node of the simulated robot: services for pushes and faults; publishes ground truth."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import TimeoutError as NotDoneError
import gc
import math
import sys

from geometry_msgs.msg import Vector3
from nav_msgs.msg import Odometry
from rclpy.node import Node
from rclpy.utilities import try_shutdown
from std_msgs.msg import Header
from std_srvs.srv import Trigger

from node_runner import init_ros, spin_beside
from quad_description import FEET
from quad_description.rotations import Vector
from quad_msgs.msg import FootContacts
from quad_msgs.srv import InjectFault, Push

from .board import POSE_TIME
from .exceptions import SetupError
from .faults import FOREVER, make_fault
from .options import Simulation
from .server import Server

TRUTH_PERIOD = 0.05  # [s]
ANSWER_TIMEOUT = 1.0  # [s] the loop answers within milliseconds
END_ALL = 'none'
SWITCH_INTERVAL = 0.0005  # [s] how long a callback may keep the robot from the interpreter


class FakeXgoNode(Node):
    """Provides ``~/push``, ``~/fault`` and ``~/stand``, and publishes the ground truth."""

    def __init__(self, server: Server, simulation: Simulation) -> None:
        """Create the services; the robot runs in the server's loop."""
        super().__init__('fake_xgo')
        self._server, self._simulation = server, simulation
        self.create_service(Push, '~/push', self._push)
        self.create_service(InjectFault, '~/fault', self._fault)
        self.create_service(Trigger, '~/stand', self._stand)
        self._truth = self.create_publisher(Odometry, '~/ground_truth', 10)
        self._contacts = self.create_publisher(FootContacts, '~/foot_contacts', 10)
        self.create_timer(TRUTH_PERIOD, self._publish)

    def _push(self, request: Push.Request, response: Push.Response) -> Push.Response:
        force, velocity = _vector(request.force), _vector(request.velocity)
        plant = self._simulation.plant

        def act() -> str:
            if not any(force) and not any(velocity):
                raise SetupError('neither force [N] nor velocity [m/s] is given')
            if any(velocity):
                plant.kick(velocity)
            if any(force):
                plant.push(force, request.duration)
            return f'pushed with {force} N for {request.duration} s, kicked by {velocity} m/s'

        response.success, response.message = self._do(act)
        return response

    def _fault(
        self, request: InjectFault.Request, response: InjectFault.Response
    ) -> InjectFault.Response:
        plan = self._simulation.line.faults

        def act() -> str:
            now = self._server.now
            plan.prune(now)
            if request.fault == END_ALL:
                plan.end_all()
                return 'all faults have ended'
            if not (math.isfinite(request.duration) and request.duration >= 0.0):
                raise SetupError(f'duration {request.duration}: give seconds, 0 for no end')
            plan.add(make_fault(request.fault, request.settings, now, request.duration or FOREVER))
            return f'{request.fault} from now on' + (
                f' for {request.duration} s' if request.duration else ''
            )

        response.success, response.message = self._do(act)
        return response

    def _stand(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        def act() -> str:
            self._simulation.board.stand()
            return f'stands in {POSE_TIME} s, as after a press of its button'

        response.success, response.message = self._do(act)
        return response

    def _do(self, action: Callable[[], str]) -> tuple[bool, str]:
        try:
            return True, self._server.submit(action).result(ANSWER_TIMEOUT)
        except SetupError as error:
            return False, str(error)
        except NotDoneError:
            return False, 'the simulation does not answer; has it ended?'

    def _publish(self) -> None:
        truth = self._server.truth
        message = Odometry()
        message.header.stamp = self.get_clock().now().to_msg()
        message.header.frame_id = 'world'
        message.child_frame_id = 'base_link'
        pose, twist = message.pose.pose, message.twist.twist
        pose.position.x, pose.position.y, pose.position.z = truth.pose.position
        orientation = pose.orientation
        orientation.x, orientation.y, orientation.z, orientation.w = truth.pose.orientation
        twist.linear.x, twist.linear.y, twist.linear.z = truth.velocity.linear
        twist.angular.x, twist.angular.y, twist.angular.z = truth.velocity.angular
        self._truth.publish(message)
        self._contacts.publish(
            FootContacts(
                header=Header(stamp=message.header.stamp),
                name=list(FEET),
                contact=list(truth.foot_contacts),
                source=FootContacts.PHYSICS,
            )
        )


def serve_with_ros(
    server: Server,
    simulation: Simulation,
    ros_arguments: Sequence[str],
    report_ready: Callable[[], None],
) -> None:
    """Run the robot in a thread and its node here, until a signal stops the server.

    Raises:
        SimulationError: The simulation failed.
    """
    init_ros(ros_arguments)
    node = FakeXgoNode(server, simulation)
    sys.setswitchinterval(SWITCH_INTERVAL)
    gc.freeze()  # what is there now is there to stay, and need not be looked through

    def live() -> None:
        report_ready()
        server.run()

    try:
        spin_beside(live, [node], server.stopping, 'fake_xgo')
    finally:
        node.destroy_node()
        try_shutdown()


def _vector(message: Vector3) -> Vector:
    return message.x, message.y, message.z
