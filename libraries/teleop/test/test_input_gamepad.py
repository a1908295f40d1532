# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import itertools

from hypothesis import given
from hypothesis import strategies as st
from input_devices import BYTE_STICK, HAT, InjectedDevice, InjectedDevices, STICK, TRIGGER
import pytest

from operator_input import PresetError, SettingError
from operator_input.devices import AxisRange
from operator_input.gamepad import (
    ABS_BRAKE,
    ABS_GAS,
    ABS_HAT0X,
    ABS_HAT0Y,
    ABS_RX,
    ABS_RY,
    ABS_RZ,
    ABS_X,
    ABS_Y,
    ABS_Z,
    AT_REST,
    Axis,
    Button,
    Deadman,
    Gamepad,
    GamepadState,
    Grip,
    position,
    Timeout,
)

BTN_SOUTH, BTN_NORTH, BTN_TL = 0x130, 0x133, 0x136
STANDARD_KEYS = range(0x130, 0x13F)
STANDARD_AXES = (
    dict.fromkeys((ABS_X, ABS_Y, ABS_RX, ABS_RY), STICK)
    | dict.fromkeys((ABS_Z, ABS_RZ), TRIGGER)
    | dict.fromkeys((ABS_HAT0X, ABS_HAT0Y), HAT)
)


def xbox(path: str = '/dev/input/event7') -> InjectedDevice:
    """Make what the driver xpad offers."""
    name = 'Microsoft X-Box 360 pad'
    return InjectedDevice(name, STANDARD_KEYS, STANDARD_AXES, vendor=0x045E, path=path)


def playstation() -> InjectedDevice:
    """Make what the driver hid-playstation offers; its sticks have 8 bits."""
    axes = STANDARD_AXES | dict.fromkeys((ABS_X, ABS_Y, ABS_RX, ABS_RY), BYTE_STICK)
    name = 'Sony Interactive Entertainment DualSense Wireless Controller'
    return InjectedDevice(name, STANDARD_KEYS, axes, vendor=0x054C)


def cheap() -> InjectedDevice:
    """Make a pad without a driver: joystick buttons, right stick on Z and Rz."""
    axes = dict.fromkeys((ABS_X, ABS_Y, ABS_Z, ABS_RZ), BYTE_STICK)
    axes |= {ABS_BRAKE: TRIGGER, ABS_GAS: TRIGGER, ABS_HAT0X: HAT, ABS_HAT0Y: HAT}
    return InjectedDevice('USB Gamepad', range(0x120, 0x12D), axes)


def opened(device: InjectedDevice, preset: str = 'auto') -> Gamepad:
    """Open a gamepad on a device."""
    gamepad = Gamepad(InjectedDevices(device), preset=preset)
    gamepad.scan(0.0)
    assert gamepad.is_connected
    return gamepad


def pressed_buttons(device: InjectedDevice, *codes: int) -> frozenset[Button]:
    """Press buttons of a device; return those that its gamepad has."""
    gamepad = opened(device)
    for code in codes:
        device.press(code)
    return gamepad.read()[-1].buttons


def test_each_kind_of_pad_is_found_and_its_letters_are_right() -> None:
    """The driver xpad calls X north; of a PlayStation's the triangle is north, the cross south."""
    assert opened(xbox()).name == 'Microsoft X-Box 360 pad (xbox)'
    assert opened(playstation()).name.endswith('(ps)')
    assert opened(cheap()).name.endswith('(generic)')
    assert opened(xbox(), preset='ps').name.endswith('(ps)'), 'the user knows better'
    assert pressed_buttons(xbox(), BTN_NORTH) == {Button.WEST}
    assert pressed_buttons(playstation(), BTN_NORTH, BTN_SOUTH) == {Button.NORTH, Button.SOUTH}
    assert pressed_buttons(cheap(), 0x124) == {Button.LEFT_SHOULDER}
    with pytest.raises(
        PresetError, match=r"'xboks'; did you mean 'xbox'.*auto, xbox, ps, generic"
    ):
        Gamepad(InjectedDevices(), preset='xboks')


def test_a_report_of_the_same_is_no_sign_of_life() -> None:
    """A receiver may repeat the last state; a stick that moves within its dead zone is a hand."""
    device = xbox()
    gamepad = opened(device)
    counts = []
    for value in (0, 0, 300, 300, 301):
        device.move(ABS_X, value)
        counts.append([state.changes for state in gamepad.read()][-1])
    steps = [after - before for before, after in itertools.pairwise(counts)]
    assert steps == [0, 1, 0, 1]
    assert gamepad.state.axis(Axis.LEFT_X) == 0.0


def test_up_and_left_are_positive() -> None:
    """The kernel counts right and down; robots count forward and left (REP 103)."""
    device = xbox()
    gamepad = opened(device)
    device.move(ABS_Y, -32768)
    device.move(ABS_X, -32768)
    device.move(ABS_RX, 32767)
    device.move(ABS_HAT0Y, -1)
    state = gamepad.read()[-1]
    assert (state.axis(Axis.LEFT_Y), state.axis(Axis.LEFT_X)) == (1.0, 1.0)
    assert (state.axis(Axis.RIGHT_X), state.axis(Axis.DPAD_Y)) == (-1.0, 1.0)
    device = cheap()
    gamepad = opened(device)
    device.move(ABS_RZ, 0)
    device.move(ABS_GAS, 255)
    state = gamepad.read()[-1]
    assert (state.axis(Axis.RIGHT_Y), state.axis(Axis.RIGHT_TRIGGER)) == (1.0, 1.0)


def test_d_pad_of_four_buttons() -> None:
    """They are the same axes; a short press is seen, and the releases among lost events."""
    device = InjectedDevice(
        'PS3', [*STANDARD_KEYS, *range(0x220, 0x224)], {ABS_X: STICK, ABS_Y: STICK}
    )
    gamepad = opened(device)
    device.press(0x220)
    device.press(0x223)
    state = gamepad.read()[-1]
    assert (state.axis(Axis.DPAD_Y), state.axis(Axis.DPAD_X)) == (1.0, -1.0)
    device.press(BTN_TL)
    device.release(BTN_TL)
    assert [state.buttons for state in gamepad.read()] == [{Button.LEFT_SHOULDER}, frozenset()]
    device.press(BTN_TL)
    gamepad.read()
    device.release(BTN_TL)
    device.release(0x220)
    device.drop_events()
    state = gamepad.read()[-1]
    assert (state.axis(Axis.DPAD_Y), state.axis(Axis.DPAD_X)) == (0.0, -1.0)
    assert state.buttons == frozenset()


def test_unplugged_gamepad_is_at_rest() -> None:
    """Pulled out with the stick forward: the last state is rest, and that stays so."""
    device = xbox()
    said: list[str] = []
    gamepad = Gamepad(InjectedDevices(device), log=said.append)
    gamepad.scan(0.0)
    device.press(BTN_TL)
    device.move(ABS_Y, -32768)
    gamepad.read()
    device.unplug()
    assert gamepad.read() == [AT_REST]
    assert gamepad.state == AT_REST
    assert not gamepad.is_connected
    assert device.is_closed
    assert 'released' in said[-1]


def test_gamepad_that_comes_later_is_used() -> None:
    """Plugged in after the start, and again after it was pulled out.

    The state at the start is the device's, not rest: the deadman sees what is pressed.
    """
    devices = InjectedDevices()
    gamepad = Gamepad(devices)
    gamepad.scan(0.0)
    assert not gamepad.is_connected
    for path in ('/dev/input/event7', '/dev/input/event9'):
        device = xbox(path)
        device.axes[ABS_Y] = -32768
        device.keys.add(BTN_TL)
        devices.plugged = [device]
        gamepad.scan(100.0)
        gamepad.scan(200.0)
        assert gamepad.is_connected
        assert gamepad.state.axis(Axis.LEFT_Y) == 1.0
        assert Deadman().grip(gamepad.state) is Grip.HELD
        device.unplug()
        gamepad.read()


@pytest.mark.parametrize(
    'other',
    [
        InjectedDevice('Keyboard', range(1, 120)),
        InjectedDevice('Mouse', {0x110, 0x111}),
        InjectedDevice('DualSense Motion Sensors', (), {ABS_X: STICK, ABS_Y: STICK}),
        InjectedDevice('Touchpad', {0x14A}, {ABS_X: STICK, ABS_Y: STICK}),
    ],
    ids=lambda device: device.info.name,
)
def test_other_devices_are_left_alone(other: InjectedDevice) -> None:
    """Keyboards, mice, and the tilt sensor of a gamepad are no gamepads.

    Opening a device wakes it: it is left alone for a while, but not for good.
    """
    devices = InjectedDevices(other)
    gamepad = Gamepad(devices)
    for now, is_looked_at in ((0.0, True), (5.0, False), (11.0, True)):
        other.is_closed = False
        gamepad.scan(now)
        assert other.is_closed is is_looked_at
    assert not gamepad.is_connected
    devices.plugged = [xbox()]  # under the same path
    gamepad.scan(30.0)
    assert gamepad.is_connected


def test_device_by_path_and_by_name() -> None:
    """Of two gamepads the one that was named is used."""
    first, second = xbox('/dev/input/event1'), playstation()
    for wanted in ('/dev/input/event7', 'DualSense'):
        gamepad = Gamepad(InjectedDevices(first, second), device=wanted)
        gamepad.scan(0.0)
        assert gamepad.name.endswith('(ps)')
    with pytest.raises(PresetError, match='neither a path nor an expression'):
        Gamepad(InjectedDevices(), device='(')


SPANS = st.tuples(st.integers(-40000, 40000), st.integers(1, 70000), st.integers(0, 20000)).map(
    lambda numbers: AxisRange(numbers[0], numbers[0] + numbers[1], numbers[2])
)


@given(
    st.sampled_from(Axis), SPANS, st.integers(-(10**6), 10**6), st.floats(0, 1, exclude_max=True)
)
def test_axis_is_bounded(axis: Axis, span: AxisRange, value: int, dead_zone: float) -> None:
    """Whatever a device says of itself and sends, an axis is within its bounds."""
    way = position(axis, span, value, dead_zone)
    assert (0.0 if axis.is_trigger else -1.0) <= way <= 1.0


@given(st.floats(0, 0.9), st.integers(0, 65534))
def test_axis_is_monotonic_and_without_a_jump(dead_zone: float, value: int) -> None:
    """Pushing further is never slower, and a step of the device is a small step of the axis."""
    span = AxisRange(0, 65535)
    here, there = (position(Axis.LEFT_X, span, each, dead_zone) for each in (value, value + 1))
    assert 0.0 <= here - there <= 2.0 / 65535 / (1.0 - dead_zone) + 1e-9
    assert position(Axis.LEFT_X, AxisRange(5, 5), value, dead_zone) == 0.0, 'a device without one'


@pytest.mark.parametrize(
    ('axes', 'at_full_deflection'),
    [
        ({}, True),
        ({Axis.LEFT_Y: 1.0}, True),
        ({Axis.LEFT_Y: 0.5}, False),
        ({Axis.LEFT_X: 0.7, Axis.LEFT_Y: -0.7}, True),
        ({Axis.RIGHT_X: -1.0, Axis.LEFT_Y: 0.3}, False),
        ({Axis.RIGHT_TRIGGER: 1.0, Axis.DPAD_X: 1.0}, True),
        ({Axis.RIGHT_TRIGGER: 0.6}, False),
    ],
)
def test_a_stick_may_rest_at_its_end(axes: dict[Axis, float], at_full_deflection: bool) -> None:
    """There, at the rim, and in the middle, a living hand changes nothing."""
    assert GamepadState(axes).at_full_deflection is at_full_deflection


def test_each_timeout_bounds_a_motion_and_is_named() -> None:
    """At full deflection the second one counts, which is never shorter than the first."""
    deadman = Deadman(timeout=0.5, full_deflection_timeout=2.0)
    partly, fully = (GamepadState({Axis.LEFT_Y: way}) for way in (0.5, 1.0))
    assert deadman.timeout_at(partly) == Timeout('deadman_timeout', 0.5)
    assert deadman.timeout_at(fully) == Timeout('deadman_full_deflection_timeout', 2.0)
    with pytest.raises(SettingError, match='it must be at least deadman_timeout, 3;'):
        Deadman(full_deflection_timeout=2.0)


def held(*buttons: Button) -> GamepadState:
    """Make a state of pressed buttons."""
    return GamepadState(buttons=frozenset(buttons))


LEFT, RIGHT, TRIGGER_BUTTON = Button.LEFT_SHOULDER, Button.RIGHT_SHOULDER, Button.LEFT_TRIGGER


@pytest.mark.parametrize(
    ('deadman', 'state', 'grip'),
    [
        (Deadman(), AT_REST, Grip.RELEASED),
        (Deadman(), held(LEFT), Grip.HELD),
        (Deadman(), held(RIGHT), Grip.TURBO),
        (Deadman(), held(LEFT, RIGHT), Grip.TURBO),
        (Deadman(), held(Button.SOUTH), Grip.RELEASED),
        (Deadman(TRIGGER_BUTTON, None), GamepadState({Axis.LEFT_TRIGGER: 0.4}), Grip.RELEASED),
        (Deadman(TRIGGER_BUTTON, None), GamepadState({Axis.LEFT_TRIGGER: 0.6}), Grip.HELD),
        (Deadman(None, None), AT_REST, Grip.HELD),
    ],
)
def test_deadman(deadman: Deadman, state: GamepadState, grip: Grip) -> None:
    """Only its buttons allow motion; a trigger that is an axis counts beyond its middle."""
    assert deadman.grip(state) is grip
