# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Sliders that send an arm to a target, and plots of how well it follows."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
import time

import numpy as np
from urdf_reader import Joint
from viser import (
    GuiDropdownHandle,
    GuiEvent,
    GuiSliderHandle,
    GuiUplotHandle,
    uplot,
    ViserServer,
)

from .aim import History, KEPT
from .robot_scene import travel
from .sliders import add_speed, value_of
from .style import WANTED

UNTOUCHED = 1.0
"""Time in [s] after which a slider follows its joint again."""
UNLOCK = 'Stopped: let the sliders send again'
HEIGHT = 170
"""Of a plot in [px]."""
TARGET_COLOR, POSITION_COLOR, ERROR_COLOR = '#e8590c', '#1971c2', '#c2255c'

Aim = Callable[[Mapping[str, float], float], None]
"""Takes targets by joint, and the share of the greatest velocity."""


class TargetPanel:
    """A slider for each joint of a controller: whoever moves one sends that joint where it shows.

    Only what a person does in a browser sends anything; sliders that follow the robot do not, nor
    do any after STOP until they are unlocked.
    """

    def __init__(self, server: ViserServer, joints: Sequence[Joint], aim: Aim) -> None:
        self._aim = aim
        self._touched = 0.0
        gui = server.gui
        gui.add_markdown('Moves to where a slider is put; STOP ends it.')
        self._unlock = gui.add_button(UNLOCK, color=WANTED, visible=False)
        self._unlock.on_click(lambda _: self._set_locked(locked=False))
        self._speed = add_speed(gui, 20.0)
        self._sliders: dict[str, GuiSliderHandle[float]] = {}
        for joint in joints:
            low, high = travel(joint)
            slider = gui.add_slider(joint.name, low, high, (high - low) / 1000.0, low)
            slider.on_update(partial(self._moved, joint.name))
            self._sliders[joint.name] = slider

    def follow(self, positions: Mapping[str, float], *, busy: bool) -> None:
        """Set the sliders to the joints' positions, unless a person moves them.

        Args:
            positions: Where the joints are.
            busy: They are on their way to a target.
        """
        if busy or time.monotonic() - self._touched < UNTOUCHED:
            return
        for name, slider in self._sliders.items():
            position = min(max(positions.get(name, slider.value), slider.min), slider.max)
            if abs(position - slider.value) > slider.step:
                slider.value = position  # type: ignore[misc]  # it has a setter

    def lock(self) -> None:
        """Send nothing until somebody unlocks the sliders: one may be dragged, or be late."""
        self._set_locked(locked=True)

    def _set_locked(self, *, locked: bool) -> None:
        self._unlock.visible = locked

    def _moved(self, joint: str, event: GuiEvent[GuiSliderHandle[float]]) -> None:
        if event.client_id is None:  # it follows its joint
            return
        if self._unlock.visible:
            return
        self._touched = time.monotonic()
        self._aim({joint: value_of(event.target)}, self._speed())


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
