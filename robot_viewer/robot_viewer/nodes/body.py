# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Body state of a walking robot (attitude, feet, battery) and the pose that the user commands."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from html import escape
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
    multiply,
    PointMass,
    Quaternion,
    rotate,
    Vector,
)
from viser import (
    GuiButtonHandle,
    GuiEvent,
    GuiSliderHandle,
    IcosphereHandle,
    LineSegmentsHandle,
)

from ..page.robot_page import RobotPage
from ..page.robot_scene import feet_of, FOOT, LEAST_FEET
from ..page.style import add_button, THREE_COLUMNS, value_of
from .listening import Listening

NOT_MEASURED = -1.0  # first covariance element of a quantity that is not measured (REP 145)
CONTACTS, CONTACTS_TYPE = 'foot_contacts', 'quad_msgs/msg/FootContacts'
FRESH = 1.0  # age in [s] above which attitude and foot contacts are unknown
LEVEL: Quaternion = (0.0, 0.0, 0.0, 1.0)
RANGES: Mapping[str, float] = {'Roll [deg]': 20.0, 'Pitch [deg]': 17.0, 'Height [mm]': 30.0}
"""Slider ranges, symmetric about zero; the controller has its own limits."""
LEVEL_LABEL = 'Level the body'
DOWN_COLOR, UP_COLOR, LINE_COLOR = (35, 112, 50), (134, 142, 150), (24, 100, 171)
MASS_COLOR, OUTSIDE_COLOR = (24, 100, 171), (255, 212, 59)
"""Colors of the projected centre of mass: inside the support polygon, and outside."""
FOOT_RADIUS = 0.012  # of a foot marker in [m]
MASS_RADIUS = 0.008  # of the marker of the projected centre of mass in [m]
LINE_WIDTH = 3.0  # in [px]

Pose: TypeAlias = tuple[float, float, float]
"""Roll and pitch in [rad], height in [m], relative to the normal pose."""


class Body:
    """Attitude, battery, feet and pose. Call in the node's thread, except :meth:`send`."""

    def __init__(
        self, node: Node, page: RobotPage, listening: Listening, positions: Mapping[str, float]
    ) -> None:
        self._node, self._page = node, page
        self._listening, self._positions = listening, positions
        self._tree: KinematicTree | None = None
        self._feet: tuple[str, ...] = ()
        self.offered = False  # on the page
        self._attitude: Quaternion | None = None
        self._attitude_at = 0.0
        self._mounted: dict[str, Quaternion] = {}  # link rotations in the root link at zero
        self.battery = ''
        self._masses: tuple[PointMass, ...] = ()
        self._radius = 0.0
        self._contacts: Contacts | None = None
        self._contacts_at = 0.0
        self._support: Support | None = None
        self._found: set[str] = set()
        self._poses: Publisher | None = None
        self._path = ''  # of the root link in the scene
        self._seen = True
        self._sliders: list[GuiSliderHandle[float]] = []
        self._level: GuiButtonHandle | None = None
        self._foot_marks: dict[str, IcosphereHandle] = {}
        self._mass: IcosphereHandle | None = None
        self._line: LineSegmentsHandle | None = None

    def describe(self, tree: KinematicTree) -> None:
        """Switch to another robot."""
        self._tree, self._feet = tree, feet_of(tree)
        self._mounted = {link: pose.rotation for link, pose in link_poses(tree, {}).items()}
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
        robot = self._page.robot
        if not self.offered and robot is not None and (self._found or self._poses is not None):
            self._path = robot.path_of(robot.tree.root)
            with self._page.place('Body', self):
                self._folder = self._page.server.gui.add_folder(None)
            with self._folder:
                self._html = self._page.server.gui.add_html('')
            self._page.offer_to_see('feet', self.show_marks)
            self.offered = True
        if self.offered and self._poses is not None and not self._sliders:
            self._offer_pose()

    def remove(self) -> None:
        """Remove the markers from the view; the page removes the groups."""
        for mark in self._marks:
            mark.remove()
        self._mass = self._line = self._level = None
        self._foot_marks, self._sliders = {}, []
        self._seen, self.offered = True, False

    def _offer_pose(self) -> None:
        """Add the body controls to the page."""
        gui, live = self._page.server.gui, self._page.live

        def moved(event: GuiEvent[GuiSliderHandle[float]]) -> None:
            if event.client_id is None:  # it was set here
                return
            if not live.refuses(event.target.label, always=False):
                roll, pitch, height = map(value_of, self._sliders)
                self.send((math.radians(roll), math.radians(pitch), height / 1000.0))

        def level() -> None:
            if live.refuses(LEVEL_LABEL, always=False):
                return
            for slider in self._sliders:
                slider.value = 0.0  # type: ignore[misc]  # it has a setter
            self.send((0.0, 0.0, 0.0))

        with self._folder:
            gui.add_html(THREE_COLUMNS)
            for label, most in RANGES.items():
                slider = gui.add_slider(label, -most, most, most / 100.0, 0.0)
                slider.on_update(moved)
                self._sliders.append(slider)
            self._level = add_button(gui, LEVEL_LABEL, level)

    def send(self, pose: Pose) -> None:
        """Publish a body pose once, immediately; the controller moves there slowly."""
        if self._poses is not None:
            roll, pitch, height = pose
            x, y, z, w = from_rpy(roll, pitch, 0.0)
            turn = QuaternionMessage(x=x, y=y, z=z, w=w)
            self._poses.publish(PoseMessage(position=Point(z=height), orientation=turn))

    def draw(self) -> None:
        """Update the foot contacts in the view."""
        if not self.offered or self._tree is None:
            return
        if time.monotonic() - self._contacts_at > FRESH:
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
        down = frozenset() if self._contacts is None else self._contacts.feet
        for foot, place in places.items():
            if foot not in self._foot_marks:
                self._foot_marks[foot] = self._mark(f'contact_{foot}', FOOT_RADIUS)
            self._foot_marks[foot].position = place
            self._foot_marks[foot].color = DOWN_COLOR if foot in down else UP_COLOR
        self._show_support(found)

    def list(self) -> None:
        """Update attitude, battery and feet on the page, and what may be set."""
        if not self.offered:
            return
        known = time.monotonic() - self._attitude_at < FRESH
        html = horizon_html(self._attitude, self.battery, known=known)
        if self._contacts is not None and self._support is not None:
            html += self._contacts.html(self._support)
        elif CONTACTS in self._found:  # the lines below stay in their places
            html += lines_html('feet on the ground: unknown', '', '')
        self._html.content = html
        live = self._page.live
        if self._level is not None:
            for each in (*self._sliders, self._level):
                each.disabled = live.stopped or not live.movable

    @property
    def _marks(self) -> Sequence[IcosphereHandle | LineSegmentsHandle]:
        marks = (*self._foot_marks.values(), self._mass, self._line)
        return [mark for mark in marks if mark is not None]

    def show_marks(self, seen: bool) -> None:
        """Show or hide foot markers, support polygon and centre of mass."""
        self._seen = seen
        for mark in self._marks:
            mark.visible = seen

    def _show_support(self, support: Support) -> None:
        """Draw the support polygon and the projected centre of mass on the ground."""
        corners = np.array(support.corners, float).reshape(-1, 3)
        ends = np.stack([corners, np.roll(corners, -1, axis=0)], axis=1)
        below, centre = support.below, support.centre
        if below is not None and centre is not None:
            ends = np.concatenate([ends, np.array([[centre, below]])])
            if self._mass is None:
                self._mass = self._mark('centre_of_mass', MASS_RADIUS)
            self._mass.position = below
            outside = support.margin is not None and support.margin < 0.0
            self._mass.color = OUTSIDE_COLOR if outside else MASS_COLOR
        if self._mass is not None:
            self._mass.visible = below is not None and self._seen
        if self._line is not None and len(self._line.points) == len(ends):
            self._line.points = ends.astype(np.float32)
            return
        if self._line is not None:
            self._line.remove()
            self._line = None
        if len(ends):
            self._line = self._page.server.scene.add_line_segments(
                f'{self._path}/support',
                ends,
                LINE_COLOR,
                thickness=LINE_WIDTH,
                thickness_units='screen',
                visible=self._seen,
            )

    def _mark(self, name: str, radius: float) -> IcosphereHandle:
        return self._page.server.scene.add_icosphere(
            f'{self._path}/{name}', radius, UP_COLOR, opacity=0.8, visible=self._seen
        )

    def _take_imu(self, message: Imu) -> None:
        turn = message.orientation
        measured = message.orientation_covariance[0] != NOT_MEASURED
        self._attitude = (turn.x, turn.y, turn.z, turn.w) if measured else None
        self._attitude_at = time.monotonic()
        mounted = self._mounted.get(message.header.frame_id)
        if self._attitude is not None and mounted is not None:
            x, y, z, w = mounted
            self._attitude = multiply(self._attitude, (-x, -y, -z, w))

    def _take_contacts(self, message: Any) -> None:  # noqa: ANN401  # quad_msgs may not be there
        pairs = zip(message.name, message.contact, strict=False)
        feet = frozenset(name for name, contact in pairs if contact)
        self._contacts, self._contacts_at = Contacts(feet, message.source), time.monotonic()

    def _take_battery(self, message: BatteryState) -> None:
        self.battery = battery_text(message.percentage, message.voltage)


SOURCES: Mapping[str, str] = {
    'measured_height': 'estimated by joints and attitude; nothing senses it',
    'physics': 'true: the simulation knows',
}
"""Texts for the `source` values of quad_msgs/FootContacts."""


@dataclass(frozen=True, slots=True)
class Contacts:
    """Feet on the ground, as published."""

    feet: frozenset[str]
    source: str  # how the contacts were determined

    def html(self, found: Support) -> str:
        """Return the contacts and the stability margin as HTML."""
        names = ', '.join(sorted(foot.removesuffix(FOOT) for foot in self.feet)) or 'none'
        source = SOURCES.get(self.source, self.source or 'the source is not stated')
        margin = found.margin
        if margin is None:  # the line stays in its place
            stable = 'centre of mass unknown: the description has no masses'
            if len(found.corners) < LEAST_FEET:
                stable = 'no support polygon'
        else:
            inside = 'inside' if margin >= 0.0 else 'outside'
            stable = f'centre of mass {abs(margin) * 1e3:.0f} mm {inside} the support'
        return lines_html(f'feet on the ground: {names}', stable, source)


@dataclass(frozen=True, slots=True)
class Support:
    """Support polygon of the feet on the ground, in the root link frame in [m]."""

    corners: tuple[Vector, ...]
    """Ground points below the feet, counterclockwise; fewer than three span no polygon."""
    centre: Vector | None  # of mass; None where the description has no masses
    below: Vector | None  # its projection onto the ground
    margin: float | None
    """Distance of `below` from the polygon's edge; negative outside, None without a polygon."""


def foot_radius(tree: KinematicTree, foot: str) -> float:
    """Return the radius of a spherical foot in [m]; 0 for other shapes."""
    balls = (s for s in tree.collisions() if s.link == foot and s.shape == 'sphere')
    return next((ball.lengths('radius')[0] for ball in balls), 0.0)


def support(
    places: Mapping[str, Vector],
    on_ground: Collection[str],
    attitude: Quaternion,
    centre: Vector | None,
    radius: float = 0.0,
) -> Support:
    """Compute the support polygon and the projection of the centre of mass onto it.

    ``places`` are foot positions in the root link; ``attitude`` rotates it to a level frame.
    """
    x, y, z, w = attitude
    back = (-x, -y, -z, w)
    levelled = {foot: rotate(attitude, places[foot]) for foot in on_ground if foot in places}
    corners = [
        (px, py, pz - radius)
        for px, py, pz in sorted(levelled.values(), key=lambda at: math.atan2(at[1], at[0]))
    ]
    if centre is None or not corners:
        return Support(tuple(rotate(back, corner) for corner in corners), centre, None, None)
    over_x, over_y, _ = rotate(attitude, centre)
    ground = sum(corner[2] for corner in corners) / len(corners)
    return Support(
        tuple(rotate(back, corner) for corner in corners),
        centre,
        rotate(back, (over_x, over_y, ground)),
        _margin(corners, over_x, over_y) if len(corners) >= LEAST_FEET else None,
    )


def _margin(corners: Sequence[Vector], x: float, y: float) -> float:
    """Return how far a point lies inside a counterclockwise polygon in [m]."""
    sides = zip(corners, (*corners[1:], corners[0]), strict=True)
    return min(
        ((bx - ax) * (y - ay) - (by - ay) * (x - ax)) / (math.hypot(bx - ax, by - ay) or 1.0)
        for (ax, ay, _), (bx, by, _) in sides
    )


def roll_pitch(attitude: Quaternion) -> tuple[float, float]:
    """Return roll (right side down positive) and pitch (nose down positive) in [rad]."""
    x, y, z, w = attitude
    sine = max(-1.0, min(1.0, 2.0 * (w * y - z * x)))
    return math.atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y)), math.asin(sine)


def lines_html(*texts: str) -> str:
    """Return HTML of lines; an empty one takes its place, too."""
    lines = ''.join(f'<div>{escape(text) or "&nbsp;"}</div>' for text in texts)
    return f'<div style="margin:0.3em 1em">{lines}</div>'


def horizon_html(attitude: Quaternion | None, battery: str, *, known: bool = True) -> str:
    """Return HTML of an artificial horizon with its angles, and the battery, where measured.

    ``known`` is whether the last attitude is recent; else it is grey, and both are unknown.
    """
    known |= attitude is None
    parts = []
    if attitude is not None:
        roll, pitch = (math.degrees(angle) for angle in roll_pitch(attitude))
        # one pixel per degree; the horizon rises when the nose goes down
        parts.append(
            '<svg viewBox="-40 -40 80 80" width="110" height="110"'
            f' style="border-radius:50%;filter:grayscale({0 if known else 1})">'
            f'<g transform="rotate({-roll:.1f}) translate(0 {-pitch:.1f})">'
            '<rect x="-90" y="-180" width="180" height="180" fill="#74c0fc"/>'
            '<rect x="-90" y="0" width="180" height="180" fill="#b08968"/>'
            '<line x1="-90" x2="90" stroke="#fff" stroke-width="1.5"/></g>'
            '<path d="M-24 0h16l8 7 8-7h16" fill="none" stroke="#212529" stroke-width="2.5"/>'
            '</svg>'
        )
        parts.append(f'roll {roll:+.1f}°, pitch {pitch:+.1f}°' if known else 'attitude unknown')
    if battery:
        parts.append(f'battery {escape(battery if known else "unknown")}')
    lines = ''.join(f'<div>{part}</div>' for part in parts)
    return f'<div style="margin:0.3em 1em">{lines}</div>'


def battery_text(percentage: float, voltage: float) -> str:
    """Format charge (0 to 1) and voltage in [V]; unmeasured values are left out."""
    parts = []
    if math.isfinite(percentage):
        parts.append(f'{100.0 * percentage:.0f} %')
    if math.isfinite(voltage) and voltage > 0.0:
        parts.append(f'{voltage:.1f} V')
    return ', '.join(parts)
