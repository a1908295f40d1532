# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Jogging as long as a button is held: the tool along axes, single joints; and grippers."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from html import escape
from typing import Protocol, TypeAlias

from urdf_reader import Joint, JointKind, KinematicTree
from viser import GuiDropdownHandle, GuiFolderHandle, GuiHtmlHandle, ViserServer

from .robot_scene import travel
from .sliders import add_speed
from .style import JOINT_ROWS, NEUTRAL, THREE_COLUMNS

Twist: TypeAlias = tuple[float, float, float, float, float, float]
Held: TypeAlias = Callable[[str, Callable[[], None], Callable[[], None]], object]
"""Adds a button with its label, what it does while it is held, and when it is let go."""

TWISTS: Mapping[str, Twist] = {
    '+ x': (1.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    '+ y': (0.0, 1.0, 0.0, 0.0, 0.0, 0.0),
    '+ z': (0.0, 0.0, 1.0, 0.0, 0.0, 0.0),
    '− x': (-1.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    '− y': (0.0, -1.0, 0.0, 0.0, 0.0, 0.0),
    '− z': (0.0, 0.0, -1.0, 0.0, 0.0, 0.0),
    '+ about x': (0.0, 0.0, 0.0, 1.0, 0.0, 0.0),
    '+ about y': (0.0, 0.0, 0.0, 0.0, 1.0, 0.0),
    '+ about z': (0.0, 0.0, 0.0, 0.0, 0.0, 1.0),
    '− about x': (0.0, 0.0, 0.0, -1.0, 0.0, 0.0),
    '− about y': (0.0, 0.0, 0.0, 0.0, -1.0, 0.0),
    '− about z': (0.0, 0.0, 0.0, 0.0, 0.0, -1.0),
}
"""Shares of the speed of jogging, along and about axes."""
REST: Twist = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
BASE = 'base'
"""The frame that a command has which names none."""
NEAR_END = 0.05
"""Share of its range at either end where a joint is marked."""


class JogActions(Protocol):
    """What is jogged; any thread may call it, and none of it waits."""

    def jog(self, twist: Twist, frame: str) -> None:
        """Command a share of the speed of jogging once, -1 to 1, along the axes of a frame."""

    def jog_joint(self, joint: str, share: float) -> None:
        """Command a share of the speed of a joint once, -1 to 1."""

    def grip(self, gripper: str, *, opens: bool) -> None:
        """Open or close a gripper."""


@dataclass(frozen=True, slots=True)
class Jogged:
    """What a panel jogs.

    Attributes:
        joints: Single joints, from the base on.
        grippers: Names of the controllers of grippers.
        actions: What is done.
    """

    joints: tuple[str, ...]
    grippers: tuple[str, ...]
    actions: JogActions


class JogPanel:
    """The tool, the joints and the grippers, a tab each."""

    def __init__(
        self, server: ViserServer, tree: KinematicTree, jogged: Jogged, held: Held
    ) -> None:
        self._gui, self._held, self._actions = server.gui, held, jogged.actions
        self._cells: dict[str, tuple[Joint, GuiHtmlHandle]] = {}
        movable = {joint.name: joint for joint in tree.movable()}
        self._folder: GuiFolderHandle = self._gui.add_folder(None)
        with self._folder:
            self._speed = add_speed(self._gui)
            tabs = self._gui.add_tab_group()
            with tabs.add_tab('Tool'):
                self._add_twists(tool_frames(tree, jogged.joints))
            if jogged.joints:
                with tabs.add_tab('Single joints'):
                    self._gui.add_html(JOINT_ROWS)
                    for number, name in enumerate(jogged.joints, 1):
                        self._add_joint(number, movable[name])
            if jogged.grippers:
                with tabs.add_tab('Gripper'):
                    for gripper in jogged.grippers:
                        self._add_gripper(gripper)

    def remove(self) -> None:
        """Remove all of it from the page."""
        self._folder.remove()

    def show(self, positions: Mapping[str, float]) -> None:
        """Show where the joints are."""
        for name, (joint, html) in self._cells.items():
            content = _cell(joint, positions.get(name))
            if html.content != content:
                html.content = content

    def _add_twists(self, frames: Sequence[str]) -> None:
        self._gui.add_html(THREE_COLUMNS)
        axes = self._gui.add_dropdown('Along the axes of', (BASE, *frames))
        for title, twist in TWISTS.items():
            self._held(title, partial(self._jog, axes, twist), partial(self._jog, axes, REST))

    def _add_joint(self, number: int, joint: Joint) -> None:
        self._cells[joint.name] = joint, self._gui.add_html(_cell(joint, None))
        for sign, way in (('−', -1.0), ('+', 1.0)):
            self._held(
                f'{number} {sign}',
                partial(self._jog_joint, joint.name, way),
                partial(self._actions.jog_joint, joint.name, 0.0),
            )

    def _add_gripper(self, gripper: str) -> None:
        self._gui.add_html(f'<div class="rv-cell"><b>{escape(gripper)}</b></div>')
        for label, opens in (('Open gripper', True), ('Close gripper', False)):
            button = self._gui.add_button(label, color=NEUTRAL)
            button.on_click(partial(self._grip, gripper, opens))

    def _grip(self, gripper: str, opens: bool, _: object) -> None:
        self._actions.grip(gripper, opens=opens)

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


def _cell(joint: Joint, position: float | None) -> str:
    low, high = travel(joint)
    name = escape(joint.name)
    if position is None:
        return f'<div class="rv-cell"><b>{name}</b><span>unknown</span></div>'
    share = min(max((position - low) / (high - low), 0.0), 1.0)
    near = ' near' if min(share, 1.0 - share) < NEAR_END else ''
    unit = 'm' if joint.kind is JointKind.PRISMATIC else 'rad'
    return (
        f'<div class="rv-cell{near}" style="--at:{100 * share:.0f}%"><b>{name}</b>'
        f'<span>{position:+.3f} {unit}</span><i></i></div>'
    )
