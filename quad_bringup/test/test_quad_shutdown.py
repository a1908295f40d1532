# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The robot lies down before it is left, if that can be."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from process_supervisor import CallError, GivenUpError
from quad_bringup.mode_client import leave


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
        """Make the time-out pass at once."""
        if self.given_up():
            raise GivenUpError(what)
        if not condition():
            raise CallError(f'waited {timeout:g} s in vain for {what}')

    def close(self) -> None:
        """Leave."""
        self.closed = True


LYING_DOWN = 'lying down first; Ctrl-C again stops at once'
STANDING_STILL = 'standing still first; Ctrl-C again stops at once'


@pytest.fixture(name='leaves')
def make_leaves(monkeypatch: pytest.MonkeyPatch) -> Callable[..., list[str]]:
    """Return what leaves a controller and returns the reports."""

    def leaves(controller: Controller, *, given_up: bool = False, hold: bool = False) -> list[str]:
        reports: list[str] = []

        def join(name: str, asked: Callable[[], bool], namespace: str) -> Controller:
            controller.given_up = asked
            return controller

        monkeypatch.setattr('quad_bringup.mode_client.ModeClient', join)
        leave(reports.append, lambda: given_up, namespace='', hold=hold)
        assert controller.closed
        return reports

    return leaves


Leaves = Callable[..., list[str]]


@pytest.mark.parametrize('state', ['', 'to '])
@pytest.mark.parametrize('mode', ['stand', 'walk', 'turn', 'policy', 'get_up', 'fault'])
def test_a_robot_on_its_feet_lies_down(mode: str, state: str, leaves: Leaves) -> None:
    """Also one that is on its way there, or has a fault; the log says how not to wait.

    One on its way down is waited for: left now, it would stay half-way.
    """
    controller = Controller(f'{state}{mode}')
    assert leaves(controller) == [LYING_DOWN]
    assert controller.modes == ['lie']
    assert leaves(Controller('to lie')) == [LYING_DOWN]


@pytest.mark.parametrize('state', ['walk', 'turn', 'policy', 'to walk', 'to stand'])
def test_a_robot_that_is_to_hold_ends_its_gait_first(state: str, leaves: Leaves) -> None:
    """So that no foot is in the air when its servos hold; the log says how not to wait."""
    controller = Controller(state)
    assert leaves(controller, hold=True) == [STANDING_STILL]
    assert (controller.modes, controller.state) == (['stand'], 'stand')


def test_a_robot_that_needs_nothing_is_left_as_it_is(leaves: Leaves) -> None:
    """Without a word."""
    for hold, states in (
        (False, ('relax', 'lie')),
        (True, ('stand', 'lie', 'to lie', 'relax', 'fault')),
    ):
        for state in states:
            controller = Controller(state)
            assert leaves(controller, hold=hold) == [], (state, hold)
            assert controller.modes == [], (state, hold)


def test_a_robot_that_fails_on_its_way_down_is_asked_once_more(leaves: Leaves) -> None:
    """A fault on the way stops it; the second request goes on in spite of it, a third is none."""
    once, always = Controller('walk'), Controller('walk')
    once.outcomes = ['fault']
    assert leaves(once) == [LYING_DOWN]
    assert (once.modes, once.state) == (['lie', 'lie'], 'lie')
    always.outcomes = ['fault', 'fault']
    assert 'in vain' in leaves(always)[-1]
    assert always.modes == ['lie', 'lie']
    holding = Controller('walk')
    holding.outcomes = ['fault']
    assert leaves(holding, hold=True) == [STANDING_STILL]


def test_a_controller_that_does_not_help_is_left(leaves: Leaves) -> None:
    """It refuses, never gets there, or its state never arrives: reported, and no error.

    After a second Ctrl-C no mode is requested any more.
    """
    refusing, idle, silent = Controller('walk'), Controller('walk'), Controller('')
    refusing.refusal = 'battery low'
    idle.follows = False
    assert leaves(refusing)[-1].endswith('refused: battery low')
    assert leaves(idle)[-1].endswith('in vain for it to lie')
    assert leaves(silent)[-1].endswith('in vain for the state of the controller')
    assert leaves(refusing, hold=True)[-1].startswith('stopping without standing still')
    given_up = Controller('walk')
    assert leaves(given_up, given_up=True) == ['stopping without lying down']
    assert given_up.modes == []
