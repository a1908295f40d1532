# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A library of the vendor's with a layout of its own: the driver goes through it, unseen."""

from __future__ import annotations

from collections.abc import Iterator
import json
import os
from pathlib import Path
import pty
import select
import sys
import threading
import time
import tty
from typing import TYPE_CHECKING

import pytest

from quad_hardware.exceptions import LinkError
from quad_hardware.link import Driver, LinkOptions, LinkState, RobotState
from quad_hardware.link.session import open_session
from quad_hardware.link.vendor_library import is_installed
from quad_hardware.protocol import LEG_MOTORS, NEW

if TYPE_CHECKING:
    from typing_extensions import Self

TIMEOUT = 15.0  # [s]

# what the article states of it, on a line of JSON; slots in the reverse order of ours
CLIENT = """
import json
import serial


class XgoDog:
    def __init__(self, port):
        self._serial = serial.Serial(port, 115200, timeout=0.2)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._serial.close()

    def _say(self, **words):
        self._serial.write(json.dumps(words).encode() + b'\\n')

    def read_version(self):
        return 'V-9'

    def system_read_battery(self):
        return 50

    def system_set_feedback(self, on):
        self._say(feedback=on)

    def write_servo_speed(self, motor, speed):
        self._say(speed=speed)

    def METHOD(self, motor, angle):
        self._say(motor=motor, angle=angle)
"""
FEEDBACK = """
import json
from types import SimpleNamespace


class SendStateParser:
    def __init__(self):
        self._rest = b''

    def feed_bytes(self, data):
        *lines, self._rest = (self._rest + data).split(b'\\n')
        return [SimpleNamespace(**json.loads(line)) for line in lines]
"""
REGISTRY = """
IDS = (11, 12, 13, 21, 22, 23, 31, 32, 33, 41, 42, 43, 51, 52, 53, 54)


def feedback_slot_of(motor_id):
    return 15 - IDS.index(motor_id)
"""


def install(folder: Path, method: str = 'write_servo_angle') -> None:
    """Write the library into a folder."""
    package = folder / 'xgo_lib2'
    package.mkdir()
    (package / '__init__.py').touch()
    (package / 'client.py').write_text(CLIENT.replace('METHOD', method))
    (package / 'feedback.py').write_text(FEEDBACK)
    (package / 'registry.py').write_text(REGISTRY)


@pytest.fixture
def library(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A folder in the path; what was imported from it is forgotten at the end."""
    kept = {name: module for name, module in sys.modules.items() if name.startswith('xgo_lib2')}
    for name in kept:
        del sys.modules[name]
    folder = tmp_path / 'site'
    folder.mkdir()
    monkeypatch.syspath_prepend(folder)
    yield folder
    for name in [name for name in sys.modules if name.startswith('xgo_lib2')]:
        del sys.modules[name]
    sys.modules.update(kept)


class JsonRobot:
    """A robot that speaks lines of JSON."""

    def __init__(self, *, acceleration: bool = True) -> None:
        """Open a terminal."""
        self._master, self._slave = pty.openpty()
        tty.setraw(self._master)
        tty.setraw(self._slave)
        self.path = os.ttyname(self._slave)
        self.angles: dict[int, float] = {}
        self._state = {
            'battery': 50,
            'roll': 1.0,
            'pitch': 2.0,
            'yaw': 3.0,
            'joint_pos_deg': [float(slot) for slot in range(16)],
            'joint_vel_deg_s': [0.0] * 16,
        }
        if acceleration:
            self._state['acc'] = [0.0, 0.0, 9.8]
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run)

    def _run(self) -> None:
        rest, feedback = b'', False
        while not self._stop.is_set():
            if select.select([self._master], [], [], 0.02)[0]:
                *lines, rest = (rest + os.read(self._master, 4096)).split(b'\n')
                for line in map(json.loads, lines):
                    feedback = bool(line.get('feedback', feedback))
                    if 'motor' in line:
                        self.angles[line['motor']] = line['angle']
            elif feedback:
                os.write(self._master, json.dumps(self._state).encode() + b'\n')

    def __enter__(self) -> Self:
        """Begin."""
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        """End."""
        self._stop.set()
        self._thread.join()
        os.close(self._master)
        os.close(self._slave)


@pytest.mark.parametrize('acceleration', [True, False])
def test_the_vendors_library_does_the_talking(library: Path, *, acceleration: bool) -> None:
    """States by its parser and its slots, angles by its method, one motor after the other."""
    install(library)
    states: list[RobotState] = []
    with JsonRobot(acceleration=acceleration) as robot:
        driver = Driver(
            LinkOptions(robot.path, vendor=True),
            lambda state: states.append(state) or '',  # type: ignore[func-returns-value]
            lambda *_: None,
        )
        driver.start()
        wait_for(lambda: len(states) > 3, driver)
        assert driver.command(dict.fromkeys(LEG_MOTORS, 12.5))
        wait_for(lambda: len(robot.angles) == 12, driver)
        assert not driver.torque(on=False)
        status = driver.status()
        driver.stop()
    assert (status.protocol, status.firmware, status.state) == ('vendor', 'V-9', LinkState.RUNNING)
    assert states[0].attitude == (1.0, 2.0, 3.0)
    assert states[0].positions[11] == 15.0
    assert robot.angles == dict.fromkeys(LEG_MOTORS, 12.5)
    assert (states[0].acceleration is None) is not acceleration


def wait_for(condition: object, driver: Driver) -> None:
    """Wait for something."""
    deadline = time.monotonic() + TIMEOUT
    while not condition():  # type: ignore[operator]
        assert time.monotonic() < deadline, driver.status()
        time.sleep(0.005)


def test_a_method_that_is_not_found_is_asked_for(library: Path) -> None:
    """The message lists what there is; the parameter names it."""
    install(library, 'turn')
    with JsonRobot() as robot:
        with pytest.raises(LinkError, match=r'vendor_servo_method to one of .*turn'):
            open_session(LinkOptions(robot.path, (), vendor=True))
        with pytest.raises(LinkError, match="no method 'spin'"):
            open_session(LinkOptions(robot.path, (), vendor=True, vendor_method='spin'))
        session = open_session(LinkOptions(robot.path, (), vendor=True, vendor_method='turn'))
        session.port.close()


def test_without_a_robot_the_others_are_tried_as_well(library: Path, tmp_path: Path) -> None:
    """And the message tells both."""
    install(library)
    with pytest.raises(LinkError, match=r'xgo_lib2 cannot open .* then without it: .*no such dev'):
        open_session(LinkOptions(str(tmp_path / 'none'), (NEW,), vendor=True))


def test_ours_is_not_taken_for_the_vendors(library: Path) -> None:
    """The stand-in is none; a library of the vendor's in the path is."""
    assert not is_installed()
    for name in [name for name in sys.modules if name.startswith('xgo_lib2')]:
        del sys.modules[name]
    install(library)
    assert is_installed()
