# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The gamepad's program on an injected pad, over DDS."""

from __future__ import annotations

from collections.abc import Iterator
import threading

from input_devices import InjectedDevice, InjectedDevices, xbox_pad
from isolation import Isolation
from model_robots import texts
import pytest
import rclpy
from ros_client import RosClient
from servo_nodes import ServoListener, TIMEOUT

from arm_servo.teleop.servo_gamepad import ServoGamepad
from operator_input.ros import serve_teleop

pytestmark = pytest.mark.scenario
ABS_X, ABS_Y, ABS_HAT0Y = 0, 1, 0x11
EAST, LEFT_SHOULDER, RIGHT_SHOULDER, START = 0x131, 0x136, 0x137, 0x13B


@pytest.fixture
def pad() -> InjectedDevice:
    """Make an Xbox pad."""
    return xbox_pad()


@pytest.fixture
def turns() -> list[float]:
    """Return when the loop of the program turned so far in [s]."""
    return []


@pytest.fixture
def servo(
    pad: InjectedDevice, turns: list[float], isolation: Isolation, monkeypatch: pytest.MonkeyPatch
) -> Iterator[ServoListener]:
    """Run the node's own loop on the pad, and listen as the servo of a GP110."""
    rclpy.init(domain_id=isolation.domain_id)
    stop = threading.Event()
    node = ServoGamepad(InjectedDevices(pad))
    serve = node.link.serve

    def turn(now: float) -> None:
        serve(now)
        turns.append(now)

    monkeypatch.setattr(node.link, 'serve', turn)
    thread = threading.Thread(target=serve_teleop, args=[node, stop])
    thread.start()
    try:
        with RosClient(isolation.domain_id, 'servo_node') as client:
            servo = ServoListener(client, *texts('gp110'))
            client.spin_until(
                lambda: node.link.has_subscriber and node.link.scales.linear == 0.2,
                TIMEOUT,
                'link',
            )
            yield servo
    finally:
        stop.set()
        thread.join()
        assert pad.is_closed
        rclpy.shutdown()


def test_the_pad_jogs_tool_and_joints(
    pad: InjectedDevice, turns: list[float], servo: ServoListener
) -> None:
    """With the deadman the stick moves, with turbo faster; let go, three rests and silence.

    Menu chooses the tool's frame, B the next joint, which the d-pad moves.
    """
    begin = 0

    def wait_for(frame: str, *twist: float, times: int = 1) -> None:
        wanted = [(frame, (*twist, *(0.0,) * (6 - len(twist))))] * times
        servo.client.spin_until(
            lambda: servo.received[begin:][-times:] == wanted, TIMEOUT, str(wanted)
        )

    pad.move(ABS_Y, -32768)
    later = len(turns) + 6
    servo.client.spin_until(lambda: len(turns) >= later, TIMEOUT, 'turns of the loop')
    assert not servo.twists, 'only with the deadman'
    pad.press(LEFT_SHOULDER)
    wait_for('base_link', 0.06)
    pad.press(RIGHT_SHOULDER)
    wait_for('base_link', 0.2)
    pad.release(RIGHT_SHOULDER)
    pad.release(LEFT_SHOULDER)
    wait_for('base_link', times=3)
    pad.move(ABS_Y, 0)
    begin = len(servo.received)
    pad.press(LEFT_SHOULDER)
    pad.press(START)
    pad.move(ABS_X, -32768)
    wait_for('tool0', 0.0, 0.06)
    pad.move(ABS_X, 0)
    pad.press(EAST)
    pad.move(ABS_HAT0Y, -1)
    servo.client.spin_until(lambda: bool(servo.jogs), TIMEOUT, 'joint')
    assert list(servo.jogs[0].joint_names) == ['joint_2_l']
    assert list(servo.jogs[0].velocities) == [pytest.approx(0.15)]
