# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A target of an arm, which it moves to while a button is held; and plots of how it follows.

Positions in [rad] or [m], times in [s].
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
import math

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

from .live import Hold
from .robot_scene import links_beyond, RobotScene, Tint, travel
from .style import NEUTRAL, pad, sentence, Share, value_of

HOLD_TARGET = 'Hold to move to the target'
TARGET_TINT: Tint = (0.44, 0.28, 0.91, 0.35)
REACHED = 0.01
"""How near to the target in [rad] or [m] it is not shown any more."""
HEIGHT = 170
"""Of a plot in [px]."""
TARGET_COLOR, POSITION_COLOR, ERROR_COLOR = '#7048e8', '#1864ab', '#495057'
KEPT = 30.0
"""How long the past is kept in [s]."""
STEP = 0.1
"""Least time between two samples in [s]."""
SHORTEST = 0.3
"""Shortest motion in [s]."""
GREATEST_ACCELERATION = 2.0
"""Of a motion to a target in [rad/s^2] or [m/s^2]: descriptions name none."""
PEAK, PEAK_ACCELERATION = 15.0 / 8.0, 10.0 / math.sqrt(3.0)
"""Greatest velocity and acceleration of a quintic from rest to rest: as a multiple of its mean
velocity, and of its way through the square of its time."""


Move = Callable[[Mapping[str, float], float], None]
"""Moves joints to targets as long as it is called, at a share of the greatest velocity."""


class TargetPanel:
    """A slider for each joint; it moves a violet target, and the joint only while it is held.

    Attributes:
        seen: The target is shown.
        hold: Number of the button that moves to it.
    """

    def __init__(
        self,
        server: ViserServer,
        robot: RobotScene,
        joints: Sequence[Joint],
        ways: tuple[Move, Callable[[], None], Share, Callable[[Hold], tuple[int, str]]],
    ) -> None:
        self._robot, self._links = (
            robot,
            links_beyond(robot.tree, frozenset(j.name for j in joints)),
        )
        self._aim, let_go, self._speed, hold = ways
        self._ghost: RobotScene | None = None
        self._targets: dict[str, float] = {}
        self._sliders: dict[str, GuiSliderHandle[float]] = {}
        self.seen = True
        gui = server.gui
        gui.add_html(sentence('Sliders move the violet target only.'))
        self.hold, html = hold(Hold(HOLD_TARGET, self._move, let_go))
        gui.add_html(pad([html], 'rv-one'))
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


def motion_time(
    start: Mapping[str, float],
    target: Mapping[str, float],
    velocities: Mapping[str, float],
    share: float,
) -> float:
    """Return how long a smooth motion takes.

    Args:
        start: Where the joints are; one that is missing does not move.
        target: Where they are to be.
        velocities: Greatest velocity of each; 1 for one that is missing.
        share: Of the greatest velocity, above 0 to 1.
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


@dataclass(frozen=True, slots=True)
class Sample:
    """A joint at one time.

    Attributes:
        time: Steady time.
        target: Where it was to be.
        position: Where it was.
    """

    time: float
    target: float
    position: float


class History:
    """The samples of all joints in the last :data:`KEPT` seconds."""

    def __init__(self) -> None:
        """Begin with none."""
        self._samples: dict[str, deque[Sample]] = {}

    @property
    def joints(self) -> tuple[str, ...]:
        """The joints that have samples."""
        return tuple(self._samples)

    def add(
        self, targets: Mapping[str, float], positions: Mapping[str, float], now: float
    ) -> None:
        """Store joint positions; ones that come too soon after the last are ignored."""
        for name in (each for each in targets if each in positions):
            samples = self._samples.setdefault(name, deque())
            if samples and now - samples[-1].time < STEP:
                continue
            samples.append(Sample(now, targets[name], positions[name]))
            while samples[0].time < now - KEPT:
                samples.popleft()

    def of(self, joint: str) -> tuple[Sample, ...]:
        """Return the samples of a joint, the oldest first."""
        return tuple(self._samples.get(joint, ()))
