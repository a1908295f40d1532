# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Joint states of drives, channels and the robot; a drive that is lost is warned of."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
import time
from types import SimpleNamespace
from typing import Any

from hypothesis import given
from hypothesis import strategies as st
from isolation import Isolation
import pytest
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.time import Time
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from urdf_reader import Mimic

from arm_canopen import CanopenError
from arm_canopen.joints import (
    JointAggregator,
    Joints,
    JointSample,
    JointSet,
    SilenceWatch,
    STALE_AFTER,
    START_TIMEOUT,
)
from arm_canopen.nodes.joint_state_publisher import BusJointStates, DriveJointStates
from arm_canopen.nodes.output_thread import OutputThread

DEADLINE = 10.0  # [s] for what takes milliseconds
URDF = """<robot name="r"><link name="a"/><link name="b"/><link name="c"/><link name="d"/>
<joint name="flange" type="fixed"><parent link="d"/><child link="e"/></joint><link name="e"/>
<joint name="elbow" type="revolute"><parent link="a"/><child link="b"/><axis xyz="0 0 1"/>
<limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
<joint name="shoulder" type="continuous"><parent link="b"/><child link="c"/>
<axis xyz="0 0 1"/></joint>
<joint name="finger" type="prismatic"><parent link="c"/><child link="d"/><axis xyz="0 0 1"/>
<limit lower="-1" upper="1" effort="1" velocity="1"/>
<mimic joint="elbow" multiplier="2"/></joint></robot>"""


def axis_of(name: str, position: float, velocity: float = 0.0, effort: float = 0.0) -> Any:
    """Return what is needed of the state of an axis."""
    return SimpleNamespace(
        name=name, position=position, velocity=velocity, effort=effort, fresh=True
    )


class Scene:
    """A node with the joint states of one drive of two channels, and who listens to them."""

    def __init__(self, node: Node) -> None:
        """Make them."""
        self.node = node
        axes = [axis_of('shoulder', 0.1, 0.2, 0.3), axis_of('elbow', 0.4, 0.5, 0.6)]
        self.drive = DriveJointStates(node, axes)
        self.output = OutputThread(node.get_logger())  # type: ignore[no-untyped-call]
        self.bus = BusJointStates(node, [self.drive], self.output)
        self.received: dict[str, JointState] = {}
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(node)
        self.output.start()

    def listen(self, topic: str) -> None:
        """Receive a topic."""
        self.node.create_subscription(
            JointState, topic, partial(self.received.__setitem__, topic), 10
        )

    def cycle(self, until: Callable[[], bool], sync_age: float = 0.0) -> None:
        """Run cycles until something holds."""
        deadline = time.monotonic() + DEADLINE
        while not until():
            self.bus.update_listeners()
            self.bus.feedback(time.monotonic() - sync_age)
            self._executor.spin_once(timeout_sec=0.02)
            assert time.monotonic() < deadline


@pytest.fixture
def scene(isolation: Isolation) -> Iterator[Scene]:
    """A scene in a ROS domain of its own."""
    rclpy.init(domain_id=isolation.domain_id)
    scene = Scene(Node('joint1'))
    yield scene
    scene.output.stop()
    scene.node.destroy_node()  # type: ignore[no-untyped-call]
    rclpy.shutdown()


@pytest.mark.slow
def test_each_channel_has_the_joint_states_of_a_drive(scene: Scene) -> None:
    """Under its own name, which is that of a joint, beside those of the whole device."""
    for topic in ('joint1', 'shoulder', 'elbow'):
        scene.listen(f'/{topic}/joint_states')
    scene.cycle(lambda: len(scene.received) == 3)
    whole, elbow, shoulder = (
        scene.received[f'/{topic}/joint_states'] for topic in ('joint1', 'elbow', 'shoulder')
    )
    assert [*whole.name] == ['shoulder', 'elbow']
    assert [*whole.position] == [0.1, 0.4]
    assert [*elbow.name] == ['elbow']
    assert [elbow.position[0], elbow.velocity[0]] == [0.4, 0.5]
    assert [*shoulder.effort] == [0.3]
    assert not scene.node.get_publishers_info_by_topic('/joint_states')  # by default


@pytest.mark.slow
def test_the_joints_of_the_robot_have_the_stamp_of_the_sync(scene: Scene) -> None:
    """All in one message, in the order of bus.yml as long as no URDF is known."""
    scene.bus.publish_robot('')
    scene.listen('/joint_states')
    scene.cycle(lambda: bool(scene.received), sync_age=5.0)
    message = scene.received['/joint_states']
    assert [*message.name] == ['shoulder', 'elbow']
    assert [*message.position] == [0.1, 0.4]
    age = scene.node.get_clock().now() - Time.from_msg(message.header.stamp)
    assert age.nanoseconds >= 5_000_000_000


@pytest.mark.slow
def test_the_urdf_gives_the_order_and_joints_that_mimic(scene: Scene) -> None:
    """From the topic of robot_state_publisher; fixed ones have no state."""
    latched = QoSProfile(  # type: ignore[no-untyped-call]
        depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL
    )
    scene.bus.publish_robot('')
    scene.listen('/joint_states')
    scene.node.create_publisher(String, 'robot_description', latched).publish(String(data=URDF))
    names = ['elbow', 'shoulder', 'finger']
    scene.cycle(lambda: bool(scene.received) and [*scene.received['/joint_states'].name] == names)
    assert [*scene.received['/joint_states'].position] == [0.4, 0.1, 0.8]


@pytest.mark.slow
@pytest.mark.parametrize(
    ('first', 'published'),
    [('lid', ['lid', 'tool', 'left', 'right']), ('elbow', ['elbow', 'finger'])],
)
def test_drives_that_the_urdf_lacks_are_named_once(
    first: str, published: list[str], scene: Scene, capfd: pytest.CaptureFixture[str]
) -> None:
    """They keep their own topics; where it lacks all of them, that of the robot, too."""
    names = [(first, 'tool'), ('left', 'right')]
    drives = [
        DriveJointStates(scene.node, [axis_of(axis, 0.7) for axis in axes]) for axes in names
    ]
    scene.bus = BusJointStates(scene.node, drives, scene.output)
    scene.bus.publish_robot(URDF)
    topics = ['/joint_states', *(f'/{axis}/joint_states' for axes in names for axis in axes)]
    for topic in topics:
        scene.listen(topic)
    scene.cycle(lambda: len(scene.received) == len(topics))
    assert [*scene.received['/joint_states'].name] == published
    (line,) = [line for line in capfd.readouterr().err.splitlines() if 'tool' in line]
    assert ('elbow, shoulder, finger' in line) == (first == 'lid')


@pytest.mark.slow
def test_a_drive_that_is_not_fresh_is_left_out_after_a_while(scene: Scene) -> None:
    """What is not known is not invented; the drive comes back with its TPDOs."""
    other = axis_of('wrist', 0.7)
    drives = [scene.drive, DriveJointStates(scene.node, [other])]
    scene.bus = BusJointStates(scene.node, drives, scene.output)
    scene.bus.publish_robot('')
    scene.listen('/joint_states')

    def published() -> list[str]:
        return [*scene.received['/joint_states'].name] if scene.received else []

    scene.cycle(lambda: published() == ['shoulder', 'elbow', 'wrist'])
    other.fresh = False
    scene.cycle(lambda: published() == ['shoulder', 'elbow'])
    other.fresh = True
    scene.cycle(lambda: published() == ['shoulder', 'elbow', 'wrist'])


@pytest.mark.parametrize(
    ('text', 'words'),
    [('<robot>', 'no XML'), ('<robot name="r"><link name="a"/></robot>', 'no revolute')],
)
def test_a_text_that_is_no_robot_is_refused(scene: Scene, text: str, words: str) -> None:
    """The parameter robot_description, before anything runs."""
    with pytest.raises(CanopenError, match=words):
        scene.bus.publish_robot(text)


PERIOD_NS = 10_000_000
NAMES = ['elbow', 'wrist', 'base']  # URDF order, which is no alphabetical one


def sample(value: float) -> JointSample:
    """Return a state that can be distinguished from others."""
    return JointSample(value, -value, 2 * value)


class Publisher:
    """Feeds an aggregator and keeps what it publishes."""

    def __init__(self, joints: Joints | None = None) -> None:
        self.aggregator = JointAggregator(joints or dict.fromkeys(NAMES))
        self.sets: list[JointSet] = []

    def receive(self, name: str, cycle: int, value: float = 0.0) -> None:
        """Receive the state of a joint at a cycle of 10 ms."""
        stamp, now = cycle * PERIOD_NS, cycle * PERIOD_NS * 1e-9
        self.sets += self.aggregator.update(name, stamp, sample(value), now)

    def settle(self) -> None:
        """Run two cycles, in which it learns which joints take part."""
        for cycle in (1, 2):
            for name in NAMES:
                self.receive(name, cycle)
        self.sets.clear()


@given(st.lists(st.permutations(NAMES), min_size=1, max_size=20))
def test_one_set_for_each_cycle_in_urdf_order(orders: list[list[str]]) -> None:
    """Whatever the order in which drives answer, each cycle gives one set, with its own values."""
    publisher = Publisher()
    publisher.settle()
    for cycle, order in enumerate(orders, start=3):
        for name in order:
            publisher.receive(name, cycle, cycle + NAMES.index(name) / 10)
    assert [state.stamp for state in publisher.sets] == [
        cycle * PERIOD_NS for cycle in range(3, 3 + len(orders))
    ]
    for cycle, state in enumerate(publisher.sets, start=3):
        assert [*state.samples] == NAMES
        assert [*state.samples.values()] == [sample(cycle + place / 10) for place in range(3)]


def test_a_lost_joint_is_left_out_after_a_while_and_named() -> None:
    """It delays one cycle only; its last state is repeated for a moment, then it counts as silent.

    From its second cycle on it is waited for again.
    """
    publisher = Publisher()
    publisher.settle()
    last = 2 + round(STALE_AFTER * 1e9 / PERIOD_NS)
    for cycle in range(3, last + 3):
        publisher.receive('base', cycle)
        assert len(publisher.sets) == max(0, cycle - 3)  # it leaves with the last joint
        publisher.receive('elbow', cycle)
    assert [state.stamp // PERIOD_NS for state in publisher.sets] == list(range(3, last + 3))
    with_wrist = [state.stamp // PERIOD_NS for state in publisher.sets if 'wrist' in state.samples]
    assert max(with_wrist) in (last - 1, last)
    assert [*publisher.sets[-1].samples] == ['elbow', 'base']
    assert publisher.aggregator.silent((last + 2) * PERIOD_NS * 1e-9) == ['wrist']
    for cycle in range(last + 3, last + 6):
        for name in NAMES:
            publisher.receive(name, cycle)
    assert [len(state.samples) for state in publisher.sets[-2:]] == [3, 3]
    assert publisher.aggregator.silent((last + 6) * PERIOD_NS * 1e-9) == []


def test_joints_that_never_come_are_silent_from_the_start() -> None:
    """In URDF order, without those that follow others; half a robot is not published at once."""
    publisher = Publisher({'a': None, 'b': Mimic('a'), 'c': None})
    assert publisher.aggregator.silent(0.0) == ['a', 'c']
    waited = round(STALE_AFTER * 1e9 / PERIOD_NS) + 1
    for cycle in range(1, waited + 1):
        publisher.receive('c', cycle)
    assert publisher.sets == []
    publisher.receive('c', waited + 1)
    assert [*publisher.sets[-1].samples] == ['c']
    assert publisher.aggregator.silent(waited * 0.01) == ['a']
    publisher = Publisher()
    for name, cycle in (('elbow', 1), ('elbow', 2), ('wrist', 2), ('base', 2)):
        publisher.receive(name, cycle)
    assert [[*state.samples] for state in publisher.sets] == [NAMES]


def test_a_mimic_joint_follows_by_its_law_unless_it_is_received_itself() -> None:
    """It is multiplier * leader + offset; a drive of its own beats the law."""
    publisher = Publisher({'a': None, 'b': Mimic('a', -2.0, 0.5)})
    publisher.receive('a', 1, 3.0)
    state = publisher.sets[-1]
    assert [*state.samples] == ['a', 'b']
    assert state.samples['b'] == JointSample(-5.5, 6.0, 0.0)
    publisher.receive('a', 2, 3.0)
    publisher.receive('b', 2, 1.0)
    for name, value in (('a', 3.0), ('b', 1.0)):
        publisher.receive(name, 3, value)
    assert publisher.sets[-1].samples == {'a': sample(3.0), 'b': sample(1.0)}


def test_a_clock_that_is_set_back_does_not_stop_the_sets() -> None:
    """Joints that report again begin a new round, whatever their stamp."""
    publisher = Publisher()
    for cycle in (1000, 1001):
        for name in NAMES:
            publisher.receive(name, cycle)
    publisher.sets.clear()
    for cycle in (10, 11, 12):
        for name in NAMES:
            publisher.receive(name, cycle)
    assert [state.stamp // PERIOD_NS for state in publisher.sets] == [10, 11, 12]


PERIOD = 2.0  # [s] between two looks


LONG = START_TIMEOUT
BOTH, ELBOW = ['base', 'elbow'], ['elbow']
LOOKS: dict[str, list[tuple[list[str], float, list[str], list[str], list[str]]]] = {
    'a slow start is no loss, neither before the master is there nor while its drives boot': [
        ([], 2.0, BOTH, [], []),
        ([], 15.0, BOTH, BOTH, []),
        (['base'], LONG, ELBOW, BOTH, []),
        (ELBOW, LONG + PERIOD, [], [], []),
    ],
    'a joint that never comes is missing, such as one that bus.yml calls otherwise': [
        (['base'], PERIOD, ELBOW, [], []),
        ([], LONG + PERIOD, ELBOW, [], ELBOW),
    ],
    'a drive that is silent in two looks is missing until it is back': [
        (BOTH, PERIOD, [], [], []),
        ([], 2 * PERIOD, ELBOW, ELBOW, []),
        ([], 3 * PERIOD, ELBOW, ELBOW, ELBOW),
        ([], 4 * PERIOD, ELBOW, ELBOW, ELBOW),
        ([], 5 * PERIOD, [], [], []),
        ([], 6 * PERIOD, ELBOW, ELBOW, []),
        ([], 7 * PERIOD, ELBOW, ELBOW, ELBOW),
    ],
    'a master that ends takes its publishers along; another one may start as slowly': [
        (BOTH, PERIOD, [], [], []),
        ([], 2 * PERIOD, BOTH, BOTH, []),
        ([], 3 * PERIOD, BOTH, [], []),
        ([], 3 * PERIOD + LONG, BOTH, BOTH, []),
        ([], 4 * PERIOD + LONG, BOTH, BOTH, BOTH),
    ],
}
"""Joints that came, when it looks in [s], which are silent, which have a publisher; missing."""


@pytest.mark.parametrize('case', LOOKS)
def test_joints_that_are_missing(case: str) -> None:
    """By what the last looks saw."""
    watch = SilenceWatch(BOTH, 0.0)
    for came, now, silent, published, missing in LOOKS[case]:
        for joint in came:
            watch.note(joint)
        assert watch.look(silent, published, now) == missing, now
