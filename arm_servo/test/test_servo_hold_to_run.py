# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A jog that is held moves no arm that had stopped following, however its commands pause."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import pytest
from servo_drives import Drives, PERIOD

from arm_canopen import Refusal, RefusalCause
from arm_servo import JogRequest, JointCommand, Source
from arm_servo.core.requests import by_joint


class Stick:
    """A client that jogs the first joint of an arm whose drives others may take."""

    def __init__(self, client: str = 'stick') -> None:
        self.drives = Drives()
        self.drives.attach()
        self.drives.run(2)
        self.client = client
        self.refusals: list[str] = []

    def push(self, speed: float, cycles: int = 1) -> None:
        """Command a speed in each cycle, as the servo node does."""
        for _ in range(cycles):
            velocities = {'panda_joint1': speed}
            command = JointCommand(*by_joint(self.drives.gateway.model, velocities, 'velocities'))
            request = JogRequest(command, self.drives.now + 0.1, client=self.client)
            future = self.drives.gateway.command(request, self._get_ready)
            self.drives.run()
            if (error := future.exception(0.0)) is not None:
                self.refusals.append(str(error))

    def wait(self, seconds: float) -> None:
        """Command nothing."""
        self.drives.run(round(seconds / PERIOD))

    @property
    def position(self) -> float:
        """Where the joint was sent in [rad]."""
        return self.drives.axes[0].setpoint

    def _get_ready(self) -> None:
        if self.drives.source.detached:
            self.drives.attach()


def halt(stick: Stick) -> None:
    """Halt a drive from outside."""
    stick.drives.source.released('panda_joint1', Refusal(RefusalCause.COMMANDED, 'halted'))


def is_enabled(stick: Stick) -> None:
    """Select the mode in which the drives follow, as ``--enable`` does."""
    for name in stick.drives.source.axes:
        selected = Refusal(RefusalCause.MODE_SELECTED, 'Cyclic synchronous position')
        stick.drives.source.released(name, selected)


def faults(stick: Stick) -> None:
    """Fault a drive, and reset it from outside."""
    axis = stick.drives.axes[1]
    faulted = Refusal(RefusalCause.FAULT)
    stick.drives.axes[1] = replace(axis, followable=False, refusal=faulted)
    stick.drives.run(100)
    stick.drives.axes[1] = axis


@pytest.mark.parametrize('pause', [0.0, 0.6, 3.0])
@pytest.mark.parametrize('happens', [halt, is_enabled, faults])
def test_a_stick_that_is_held_moves_nothing_after_a_stop(
    happens: Callable[[Stick], None], pause: float
) -> None:
    """Its commands pause as a stalled process makes them; let go and pushed again, it moves."""
    stick = Stick()
    stick.push(0.2, 50)
    assert stick.drives.gateway.snapshot.source is Source.JOG
    happens(stick)
    stick.wait(1.0)
    rest, attached = stick.position, len(stick.drives.attachments)
    stick.wait(pause)
    stick.push(0.2, 100)
    assert stick.position == pytest.approx(rest, abs=1e-6)
    assert len(stick.drives.attachments) == attached
    assert 'release and jog again' in stick.refusals[-1]
    assert 'call its ~/cyclic_position_mode' not in stick.refusals[-1]  # it is selected
    stick.push(0.0)
    stick.push(0.2, 50)
    assert stick.position > rest + 0.02


def test_a_stick_that_is_held_moves_no_arm_that_is_enabled() -> None:
    """It was pushed while the drives were disabled; they were enabled for something else."""
    stick = Stick()
    stick.wait(1.0)
    enabled, disabled = list(stick.drives.axes), Refusal(RefusalCause.NOT_ENABLED)
    stick.drives.axes = [replace(axis, followable=False, refusal=disabled) for axis in enabled]
    stick.wait(0.1)
    stick.push(0.2, 100)
    stick.drives.axes = enabled
    rest = stick.position
    stick.push(0.2, 100)
    assert stick.position == pytest.approx(rest, abs=1e-6)
    stick.push(0.0)
    stick.push(0.2, 50)
    assert stick.position > rest + 0.02


def test_a_new_push_gets_the_drives_back() -> None:
    """The stick was let go before somebody took a drive."""
    stick = Stick()
    stick.push(0.2, 50)
    stick.push(0.0)
    stick.wait(1.0)
    halt(stick)
    stick.wait(0.1)
    rest = stick.position
    stick.push(0.2, 50)
    assert stick.position > rest + 0.02


def test_others_need_not_let_go() -> None:
    """Only who held when the arm stopped."""
    stick = Stick()
    stick.push(0.2, 50)
    halt(stick)
    stick.wait(1.0)
    rest, stick.client = stick.position, 'another'
    stick.push(0.2, 50)
    assert stick.position > rest + 0.02


@pytest.mark.parametrize('pause', [1.0, 3.0, 6.0])
@pytest.mark.parametrize('happens', [halt, is_enabled, faults])
def test_who_was_silent_before_a_stop_moves_the_arm_after_it(
    happens: Callable[[Stick], None], pause: float
) -> None:
    """A client that lets go by silence, as those of moveit_servo do, held nothing."""
    stick = Stick()
    stick.push(0.2, 50)
    stick.wait(5.0)
    happens(stick)
    stick.wait(pause)
    rest = stick.position
    stick.push(0.2, 50)
    assert stick.refusals == []
    assert stick.position > rest + 0.02
