# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What drives an arm: its joints, the tool along axes, a target, and grippers."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from functools import partial
from html import escape
from typing import Protocol, TypeAlias, TypeVar

from urdf_reader import Joint, JointKind, KinematicTree
from viser import GuiDropdownHandle, GuiFolderHandle, GuiTabHandle, ViserServer

from ..robot_state import Stop
from .live import Hold, Live
from .robot_scene import RobotScene, travel
from .style import NEUTRAL, pad, sentence, Share, THREE_COLUMNS, value_of
from .target_panel import TargetPanel

Velocity: TypeAlias = tuple[float, float, float]
Twist: TypeAlias = tuple[float, float, float, float, float, float]
_Offer = TypeVar('_Offer')

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


@dataclass(slots=True)
class _Tab:
    """A tab, what it offers, and the HTML of its buttons by their numbers."""

    handle: GuiTabHandle
    content: GuiFolderHandle | None = None
    offered: object = None
    holds: dict[int, str] = field(default_factory=dict)


class JogPanel:
    """The joints, the tool, the target and the grippers, a tab each, which stay while it is there.

    What can be driven is found out piece by piece: only what offers something else than before is
    made anew, so that a person stays in the tab that is open.
    """

    def __init__(
        self,
        server: ViserServer,
        robot: RobotScene,
        ways: tuple[Actions, Live, Share],
        place: Callable[[JogPanel], AbstractContextManager[None]],
    ) -> None:
        """Offer nothing yet."""
        self._actions, self._live, self._speed = ways
        self._server, self._gui, self._robot = server, server.gui, robot
        self._joints = {joint.name: joint for joint in robot.tree.movable()}
        self.target: TargetPanel | None = None
        with place(self):
            tabs = self._gui.add_tab_group()
            self._tabs = {
                name: _Tab(tabs.add_tab(name)) for name in ('Joints', 'Tool', 'Target', 'Gripper')
            }
            # of tabs that are not shown there are no buttons; keys hold these
            self._keys = self._gui.add_html('')
        self._filled = self._tabs['Joints']
        self.offer(Offered())

    def offer(self, offered: Offered) -> None:
        """Offer to drive what there is now."""
        frames = tool_frames(self._robot.tree, offered.joints) if offered.tool else None
        self._fill('Joints', offered.joints, self._add_joints)
        self._fill('Tool', frames, self._add_twists)
        self._fill('Target', offered.targets, self._add_target)
        self._fill('Gripper', offered.grippers, self._add_grippers)
        holds = [html for tab in self._tabs.values() for html in tab.holds.values() if html]
        self._keys.content = pad(holds, 'rv-keyed')

    def _fill(self, name: str, offered: _Offer, add: Callable[[_Offer], None]) -> None:
        """Fill a tab anew where it offers something else than before."""
        tab = self._tabs[name]
        if tab.content is not None:
            if tab.offered == offered:
                return
            tab.content.remove()
        for number in tab.holds:
            self._live.remove(number)
        tab.offered, tab.holds, self._filled = offered, {}, tab
        with tab.handle:
            tab.content = self._gui.add_folder(None)
        with tab.content:
            add(offered)

    def remove(self) -> None:
        """Remove the target from the picture; the page removes its groups."""
        if self.target is not None:
            self.target.remove()

    def _hold(self, hold: Hold) -> tuple[int, str]:
        number, html = self._live.button(hold)
        self._filled.holds[number] = html if hold.key else ''
        return number, html

    def _add_target(self, targets: Sequence[str]) -> None:
        if self.target is not None:
            self.target.remove()
            self.target = None
        if not targets:
            self._gui.add_html(sentence('No trajectory controller moves these joints.'))
            return
        joints = [self._joints[name] for name in targets]
        aiming = self._actions.aim, self._actions.let_go, self._speed, self._hold
        self.target = TargetPanel(self._server, self._robot, joints, aiming)

    def _add_grippers(self, grippers: Sequence[tuple[str, str]]) -> None:
        for gripper, joint in grippers:
            self._add_gripper(gripper, self._joints[joint])
        if not grippers:
            self._gui.add_html(sentence('This robot has no gripper.'))

    def _add_joints(self, jogged: Sequence[str]) -> None:
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
        self._gui.add_html(pad(rows, 'rv-rows'))
        if not jogged:
            self._gui.add_html(sentence('No servo_node jogs these joints.'))

    def _add_twists(self, frames: Sequence[str] | None) -> None:
        if frames is None:
            self._gui.add_html(sentence('No servo_node jogs this tool.'))
            return
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
