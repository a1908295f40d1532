# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The body of a walking robot on a page: its pose, its attitude, and what its feet span."""

from __future__ import annotations

from collections.abc import Callable, Mapping
import math
from typing import TypeAlias

import numpy as np
from urdf_reader import Vector
from viser import (
    GuiEvent,
    GuiHtmlHandle,
    GuiSliderHandle,
    IcosphereHandle,
    LineSegmentsHandle,
    ViserServer,
)

from .live import Live
from .sliders import value_of
from .standing import Contacts, Support
from .style import NEUTRAL

RANGES: Mapping[str, float] = {'Roll [deg]': 20.0, 'Pitch [deg]': 17.0, 'Height [mm]': 30.0}
"""Of the sliders to either side; the controller has limits of its own."""
LEVEL = 'Level the body'
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


class BodyPanel:
    """Sliders of the body's pose, a horizon, and marks at the feet."""

    def __init__(self, server: ViserServer, path: str, live: Live) -> None:
        self._server, self._path, self._live = server, path, live
        gui = server.gui
        self._folder = gui.add_folder(None)
        with self._folder:
            self._html: GuiHtmlHandle = gui.add_html('')
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
            if self._live.refuses(LEVEL, always=False):
                return
            for slider in self._sliders:
                slider.value = 0.0  # type: ignore[misc]  # it has a setter
            send((0.0, 0.0, 0.0))

        gui = self._server.gui
        with self._folder:
            for label, most in RANGES.items():
                slider = gui.add_slider(label, -most, most, most / 100.0, 0.0)
                slider.on_update(moved)
                self._sliders.append(slider)
            gui.add_button(LEVEL, color=NEUTRAL).on_click(lambda _: level())

    def remove(self) -> None:
        """Remove all of it from the page."""
        self._folder.remove()
        for node in (*self._feet.values(), self._mass, self._line):
            if node is not None:
                node.remove()

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
            self._mass.visible = below is not None
        if self._line is not None and len(self._line.points) == len(ends):
            self._line.points = ends.astype(np.float32)
            return
        if self._line is not None:
            self._line.remove()
            self._line = None
        if len(ends):
            self._line = self._server.scene.add_line_segments(
                f'{self._path}/support',
                ends,
                LINE_COLOR,
                thickness=LINE_WIDTH,
                thickness_units='screen',
            )

    def _mark(self, name: str, radius: float) -> IcosphereHandle:
        path = f'{self._path}/{name}'
        return self._server.scene.add_icosphere(path, radius, UP_COLOR, opacity=0.8)


def _paint(mark: IcosphereHandle, color: tuple[int, int, int]) -> None:
    if tuple(mark.color) != color:
        mark.color = color
