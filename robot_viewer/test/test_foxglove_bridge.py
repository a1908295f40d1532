# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The bridge as a process, over DDS and a WebSocket, with a client that is not ours."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
import queue
import re
import socket
import threading

from foxglove_client import FORMER, FoxgloveClient
from isolation import Isolation, reserve
from processes import executable, RunningProcess
import pytest
import rclpy
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.serialization import serialize_message
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from websockets.client import ClientProtocol
from websockets.exceptions import InvalidStatus
from websockets.uri import parse_uri

from node_runner import spin
from robot_viewer.nodes.foxglove_bridge import Admission, FOXGLOVE_ORIGINS, PROTOCOLS, Server

ANYWHERE = frozenset({'*'})
FOXGLOVE = frozenset(FOXGLOVE_ORIGINS)


@pytest.mark.parametrize(
    ('origin', 'admitted'),
    [
        ('https://app.foxglove.dev', True),
        ('file://', True),
        ('http://localhost:8080', True),
        ('http://[::1]:8080', True),
        ('https://app.foxglove.dev.evil.example', False),
        ('http://localhost.evil.example', False),
        ('https://evil.example', False),
        ('null', False),
        ('', False),
    ],
)
def test_sites_on_loopback(origin: str, admitted: bool) -> None:
    """A page cannot change its Origin; a program sends none."""
    admission = Admission(FOXGLOVE, '')
    assert not admission.refusal('/', [])
    assert bool(admission.refusal('/', [origin])) != admitted
    assert not Admission(ANYWHERE, '').refusal('/', [origin])


def test_from_elsewhere_the_token_counts() -> None:
    """Whatever the site is."""
    admission = Admission(FOXGLOVE, 'secret')
    assert not admission.refusal('/?token=secret', [])
    for path in ('/', '/?token=', '/?token=secretx', '/secret', '/?token=s\u00e9cret'):
        assert 'token' in admission.refusal(path, [])
    assert 'allowed_origins' in admission.refusal('/?token=secret', ['https://evil.example'])


def test_a_topic_that_is_offered_anew_is_subscribed_to_anew() -> None:
    """A subscription ends with its channel: each message comes once, and under a number of now."""
    taken = queue.SimpleQueue[str]()
    server = Server(('127.0.0.1', 0), Admission(FOXGLOVE, ''), taken.put)
    client = FoxgloveClient(f'ws://127.0.0.1:{server.port}')
    try:
        for number in (1, 2):
            string = {'schemaName': 'std_msgs/msg/String', 'schema': 'string data'}
            form = {'encoding': 'cdr', 'schemaEncoding': 'ros2msg', **string}
            server.post(server.offer, '/a', {'id': number, 'topic': '/a', **form})
            client.subscribe('/a')
            assert taken.get(timeout=60.0) == '/a'
            for text in ('first', 'second'):
                server.post(server.send, '/a', 0, serialize_message(String(data=text)))
            assert [client.next_message('/a').data for _ in range(2)] == ['first', 'second']
            server.post(server.withdraw, '/a')
            client.until(lambda: '/a' not in client.channels, 'its end')
            assert not server.wanted
    finally:
        client.close()
        server.close()


def test_a_client_that_does_not_answer_is_not_waited_for() -> None:
    """As one on a computer that sleeps: it holds up no end of the bridge."""
    server = Server(('127.0.0.1', 0), Admission(FOXGLOVE, ''), lambda _: None)
    protocol = ClientProtocol(parse_uri(f'ws://127.0.0.1:{server.port}'), subprotocols=PROTOCOLS)
    protocol.send_request(protocol.connect())
    with socket.create_connection(('127.0.0.1', server.port), timeout=60.0) as silent:
        silent.sendall(b''.join(protocol.data_to_send()))
        assert silent.recv(1000).startswith(b'HTTP/1.1 101')
        ending = threading.Thread(target=server.close, daemon=True)
        ending.start()
        ending.join(5.0)
        assert not ending.is_alive()


LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
MESH = b'solid cube\nendsolid cube\n'


class Robot(Node):
    """What the bridge meets, served in a thread of its own."""

    def __init__(self) -> None:
        super().__init__('robot')
        self.changed = threading.Condition()
        self.states = self.create_publisher(JointState, 'joint_states', 10)
        self.description = self.create_publisher(String, 'robot_description', LATCHED)
        self.description.publish(String(data='<robot name="r"/>'))
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


@dataclass(frozen=True)
class Rig:
    """A robot, and a bridge beside it."""

    robot: Robot  # the robot
    isolation: Isolation  # of both
    url: str  # of the bridge
    process: RunningProcess  # the bridge


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


@pytest.mark.scenario
@pytest.mark.xdist_group('foxglove-bridge')
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


@pytest.mark.scenario
@pytest.mark.xdist_group('foxglove-bridge')
def test_who_comes_late_gets_what_is_latched(rig: Rig, client: FoxgloveClient) -> None:
    """Also when another client has the topic already."""
    for each in (client, FoxgloveClient(rig.url)):
        each.subscribe('/robot_description')
        assert each.next_message('/robot_description').data == '<robot name="r"/>'
    each.close()


@pytest.mark.scenario
@pytest.mark.xdist_group('foxglove-bridge')
def test_clients_from_before_the_sdk_are_served(rig: Rig) -> None:
    """As @foxglove/ws-protocol of npm and Lichtblick; one that is killed leaves nothing."""
    robot, client = rig.robot, FoxgloveClient(rig.url, protocol=FORMER)
    assert client.info['metadata']['ROS_DISTRO'] == 'jazzy'
    client.subscribe('/robot_description')
    assert client.next_message('/robot_description').data == '<robot name="r"/>'
    client.subscribe('/joint_states')
    robot.until(lambda: robot.states.get_subscription_count() == 1, 'subscription')
    client.abort()
    robot.until(lambda: robot.states.get_subscription_count() == 0, 'its end')


@pytest.mark.scenario
@pytest.mark.xdist_group('foxglove-bridge')
def test_what_is_not_of_the_protocol_is_refused(client: FoxgloveClient) -> None:
    """With the text, and why; the client keeps its connection."""
    client.send('subscribe')
    client.until(lambda: bool(client.statuses), 'refusal')
    client.send('fetchAsset', uri='package://cube_description/meshes/cube.stl')
    client.until(lambda: len(client.statuses) > 1, 'another refusal')
    for name, text in zip(('subscriptions', 'requestId'), client.statuses, strict=True):
        assert text.startswith('not understood: \'{"op": ')
        assert f"KeyError: '{name}'" in text


@pytest.mark.scenario
@pytest.mark.xdist_group('foxglove-bridge')
def test_a_number_that_no_message_carries_is_refused(rig: Rig, client: FoxgloveClient) -> None:
    """Its client keeps its connection, and the others get their messages."""
    robot, topic, other = rig.robot, '/joint_states', FoxgloveClient(rig.url)
    other.until(lambda: topic in other.channels, 'channel')
    wrong: list[object] = [-1, 2**32, 1.5, True, '7']
    for number in wrong:
        wanted = {'id': number, 'channelId': other.channels[topic]['id']}
        other.send('subscribe', subscriptions=[wanted])
    other.send('fetchAsset', uri='package://cube_description/meshes/cube.stl', requestId=-1)
    other.subscribe(topic)
    client.subscribe(topic)
    client.until(lambda: robot.states.get_subscription_count() == 1, 'subscription')
    other.until(lambda: len(other.statuses) > len(wrong), 'refusals')
    for number, text in zip([*wrong, -1], other.statuses, strict=True):
        assert f' {number!r}: give it a whole number from 0 to 4294967295' in text
    for each in (client, other):
        robot.states.publish(JointState(name=['a']))
        assert list(each.next_message(topic).name) == ['a']
    other.close()


@pytest.mark.scenario
@pytest.mark.xdist_group('foxglove-bridge')
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


@pytest.mark.scenario
@pytest.mark.xdist_group('foxglove-bridge')
def test_pages_of_other_sites_are_refused(rig: Rig) -> None:
    """Each page that a browser has open reaches the port."""
    FoxgloveClient(rig.url, 'https://app.foxglove.dev').close()
    with pytest.raises(InvalidStatus) as refused:
        FoxgloveClient(rig.url, 'https://elsewhere.example')
    assert refused.value.response.status_code == 403
    assert 'allowed_origins' in refused.value.response.body.decode()


@pytest.mark.scenario
@pytest.mark.xdist_group('foxglove-bridge')
def test_a_port_in_use_is_named(rig: Rig) -> None:
    """With what to do."""
    port = rig.url.rpartition(':')[2]
    command = [executable('robot_viewer', 'foxglove_bridge'), '--ros-args', '-p', f'port:={port}']
    with RunningProcess(command, rig.isolation.env) as process:
        assert process.wait(60.0) == 1
        assert f'port {port} of 127.0.0.1' in process.output
        assert 'choose another' in process.output
