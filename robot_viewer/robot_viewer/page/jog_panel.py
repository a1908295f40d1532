# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Controls of an arm (joints, tool, target, grippers) and plots of its tracking.

Positions are in [rad] or [m], times in [s].
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from functools import partial
from html import escape
import math
from typing import TypeAlias, TypeVar

import numpy as np
import numpy.typing as npt
from urdf_reader import Joint, JointKind, KinematicTree
from viser import (
    GuiApi,
    GuiButtonHandle,
    GuiDropdownHandle,
    GuiEvent,
    GuiFolderHandle,
    GuiSliderHandle,
    GuiTabHandle,
    uplot,
)

from ..robot_state import Stop
from .live import Hold, Live
from .robot_scene import links_beyond, RobotScene, Tint, travel
from .style import add_button, pad, sentence, Share, THREE_COLUMNS, value_of

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
"""Keys of servo_keyboard_input, and fractions of the jog speed along and about the axes."""
REST: Twist = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
BASE = 'base'  # the frame of a command without frame


@dataclass(frozen=True, slots=True)
class Actions:
    """Callbacks for the actions of a page. Thread-safe and non-blocking."""

    stop: Callable[[], Future[Stop]]  # stops all motion; the future holds the robot's answer
    act: Callable[[str], None]  # runs the suggested action, if it is still this one
    call: Callable[[str, Sequence[str]], None]
    """Calls Trigger services in parallel; the first argument is their label."""
    walk: Callable[[Velocity], None]  # sends one velocity command in [m/s] and [rad/s]
    set_mode: Callable[[str], None]  # requests a mode of a walking robot
    jog: Callable[[Twist, str], None]
    """Sends one jog command: fractions of the jog speed, -1 to 1, along the axes of a frame."""
    jog_joint: Callable[[str, float], None]  # the same for one joint
    grip: Callable[[str, float], None]  # moves a gripper to a position in [m] or [rad]
    aim: Callable[[Mapping[str, float], float], None]
    """Moves joints to targets while called repeatedly, at a fraction of their maximum velocity."""
    let_go: Callable[[], None]  # stops a motion to targets


@dataclass(frozen=True, slots=True)
class Offered:
    """What the page can move now."""

    joints: tuple[str, ...] = ()  # joints that can be jogged, from the base
    tool: bool = False  # whether the tool can be jogged
    grippers: tuple[tuple[str, str], ...] = ()  # pairs of controller and joint name
    targets: tuple[str, ...] = ()  # joints that a controller can move to a target


@dataclass(slots=True)
class _Tab:
    """A tab, its offered items, and the HTML of its buttons by number."""

    handle: GuiTabHandle
    content: GuiFolderHandle | None = None
    offered: object = None
    holds: dict[int, str] = field(default_factory=dict)


class JogPanel:
    """Permanent tabs for joints, tool, target and grippers.

    The node discovers the movable parts one by one: only tabs whose content changes are rebuilt,
    so that the open tab stays open.
    """

    def __init__(
        self,
        gui: GuiApi,
        robot: RobotScene,
        ways: tuple[Actions, Live, Share],
        place: Callable[[JogPanel], AbstractContextManager[None]],
    ) -> None:
        self._actions, self._live, self._speed = ways
        self._gui, self._robot = gui, robot
        self._joints = {joint.name: joint for joint in robot.tree.movable()}
        self.target: TargetPanel | None = None
        self._grips: list[GuiButtonHandle] = []
        with place(self):
            tabs = self._gui.add_tab_group()
            self._tabs = {
                name: _Tab(tabs.add_tab(name)) for name in ('Joints', 'Tool', 'Target', 'Gripper')
            }
            # hidden tabs have no buttons; keys hold these
            self._keys = self._gui.add_html('')
        self._filled = self._tabs['Joints']
        self.offer(Offered())

    def offer(self, offered: Offered) -> None:
        """Update the tabs to what can be moved now."""
        frames = tool_frames(self._robot.tree, offered.joints) if offered.tool else None
        self._fill('Joints', offered.joints, self._add_joints)
        self._fill('Tool', frames, self._add_twists)
        self._fill('Target', offered.targets, self._add_target)
        self._fill('Gripper', offered.grippers, self._add_grippers)
        holds = [html for tab in self._tabs.values() for html in tab.holds.values() if html]
        self._keys.content = pad(holds, 'rv-keyed')

    def _fill(self, name: str, offered: _Offer, add: Callable[[_Offer], None]) -> None:
        """Rebuild a tab if its content has changed."""
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

    def permit(self, allowed: bool) -> None:
        """Enable the buttons that move a gripper by one press."""
        for button in self._grips:
            button.disabled = not allowed

    def remove(self) -> None:
        """Remove the target from the scene; the page removes the groups."""
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
        ways = self._actions, self._speed, self._hold
        self.target = TargetPanel(self._gui, self._robot, joints, ways)

    def _add_grippers(self, grippers: Sequence[tuple[str, str]]) -> None:
        self._grips = []
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

            for label, position in (
                ('Open gripper', lambda: high),
                ('Close gripper', lambda: low),
                ('Move to width', lambda: value_of(width) / size),
            ):
                press = partial(self._grip, label, gripper, position)
                self._grips.append(add_button(self._gui, label, press))

    def _grip(self, label: str, gripper: str, position: Callable[[], float]) -> None:
        if not self._live.refuses(label):
            self._actions.grip(gripper, position())

    def _jog(self, axes: GuiDropdownHandle[str], twist: Twist) -> None:
        x, y, z, a, b, c = (self._speed() * part for part in twist)
        self._actions.jog((x, y, z, a, b, c), '' if axes.value == BASE else axes.value)

    def _jog_joint(self, joint: str, way: float) -> None:
        self._actions.jog_joint(joint, self._speed() * way)


def tool_frames(tree: KinematicTree, joints: Sequence[str]) -> list[str]:
    """Return the links that all joints of a chain move, the closest first."""
    moving = [joint for joint in tree.joints if joint.name in joints]
    if not moving:
        return []
    depths = {joint.child: len(tree.chain(tree.root, joint.child)) for joint in moving}
    frames = [max(depths, key=lambda link: depths[link])]
    own = {joint.name for joint in tree.movable()} - set(joints)
    for link in frames:  # grows in the loop
        frames += [j.child for j in tree.joints if j.parent == link and j.name not in own]
    return frames


def joint_texts(
    tree: KinematicTree, positions: Mapping[str, float]
) -> dict[str, tuple[str, float]]:
    """Return text and fraction of the range for each joint with a known position."""
    found = {}
    for joint in tree.movable():
        position = positions.get(joint.name)
        if position is not None:
            low, high = travel(joint)
            unit = 'm' if joint.kind is JointKind.PRISMATIC else 'rad'
            share = round(min(max((position - low) / (high - low), 0.0), 1.0), 3)
            found[joint.name] = (f'{position:+.3f} {unit}', share)
    return found


HOLD_TARGET = 'Hold to move to the target'
TARGET_TINT: Tint = (0.44, 0.28, 0.91, 0.35)
REACHED = 0.01  # distance in [rad] or [m] below which the target is hidden
HEIGHT = 170  # of a plot in [px]
TARGET_COLOR, POSITION_COLOR, ERROR_COLOR = '#7048e8', '#1864ab', '#495057'
KEPT = 30.0  # length of the history in [s]
STEP = 0.1  # minimum time between two samples in [s]
SHORTEST = 0.3  # shortest motion in [s]
GREATEST_ACCELERATION = 2.0
"""Acceleration limit to a target in [rad/s^2] or [m/s^2]: a URDF has none."""
PEAK, PEAK_ACCELERATION = 15.0 / 8.0, 10.0 / math.sqrt(3.0)
"""Peak velocity and acceleration of a quintic from rest to rest, relative to its mean velocity and
to distance / duration^2."""


class TargetPanel:
    """A slider per joint moves a violet target; the joints move only while a button is held."""

    def __init__(
        self,
        gui: GuiApi,
        robot: RobotScene,
        joints: Sequence[Joint],
        ways: tuple[Actions, Share, Callable[[Hold], tuple[int, str]]],
    ) -> None:
        self._robot = robot
        self._links = links_beyond(robot.tree, frozenset(j.name for j in joints))
        self._actions, self._speed, hold = ways
        self._ghost: RobotScene | None = None
        self._targets: dict[str, float] = {}
        self._sliders: dict[str, GuiSliderHandle[float]] = {}
        self.seen = True
        gui.add_html(sentence('Sliders move the violet target only.'))
        self.hold, html = hold(Hold(HOLD_TARGET, self._move, self._actions.let_go))
        gui.add_html(pad([html], 'rv-one'))
        for joint in joints:
            low, high = travel(joint)
            step = 10.0 ** math.floor(math.log10((high - low) / 1000.0))  # to show few digits
            slider = gui.add_slider(joint.name, low, high, step, low)
            slider.on_update(partial(self._moved, joint.name))
            self._sliders[joint.name] = slider
        add_button(gui, 'Put the target where the robot is', self._targets.clear)

    def follow(self, positions: Mapping[str, float]) -> None:
        """Update the target; without one the sliders follow the joints."""
        targets = dict(self._targets)
        if targets and all(
            abs(positions.get(name, np.inf) - at) < REACHED for name, at in targets.items()
        ):
            self._targets.clear()
            targets = {}
        for name, slider in self._sliders.items():
            position = min(max(positions.get(name, slider.value), slider.min), slider.max)
            if name not in targets and abs(position - slider.value) > slider.step:
                slider.value = position  # type: ignore[misc]  # it has a setter
        if targets and self.seen and self._ghost is None:
            self._ghost = self._robot.ghost('target', self._links, TARGET_TINT)
        if self._ghost is not None:
            self._ghost.show(seen=bool(targets) and self.seen)
            if targets:
                self._ghost.place({**positions, **targets})

    def remove(self) -> None:
        """Remove the target from the scene."""
        if self._ghost is not None:
            self._ghost.remove()

    async def _moved(self, joint: str, event: GuiEvent[GuiSliderHandle[float]]) -> None:
        if event.client_id is not None:  # else the slider follows its joint
            self._targets[joint] = value_of(event.target)

    def _move(self) -> None:
        if self._targets:
            self._actions.aim(dict(self._targets), self._speed())


class PlotPanel:
    """Target, position and following error of one joint in the last half minute."""

    def __init__(self, gui: GuiApi, joints: Sequence[str]) -> None:
        self._joint = gui.add_dropdown('Joint', tuple(joints))
        times = {'x': uplot.Scale(time=False, auto=False, range=(-KEPT, 0.0))}
        self._positions = gui.add_uplot(
            (np.array([-KEPT, 0.0]), np.zeros(2), np.zeros(2)),
            (
                uplot.Series(label='time [s]'),
                uplot.Series(label='target', stroke=TARGET_COLOR, width=2),
                uplot.Series(label='position', stroke=POSITION_COLOR, width=2),
            ),
            title='target and position [rad or m]',
            scales=times,
            height=HEIGHT,
        )
        self._errors = gui.add_uplot(
            (np.array([-KEPT, 0.0]), np.zeros(2)),
            (
                uplot.Series(label='time [s]'),
                uplot.Series(label='error', stroke=ERROR_COLOR, width=2),
            ),
            title='following error [mrad or mm]',
            scales=times,
            height=HEIGHT,
        )

    def show(self, history: History, now: float) -> None:
        """Plot the selected joint."""
        times, targets, positions = history.of(self._joint.value)
        if len(times):
            self._positions.data = (times - now, targets, positions)
            self._errors.data = (times - now, 1000.0 * (targets - positions))


def motion_time(
    start: Mapping[str, float],
    target: Mapping[str, float],
    velocities: Mapping[str, float],
    share: float,
) -> float:
    """Return the duration of a smooth motion in [s], at a fraction of the maximum velocities.

    Joints without a start do not move; joints without a velocity limit have 1 [rad/s] or [m/s].
    """
    longest = SHORTEST
    for name, position in target.items():
        way = abs(position - start.get(name, position))
        greatest = velocities.get(name, 1.0) * share
        longest = max(
            longest,
            PEAK * way / greatest,
            math.sqrt(PEAK_ACCELERATION * way / (GREATEST_ACCELERATION * share)),
        )
    return longest


class History:
    """The samples of all joints in the last :data:`KEPT` seconds."""

    def __init__(self) -> None:
        self._samples: dict[str, deque[tuple[float, float, float]]] = {}

    @property
    def joints(self) -> tuple[str, ...]:
        """Joints with samples."""
        return tuple(self._samples)

    def add(
        self, targets: Mapping[str, float], positions: Mapping[str, float], now: float
    ) -> None:
        """Store targets and positions, unless the last sample is too recent."""
        for name in (each for each in targets if each in positions):
            samples = self._samples.setdefault(name, deque())
            if samples and now - samples[-1][0] < STEP:
                continue
            samples.append((now, targets[name], positions[name]))
            while samples[0][0] < now - KEPT:
                samples.popleft()

    def of(self, joint: str) -> npt.NDArray[np.float64]:
        """Return rows of times, targets and positions of a joint."""
        samples = np.array(self._samples.get(joint, ()), float).reshape(-1, 3)
        rows: npt.NDArray[np.float64] = samples.T.copy()
        return rows
