# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
import threading
from typing import Any

from hypothesis import given
from hypothesis import strategies as st
from input_devices import InjectedDevice, InjectedDevices, xbox_pad
from isolation import Isolation
import pytest
import rclpy
from ros_client import RosClient
from teleop_robot import Robot, TEST_TIMEOUT

from operator_input import CommandStream
from operator_input.gamepad import AT_REST, Axis, Button, Deadman, GamepadState
from operator_input.ros import serve_teleop
from quad_teleop import BodyPose, Mode, Speeds, Velocity
from quad_teleop.mappings import GamepadTeleop, MODE_BUTTONS
from quad_teleop.motion import NEUTRAL, PoseSteps, rest_of, RobotRequest, ZERO
from quad_teleop.nodes.teleop import TeleopGamepad

ABS_Y, ABS_HAT0Y = 1, 0x11
SOUTH, LEFT_SHOULDER, RIGHT_SHOULDER, SELECT = 0x130, 0x136, 0x137, 0x13A
FORWARD = (0.15, 0.0, 0.0)


@pytest.fixture
def pad() -> InjectedDevice:
    """Make an Xbox pad."""
    return xbox_pad()


@pytest.fixture
def robot(pad: InjectedDevice, isolation: Isolation) -> Iterator[Robot]:
    """Run the node's own loop on the pad, and listen."""
    stop = threading.Event()
    rclpy.init(domain_id=isolation.domain_id)
    node = TeleopGamepad(InjectedDevices(pad))
    thread = threading.Thread(target=serve_teleop, args=[node, stop])
    thread.start()
    try:
        with RosClient(isolation.domain_id) as client:
            robot = Robot(client)
            robot.wait_until_linked()
            client.spin_until(lambda: node.robot.has_subscriber, TEST_TIMEOUT, 'link')
            yield robot
    finally:
        stop.set()
        thread.join()
        rclpy.shutdown()
        assert pad.is_closed


@pytest.mark.scenario
def test_a_gamepad_drives_the_robot(pad: InjectedDevice, robot: Robot) -> None:
    """Stick alone: nothing. With the deadman it walks, with turbo faster; let go, it stops.

    With the deadman, A asks to stand and the d-pad lifts the body.
    """
    pad.move(ABS_Y, -32768)
    robot.listen_for(0.3)
    assert robot.twists == []
    pad.press(LEFT_SHOULDER)
    robot.wait_for(FORWARD)
    pad.press(RIGHT_SHOULDER)
    robot.wait_for((0.3, 0.0, 0.0))
    pad.press(SOUTH)
    robot.client.spin_until(lambda: robot.modes == ['stand'], TEST_TIMEOUT, 'set_mode')
    pad.move(ABS_HAT0Y, -1)
    robot.client.spin_until(lambda: bool(robot.poses), TEST_TIMEOUT, 'body pose')
    assert robot.poses[0].position.z == pytest.approx(0.005)
    pad.release(RIGHT_SHOULDER)
    pad.release(LEFT_SHOULDER)
    robot.wait_until_silent()


NO_ROBOT: Any = None
DEADMAN, TURBO = Button.LEFT_SHOULDER, Button.RIGHT_SHOULDER


def teleop(deadman: Deadman | None = None) -> GamepadTeleop:
    """Make one: normal speeds 0.15 and 0.6, turbo 0.3 and 1.2."""
    speeds, stream = (Speeds(0.15, 0.6), Speeds(0.3, 1.2)), CommandStream(0.05, rest_of)
    return GamepadTeleop(NO_ROBOT, deadman or Deadman(), stream, *speeds, steps=PoseSteps())


def state(*buttons: Button, **axes: float) -> GamepadState:
    """Make a state of the gamepad."""
    return GamepadState({Axis[name]: way for name, way in axes.items()}, frozenset(buttons))


@pytest.mark.slow
def test_sticks_move_only_with_the_deadman() -> None:
    """The left one walks, the right one turns; turbo alone is a deadman, at its speeds."""
    target = teleop()
    target.feed(state(LEFT_Y=1.0))
    assert target.step(0.0) is None
    target.feed(state(DEADMAN, LEFT_Y=1.0, LEFT_X=-0.5, RIGHT_X=0.5))
    assert target.step(0.1) == Velocity(0.15, -0.075, 0.3)
    target.feed(state(TURBO, LEFT_Y=1.0, RIGHT_X=-1.0))
    assert target.step(0.2) == Velocity(0.3, 0.0, -1.2)


@pytest.mark.slow
def test_without_a_deadman_button_rest_is_silence() -> None:
    """Where no button is needed, an untouched or unplugged gamepad does not stream zeros."""
    target = teleop(Deadman(enable=None, turbo=None))
    target.feed(state(LEFT_Y=1.0))
    assert target.step(0.0) == Velocity(0.15, 0.0, 0.0)
    target.feed(AT_REST)
    words = [target.step(0.1 + 0.1 * index) for index in range(20)]
    assert [word for word in words if word is not None] == [ZERO] * 3


@pytest.mark.slow
def test_modes_that_move_need_the_deadman() -> None:
    """A button hit by accident does not make the robot stand up; lying down is always allowed.

    So is clearing a fault, once for a press; nothing moves by it.
    """
    for button, mode in MODE_BUTTONS.items():
        assert teleop().feed(state(DEADMAN, button)) == [mode]
        assert teleop().feed(state(button)) == ([mode] if mode is Mode.LIE else [])
    target = teleop()
    assert target.feed(state(Button.SELECT)) == [RobotRequest.CLEAR_FAULT]
    assert target.feed(state(Button.SELECT, LEFT_Y=0.5)) == []
    assert target.step(0.0) is None


PARTLY, AT_A_STOP, AT_THE_RIM = {'LEFT_Y': 0.6}, {'LEFT_Y': 1.0}, {'LEFT_X': 0.7, 'LEFT_Y': 0.7}


@pytest.mark.slow
@pytest.mark.parametrize(
    ('sticks', 'ends_at'), [(PARTLY, 3.0), (AT_A_STOP, 10.0), (AT_THE_RIM, 10.0)]
)
def test_a_pad_that_does_not_change_is_no_hand(sticks: dict[str, float], ends_at: float) -> None:
    """A receiver repeats the last state, or is silent; a hand is still only at a stop."""
    for repeats in (True, False):
        target = teleop()
        walking = state(DEADMAN, **sticks)
        target.feed(walking)
        now, moved_until = 0.0, 0.0
        while now < 12.0:
            if repeats:
                target.feed(walking)
            moved_until = now if target.step(now) not in {None, ZERO} else moved_until
            now += 0.02
        assert moved_until == pytest.approx(ends_at, abs=0.1)
        assert target.expired
        target.feed(state(DEADMAN, LEFT_Y=0.5))
        assert target.step(now) is None  # it lives again, and nothing begins by itself
        target.feed(state())
        target.feed(walking)
        assert target.step(now + 0.1) not in {None, ZERO}


@pytest.mark.slow
def test_a_hand_that_trembles_goes_on() -> None:
    """Changes within the dead zone are a sign of life; a stick in the middle needs none."""
    target = teleop()
    for tick in range(500):
        trembling = replace(state(DEADMAN, LEFT_Y=1.0), changes=tick // 50)
        target.feed(trembling)
        target.step(0.02 * tick)
    assert not target.expired
    resting = teleop()
    resting.feed(state(DEADMAN))
    assert [resting.step(float(second)) for second in range(10)] == [ZERO] * 10
    resting.feed(state(DEADMAN, LEFT_Y=1.0))
    assert resting.step(10.0) == Velocity(0.15, 0.0, 0.0)


@pytest.mark.slow
def test_d_pad_lifts_and_tilts_step_by_step() -> None:
    """Each press is a step, as far as the limit; start is neutral."""
    target = teleop()
    assert target.feed(state(DEADMAN, DPAD_Y=1.0)) == [BodyPose(height=0.005)]
    assert target.feed(state(DEADMAN, DPAD_Y=1.0)) == []
    target.feed(state(DEADMAN))
    assert target.feed(state(DEADMAN, DPAD_X=-1.0)) == [BodyPose(0.005, 0.05)]
    assert target.feed(state(DEADMAN, Button.START, DPAD_X=-1.0)) == [NEUTRAL]
    assert target.feed(state(DPAD_Y=-1.0)) == []


STATES = st.builds(
    GamepadState,
    st.dictionaries(st.sampled_from(Axis), st.floats(-1, 1)),
    st.frozensets(st.sampled_from(Button), max_size=4),
)


@pytest.mark.slow
@given(st.lists(STATES, max_size=30))
def test_speed_is_bounded_and_only_with_the_deadman(states: list[GamepadState]) -> None:
    """Whatever the pad reports: no motion without the button, and none above the speeds.

    At rest, as after it was unplugged, the last word is zero and then there is none.
    """
    target = teleop()
    last: object = ZERO
    for index, each in enumerate([*states, *[AT_REST] * 10]):
        target.feed(each)
        velocity = target.step(0.1 * index)
        if not each.buttons & {DEADMAN, TURBO}:
            assert velocity in {None, ZERO}
        elif isinstance(velocity, Velocity):
            limit = 0.3 if TURBO in each.buttons else 0.15
            assert max(abs(velocity.x), abs(velocity.y)) <= limit
            assert abs(velocity.yaw) <= limit * 4
        last = velocity or last
    assert last == ZERO
    assert target.step(100.0) is None
