# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""How a walking robot stands: pure, and by its topics."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from contextlib import closing
import math
import sys
from types import SimpleNamespace
from typing import Any

from geometry_msgs.msg import Pose, Quaternion
from hypothesis import given
from hypothesis import strategies as st
from isolation import Isolation
import pytest
from rclpy.node import Node
from sensor_msgs.msg import BatteryState, Imu, JointState
from std_msgs.msg import Header, String
from urdf_reader import centre_of_mass, from_rpy, link_poses, multiply, read_urdf, Vector
from viewer_rig import in_domain, ViewerRig

from node_runner import LATCHED
from quad_msgs.msg import FootContacts
from robot_viewer.nodes.body import (
    battery_text,
    Body,
    Contacts,
    DOWN_COLOR,
    horizon_html,
    roll_pitch,
    SOURCES,
    support,
)
from robot_viewer.page.robot_page import RobotPage
from robot_viewer.page.robot_scene import feet_of

LEVEL = (0.0, 0.0, 0.0, 1.0)
LEGS = {'fl': (0.1, 0.1), 'fr': (0.1, -0.1), 'rl': (-0.1, 0.1), 'rr': (-0.1, -0.1)}
URDF = f"""<robot name="dog"><link name="body"/>{
    ''.join(
        f'<link name="{name}_foot"/><joint name="{name}" type="prismatic">'
        f'<parent link="body"/><child link="{name}_foot"/><origin xyz="{x} {y} -0.1"/>'
        '<axis xyz="0 0 1"/><limit lower="-1" upper="1" velocity="1" effort="1"/></joint>'
        for name, (x, y) in LEGS.items()
    )
}<link name="imu_link"/><joint name="imu" type="fixed"><origin rpy="3.14159265 0 2"/>
<parent link="body"/><child link="imu_link"/></joint></robot>"""
TREE = read_urdf(URDF)
SOURCE_CONSTANTS = [name for name, value in vars(FootContacts).items() if isinstance(value, str)]
SOURCE_CONSTANTS = [name for name in SOURCE_CONSTANTS if name.isupper()]


@given(st.floats(-1.5, 1.5), st.floats(-1.5, 1.5), st.floats(-3.0, 3.0))
def test_roll_and_pitch_do_not_depend_on_the_heading(
    roll: float, pitch: float, yaw: float
) -> None:
    """They are those of the quaternion."""
    assert roll_pitch(from_rpy(roll, pitch, yaw)) == pytest.approx((roll, pitch), abs=1e-6)


def test_what_feet_on_the_ground_span() -> None:
    """All round the robot, below the feet; the centre of mass over it, however the body leans."""
    feet = feet_of(TREE)
    assert len(feet) == 4
    poses = link_poses(TREE, {})
    places = {foot: poses[foot].translation for foot in feet}
    found = support(places, feet, LEVEL, (0.02, 0.0, 0.05), 0.01)
    assert [corner[:2] for corner in found.corners] == [
        (-0.1, -0.1), (0.1, -0.1), (0.1, 0.1), (-0.1, 0.1)
    ]  # fmt: skip
    assert [corner[2] for corner in found.corners] == pytest.approx([-0.11] * 4)
    assert found.below == pytest.approx((0.02, 0.0, -0.11))
    assert found.margin == pytest.approx(0.08)
    three = support(places, set(feet) - {'fl_foot'}, LEVEL, (0.02, 0.02, 0.0))
    assert three.margin == pytest.approx(-0.04 / math.sqrt(2.0))
    two = support(places, ['fl_foot', 'rr_foot'], LEVEL, (0.0, 0.0, 0.0))
    assert two.margin is None
    assert two.below == pytest.approx((0.0, 0.0, -0.1))
    nose_down = support(places, feet, from_rpy(0.0, 0.2, 0.0), (0.0, 0.0, 0.05))
    assert nose_down.margin == pytest.approx(0.1 * math.cos(0.2) - 0.15 * math.sin(0.2))
    assert support(places, (), LEVEL, None).corners == ()


def test_the_centre_of_mass_moves_with_the_links() -> None:
    """Half of it is in a foot that is lifted; none is known of links without."""
    mass = '<inertial><mass value="1"/><origin xyz="0 0 {z}"/></inertial>'
    text = URDF
    for link, z in (('body', 0.2), ('fl_foot', 0.0)):
        whole = f'<link name="{link}">{mass.format(z=z)}</link>'
        text = text.replace(f'<link name="{link}"/>', whole)
    tree = read_urdf(text)
    poses = link_poses(tree, {'fl': 0.02})
    assert centre_of_mass(tuple(tree.masses()), poses) == pytest.approx((0.05, 0.05, 0.06))
    assert centre_of_mass((), poses) is None


def test_contacts_say_how_they_are_known() -> None:
    """And whether the robot would stand still, or why nobody knows."""
    places = {foot: link_poses(TREE, {})[foot].translation for foot in feet_of(TREE)}
    two = {'fl_foot', 'rr_foot'}

    def text(feet: Collection[str], centre: Vector | None, source: str = 'physics') -> str:
        return Contacts(frozenset(feet), source).html(support(places, feet, LEVEL, centre))

    stands = text(two, (0.0, 0.0, 0.0), 'measured_height')
    assert 'feet on the ground: fl, rr<' in stands
    assert 'nothing senses it' in stands
    assert 'no support polygon' in stands
    assert '12 mm outside the support' in text(places, (0.112, 0.0, 0.0))
    assert 'the simulation knows' in text(places, (0.0, 0.0, 0.0))
    assert 'centre of mass unknown' in text(places, None)
    assert 'no support polygon' in text(two, None)
    assert 'on the ground: none<' in text((), None, '')


@pytest.mark.parametrize('name', SOURCE_CONSTANTS)
def test_each_source_of_contacts_has_words(name: str) -> None:
    """Those of the message are those of the page."""
    assert getattr(FootContacts, name) in SOURCES
    assert len(SOURCES) == len(SOURCE_CONSTANTS)


def test_a_robot_without_feet_has_none() -> None:
    """An arm, or what has two of them."""
    assert feet_of(read_urdf('<robot name="r"><link name="a_foot"/></robot>')) == ()


def test_what_is_not_measured_is_not_shown() -> None:
    """Numbers and horizon without an attitude, and a battery without a voltage."""
    assert 'roll' not in horizon_html(None, '50 %')
    assert battery_text(0.5, math.nan) == '50 %'
    assert battery_text(math.nan, 7.4) == '7.4 V'
    assert 'battery' not in horizon_html(LEVEL, battery_text(math.nan, 0.0))
    shown = horizon_html(from_rpy(0.1, -0.2, 1.0), '')
    assert 'roll +5.7°, pitch -11.5°' in shown
    assert 'rotate(-5.7) translate(0 11.5)' in shown


class Watched:
    """A body whose robot publishes contacts of feet, without ROS.

    Attributes:
        warnings: What it warned of.
        topics: What it listens to.
    """

    def __init__(self) -> None:
        self.warnings: list[str] = []
        self.topics: list[str] = []
        publisher = SimpleNamespace(topic_type='quad_msgs/msg/FootContacts')
        node: Any = SimpleNamespace(
            get_logger=lambda: SimpleNamespace(warning=self.warnings.append),
            count_publishers=lambda topic: 0,
            count_subscribers=lambda topic: 0,
            get_publishers_info_by_topic=lambda topic: [publisher],
        )
        listening: Any = SimpleNamespace(add=lambda _, topic, __: self.topics.append(topic))
        page: Any = SimpleNamespace(robot=None)
        self.body = Body(node, page, listening, {})


def test_another_robot_has_nothing_of_the_one_before() -> None:
    """Contacts are gone; a damaged foot costs its radius, and not the centre of mass."""
    watched = Watched()
    watched.body.describe(TREE)
    watched.body._take_contacts(FootContacts(name=['fl_foot'], contact=[True], source='physics'))
    assert watched.body._contacts is not None
    sphere = '<collision><geometry><sphere radius="big"/></geometry></collision>'
    mass = '<inertial><mass value="1"/></inertial>'
    text = URDF.replace('<link name="fl_foot"/>', f'<link name="fl_foot">{mass}{sphere}</link>')
    watched.body.describe(read_urdf(text))
    assert watched.body._contacts is None
    (warning,) = watched.warnings
    assert 'feet’s centres' in warning
    assert len(watched.body._masses) == 1


@pytest.fixture
def dog(isolation: Isolation, monkeypatch: pytest.MonkeyPatch) -> Iterator[Dog]:
    """Start a page beside it, as if it were open."""
    monkeypatch.setattr(RobotPage, 'watched', True)
    with in_domain(isolation, 'port:=8700'), closing(Dog()) as made:
        yield made


class Dog(ViewerRig):
    """What the page takes for a quadruped."""

    def __init__(self) -> None:
        node = Node('dog')
        super().__init__(node)
        self.poses: list[Pose] = []
        self.lift = 0.0
        node.create_subscription(Pose, 'body_pose', self.poses.append, 10)
        self._text = node.create_publisher(String, 'robot_description', LATCHED)
        self._states = node.create_publisher(JointState, 'joint_states', 10)
        self._imu = node.create_publisher(Imu, 'imu', 10)
        self._battery = node.create_publisher(BatteryState, 'battery_state', 10)
        self._contacts = node.create_publisher(FootContacts, 'foot_contacts', 10)
        self.sends_contacts = self.sends_imu = True
        node.create_timer(0.05, self._publish)
        self._text.publish(String(data=URDF))

    @property
    def body(self) -> Body:
        """That of the page."""
        return self.viewer._body

    def _publish(self) -> None:
        positions = [self.lift, 0.0, 0.0, 0.0]
        self._states.publish(JointState(name=list(LEGS), position=positions))
        x, y, z, w = multiply(from_rpy(0.1, 0.0, 0.0), from_rpy(math.pi, 0.0, 2.0))
        turned = Quaternion(x=x, y=y, z=z, w=w)
        if self.sends_imu:
            self._imu.publish(Imu(header=Header(frame_id='imu_link'), orientation=turned))
        self._battery.publish(BatteryState(percentage=0.75, voltage=7.4))
        if self.sends_contacts:
            names = [f'{leg}_foot' for leg in LEGS]
            contact = [False, True, True, True]
            source = FootContacts.MEASURED_HEIGHT
            self._contacts.publish(FootContacts(name=names, contact=contact, source=source))


def test_the_page_shows_how_it_stands(dog: Dog) -> None:
    """Attitude, battery and feet; its sliders move the body until STOP."""
    dog.spin_until(lambda: dog.body.offered, 'the panel')
    dog.spin_until(lambda: 'roll +5.7' in dog.body._html.content, 'the attitude')
    dog.spin_until(lambda: 'battery 75 %, 7.4 V' in dog.body._html.content, 'the battery')
    dog.spin_until(lambda: 'fr, rl, rr' in dog.body._html.content, 'contacts')
    feet = dog.body._foot_marks
    dog.spin_until(lambda: tuple(feet['rr_foot'].color) == DOWN_COLOR, 'marks of contacts')
    assert tuple(feet['fl_foot'].color) != DOWN_COLOR
    dog.body.show_marks(False)
    assert not any(mark.visible for mark in dog.body._marks)
    dog.sends_contacts = False
    dog.spin_until(lambda: tuple(feet['rr_foot'].color) != DOWN_COLOR, 'the end of old contacts')
    dog.spin_until(lambda: len(dog.body._sliders) == 3, 'sliders')
    publisher = dog.body._poses
    assert publisher is not None
    dog.spin_until(lambda: publisher.get_subscription_count() > 0, 'a subscription')
    dog.body.send((0.1, 0.2, -0.01))
    dog.spin_until(lambda: bool(dog.poses), 'a pose')
    turn, place = dog.poses[0].orientation, dog.poses[0].position
    assert roll_pitch((turn.x, turn.y, turn.z, turn.w)) == pytest.approx((0.1, 0.2))
    assert (place.x, place.y, place.z) == (0.0, 0.0, -0.01)
    assert not any(slider.disabled for slider in dog.body._sliders)
    dog.viewer.page._stop()
    dog.spin_until(lambda: all(slider.disabled for slider in dog.body._sliders), 'no motion')
    dog.sends_imu = False
    dog.spin_until(lambda: 'attitude unknown' in dog.body._html.content, 'its end')
    assert 'battery unknown' in dog.body._html.content
    assert 'feet on the ground: unknown' in dog.body._html.content


def test_a_machine_without_the_messages_shows_the_rest(
    dog: Dog, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The robot may be elsewhere; it is said once what is missing."""
    said: list[str] = []
    monkeypatch.setattr(dog.viewer.page, 'say', lambda text, **_: said.append(text))
    monkeypatch.setitem(sys.modules, 'quad_msgs.msg', None)
    dog.spin_until(lambda: dog.body.offered, 'the panel')
    dog.spin_until(lambda: 'roll +5.7' in dog.body._html.content, 'the attitude')
    dog.spin_until(lambda: len(dog.body._sliders) == 3, 'sliders')
    (text,) = (text for text in said if 'quad_msgs' in text)
    assert text.startswith('the body is not shown as a whole: quad_msgs is not installed here')
