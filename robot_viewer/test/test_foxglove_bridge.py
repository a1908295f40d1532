# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The bridge as a process, over DDS and a WebSocket, with a client that is not ours."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
import re
from socket import gethostname
import threading

from foxglove_client import encoded, FORMER, FoxgloveClient
from geometry_msgs.msg import Twist
from isolation import Isolation, reserve
from processes import executable, RunningProcess
import pytest
import rclpy
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from std_srvs.srv import SetBool, Trigger
from websockets.exceptions import InvalidStatus

from node_runner import spin

pytestmark = [pytest.mark.scenario, pytest.mark.xdist_group('foxglove-bridge')]

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
MESH = b'solid cube\nendsolid cube\n'
EMPTY = encoded('std_msgs/msg/Empty')
"""The request of a Trigger, which has no fields either."""


class Robot(Node):
    """What the bridge meets, served in a thread of its own."""

    def __init__(self) -> None:
        """Publish, subscribe and serve."""
        super().__init__('robot')
        self.twists: list[Twist] = []
        self.changed = threading.Condition()
        self.states = self.create_publisher(JointState, 'joint_states', 10)
        self.description = self.create_publisher(String, 'robot_description', LATCHED)
        self.description.publish(String(data='<robot name="r"/>'))
        self.create_subscription(Twist, 'cmd_vel', self._receive, 10)
        self.create_service(Trigger, 'halt', self._halt)
        self.create_service(SetBool, 'brake', self._brake)
        self._ending = threading.Event()
        self._thread = threading.Thread(target=spin, args=([self], self._ending))
        self._thread.start()

    def close(self) -> None:
        """End it."""
        self._ending.set()
        self._thread.join()
        self.destroy_node()

    def until(self, condition: Callable[[], bool], what: str) -> None:
        """Wait until something is true."""
        with self.changed:
            for _ in range(600):
                if condition():
                    return
                self.changed.wait(0.1)
        raise AssertionError(f'no {what}')

    def _receive(self, message: Twist) -> None:
        with self.changed:
            self.twists.append(message)
            self.changed.notify_all()

    def _halt(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        response.success, response.message = True, 'halted ✓'
        return response

    def _brake(self, request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        response.success, response.message = request.data, f'brake {request.data}'
        return response


@dataclass(frozen=True)
class Rig:
    """A robot, and a bridge beside it.

    Attributes:
        robot: The robot.
        isolation: Of both.
        url: Of the bridge.
        process: The bridge.
    """

    robot: Robot
    isolation: Isolation
    url: str
    process: RunningProcess


def bridge(env: dict[str, str], *parameters: str) -> RunningProcess:
    """Start a bridge on a free port."""
    given = [word for each in ('port:=0', *parameters) for word in ('-p', each)]
    return RunningProcess(
        [executable('robot_viewer', 'foxglove_bridge'), '--ros-args', *given], env
    )


def url_of(process: RunningProcess) -> str:
    """Wait until it listens, and return where."""
    process.wait_until_ready()
    line = process.wait_for(r'open wss?://')
    found = re.search(r'wss?://\S+', line)
    assert found is not None
    return found[0]


@pytest.fixture(scope='module')
def rig(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Rig]:
    """Start both, with a package that has a mesh."""
    prefix = tmp_path_factory.mktemp('prefix')
    share = prefix / 'share' / 'cube_description'
    (share / 'meshes').mkdir(parents=True)
    (share / 'meshes' / 'cube.stl').write_bytes(MESH)
    (share / 'secret.txt').write_text('secret')
    with reserve() as isolation:
        env = isolation.env
        env['AMENT_PREFIX_PATH'] = f'{env["AMENT_PREFIX_PATH"]}:{prefix}'
        rclpy.init(domain_id=isolation.domain_id)
        robot = Robot()
        try:
            with bridge(env) as process:
                yield Rig(robot, isolation, url_of(process), process)
                assert process.stop(60.0) == 0
                assert 'number of timers' not in process.output  # of rclpy, at each new client
        finally:
            robot.close()
            rclpy.shutdown()


@pytest.fixture
def client(rig: Rig) -> Iterator[FoxgloveClient]:
    """Connect to the bridge."""
    connected = FoxgloveClient(rig.url)
    yield connected
    connected.close()


def test_topics_come_as_they_are_while_somebody_wants_them(
    rig: Rig, client: FoxgloveClient
) -> None:
    """With the definition, in which another decoder finds every field."""
    robot = rig.robot
    client.subscribe('/joint_states')
    client.until(lambda: robot.states.get_subscription_count() == 1, 'subscription')
    sent = JointState(name=['a', 'b'], position=[0.5, -1.0])
    sent.header.frame_id = 'base'
    sent.header.stamp.sec = 12
    robot.states.publish(sent)
    got = client.next_message('/joint_states')
    assert (list(got.name), list(got.position)) == (sent.name, [0.5, -1.0])
    assert (got.header.frame_id, got.header.stamp.sec) == ('base', 12)
    client.close()
    robot.until(lambda: robot.states.get_subscription_count() == 0, 'end of the subscription')


def test_who_comes_late_gets_what_is_latched(rig: Rig, client: FoxgloveClient) -> None:
    """Also when another client has the topic already."""
    for each in (client, FoxgloveClient(rig.url)):
        each.subscribe('/robot_description')
        assert each.next_message('/robot_description').data == '<robot name="r"/>'
    each.close()


def test_clients_from_before_the_sdk_are_served(rig: Rig) -> None:
    """As @foxglove/ws-protocol of npm and older Lichtblick; all get the distribution."""
    robot, client = rig.robot, FoxgloveClient(rig.url, protocol=FORMER)
    assert client.info['metadata']['ROS_DISTRO'] == 'jazzy'
    client.subscribe('/robot_description')
    assert client.next_message('/robot_description').data == '<robot name="r"/>'
    assert client.call('/halt', EMPTY).success
    client.advertise('/cmd_vel', 'geometry_msgs/msg/Twist')
    robot.until(lambda: robot.count_publishers('cmd_vel') == 1, 'publisher')
    client.close()
    robot.until(lambda: robot.count_publishers('cmd_vel') == 0, 'end of the publisher')


def test_clients_publish_until_they_have_gone(rig: Rig) -> None:
    """A message that is none never reaches the topic; a killed client leaves no publisher."""
    robot, client = rig.robot, FoxgloveClient(rig.url)
    assert 'clientPublish' in client.info['capabilities']
    assert client.info['supportedEncodings'] == ['cdr']
    channel = client.advertise('/cmd_vel', 'geometry_msgs/msg/Twist')
    robot.until(lambda: robot.count_publishers('cmd_vel') == 1, 'publisher')
    vector = [encoded('geometry_msgs/msg/Vector3', x=x, y=0.0, z=0.0)[4:] for x in (0.2, 0.4)]
    twist = b'\0\1\0\0' + b''.join(vector)

    def arrives() -> bool:
        """Send it again: what is sent before both ends know each other is lost."""
        client.publish(channel, twist)
        return bool(robot.twists)

    robot.until(arrives, 'twist')
    client.publish(channel, b'\0\1\0\0short')
    client.until(lambda: any('is no Twist' in text for text in client.statuses), 'refusal')
    client.advertise('/cmd_vel', 'nobody_msgs/msg/Twist')
    client.until(lambda: any('nobody_msgs' in text for text in client.statuses), 'refusal')
    client.abort()
    robot.until(lambda: robot.count_publishers('cmd_vel') == 0, 'end of the publisher')
    assert {(each.linear.x, each.angular.x) for each in robot.twists} == {(0.2, 0.4)}


def test_services_are_called(rig: Rig, client: FoxgloveClient) -> None:
    """By CDR, with both definitions; a request that is none fails in words."""
    assert rig.url
    answer = client.call('/halt', EMPTY)
    assert (answer.success, answer.message) == (True, 'halted ✓')
    assert client.services['/halt']['type'] == 'std_srvs/srv/Trigger'
    answer = client.call('/brake', encoded('std_msgs/msg/Bool', data=True))
    assert (answer.success, answer.message) == (True, 'brake True')
    assert 'no request of it in CDR' in client.call('/brake', b'\0\1\0\0')


def test_files_of_packages_are_fetched(rig: Rig, client: FoxgloveClient) -> None:
    """Meshes, and nothing else."""
    assert rig.url
    assert client.fetch('package://cube_description/meshes/cube.stl') == MESH
    for uri, reason in (
        ('package://cube_description/secret.txt', 'no mesh or image of a package'),
        ('file:///etc/passwd', 'no mesh or image of a package'),
        ('package://cube_description/%2e%2e/x.stl', 'leaves its package'),
        ('package://nobody/x.stl', 'nobody is not installed'),
    ):
        answer = client.fetch(uri)
        assert isinstance(answer, str)
        assert reason in answer


@pytest.mark.parametrize(
    ('origin', 'admitted'),
    [
        ('https://app.foxglove.dev', True),
        ('http://localhost:8080', True),
        ('https://elsewhere.example', False),
        ('null', False),
    ],
)
def test_pages_of_other_sites_are_refused(rig: Rig, origin: str, admitted: bool) -> None:
    """Each page that a browser has open reaches the port, and would drive the robot."""
    if admitted:
        FoxgloveClient(rig.url, origin).close()
        return
    with pytest.raises(InvalidStatus) as refused:
        FoxgloveClient(rig.url, origin)
    assert refused.value.response.status_code == 403
    assert 'allowed_origins' in refused.value.response.body.decode()


def test_what_is_not_allowed_is_not_there(rig: Rig) -> None:
    """A bridge that only shows; for other hosts it needs its token."""
    with bridge(
        rig.isolation.env,
        'address:=0.0.0.0',
        "topic_whitelist:=['/joint_.*']",
        "service_whitelist:=['']",
        "client_topic_whitelist:=['']",
    ) as process:
        url = url_of(process).replace(gethostname(), '127.0.0.1')
        with pytest.raises(InvalidStatus):
            FoxgloveClient(url.partition('?')[0])
        client = FoxgloveClient(url)
        client.subscribe('/joint_states')
        assert client.channels.keys() == {'/joint_states'}
        assert not client.services
        client.advertise('/cmd_vel', 'geometry_msgs/msg/Twist')
        client.until(lambda: bool(client.statuses), 'refusal')
        client.close()
        assert rig.robot.count_publishers('cmd_vel') == 0


def test_a_port_in_use_is_named(rig: Rig) -> None:
    """With what to do."""
    port = rig.url.rpartition(':')[2]
    command = [executable('robot_viewer', 'foxglove_bridge'), '--ros-args', '-p', f'port:={port}']
    with RunningProcess(command, rig.isolation.env) as process:
        assert process.wait(60.0) == 1
        assert f'port {port} of 127.0.0.1' in process.output
        assert 'choose another' in process.output


def test_what_is_missing_is_named(rig: Rig, tmp_path: Path) -> None:
    """Whoever has not foxglove-sdk reads in one line how to install it."""
    (tmp_path / 'foxglove.py').write_text("raise ModuleNotFoundError(name='foxglove')\n")
    env = rig.isolation.env
    env['PYTHONPATH'] = f'{tmp_path}:{env.get("PYTHONPATH", "")}'
    with bridge(env) as process:
        assert process.wait(60.0) == 1
        assert 'workspace build --with foxglove' in process.output
        assert 'Traceback' not in process.output
