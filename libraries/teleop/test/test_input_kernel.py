# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

from collections.abc import Callable
import os
from pathlib import Path
import sys
import time
from typing import Any

import pytest

from operator_input import DeviceError
from operator_input.devices import InputDevices
from operator_input.gamepad import AT_REST, Axis, Button, Gamepad, GamepadState
from operator_input.keyboard import Keyboards, ReleaseMatcher

UINPUT = Path('/dev/uinput')
BTN_SOUTH, EV_KEY, EV_ABS, ABS_X, ABS_Y = 0x130, 1, 3, 0, 1


def wait_for(condition: Callable[[], bool]) -> None:
    """Wait until something holds."""
    deadline = time.monotonic() + 10
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.02)


@pytest.mark.parametrize('exists', [True, False])
def test_what_cannot_be_opened_is_reported(exists: bool, tmp_path: Path) -> None:
    """With its path and the remedy: no device, or one that went away; no folder is no error."""
    assert InputDevices(str(tmp_path / 'input')).paths() == []
    file = tmp_path / 'event0'
    if exists:
        file.touch()
    with pytest.raises(DeviceError, match=r'event0.*group input' if exists else 'event0'):
        InputDevices(str(tmp_path)).open(str(file))


def test_devices_are_found_and_problems_reported_with_their_remedy(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """No package, no devices, no permission: each has words of its own; else there is none.

    event10 comes after event9, and what is no event device is left out.
    """
    devices = InputDevices(str(tmp_path))
    assert 'plug one in, or give the container --device' in devices.problem()
    for name in ('event10', 'event9', 'mouse0', 'by-id'):
        (tmp_path / name).touch()
    assert [Path(path).name for path in devices.paths()] == ['event9', 'event10']
    assert not devices.problem()
    monkeypatch.setattr('os.access', lambda *_: False)
    assert 'usermod -aG input' in devices.problem()
    monkeypatch.setattr('importlib.util.find_spec', lambda _: None)
    assert 'apt-get install python3-evdev' in devices.problem()


def test_keys_work_without_the_package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where evdev is not installed, a device is a DeviceError, and keyboards are simply none."""
    monkeypatch.setitem(sys.modules, 'evdev', None)
    (tmp_path / 'event0').touch()
    devices = InputDevices(str(tmp_path))
    with pytest.raises(DeviceError, match='package evdev is missing'):
        devices.open(str(tmp_path / 'event0'))
    keyboards = Keyboards(devices, ReleaseMatcher())
    keyboards.scan(0.0)
    assert keyboards.names == []


@pytest.mark.skipif(
    not os.access(UINPUT, os.W_OK), reason='needs /dev/uinput, to make a gamepad of the kernel'
)
def test_gamepad_of_the_kernel() -> None:
    """A gamepad that the kernel itself offers is found, read and lost."""
    import evdev

    stick = evdev.AbsInfo(value=0, min=-100, max=100, fuzz=0, flat=0, resolution=0)
    capabilities: dict[int, Any] = {EV_KEY: [BTN_SOUTH], EV_ABS: [(ABS_X, stick), (ABS_Y, stick)]}
    name = f'Workspace test gamepad {os.getpid()}'
    gamepad = Gamepad(InputDevices(), device=name)
    states: list[GamepadState] = []

    def look() -> bool:
        gamepad.scan(time.monotonic())
        states.extend(gamepad.read())
        return gamepad.is_connected

    with evdev.UInput(capabilities, name=name) as uinput:
        wait_for(look)
        uinput.write(EV_KEY, BTN_SOUTH, 1)
        uinput.write(EV_ABS, ABS_Y, -100)
        uinput.syn()
        wait_for(lambda: look() and bool(states))
        assert states[-1].buttons == {Button.SOUTH}
        assert states[-1].axis(Axis.LEFT_Y) == 1.0
    wait_for(lambda: not look())
    assert states[-1] == gamepad.state == AT_REST
