# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Uses the vendor's own xgo_lib2 to connect to a robot, if installed.

It knows the layout of protocol v2, which is not public. This module uses its public parts:
``client.XgoDog(port)``, ``read_version``, ``system_set_feedback``,
``feedback.SendStateParser.feed_bytes``, and the names in its states. The method that writes a
servo angle by motor id is not public; the user has to name it. This module searches for the serial
port inside XgoDog and the name of the acceleration, and reports if it finds none.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
import importlib
import inspect
from typing import Any

from quad_description.rotations import Vector

from ..exceptions import LinkError
from ..protocol import MOTOR_ORDER, ParserCounters, Protocol, V2
from ..report import Report
from .dialect import Dialect, Step, vector
from .dialects import REQUEST_PERIOD, STATE_WIRE_TIME
from .port import SerialPort

WriteAngle = Callable[[int, float], object]


def is_installed() -> bool:
    """Return whether ``import xgo_lib2`` loads the vendor's library, not our stand-in."""
    try:
        library = importlib.import_module('xgo_lib2')
    except ImportError:
        return False
    return not hasattr(library, 'IS_STAND_IN')


def find_descriptor(dog: object, depth: int = 2) -> int | None:
    """Return the descriptor of the open port in an object's attributes, or in theirs."""
    slots = (getattr(dog, name, None) for name in getattr(dog, '__slots__', ()))
    for value in (*getattr(dog, '__dict__', {}).values(), *slots):
        if callable(getattr(value, 'fileno', None)) and callable(getattr(value, 'write', None)):
            return int(value.fileno())
        if depth > 1 and (found := find_descriptor(value, depth - 1)) is not None:
            return found
    return None


def find_write_method(dog: object, name: str) -> WriteAngle:
    """Return the method that writes a servo angle.

    Its name is not public, and a wrong method could move servos in another unit or not at all.

    Raises:
        LinkError: The object has no method of that name; the message lists its methods.
    """
    methods = dict(inspect.getmembers(dog, callable))
    if name in methods and not name.startswith('_'):
        return methods[name]
    public = ', '.join(method for method in methods if not method.startswith('_'))
    raise LinkError(
        f'the XgoDog of xgo_lib2 has no method {name!r}; set vendor_servo_method to the one that '
        f'writes the angle [deg] of a motor by its id, one of {public}'
    )


VENDOR = Protocol(
    name='vendor',
    origin='the vendor’s xgo_lib2',
    baud=V2.baud,
    address_size=V2.address_size,
    kinds=V2.kinds,
    functions=V2.functions,
)
_ACCELERATIONS = ('acceleration', 'acc', 'accel', 'linear_acceleration')


class VendorPort(SerialPort):
    """The serial port inside the vendor's XgoDog."""

    def __init__(self, path: str) -> None:
        """Connect to a robot with the vendor's library.

        Raises:
            LinkError: The library failed, or its serial port was not found.
        """
        self.path = path
        self.baud = VENDOR.baud  # as far as is known
        client = importlib.import_module('xgo_lib2.client')
        try:
            self.dog = client.XgoDog(path)  # the vendor's object
        except Exception as error:  # whatever the vendor's library raises
            raise LinkError(f'xgo_lib2 cannot open {path}: {error}') from error
        descriptor = find_descriptor(self.dog)
        if descriptor is None:
            self.close()
            raise LinkError(
                'no serial port is found in the XgoDog of xgo_lib2; '
                'set protocol to v2 or v1 to do without it'
            )
        self._descriptor = descriptor

    def read_version(self) -> str:
        """Return the firmware version.

        Raises:
            LinkError: The robot does not answer.
        """
        try:
            return str(self.dog.read_version())
        except Exception as error:  # whatever the vendor's library raises
            raise LinkError(f'xgo_lib2 finds no robot on {self.path}: {error}') from error

    def fileno(self) -> int:
        """Return the file descriptor."""
        return self._descriptor

    def write(self, data: bytes) -> None:
        """Do nothing: the vendor's methods send by themselves."""

    def close(self) -> None:
        """Close the robot as the vendor's library does."""
        close = getattr(self.dog, 'close', None)
        if callable(close):
            close()
        else:
            leave = getattr(self.dog, '__exit__', None)
            if callable(leave):
                leave(None, None, None)


class VendorParser:
    """Adapter of the vendor's parser."""

    def __init__(self) -> None:
        feedback = importlib.import_module('xgo_lib2.feedback')
        self._parser = feedback.SendStateParser()
        self.counters = ParserCounters()  # of bytes and states; the others are the vendor's affair
        self.pending = 0

    def feed(self, data: bytes) -> list[object]:
        """Parse bytes; return the completed states."""
        self.counters.bytes += len(data)
        try:
            states = list(self._parser.feed_bytes(data))
        except Exception as error:  # whatever the vendor's library raises
            raise LinkError(f'xgo_lib2 cannot read what came: {error}') from error
        self.counters.frames += len(states)
        return states

    def expire(self) -> list[object]:
        """Return nothing: only the vendor's parser knows the buffered bytes."""
        return []


class VendorDialect(Dialect):
    """Receives states from the vendor's parser; sends commands by the vendor's methods."""

    def __init__(self, dog: Any, now: float, method: str) -> None:  # noqa: ANN401
        """Start a conversation.

        Args:
            method: Name of the method that writes the angle [deg] of a motor by its id.

        Raises:
            LinkError: The method does not exist.
        """
        super().__init__(VENDOR)
        self.can_release = False
        self._request_at = now
        self._dog = dog
        self._write = find_write_method(dog, method)
        registry = importlib.import_module('xgo_lib2.registry')
        self._slots = {motor: int(registry.feedback_slot_of(motor)) for motor in MOTOR_ORDER}
        self._angles: dict[int, float] = {}

    @property
    def pending(self) -> bool:
        """Whether angles have not been written yet."""
        return bool(self._angles)

    def command(self, angles: Mapping[int, float]) -> None:
        """Set the angles to write at the next step."""
        self._angles = dict(angles)

    def torque(self, *, on: bool) -> None:
        """Do nothing: the vendor's library has no public method for it."""

    def cancel_pending(self) -> None:
        """Discard a command that has not been sent yet."""
        self._angles = {}

    def step(self, now: float) -> Step:
        """Write angles, and request states if they are missing.

        Raises:
            LinkError: The vendor's library failed.
        """
        angles, self._angles = self._angles, {}
        try:
            if now >= self._request_at:
                self._request_at = now + REQUEST_PERIOD
                self._dog.system_set_feedback(1)
            for motor, angle in angles.items():
                self._write(motor, angle)
        except Exception as error:  # whatever the vendor's library raises
            raise LinkError(f'xgo_lib2 failed: {error}') from error
        return Step(b'', self._request_at)

    def handle_frame(self, frame: object, now: float) -> Report | None:
        """Process a state of the vendor's parser; missing values stay missing.

        Raises:
            LinkError: The state lacks its public fields.
        """
        self._request_at = now + REQUEST_PERIOD
        self.counters.states += 1
        try:
            return Report(
                arrival=now,
                wire_time=STATE_WIRE_TIME,
                attitude=vector(_number(frame, name) for name in ('roll', 'pitch', 'yaw')),
                acceleration=_acceleration(frame),
                positions=self._by_motor(frame, 'joint_pos_deg'),
                velocities=self._by_motor(frame, 'joint_vel_deg_s'),
                battery=min(max(int(_number(frame, 'battery')), 0), 100),
            )
        except (AttributeError, IndexError, TypeError, ValueError) as error:
            raise LinkError(f'a state of xgo_lib2 is not as expected: {error}') from error

    def _by_motor(self, state: object, name: str) -> dict[int, float]:
        values = list(getattr(state, name))
        return {motor: float(values[slot]) for motor, slot in self._slots.items()}


def _number(state: object, name: str) -> float:
    return float(getattr(state, name))


def _acceleration(state: object) -> Vector | None:
    name = next((name for name in _ACCELERATIONS if hasattr(state, name)), None)
    if name is None:
        return None
    acceleration = vector(float(number) for number in getattr(state, name))
    return acceleration if any(acceleration) else None  # no accelerometer on earth reads zero
