# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Checks observed ROS traffic: nodes, rates, joint names, transforms."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import closing, suppress
from dataclasses import dataclass, field
import time

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from nav_msgs.msg import Odometry
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, qos_profile_sensor_data, QoSProfile
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage
from urdf_reader import DescriptionError, read_urdf

from process_supervisor import CallError
from process_supervisor.graph_client import GraphClient
from quad_description import movable_joints
from quad_msgs.msg import JointCommand

from . import error, Finding, good, note, warning

ROOT = 'odom'


def links_without_place(links: Iterable[str], parents: Mapping[str, str]) -> list[str]:
    """Return the links that no chain of transforms connects to odom."""
    return [link for link in links if not _reaches(link, parents)]


def _reaches(link: str, parents: Mapping[str, str]) -> bool:
    seen: set[str] = set()
    while link != ROOT:
        if link in seen or link not in parents:  # a loop is no way either
            return False
        seen.add(link)
        link = parents[link]
    return True


NODES = ('hardware_node', 'controller_node', 'robot_state_publisher')
RATE, MIN_RATE_RATIO = 50.0, 0.9  # [Hz], and the share of it that is still well
_SOURCES = {
    'joint_states': 'hardware_node',
    'imu': 'hardware_node',
    'odom': 'hardware_node',
    'joint_command': 'controller_node',
}


@dataclass(slots=True)
class Observation:
    """Messages and graph data received during an observation."""

    duration: float  # how long [s]
    nodes: set[str] = field(default_factory=set)  # names of nodes
    publishers: dict[str, list[str]] = field(default_factory=dict)  # names of nodes by topic
    counts: dict[str, int] = field(default_factory=dict)  # messages by topic
    joints: tuple[str, ...] = ()  # names in the last /joint_states
    urdf: str = ''  # the robot, from /robot_description; empty when there is none
    # parent by child of all transforms, static ones included
    parents: dict[str, str] = field(default_factory=dict)
    # level and text of each status that is not well
    diagnostics: list[tuple[int, str]] = field(default_factory=list)


def check_graph(seen: Observation, port: str) -> Iterator[Finding]:
    """Check all observations."""
    bringup = f'ros2 run quad_bringup bringup --port {port}'
    running = [name for name in NODES if name in seen.nodes]
    if not running:
        yield note(
            'nodes',
            'nothing of the robot runs in this domain',
            f'{bringup}; if it does run, compare ROS_DOMAIN_ID on both sides',
        )
        return
    yield from _check_nodes(seen, bringup)
    for topic in _SOURCES:
        yield from _check_rate(seen, topic)
    yield from _check_joints(seen)
    yield from _check_transforms(seen)
    for level, text in seen.diagnostics:
        remedy = 'see /diagnostics'
        yield (warning if level == 1 else error)('diagnostics', text, remedy)


def _check_nodes(seen: Observation, bringup: str) -> Iterator[Finding]:
    missing = [name for name in NODES if name not in seen.nodes]
    if missing:
        remedy = f'{bringup} starts all of them'
        yield warning('nodes', f'{", ".join(missing)} not running', remedy)
    else:
        yield good('nodes', ', '.join(NODES))
    for topic, names in seen.publishers.items():
        if len(names) > 1 and topic in _SOURCES:
            remedy = 'end all but one: they contradict each other'
            yield error(topic, f'{len(names)} publishers: {", ".join(names)}', remedy)


def _check_rate(seen: Observation, topic: str) -> Iterator[Finding]:
    source = _SOURCES[topic]
    rate = seen.counts.get(topic, 0) / seen.duration
    if rate >= RATE * MIN_RATE_RATIO:
        yield good(topic, f'{rate:.1f} Hz')
    elif rate > 0:
        remedy = 'free -h; no parallel build while it walks; see the counters in /diagnostics'
        yield warning(topic, f'{rate:.1f} Hz instead of {RATE:.0f}', remedy)
    elif source not in seen.nodes:
        yield note(topic, f'silent, for {source} is not running')
    elif topic == 'joint_command':
        yield note(
            topic, 'silent', "ros2 service call /set_mode quad_msgs/srv/SetMode '{mode: stand}'"
        )
    else:
        yield error(topic, 'silent', f'see the log of {source}; is the robot connected?')


def _check_joints(seen: Observation) -> Iterator[Finding]:
    if not seen.urdf:
        remedy = 'run robot_state_publisher, which publishes it'
        yield warning('robot_description', 'no publisher', remedy)
        return
    try:
        wanted = [joint.name for joint in movable_joints(seen.urdf)]
    except DescriptionError as problem:
        yield error('robot_description', str(problem), 'correct the URDF')
        return
    if not seen.joints:
        return
    missing = [name for name in wanted if name not in seen.joints]
    unknown = [name for name in seen.joints if name not in wanted]
    remedy = 'give hardware_node and robot_state_publisher the same URDF'
    if missing:
        yield error('joints', f'in the URDF, not in /joint_states: {", ".join(missing)}', remedy)
    if unknown:
        yield error('joints', f'in /joint_states, not in the URDF: {", ".join(unknown)}', remedy)
    if not missing and not unknown:
        yield good('joints', f'{len(wanted)}, as in the URDF')


def _check_transforms(seen: Observation) -> Iterator[Finding]:
    if not seen.urdf:
        return
    try:
        lost = links_without_place(read_urdf(seen.urdf).links, seen.parents)
    except DescriptionError:
        return  # said above
    if lost:
        remedy = 'robot_state_publisher and hardware_node publish them; compare joint names above'
        yield error('tf', f'no way from odom to {", ".join(lost)}', remedy)
    else:
        yield good('tf', f'{len(seen.parents)} transforms, complete from odom')


SETTLING = 1.0  # [s] until topics are connected
DISCOVERY = 5.0  # [s] until the others are found, if they are there at all
_KINDS = {
    'joint_states': JointState,
    'imu': Imu,
    'odom': Odometry,
    'joint_command': JointCommand,
}
_LATCHED = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)


def observe(duration: float) -> Observation:
    """Subscribe to the robot's topics for a while; return what was received."""
    with closing(GraphClient('quad_doctor', lambda: False)) as client:
        node, seen = client.node, Observation(duration)
        _subscribe(node, seen)
        with suppress(CallError):
            client.wait_until(lambda: not _running(node).isdisjoint(NODES), DISCOVERY, 'a robot')
        client.listen(SETTLING)
        seen.counts.clear()
        began = time.monotonic()
        client.listen(duration)
        seen.duration = time.monotonic() - began
        seen.nodes = _running(node)
        for topic in _KINDS:
            infos = node.get_publishers_info_by_topic(topic)
            seen.publishers[topic] = [info.node_name for info in infos]
        return seen


def _running(node: Node) -> set[str]:
    return set(node.get_node_names())


def _subscribe(node: Node, seen: Observation) -> None:
    for topic, kind in _KINDS.items():
        node.create_subscription(kind, topic, _count(seen, topic), qos_profile_sensor_data)

    def description(message: String) -> None:
        seen.urdf = message.data

    def transforms(message: TFMessage) -> None:
        seen.parents.update({t.child_frame_id: t.header.frame_id for t in message.transforms})

    def diagnostics(message: DiagnosticArray) -> None:
        names = {status.name for status in message.status}
        kept = [entry for entry in seen.diagnostics if entry[1].split(' (')[0] not in names]
        bad = (s for s in message.status if s.level != DiagnosticStatus.OK)
        seen.diagnostics = [*kept, *((s.level[0], f'{s.name} ({s.message})') for s in bad)]

    node.create_subscription(String, 'robot_description', description, _LATCHED)
    node.create_subscription(TFMessage, '/tf', transforms, 100)
    node.create_subscription(TFMessage, '/tf_static', transforms, _LATCHED)
    node.create_subscription(DiagnosticArray, 'diagnostics', diagnostics, 10)


def _count(seen: Observation, topic: str) -> Callable[[object], None]:
    def take(message: object) -> None:
        seen.counts[topic] = seen.counts.get(topic, 0) + 1
        if isinstance(message, JointState):
            seen.joints = tuple(message.name)

    return take
