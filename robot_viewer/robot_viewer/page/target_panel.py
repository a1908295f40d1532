# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A target of an arm, which it moves to while a button is held; and plots of how it follows."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial

import numpy as np
from urdf_reader import Joint, KinematicTree
from viser import (
    GuiDropdownHandle,
    GuiEvent,
    GuiSliderHandle,
    GuiUplotHandle,
    uplot,
    ViserServer,
)

from ..link_poses import links_beyond
from .aim import History, KEPT
from .live import Hold
from .robot_scene import RobotScene, Tint, travel
from .sliders import Share, value_of
from .style import NEUTRAL, pad, sentence

HOLD_TARGET = 'Hold to move to the target'
TARGET_TINT: Tint = (0.44, 0.28, 0.91, 0.35)
REACHED = 0.01
"""How near to the target in [rad] or [m] it is not shown any more."""
HEIGHT = 170
"""Of a plot in [px]."""
TARGET_COLOR, POSITION_COLOR, ERROR_COLOR = '#7048e8', '#1864ab', '#495057'


Move = Callable[[Mapping[str, float], float], None]
"""Moves joints to targets as long as it is called, at a share of the greatest velocity."""


class TargetPanel:
    """A slider for each joint; it moves a violet target, and the joint only while it is held.

    Attributes:
        seen: The target is shown.
    """

    def __init__(
        self,
        server: ViserServer,
        robot: RobotScene,
        tree: KinematicTree,
        joints: Sequence[Joint],
        ways: tuple[Move, Callable[[], None], Share, Callable[[Hold], str]],
    ) -> None:
        self._robot, self._links = robot, links_beyond(tree, frozenset(j.name for j in joints))
        self._aim, let_go, self._speed, hold = ways
        self._ghost: RobotScene | None = None
        self._targets: dict[str, float] = {}
        self._sliders: dict[str, GuiSliderHandle[float]] = {}
        self.seen = True
        gui = server.gui
        gui.add_html(sentence('Sliders move the violet target only.'))
        gui.add_html(pad([hold(Hold(HOLD_TARGET, self._move, let_go))], 'rv-one'))
        for joint in joints:
            low, high = travel(joint)
            slider = gui.add_slider(joint.name, low, high, (high - low) / 1000.0, low)
            slider.on_update(partial(self._moved, joint.name))
            self._sliders[joint.name] = slider
        gui.add_button('Put the target where the robot is', color=NEUTRAL).on_click(
            lambda _: self._targets.clear()
        )

    def follow(self, positions: Mapping[str, float]) -> None:
        """Show the target; without one the sliders follow the joints."""
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

    def _moved(self, joint: str, event: GuiEvent[GuiSliderHandle[float]]) -> None:
        if event.client_id is not None:  # or it follows its joint
            self._targets[joint] = value_of(event.target)

    def _move(self) -> None:
        if self._targets:
            self._aim(dict(self._targets), self._speed())


class PlotPanel:
    """Target, position and following error of one joint in the last half minute."""

    def __init__(self, server: ViserServer, joints: Sequence[str]) -> None:
        gui = server.gui
        self._joint: GuiDropdownHandle[str] = gui.add_dropdown('Joint', tuple(joints))
        times = {'x': uplot.Scale(time=False, auto=False, range=(-KEPT, 0.0))}
        self._positions: GuiUplotHandle = gui.add_uplot(
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
        self._errors: GuiUplotHandle = gui.add_uplot(
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
        """Draw the joint that is chosen."""
        samples = history.of(self._joint.value)
        if not samples:
            return
        times = np.array([sample.time - now for sample in samples])
        targets = np.array([sample.target for sample in samples])
        positions = np.array([sample.position for sample in samples])
        self._positions.data = (times, targets, positions)
        self._errors.data = (times, 1000.0 * (targets - positions))
