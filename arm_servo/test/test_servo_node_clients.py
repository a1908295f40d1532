# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Messages of the servo's topics: whose they are, and what becomes of those that go wrong."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

from geometry_msgs.msg import TwistStamped
import numpy as np
from servo_drives import Drives

from arm_servo import JogRequest, Source, TwistCommand
from arm_servo.core.requests import CommandType
from arm_servo.ros.refusals import Refusals
from arm_servo.ros.servo.node import Servo


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
        self.servo = servo

    def send(self, numbers: list[float], frame: str = '') -> None:
        """Deliver a twist; the cycle of the test has its own time."""
        expires = self.drives.now + 0.1

        def convert(_message: object, _sent: float) -> JogRequest:
            return JogRequest(TwistCommand(np.array(numbers)), expires)

        message = TwistStamped()
        message.header.frame_id = frame
        self.servo._take(CommandType.TWIST, convert, message)


def test_zeros_in_another_frame_do_not_touch_a_jog() -> None:
    """A gamepad at rest streams them, while somebody jogs with the keyboard."""
    commands = Commands()
    for _ in range(80):
        commands.send([0.0, 0.05, 0.0, 0.0, 0.0, 0.0])
        commands.send([0.0] * 6, 'panda_hand')
        commands.drives.run()
    point = commands.drives.gateway.snapshot.set_point
    assert point is not None
    model, state = commands.drives.gateway.model, point.state
    speed = (model.jacobian(state.position) @ state.velocity)[1]
    assert abs(speed - 0.05) < 1e-3
    commands.send([0.0] * 6)
    commands.drives.run(40)
    assert commands.drives.gateway.snapshot.source is Source.NONE


def test_whatever_a_command_raises_ends_that_command_only() -> None:
    """It is refused in the status, with a traceback in the log, and the next one counts."""
    commands = Commands()

    def fail(_message: object, _sent: float) -> JogRequest:
        raise ZeroDivisionError('no such luck')

    commands.servo._take(CommandType.TWIST, fail, TwistStamped())
    assert 'ZeroDivisionError: no such luck' in commands.servo._refusals.fresh(0.0)
    assert 'Traceback' in commands.logged[0]
    commands.servo._prepare = lambda: 1 // 0
    commands.send([0.0, 0.05, 0.0, 0.0, 0.0, 0.0])
    assert len(commands.logged) == 2
    commands.servo._prepare = lambda: None
    commands.send([0.0, 0.05, 0.0, 0.0, 0.0, 0.0])
    commands.drives.run()
    assert commands.drives.gateway.snapshot.source is Source.JOG
