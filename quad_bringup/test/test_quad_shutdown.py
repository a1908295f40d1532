# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The robot lies down before it is left, if that can be."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from process_supervisor import CallError, GivenUpError
from quad_bringup.shutdown import lie_down, stand_still


class Controller:
    """A controller as its client sees it."""

    def __init__(self, state: str) -> None:
        self.state = state
        self.modes: list[str] = []
        self.closed = False
        self.follows, self.refusal = True, ''
        self.outcomes: list[str] = []  # of requests, in the place of the mode
        self.given_up: Callable[[], bool] = lambda: False

    def set_mode(self, mode: str, timeout: float) -> str:
        """Follow at once, in a while, or never."""
        if self.refusal:
            raise CallError(f'the mode {mode!r} was refused: {self.refusal}')
        self.modes.append(mode)
        if self.follows:
            self.state = self.outcomes.pop(0) if self.outcomes else mode
        return mode

    def wait_until(self, condition: Callable[[], bool], timeout: float, what: str) -> None:
        """Let the time-out pass at once."""
        if self.given_up():
            raise GivenUpError(what)
        if not condition():
            raise CallError(f'waited {timeout:g} s in vain for {what}')

    def close(self) -> None:
        """Leave."""
        self.closed = True


def leave(controller: Controller, *, given_up: bool = False, hold: bool = False) -> list[str]:
    """Let it lie down, or stand still; return what was said."""
    said: list[str] = []

    def make_client(asked: Callable[[], bool]) -> Controller:
        controller.given_up = asked
        return controller

    (stand_still if hold else lie_down)(said.append, lambda: given_up, make_client)
    assert controller.closed
    return said


@pytest.mark.parametrize(
    'state',
    [
        'stand',
        'walk',
        'turn',
        'policy',
        'get_up',
        'to stand',
        'to walk',
        'fault',
        'to fault',
        'to lie',
    ],
)
def test_a_robot_on_its_feet_lies_down(state: str) -> None:
    """Also one that is on its way there or down, or has a fault; the log says how not to wait."""
    controller = Controller(state)
    said = leave(controller)
    assert controller.modes == ['lie']
    assert said == ['lying down first; Ctrl-C again stops at once']


@pytest.mark.parametrize('state', ['walk', 'turn', 'policy', 'to walk', 'to stand'])
def test_a_robot_that_is_to_hold_ends_its_gait_first(state: str) -> None:
    """So that no foot is in the air when its servos hold; the log says how not to wait."""
    controller = Controller(state)
    assert leave(controller, hold=True) == ['standing still first; Ctrl-C again stops at once']
    assert (controller.modes, controller.state) == (['stand'], 'stand')


@pytest.mark.parametrize('state', ['stand', 'lie', 'to lie', 'relax', 'fault'])
def test_a_robot_that_is_to_hold_and_does_not_walk_is_left_as_it_is(state: str) -> None:
    """Without a word."""
    controller = Controller(state)
    assert leave(controller, hold=True) == []
    assert controller.modes == []


def test_a_robot_that_is_to_hold_and_does_not_stop_is_left() -> None:
    """It refuses, or fails: said, or seen, and no error."""
    refusing, failing = Controller('walk'), Controller('walk')
    refusing.refusal = 'no attitude'
    failing.outcomes = ['fault']
    assert leave(refusing, hold=True)[-1].startswith('stopping without standing still')
    assert leave(failing, hold=True) == ['standing still first; Ctrl-C again stops at once']


def test_a_robot_that_fails_on_its_way_down_is_asked_once_more() -> None:
    """A fault on the way stops it; the second request goes on in spite of it, a third is none."""
    once, always = Controller('walk'), Controller('walk')
    once.outcomes = ['fault']
    assert leave(once) == ['lying down first; Ctrl-C again stops at once']
    assert (once.modes, once.state) == (['lie', 'lie'], 'lie')
    always.outcomes = ['fault', 'fault']
    assert 'in vain' in leave(always)[-1]
    assert always.modes == ['lie', 'lie']


@pytest.mark.parametrize('state', ['relax', 'lie'])
def test_a_robot_that_lies_is_left_as_it_is(state: str) -> None:
    """Without a word."""
    controller = Controller(state)
    assert leave(controller) == []
    assert controller.modes == []


def test_a_controller_that_does_not_help_is_left() -> None:
    """It refuses, never gets there, or its state never arrives: reported, and no error."""
    refusing, idle, silent = Controller('walk'), Controller('walk'), Controller('')
    refusing.refusal = 'battery low'
    idle.follows = False
    assert leave(refusing)[-1].endswith('refused: battery low')
    assert leave(idle)[-1].endswith('in vain for it to lie')
    assert leave(silent)[-1].endswith('in vain for the state of the controller')


def test_ctrl_c_again_ends_the_wait() -> None:
    """Nothing is asked for any more."""
    controller = Controller('walk')
    assert leave(controller, given_up=True) == ['stopping without lying down']
    assert controller.modes == []
