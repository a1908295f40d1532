# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The status line, and what a person reads above it."""

from __future__ import annotations

from dataclasses import dataclass, field
import re
from typing import Any

import pytest

from operator_input import CommandStream, HeldKeys, KeyAction, KeyEvent, status_text
from quad_teleop import Mode, Speeds
from quad_teleop.mappings import KeyboardTeleop
from quad_teleop.motion import ControllerReport, PoseSteps, read_report, rest_of


@dataclass
class Robot:
    """Knows of itself what the test says, and writes down what is said."""

    mode: Mode | None = None
    known: ControllerReport | None = None
    has_subscriber: bool = True
    said: list[str] = field(default_factory=list)

    def report(self, now: float) -> ControllerReport | None:
        """Return the report of the controller."""
        return self.known if self.known and self.known.is_fresh(now) else None

    def say(self, text: str) -> None:
        """Write it down."""
        self.said.append(text)


def report(state: str, goal: str, fault: str = '') -> ControllerReport:
    """Make a report of the controller."""
    return ControllerReport(state, goal, bool(fault), fault, 0.0)


def teleop(robot: Robot, *keys: str) -> KeyboardTeleop:
    """Make one, and press keys."""
    watched: Any = robot
    made = KeyboardTeleop(watched, HeldKeys(), CommandStream(0.05, rest_of), Speeds(), PoseSteps())
    for key in keys:
        made.feed(KeyEvent(key, KeyAction.PRESSED, 0.0))
    return made


def line(robot: Robot, *keys: str) -> str:
    """Return the status line after keys were pressed."""
    return status_text(teleop(robot, *keys).status(0.0), colour=False)


def test_what_matters_most_stands_first() -> None:
    """Mode and speeds survive the narrowest pane; the body comes last.

    What the controller says counts more than what it granted once.
    """
    assert line(Robot(), 'i', 't', 'h') == (
        'mode ? | 0.15 m/s 0.60 rad/s | x +0.15 y +0.00 yaw +0.00 | body +5 mm +3 +0 +0 deg'
    )
    idle = f'{"idle":<27}'
    assert line(Robot(has_subscriber=False), 'q') == (
        f'mode ? | 0.17 m/s 0.66 rad/s | {idle} | no subscriber'
    )
    assert line(Robot(Mode.WALK, report('to stand', 'walk'))).startswith('to stand | ')
    assert line(Robot(Mode.WALK)).startswith('walk | ')


@pytest.mark.parametrize(
    ('robot', 'keys', 'word'),
    [
        (Robot(), '', ''),
        (Robot(), 'i', ''),
        (Robot(Mode.WALK), 'i', ''),
        (Robot(Mode.STAND), 'i', r'does not walk now \(stand\): press 2'),
        (Robot(known=report('relax', 'relax')), 'i', r'\(relax\): press 2'),
        (Robot(known=report('to stand', 'walk')), 'i', ''),
        (Robot(Mode.LIE, report('walk', 'walk')), 'i', ''),
        (Robot(Mode.STAND, has_subscriber=False), 'i', ''),
        (
            Robot(known=report('fault', 'fault', 'it fell over')),
            '',
            'fault: it fell over; Backspace clears it, 0 lies down, 9 gets up',
        ),
    ],
)
def test_hint_says_why_nothing_moves(robot: Robot, keys: str, word: str) -> None:
    """A person who holds a key and sees nothing move reads what to press; else nothing."""
    line(robot, *keys)
    assert len(robot.said) == bool(word)
    assert re.search(word, ''.join(robot.said))


def test_hint_is_said_once_for_each_motion() -> None:
    """Not in each turn of the loop; again after a motion that was followed."""
    robot = Robot(Mode.STAND)
    target = teleop(robot, 'i')
    for _ in range(3):
        target.status(0.0)
    assert len(robot.said) == 1
    robot.mode = Mode.WALK
    target.status(0.0)
    robot.mode = Mode.STAND
    target.status(0.0)
    assert len(robot.said) == 2


def test_report_is_read_from_diagnostics() -> None:
    """Only the controller's own status counts, also below a namespace."""
    values = {'state': 'walk', 'goal': 'walk'}
    found = read_report('dog1: controller_node: state', 1, 'battery low', values, 5.0)
    assert found == ControllerReport('walk', 'walk', False, 'battery low', 5.0)
    assert found.is_fresh(7.0)
    assert not found.is_fresh(9.0)
    assert read_report('hardware_node: serial link', 0, '', values, 0.0) is None
    assert read_report('controller_node: state', 0, '', {}, 0.0) is None
    fault = read_report('controller_node: state', 2, 'it fell over', values, 0.0)
    assert fault == ControllerReport('walk', 'walk', True, 'it fell over', 0.0)
