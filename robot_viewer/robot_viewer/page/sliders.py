# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Values of sliders: a number that is typed beside one may be beyond its range."""

from __future__ import annotations

from collections.abc import Callable

from viser import GuiApi, GuiSliderHandle

Share = Callable[[], float]
"""Returns the share of the greatest velocity that was chosen, above 0 to 1."""


def value_of(slider: GuiSliderHandle[float]) -> float:
    """Return the value of a slider, within its range.

    Args:
        slider: The slider.
    """
    return min(max(slider.value, slider.min), slider.max)


def add_speed(gui: GuiApi, percent: float = 30.0) -> Share:
    """Add the slider of a speed.

    Args:
        gui: Of the page.
        percent: Where it is in the beginning.
    """
    slider = gui.add_slider('Speed [%]', 5.0, 100.0, 5.0, percent)
    return lambda: value_of(slider) / 100.0
