# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Keys to motions, in simulated time."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

from hypothesis import given
from hypothesis import strategies as st
import pytest

from arm_model import ArmNames
from arm_servo.teleop import CartesianJog, Frame, JointJog, KeyboardTeleop, Scales
from arm_servo.teleop.jog import Jog, rest_of, ServoRequest, Steps
from arm_servo.teleop.keyboard_teleop import JOINTS, TOOL
from operator_input import CommandStream, HeldKeys, KeyAction, KeyEvent

PERIOD = 0.02


def make(speed: float = 0.5, joints: tuple[str, ...] = ()) -> KeyboardTeleop:
    """Make an idle one, of a servo that runs."""
    servo: Any = SimpleNamespace(
        names=ArmNames(joints),
        scales=Scales(),
        paused=False,
        has_subscriber=True,
        report=lambda _now: (0, ''),
    )
    return KeyboardTeleop(servo, HeldKeys(), CommandStream(PERIOD, rest_of), speed, Steps())


def press(teleop: KeyboardTeleop, *keys: str) -> list[object]:
    """Press keys; return what they answer."""
    events = [KeyEvent(key, KeyAction.PRESSED, 0.0) for key in keys]
    return [answer for event in events for answer in teleop.feed(event)]


def published(teleop: KeyboardTeleop, begin: float, end: float) -> list[tuple[float, Jog]]:
    """Serve as the program does: whenever it is due."""
    sent, now = [], begin
    while now <= end:
        jog = teleop.step(now)
        if isinstance(jog, Jog):
            sent.append((now, jog))
        now = max(min(teleop.due(now), now + PERIOD), now + 1e-4)
    return sent


@pytest.mark.parametrize(
    ('key', 'axis', 'speed'),
    [
        *(('up', 0, 0.5), ('down', 0, -0.5), ('right', 1, 0.5), ('left', 1, -0.5)),
        *((';', 2, 0.5), ('.', 2, -0.5), ('s', 3, 0.5), ('c', 4, -0.5), ('V', 5, -0.5)),
    ],
)
def test_keys_of_the_tool(key: str, axis: int, speed: float) -> None:
    """The tutorial's keys move along its axes, ours turn."""
    teleop = make()
    press(teleop, key)
    jog = teleop.step(0.0)
    assert isinstance(jog, CartesianJog)
    assert [*jog.linear, *jog.angular] == [speed if each == axis else 0.0 for each in range(6)]
    assert jog.frame is Frame.BASE


def test_release_stops_with_rests_of_the_same_kind() -> None:
    """After the release three rests follow, then nothing; a joint's rest names the joint."""
    teleop = make()
    press(teleop, '3')
    moving = published(teleop, 0.0, 0.1)
    teleop.feed(KeyEvent('3', KeyAction.RELEASED, 0.1))
    after = published(teleop, 0.1, 0.5)
    assert {jog for _, jog in moving} == {JointJog(2, 0.5)}
    assert [jog for _, jog in after] == [JointJog(2)] * 3


def test_frame_and_speed_keys() -> None:
    """E is the tool's frame, W the base's, each stops a motion; R turns the joint keys round.

    Plus ends at full speed and says so, minus before standing still.
    """
    teleop = make()
    press(teleop, 'e', 'up')
    assert teleop.wanted(0.0) == CartesianJog((0.5, 0.0, 0.0), (0.0, 0.0, 0.0), Frame.TOOL)
    press(teleop, 'W')
    assert teleop.wanted(0.0) is None
    assert teleop.frame is Frame.BASE
    press(teleop, 'R', '1')
    assert teleop.wanted(0.0) == JointJog(0, -0.5)
    assert press(teleop, *'+' * 30)
    assert teleop.speed == 1.0
    press(teleop, *'-' * 60)
    assert 0.0 < teleop.speed <= 0.02


@pytest.mark.slow
@given(
    key=st.sampled_from([*TOOL, *JOINTS]),
    speed=st.floats(0.05, 1.0),
    linear=st.floats(0.01, 2.0),
    angular=st.floats(0.05, 3.0),
    unitless=st.booleans(),
)
def test_a_step_is_a_step(
    key: str, speed: float, linear: float, angular: float, unitless: bool
) -> None:
    """Speed times time of a stroke is the step, at any speed; it ends by itself.

    The repeats of a held key are no further steps while one is under way.
    """
    scales = Scales(linear=linear, rotational=angular, joint=angular, unitless=unitless)
    teleop = make(speed)
    teleop.robot.scales = scales
    press(teleop, 'm', key)
    for _ in range(3):
        teleop.feed(KeyEvent(key, KeyAction.REPEATED, 0.01))
    is_linear = key in TOOL and any(TOOL[key].linear)
    value, end = 0.0, math.nan
    for now, jog in published(teleop, 0.0, 20.0):
        message = scales.to_message(jog)
        if isinstance(message, JointJog):
            size = abs(message.velocity)
        else:
            size = max(map(abs, (*message.linear, *message.angular)))
        if size:
            value = size * ((linear if is_linear else angular) if unitless else 1.0)
            end = math.nan
        elif math.isnan(end):
            end = now
    wanted = Steps().linear if is_linear else Steps().angular
    assert value * end == pytest.approx(wanted, rel=1e-3)
    assert teleop.wanted(end) is None


def test_every_other_key_stops() -> None:
    """Space and unknown keys let go; Space publishes rests although nothing moves."""
    teleop = make()
    for key in ('space', 'z', 'f5'):
        press(teleop, 'up', key)
        assert teleop.wanted(0.0) is None
    fresh = make()
    assert press(fresh, 'k') == []
    assert press(fresh, 'space') == [ServoRequest.STOP_ROBOT], 'also what others move'
    assert [jog for _, jog in published(fresh, 0.0, 0.5)] == [CartesianJog()] * 3


def test_a_joint_that_there_is_not_is_reported_once_while_its_key_repeats() -> None:
    """Without releases each repeat is a stroke of its own; the help stays in sight."""
    teleop = make(joints=tuple(f'joint_{number}' for number in range(1, 7)))
    events = [KeyEvent('7', KeyAction.TYPED, 0.05 * number) for number in range(40)]
    reported = [answer for event in events for answer in teleop.feed(event)]
    assert reported == ['the arm has 6 joints: there is no joint 7']
    assert teleop.wanted(2.0) is None
    assert len(teleop.feed(KeyEvent('7', KeyAction.TYPED, 4.0))) == 1
    assert len(teleop.feed(KeyEvent('8', KeyAction.TYPED, 4.1))) == 1
