# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""How the body of a walking robot is, and the pose that people give it, by topics."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from importlib import import_module
import math
import time
from typing import Any, TypeAlias

from geometry_msgs.msg import Point
from geometry_msgs.msg import Pose as PoseMessage
from geometry_msgs.msg import Quaternion as QuaternionMessage
import numpy as np
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile
from sensor_msgs.msg import BatteryState, Imu
from urdf_reader import (
    centre_of_mass,
    DescriptionError,
    from_rpy,
    KinematicTree,
    link_poses,
    PointMass,
    Quaternion,
    Vector,
)
from viser import (
    GuiEvent,
    GuiHtmlHandle,
    GuiSliderHandle,
    IcosphereHandle,
    LineSegmentsHandle,
)

from ..page.robot_page import RobotPage
from ..page.robot_scene import RobotScene
from ..page.standing import (
    battery_text,
    Contacts,
    feet_of,
    foot_radius,
    horizon_html,
    Support,
    support,
)
from ..page.style import NEUTRAL, value_of
from .listening import Listening

NOT_MEASURED = -1.0
"""First number of a covariance where nothing is measured (REP 145)."""
CONTACTS, CONTACTS_TYPE = 'foot_contacts', 'quad_msgs/msg/FootContacts'
CONTACTS_AGE = 1.0
"""After which contacts of feet are not shown any more in [s]."""
LEVEL: Quaternion = (0.0, 0.0, 0.0, 1.0)
RANGES: Mapping[str, float] = {'Roll [deg]': 20.0, 'Pitch [deg]': 17.0, 'Height [mm]': 30.0}
"""Of the sliders to either side; the controller has limits of its own."""
LEVEL_LABEL = 'Level the body'
DOWN_COLOR, UP_COLOR, LINE_COLOR = (35, 112, 50), (134, 142, 150), (24, 100, 171)
MASS_COLOR, OUTSIDE_COLOR = (24, 100, 171), (255, 212, 59)
"""Of the place below the centre of mass: over the support, or outside."""
FOOT_RADIUS = 0.012
"""Of the mark of a foot in [m]."""
MASS_RADIUS = 0.008
"""Of the mark below the centre of mass in [m]."""
LINE_WIDTH = 3.0
"""In [px]."""

Pose: TypeAlias = tuple[float, float, float]
"""Roll and pitch in [rad], height in [m], relative to the normal pose."""


class Body:
    """Attitude, battery, feet and pose; in the thread of the node, but for :meth:`send`.

    Attributes:
        battery: Its charge in words; empty where nothing measures it.
        panel: Where it is shown; None before something of it is known.
    """

    def __init__(
        self, node: Node, page: RobotPage, listening: Listening, positions: Mapping[str, float]
    ) -> None:
        self._node, self._page = node, page
        self._listening, self._positions = listening, positions
        self._tree: KinematicTree | None = None
        self._feet: tuple[str, ...] = ()
        self.panel: BodyPanel | None = None
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
        self._tree, self._feet, self.panel = tree, feet_of(tree), None
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
                self._listening.add(kind, topic, take)
        if CONTACTS not in self._found and CONTACTS_TYPE in (
            end.topic_type for end in self._node.get_publishers_info_by_topic(CONTACTS)
        ):
            self._found.add(CONTACTS)
            kind = import_module('quad_msgs.msg').FootContacts
            self._listening.add(kind, CONTACTS, self._take_contacts)
        if self._poses is None and self._node.count_subscribers('body_pose'):
            self._poses = self._node.create_publisher(
                PoseMessage, 'body_pose', QoSProfile(depth=1)
            )
        if self.panel is None and (self._found or self._poses is not None):
            robot = self._page.robot
            self.panel = None if robot is None else BodyPanel(self._page, robot)
        if self.panel is not None and self._poses is not None:
            self.panel.offer_pose(self.send)

    def send(self, pose: Pose) -> None:
        """Publish a pose of the body once, at once; the controller moves there slowly."""
        if self._poses is not None:
            roll, pitch, height = pose
            x, y, z, w = from_rpy(roll, pitch, 0.0)
            turn = QuaternionMessage(x=x, y=y, z=z, w=w)
            self._poses.publish(PoseMessage(position=Point(z=height), orientation=turn))

    def draw(self) -> None:
        """Show how the feet are now."""
        if self.panel is None or self._tree is None:
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
        self.panel.show_feet(places, self._contacts)
        self.panel.show_support(found)

    def list(self) -> None:
        """Show attitude and battery."""
        if self.panel is not None:
            feet = ''
            if self._contacts is not None and self._support is not None:
                feet = self._contacts.html(self._support)
            self.panel.show(horizon_html(self._attitude, self.battery) + feet)

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


class BodyPanel:
    """Sliders of the body's pose, a horizon, and marks at the feet."""

    def __init__(self, page: RobotPage, robot: RobotScene) -> None:
        self._gui, self._scene, self._live = page.server.gui, page.server.scene, page.live
        self._path = robot.path_of(robot.tree.root)
        with page.place('Body', self):
            self._folder = self._gui.add_folder(None)
        with self._folder:
            self._html: GuiHtmlHandle = self._gui.add_html('')
        page.offer_to_see('feet', self.show_marks)
        self._seen = True
        self._sliders: list[GuiSliderHandle[float]] = []
        self._feet: dict[str, IcosphereHandle] = {}
        self._mass: IcosphereHandle | None = None
        self._line: LineSegmentsHandle | None = None

    def offer_pose(self, send: Callable[[Pose], None]) -> None:
        """Enable the controls of the body."""
        if self._sliders:
            return

        def moved(event: GuiEvent[GuiSliderHandle[float]]) -> None:
            if event.client_id is None:  # it was set here
                return
            if not self._live.refuses(event.target.label, always=False):
                roll, pitch, height = map(value_of, self._sliders)
                send((math.radians(roll), math.radians(pitch), height / 1000.0))

        def level() -> None:
            if self._live.refuses(LEVEL_LABEL, always=False):
                return
            for slider in self._sliders:
                slider.value = 0.0  # type: ignore[misc]  # it has a setter
            send((0.0, 0.0, 0.0))

        with self._folder:
            for label, most in RANGES.items():
                slider = self._gui.add_slider(label, -most, most, most / 100.0, 0.0)
                slider.on_update(moved)
                self._sliders.append(slider)
            self._gui.add_button(LEVEL_LABEL, color=NEUTRAL).on_click(lambda _: level())

    def remove(self) -> None:
        """Remove its marks from the view."""
        for node in self._marks:
            node.remove()

    @property
    def _marks(self) -> list[IcosphereHandle | LineSegmentsHandle]:
        marks = (*self._feet.values(), self._mass, self._line)
        return [mark for mark in marks if mark is not None]

    def show_marks(self, seen: bool) -> None:
        """Show or hide feet, support and centre of mass."""
        self._seen = seen
        for mark in self._marks:
            mark.visible = seen

    def show(self, html: str) -> None:
        """Show attitude and battery."""
        if self._html.content != html:
            self._html.content = html

    def show_feet(self, places: Mapping[str, Vector], contacts: Contacts | None) -> None:
        """Mark the feet."""
        down = frozenset() if contacts is None else contacts.feet
        for foot, place in places.items():
            mark = self._feet.get(foot)
            if mark is None:
                mark = self._feet[foot] = self._mark(f'contact_{foot}', FOOT_RADIUS)
            mark.position = place
            _paint(mark, DOWN_COLOR if foot in down else UP_COLOR)

    def show_support(self, support: Support) -> None:
        """Draw on the ground what the feet span, and the place below the centre of mass."""
        corners = np.array(support.corners, float).reshape(-1, 3)
        ends = np.stack([corners, np.roll(corners, -1, axis=0)], axis=1)
        below, centre = support.below, support.centre
        if below is not None and centre is not None:
            ends = np.concatenate([ends, np.array([[centre, below]])])
            if self._mass is None:
                self._mass = self._mark('centre_of_mass', MASS_RADIUS)
            self._mass.position = below
            outside = support.margin is not None and support.margin < 0.0
            _paint(self._mass, OUTSIDE_COLOR if outside else MASS_COLOR)
        if self._mass is not None:
            self._mass.visible = below is not None and self._seen
        if self._line is not None and len(self._line.points) == len(ends):
            self._line.points = ends.astype(np.float32)
            return
        if self._line is not None:
            self._line.remove()
            self._line = None
        if len(ends):
            self._line = self._scene.add_line_segments(
                f'{self._path}/support',
                ends,
                LINE_COLOR,
                thickness=LINE_WIDTH,
                thickness_units='screen',
                visible=self._seen,
            )

    def _mark(self, name: str, radius: float) -> IcosphereHandle:
        path = f'{self._path}/{name}'
        return self._scene.add_icosphere(path, radius, UP_COLOR, opacity=0.8, visible=self._seen)


def _paint(mark: IcosphereHandle, color: tuple[int, int, int]) -> None:
    if tuple(mark.color) != color:
        mark.color = color
