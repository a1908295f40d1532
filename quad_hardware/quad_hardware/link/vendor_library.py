# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What is known of the vendor's xgo_lib2, and what has to be named or looked for in it."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
import importlib
import inspect
from typing import Protocol as Interface

from ..exceptions import LinkError

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
    """Return whether ``import xgo_lib2`` gives the vendor's library and not our stand-in."""
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
    slots = (getattr(dog, name, None) for name in getattr(dog, '__slots__', ()))
    for value in (*getattr(dog, '__dict__', {}).values(), *slots):
        if callable(getattr(value, 'fileno', None)) and callable(getattr(value, 'write', None)):
            return Descriptor(value.fileno)
        if depth > 1 and (found := find_serial(value, depth - 1)) is not None:
            return found
    return None


def find_write_method(dog: object, name: str) -> WriteAngle:
    """Return the method that writes a servo angle.

    Nothing public says its name, and a wrong one would move servos in another unit or not at all.

    Raises:
        LinkError: It has no method of that name; the message lists what there is.
    """
    methods = dict(inspect.getmembers(dog, callable))
    if name in methods and not name.startswith('_'):
        return methods[name]
    public = ', '.join(method for method in methods if not method.startswith('_'))
    raise LinkError(
        f'the XgoDog of xgo_lib2 has no method {name!r}; set vendor_servo_method to the one that '
        f'writes the angle [deg] of a motor by its id, one of {public}'
    )
