# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

from dataclasses import replace
import re

import pytest

from operator_input import ReleaseSource
from quad_teleop import BodyPose, Mode, Speeds, Velocity
from quad_teleop.body_pose import NEUTRAL
from quad_teleop.controller_report import ControllerReport, Level, read_report
from quad_teleop.nodes.screen import hint, status, View

VIEW = View(None, None, Speeds(), None, NEUTRAL, ReleaseSource.TIME_OUT, has_subscriber=True)
MOVING = replace(VIEW, velocity=Velocity(0.15, 0.0, 0.0))


def report(state: str, goal: str, level: Level = Level.OK, message: str = '') -> ControllerReport:
    """Make a report of the controller."""
    return ControllerReport(state, goal, level, message, 0.0)


def test_what_matters_most_stands_first() -> None:
    """Mode and speeds survive the narrowest pane; body and release come last."""
    text = status(replace(MOVING, pose=BodyPose(0.01, 0.1)), colour=False)
    assert text == (
        'mode ? | 0.15 m/s 0.60 rad/s | x +0.15 y +0.00 yaw +0.00 | body +10 mm +6 +0 +0 deg'
        ' | timed releases'
    )


def test_colours_change_no_words() -> None:
    """With colours the line reads the same."""
    coloured = status(MOVING, colour=True)
    assert re.sub('\x1b\\[[0-9;]*m', '', coloured) == status(MOVING, colour=False)
    assert coloured != status(MOVING, colour=False)


def test_state_of_the_controller_is_shown() -> None:
    """What the controller says counts more than what it granted once."""
    view = replace(VIEW, mode=Mode.WALK, report=report('to stand', 'walk'))
    assert status(view, colour=False).startswith('to stand | ')
    assert status(replace(view, report=None), colour=False).startswith('walk | ')


@pytest.mark.parametrize(
    ('view', 'word'),
    [
        (VIEW, ''),
        (MOVING, ''),
        (replace(MOVING, mode=Mode.WALK), ''),
        (replace(MOVING, mode=Mode.STAND), r'does not walk now \(stand\): press 2'),
        (replace(MOVING, report=report('relax', 'relax')), r'\(relax\): press 2'),
        (replace(MOVING, report=report('to stand', 'walk')), ''),
        (replace(MOVING, report=report('walk', 'walk'), mode=Mode.LIE), ''),
        (replace(MOVING, mode=Mode.STAND, has_subscriber=False), ''),
        (
            replace(VIEW, report=report('fault', 'fault', Level.ERROR, 'it fell over')),
            'fault: it fell over; Backspace clears it, 0 lies down, 9 gets up',
        ),
    ],
)
def test_hint_says_why_nothing_moves(view: View, word: str) -> None:
    """A person who holds a key and sees nothing move reads what to press; else nothing."""
    assert re.search(word, hint(view)) if word else not hint(view)


def test_report_is_read_from_diagnostics() -> None:
    """Only the controller's own status counts, also below a namespace."""
    values = {'state': 'walk', 'goal': 'walk'}
    found = read_report('dog1: controller_node: state', 1, 'battery low', values, 5.0)
    assert found == ControllerReport('walk', 'walk', Level.WARN, 'battery low', 5.0)
    assert found.is_fresh(7.0)
    assert not found.is_fresh(9.0)
    assert read_report('hardware_node: serial link', 0, '', values, 0.0) is None
    assert read_report('controller_node: state', 0, '', {}, 0.0) is None
    assert read_report('controller_node: state', 77, '', values, 0.0) == ControllerReport(
        'walk', 'walk', Level.STALE, '', 0.0
    )
