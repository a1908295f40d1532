# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""How the body of a walking robot is, and the pose that people give it, by topics."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

from geometry_msgs.msg import Point
from geometry_msgs.msg import Pose as PoseMessage
from geometry_msgs.msg import Quaternion as QuaternionMessage
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import qos_profile_sensor_data, QoSProfile
from sensor_msgs.msg import BatteryState, Imu
from urdf_reader import from_rpy, KinematicTree, Quaternion

from ..page.body_panel import BodyPanel, Pose
from ..page.standing import battery_text, feet_of, feet_places, horizon_html, standing
from .listening import Listening

NOT_MEASURED = -1.0
"""First number of a covariance where nothing is measured (REP 145)."""


class Page(Protocol):
    """Where it is shown."""

    def offer_body(self) -> BodyPanel | None:
        """Offer what is known of the body; None as long as there is no robot."""


class Body:
    """Attitude, battery, feet and pose; in the thread of the node, but for :meth:`send`."""

    def __init__(
        self, node: Node, page: Page, listening: Listening, positions: Mapping[str, float]
    ) -> None:
        """Find nothing yet.

        Args:
            node: The node of the page.
            page: The page.
            listening: Subscribes while somebody looks.
            positions: Where the joints are in [rad], always the last ones.
        """
        self._node, self._page = node, page
        self._listening, self._positions = listening, positions
        self._tree: KinematicTree | None = None
        self._feet: tuple[str, ...] = ()
        self._panel: BodyPanel | None = None
        self._attitude: Quaternion | None = None
        self._battery = ''
        self._found: set[str] = set()
        self._poses: Publisher | None = None

    def describe(self, tree: KinematicTree) -> None:
        """Take another robot; the page has taken the panel away."""
        self._tree, self._feet, self._panel = tree, feet_of(tree), None

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
        if self._panel is not None and self._tree is not None and self._attitude is not None:
            places = feet_places(self._tree, self._feet, self._positions)
            self._panel.show_feet(places, standing(places, self._attitude))

    def list(self) -> None:
        """Show attitude and battery."""
        if self._panel is not None:
            self._panel.show(horizon_html(self._attitude, self._battery))

    def _take_imu(self, message: Imu) -> None:
        turn = message.orientation
        measured = message.orientation_covariance[0] != NOT_MEASURED
        self._attitude = (turn.x, turn.y, turn.z, turn.w) if measured else None

    def _take_battery(self, message: BatteryState) -> None:
        self._battery = battery_text(message.percentage, message.voltage)
