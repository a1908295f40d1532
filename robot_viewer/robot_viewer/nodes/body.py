# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""How the body of a walking robot is, and the pose that people give it, by topics."""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
import time
from typing import Any, Protocol

from geometry_msgs.msg import Point
from geometry_msgs.msg import Pose as PoseMessage
from geometry_msgs.msg import Quaternion as QuaternionMessage
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import qos_profile_sensor_data, QoSProfile
from sensor_msgs.msg import BatteryState, Imu
from urdf_reader import (
    centre_of_mass,
    DescriptionError,
    from_rpy,
    KinematicTree,
    link_poses,
    PointMass,
    Quaternion,
)

from ..page.body_panel import BodyPanel, Pose
from ..page.standing import (
    battery_text,
    Contacts,
    feet_of,
    foot_radius,
    horizon_html,
    Support,
    support,
)
from .listening import Listening

NOT_MEASURED = -1.0
"""First number of a covariance where nothing is measured (REP 145)."""
CONTACTS, CONTACTS_TYPE = 'foot_contacts', 'quad_msgs/msg/FootContacts'
CONTACTS_AGE = 1.0
"""After which contacts of feet are not shown any more in [s]."""
LEVEL: Quaternion = (0.0, 0.0, 0.0, 1.0)


class Page(Protocol):
    """Where it is shown."""

    def offer_body(self) -> BodyPanel | None:
        """Offer what is known of the body; None as long as there is no robot."""


class Body:
    """Attitude, battery, feet and pose; in the thread of the node, but for :meth:`send`.

    Attributes:
        battery: Its charge in words; empty where nothing measures it.
    """

    def __init__(
        self, node: Node, page: Page, listening: Listening, positions: Mapping[str, float]
    ) -> None:
        self._node, self._page = node, page
        self._listening, self._positions = listening, positions
        self._tree: KinematicTree | None = None
        self._feet: tuple[str, ...] = ()
        self._panel: BodyPanel | None = None
        self._attitude: Quaternion | None = None
        self.battery = ''
        self._masses: tuple[PointMass, ...] = ()
        self._radius = 0.0
        self._contacts: Contacts | None = None
        self._contacts_at = 0.0
        self._support: Support | None = None
        self._found: set[str] = set()
        self._poses: Publisher | None = None

    def describe(self, tree: KinematicTree) -> None:
        """Use another robot; the page has removed the panel."""
        self._tree, self._feet, self._panel = tree, feet_of(tree), None
        self._masses, self._radius = (), 0.0
        self._contacts = self._support = None
        if not self._feet:
            return
        try:
            self._masses = tuple(tree.masses())
        except DescriptionError as error:
            self._node.get_logger().warning(f'no centre of mass is shown: {error}')
        try:
            self._radius = foot_radius(tree, self._feet[0])
        except DescriptionError as error:
            self._node.get_logger().warning(f'the ground is shown at the feet’s centres: {error}')

    def look(self) -> None:
        """Find the topics of a walking robot in the namespace of the node."""
        if not self._feet:
            return
        for kind, topic, take in (
            (Imu, 'imu', self._take_imu),
            (BatteryState, 'battery_state', self._take_battery),
        ):
            if topic not in self._found and self._node.count_publishers(topic):
                self._found.add(topic)
                self._listening.add(kind, topic, take, qos_profile_sensor_data)
        if CONTACTS not in self._found and CONTACTS_TYPE in (
            end.topic_type for end in self._node.get_publishers_info_by_topic(CONTACTS)
        ):
            self._found.add(CONTACTS)
            kind = import_module('quad_msgs.msg').FootContacts
            self._listening.add(kind, CONTACTS, self._take_contacts, qos_profile_sensor_data)
        if self._poses is None and self._node.count_subscribers('body_pose'):
            self._poses = self._node.create_publisher(
                PoseMessage, 'body_pose', QoSProfile(depth=1)
            )
        if self._panel is None and (self._found or self._poses is not None):
            self._panel = self._page.offer_body()
        if self._panel is not None and self._poses is not None:
            self._panel.offer_pose(self.send)

    def send(self, pose: Pose) -> None:
        """Publish a pose of the body once, at once; the controller moves there slowly."""
        if self._poses is not None:
            roll, pitch, height = pose
            x, y, z, w = from_rpy(roll, pitch, 0.0)
            turn = QuaternionMessage(x=x, y=y, z=z, w=w)
            self._poses.publish(PoseMessage(position=Point(z=height), orientation=turn))

    def draw(self) -> None:
        """Show how the feet are now."""
        if self._panel is None or self._tree is None:
            return
        if time.monotonic() - self._contacts_at > CONTACTS_AGE:
            self._contacts = None
        poses = link_poses(self._tree, self._positions)
        places = {foot: poses[foot].translation for foot in self._feet}
        found = self._support = support(
            places,
            () if self._contacts is None else self._contacts.feet,
            self._attitude or LEVEL,
            centre_of_mass(self._masses, poses),
            self._radius,
        )
        self._panel.show_feet(places, self._contacts)
        self._panel.show_support(found)

    def list(self) -> None:
        """Show attitude and battery."""
        if self._panel is not None:
            feet = ''
            if self._contacts is not None and self._support is not None:
                feet = self._contacts.html(self._support)
            self._panel.show(horizon_html(self._attitude, self.battery) + feet)

    def _take_imu(self, message: Imu) -> None:
        turn = message.orientation
        measured = message.orientation_covariance[0] != NOT_MEASURED
        self._attitude = (turn.x, turn.y, turn.z, turn.w) if measured else None

    def _take_contacts(self, message: Any) -> None:  # noqa: ANN401  # quad_msgs may not be there
        pairs = zip(message.name, message.contact, strict=False)
        feet = frozenset(name for name, contact in pairs if contact)
        self._contacts, self._contacts_at = Contacts(feet, message.source), time.monotonic()

    def _take_battery(self, message: BatteryState) -> None:
        self.battery = battery_text(message.percentage, message.voltage)
