# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Messages of the servo's topics: whose they are, and what becomes of those that go wrong."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

from geometry_msgs.msg import TwistStamped
from hypothesis import given
from hypothesis import strategies as st
from servo_drives import Drives

from arm_servo.commands import twist_command
from arm_servo.nodes.publishers import Publishers, UNSUPPORTED
from arm_servo.nodes.refusals import Refusals
from arm_servo.nodes.servo import FRESH, Servo
from arm_servo.nodes.servo_modes import CommandKind
from arm_servo.requests import JogRequest
from arm_servo.set_point import Source


@given(
    st.lists(st.integers(1, 10**6), min_size=1, max_size=5, unique=True),
    st.lists(st.tuples(st.integers(0, 4), st.integers(1, 5)), max_size=60),
)
def test_publishers_are_told_apart(starts: list[int], messages: list[tuple[int, int]]) -> None:
    """By the numbers of their messages, of which some get lost."""
    numbers = [start * 1000 for start in starts]
    publishers, found = Publishers(), dict[int, int]()
    for who, step in messages:
        sender = who % len(numbers)
        numbers[sender] += step
        publisher = publishers.of({'publication_sequence_number': numbers[sender]})
        assert found.setdefault(sender, publisher) == publisher
    assert len(set(found.values())) == len(found)


def test_two_publishers_that_began_together_are_told_apart() -> None:
    """Their numbers are the same, message by message."""
    publishers = Publishers()
    found = [
        publishers.of({'publication_sequence_number': number // 2}) for number in range(2, 40)
    ]
    assert len(set(found[::2])) == 1
    assert len(set(found[1::2])) == 1
    assert found[0] != found[1]


def test_without_numbers_all_publishers_are_one() -> None:
    """A middleware need not count."""
    publishers = Publishers()
    assert publishers.of({'publication_sequence_number': UNSUPPORTED}) == publishers.of({})


class Commands:
    """A servo without its ROS node, and the arm behind it."""

    def __init__(self) -> None:
        self.drives = Drives()
        self.drives.attach()
        self.drives.run(2)
        self.logged: list[str] = []
        servo: Any = object.__new__(Servo)
        logger = SimpleNamespace(error=lambda text, **_: self.logged.append(text))
        servo._node = SimpleNamespace(get_logger=lambda: logger)
        servo._modes = SimpleNamespace(admit=lambda _kind: None)
        servo._prepare = lambda: None
        servo._gateway, servo._refusals = self.drives.gateway, Refusals()
        servo._last = -FRESH
        self.servo = servo

    def send(self, numbers: list[float], publishers: Publishers, number: int) -> None:
        """Let a twist come, with its number; the cycle of the test has its own time."""
        model, expires = self.drives.gateway.model, self.drives.now + 0.1

        def convert(_message: object, _sent: float) -> JogRequest:
            return JogRequest(twist_command(model, numbers, None, None), expires)

        info = {'publication_sequence_number': number}
        self.servo._take(CommandKind.TWIST, convert, publishers, TwistStamped(), info)


def test_zeros_of_another_publisher_do_not_touch_a_jog() -> None:
    """A gamepad at rest streams them, while somebody jogs with the keyboard."""
    commands, publishers = Commands(), Publishers()
    for number in range(1, 80):
        commands.send([0.0, 0.05, 0.0, 0.0, 0.0, 0.0], publishers, number)
        commands.send([0.0] * 6, publishers, 5000 + number)
        commands.drives.run()
    point = commands.drives.gateway.snapshot.set_point
    assert point is not None
    model, state = commands.drives.gateway.model, point.state
    speed = (model.jacobian(state.position) @ state.velocity)[1]
    assert abs(speed - 0.05) < 1e-3
    commands.send([0.0] * 6, publishers, 80)
    commands.drives.run(40)
    assert commands.drives.gateway.snapshot.source is Source.NONE


def test_whatever_a_command_raises_ends_that_command_only() -> None:
    """It is refused in the status, with a traceback in the log, and the next one counts."""
    commands, publishers = Commands(), Publishers()

    def fail(_message: object, _sent: float) -> JogRequest:
        raise ZeroDivisionError('no such luck')

    commands.servo._take(CommandKind.TWIST, fail, publishers, TwistStamped(), {})
    assert 'ZeroDivisionError: no such luck' in commands.servo._refusals.fresh(0.0)
    assert 'Traceback' in commands.logged[0]
    commands.servo._prepare = lambda: 1 // 0
    commands.send([0.0, 0.05, 0.0, 0.0, 0.0, 0.0], publishers, 1)
    assert len(commands.logged) == 2
    commands.servo._prepare = lambda: None
    commands.send([0.0, 0.05, 0.0, 0.0, 0.0, 0.0], publishers, 2)
    commands.drives.run()
    assert commands.drives.gateway.snapshot.source is Source.JOG
