# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What drives an arm: its joints, the tool along axes, a target, and grippers."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future
from contextlib import AbstractContextManager
from dataclasses import dataclass
from functools import partial
from html import escape
from typing import Protocol, TypeAlias

from urdf_reader import Joint, JointKind, KinematicTree
from viser import GuiDropdownHandle, ViserServer

from ..robot_state import Stop
from .live import Hold, Live
from .robot_scene import RobotScene, travel
from .style import NEUTRAL, pad, sentence, Share, THREE_COLUMNS, value_of
from .target_panel import TargetPanel

Velocity: TypeAlias = tuple[float, float, float]
Twist: TypeAlias = tuple[float, float, float, float, float, float]

TWISTS: Mapping[str, tuple[str, Twist]] = {
    'X +': ('ArrowUp', (1.0, 0.0, 0.0, 0.0, 0.0, 0.0)),
    'Y +': ('ArrowRight', (0.0, 1.0, 0.0, 0.0, 0.0, 0.0)),
    'Z +': (';', (0.0, 0.0, 1.0, 0.0, 0.0, 0.0)),
    'X −': ('ArrowDown', (-1.0, 0.0, 0.0, 0.0, 0.0, 0.0)),
    'Y −': ('ArrowLeft', (0.0, -1.0, 0.0, 0.0, 0.0, 0.0)),
    'Z −': ('.', (0.0, 0.0, -1.0, 0.0, 0.0, 0.0)),
    'Turn X +': ('s', (0.0, 0.0, 0.0, 1.0, 0.0, 0.0)),
    'Turn Y +': ('d', (0.0, 0.0, 0.0, 0.0, 1.0, 0.0)),
    'Turn Z +': ('f', (0.0, 0.0, 0.0, 0.0, 0.0, 1.0)),
    'Turn X −': ('x', (0.0, 0.0, 0.0, -1.0, 0.0, 0.0)),
    'Turn Y −': ('c', (0.0, 0.0, 0.0, 0.0, -1.0, 0.0)),
    'Turn Z −': ('v', (0.0, 0.0, 0.0, 0.0, 0.0, -1.0)),
}
"""Keys of servo_keyboard_input, and shares of the speed of jogging along and about axes."""
REST: Twist = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
BASE = 'base'
"""The frame that a command has which names none."""


class Actions(Protocol):
    """What a page may have done; any thread may call it, and none of it waits."""

    def stop(self) -> Future[Stop]:
        """Stop whatever moves; the future has the robot's answer."""

    def act(self, action: str) -> None:
        """Do the action that is wanted now, if it is still this one."""

    def call(self, what: str, services: Sequence[str]) -> None:
        """Call Trigger services at the same time; what they are for, in words."""

    def walk(self, velocity: Velocity) -> None:
        """Command a velocity in [m/s] and [rad/s] once."""

    def set_mode(self, mode: str) -> None:
        """Request a mode of a walking robot."""

    def jog(self, twist: Twist, frame: str) -> None:
        """Command a share of the speed of jogging once, -1 to 1, along the axes of a frame."""

    def jog_joint(self, joint: str, share: float) -> None:
        """Command a share of the speed of a joint once, -1 to 1."""

    def grip(self, gripper: str, position: float) -> None:
        """Move a gripper to a position of its joint in [m] or [rad]."""

    def aim(self, targets: Mapping[str, float], share: float) -> None:
        """Move joints to targets as long as this comes, at a share of their greatest velocity."""

    def let_go(self) -> None:
        """Stop a motion to targets."""


@dataclass(frozen=True, slots=True)
class Offered:
    """What can be driven.

    Attributes:
        joints: Single joints that are jogged, from the base on.
        tool: The tool is jogged.
        grippers: Their joints by the names of their controllers.
        targets: Joints that a controller brings to a target.
    """

    joints: tuple[str, ...] = ()
    tool: bool = False
    grippers: tuple[tuple[str, str], ...] = ()
    targets: tuple[str, ...] = ()


class JogPanel:
    """The joints, the tool, the target and the grippers, a tab each."""

    def __init__(
        self,
        server: ViserServer,
        robot: RobotScene,
        offered: Offered,
        ways: tuple[Actions, Live, Share],
        place: Callable[[JogPanel], AbstractContextManager[None]],
    ) -> None:
        actions, live, self._speed = ways
        self._gui, self._actions, self._live = server.gui, actions, live
        self._numbers: list[int] = []
        self._keyed: list[str] = []
        self._joints = {joint.name: joint for joint in robot.tree.movable()}
        self.target: TargetPanel | None = None
        with place(self):
            self._tabs = tabs = self._gui.add_tab_group()
            with tabs.add_tab('Joints'):
                self._gui.add_html(self._joint_rows(offered.joints))
                if not offered.joints:
                    self._gui.add_html(sentence('No servo_node jogs these joints.'))
            with tabs.add_tab('Tool'):
                if offered.tool:
                    self._add_twists(tool_frames(robot.tree, offered.joints))
                else:
                    self._gui.add_html(sentence('No servo_node jogs this tool.'))
            with tabs.add_tab('Target'):
                if offered.targets:
                    joints = [self._joints[name] for name in offered.targets]
                    aiming = actions.aim, actions.let_go, self._speed, self._hold
                    self.target = TargetPanel(server, robot, joints, aiming)
                else:
                    self._gui.add_html(sentence('No trajectory controller moves these joints.'))
            with tabs.add_tab('Gripper'):
                for gripper, joint in offered.grippers:
                    self._add_gripper(gripper, self._joints[joint])
                if not offered.grippers:
                    self._gui.add_html(sentence('This robot has no gripper.'))
            # of tabs that are not shown there are no buttons; keys hold these
            self._keys = self._gui.add_html(pad(self._keyed, 'rv-keyed'))

    def remove(self) -> None:
        """Remove all of it from the page."""
        for number in self._numbers:
            self._live.remove(number)
        if self.target is not None:
            self.target.remove()
        self._tabs.remove()
        self._keys.remove()

    def _hold(self, hold: Hold) -> tuple[int, str]:
        number, html = self._live.button(hold)
        self._numbers.append(number)
        if hold.key:
            self._keyed.append(html)
        return number, html

    def _joint_rows(self, jogged: Sequence[str]) -> str:
        free = [joint for joint in self._joints.values() if joint.mimic is None]
        rows = []
        for joint in free:
            name = escape(joint.name)
            cell = (
                f'<div class="rv-cell" data-joint="{name}"><b>{name}</b>'
                '<span>unknown</span><i></i></div>'
            )
            buttons = ['<span></span>'] * 2
            if joint.name in jogged:
                number = jogged.index(joint.name) + 1
                buttons = [
                    self._hold(
                        Hold(
                            f'{number} {sign}',
                            partial(self._jog_joint, joint.name, way),
                            partial(self._actions.jog_joint, joint.name, 0.0),
                            key=f'{number}{sign}',
                        )
                    )[1]
                    for sign, way in (('−', -1.0), ('+', 1.0))
                ]
            rows += [cell, *buttons]
        return pad(rows, 'rv-rows')

    def _add_twists(self, frames: Sequence[str]) -> None:
        axes = self._gui.add_dropdown('Along axes of', (BASE, *frames))
        buttons = [
            self._hold(
                Hold(
                    title, partial(self._jog, axes, twist), partial(self._jog, axes, REST), key=key
                )
            )[1]
            for title, (key, twist) in TWISTS.items()
        ]
        self._gui.add_html(pad(buttons))

    def _add_gripper(self, gripper: str, joint: Joint) -> None:
        low, high = travel(joint)
        slides = joint.kind is JointKind.PRISMATIC
        size, unit = (1000.0, 'mm') if slides else (1.0, 'rad')
        with self._gui.add_folder(gripper.rpartition('/')[2]):
            self._gui.add_html(THREE_COLUMNS)
            width = self._gui.add_slider(
                f'Width [{unit}]', size * low, size * high, size * (high - low) / 100.0, size * low
            )

            def move(label: str, position: Callable[[], float]) -> Callable[[object], None]:
                return lambda _: self._grip(label, gripper, position())

            for label, position in (
                ('Open gripper', lambda: high),
                ('Close gripper', lambda: low),
                ('Move to width', lambda: value_of(width) / size),
            ):
                self._gui.add_button(label, color=NEUTRAL).on_click(move(label, position))

    def _grip(self, label: str, gripper: str, position: float) -> None:
        if not self._live.refuses(label):
            self._actions.grip(gripper, position)

    def _jog(self, axes: GuiDropdownHandle[str], twist: Twist) -> None:
        x, y, z, a, b, c = (self._speed() * part for part in twist)
        self._actions.jog((x, y, z, a, b, c), '' if axes.value == BASE else axes.value)

    def _jog_joint(self, joint: str, way: float) -> None:
        self._actions.jog_joint(joint, self._speed() * way)


def tool_frames(tree: KinematicTree, joints: Sequence[str]) -> list[str]:
    """Return the links that all of some joints in a row move, the nearest to them first."""
    moving = [joint for joint in tree.joints if joint.name in joints]
    if not moving:
        return []
    depths = {joint.child: len(tree.chain(tree.root, joint.child)) for joint in moving}
    frames = [max(depths, key=lambda link: depths[link])]
    own = {joint.name for joint in tree.movable()} - set(joints)
    for link in frames:  # it grows
        frames += [j.child for j in tree.joints if j.parent == link and j.name not in own]
    return frames


def joint_texts(
    tree: KinematicTree, positions: Mapping[str, float]
) -> dict[str, tuple[str, float]]:
    """Return position in words and share of the range of each joint that is known."""
    found = {}
    for joint in tree.movable():
        position = positions.get(joint.name)
        if position is not None:
            low, high = travel(joint)
            unit = 'm' if joint.kind is JointKind.PRISMATIC else 'rad'
            share = round(min(max((position - low) / (high - low), 0.0), 1.0), 3)
            found[joint.name] = (f'{position:+.3f} {unit}', share)
    return found
