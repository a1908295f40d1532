# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What is known of the vendor's xgo_lib2, and what has to be looked for in it."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
import importlib
import inspect
from typing import Protocol as Interface

from ..exceptions import LinkError

WRITE_AUTO = 'auto'
_WRITE_WORDS, _SERVO_WORDS = ('write', 'set', 'move'), ('servo', 'motor', 'joint')
_OTHER_WORDS = ('speed', 'load', 'torque', 'offset', 'zero', 'id', 'feedback', 'angles')

WriteAngle = Callable[[int, float], object]


class Dog(Interface):
    """What is public of the vendor's XgoDog."""

    def read_version(self) -> object:
        """Return the firmware version."""

    def system_set_feedback(self, on: int, /) -> object:
        """Have states pushed."""


class StateParser(Interface):
    """What is public of the vendor's SendStateParser."""

    def feed_bytes(self, data: bytes, /) -> Iterable[object]:
        """Take bytes, return states."""


def is_installed() -> bool:
    """Tell whether ``import xgo_lib2`` gives the vendor's library and not our stand-in."""
    try:
        library = importlib.import_module('xgo_lib2')
    except ImportError:
        return False
    return not hasattr(library, 'IS_STAND_IN')


@dataclass(frozen=True, slots=True)
class Descriptor:
    """Something with a file descriptor."""

    fileno: Callable[[], int]


def find_serial(dog: object, depth: int = 2) -> Descriptor | None:
    """Return the open serial port among the attributes of an object, or of what it holds."""
    for value in list(getattr(dog, '__dict__', {}).values()):
        if callable(getattr(value, 'fileno', None)) and callable(getattr(value, 'write', None)):
            return Descriptor(value.fileno)
        if depth > 1 and (found := find_serial(value, depth - 1)) is not None:
            return found
    return None


def find_write_method(dog: object, name: str) -> WriteAngle:
    """Return the method that writes a servo angle.

    Args:
        dog: The vendor's XgoDog.
        name: Of the method; ``auto`` looks for the one whose name says so.

    Raises:
        LinkError: There is none of that name, or not exactly one that fits.
    """
    methods = dict(inspect.getmembers(dog, callable))
    if name != WRITE_AUTO:
        if name not in methods:
            raise LinkError(f'the XgoDog of xgo_lib2 has no method {name!r}')
        return methods[name]
    fitting = [method for method in methods if _writes_an_angle(method)]
    if len(fitting) == 1:
        return methods[fitting[0]]
    public = ', '.join(method for method in methods if not method.startswith('_'))
    raise LinkError(
        f'which method of xgo_lib2’s XgoDog writes one servo angle? {len(fitting)} names fit; set '
        f'vendor_servo_method to one of {public}'
    )


def _writes_an_angle(method: str) -> bool:
    words = method.lower().split('_')
    return (
        not method.startswith('_')
        and any(word in words for word in _WRITE_WORDS)
        and any(word in words for word in _SERVO_WORDS)
        and not any(word in words for word in _OTHER_WORDS)
    )
