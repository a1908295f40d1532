# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""From a YAML scalar to a value of a primitive ROS type, or an error with what is accepted."""

from __future__ import annotations

import math
import struct

from ..aliases import Slot, Value
from ..cli.errors import FieldValueError

# https://design.ros2.org/articles/idl_interface_definition.html, integer types; octet and char
# are one byte
_INTEGERS: dict[str, range] = {
    f'{sign}int{bits}': range(1 << bits) if sign else range(-(1 << bits - 1), 1 << bits - 1)
    for sign in ('', 'u')
    for bits in (8, 16, 32, 64)
}
_CHARS = {'char': range(256), 'wchar': range(1 << 16)}
_FLOATS = ('float', 'double', 'long double')


def to_primitive(slot: Slot, value: object, path: str) -> Value:
    """Convert one value.

    Args:
        slot: The field's type, a `rosidl_parser.definition` type that is no message or array.
        value: What YAML gave.
        path: The field's name with those of the messages around it, for the error message.

    Returns:
        The value as the generated class keeps it.

    Raises:
        FieldValueError: When the type cannot hold the value.
    """
    typename = getattr(slot, 'typename', None)
    if typename is None:
        return _text(slot, value, path)
    if typename == 'boolean':
        return _bool(value, path)
    if typename == 'octet':
        return _octet(value, path)
    if typename in _FLOATS:
        return _float(typename, value, path)
    limits = _INTEGERS.get(typename) or _CHARS[typename]
    return _integer(typename, limits, value, path)


def _bool(value: object, path: str) -> bool:
    if isinstance(value, bool) or (isinstance(value, int) and value in {0, 1}):
        return bool(value)
    raise FieldValueError(f'{path}: {value!r} is no bool; write true or false')


def _octet(value: object, path: str) -> bytes:
    if isinstance(value, bytes) and len(value) == 1:
        return value
    if isinstance(value, int) and not isinstance(value, bool) and value in range(256):
        return bytes([value])
    raise FieldValueError(f'{path}: {value!r} is no byte; write 0 to 255')


def _integer(typename: str, limits: range, value: object, path: str) -> int:
    number = _number(value)
    if number is None or number != number // 1:
        raise FieldValueError(f'{path}: {value!r} is no integer ({typename})')
    if number not in limits:
        raise FieldValueError(
            f'{path}: {value} is outside of {typename} [{limits.start}, {limits.stop - 1}]'
        )
    return int(number)


def _float(typename: str, value: object, path: str) -> float:
    number = _number(value)
    if number is None:
        raise FieldValueError(f'{path}: {value!r} is no number ({typename})')
    result = float(number)
    if typename == 'float' and math.isfinite(result):
        try:
            struct.pack('<f', result)
        except OverflowError:
            raise FieldValueError(f'{path}: {value} is outside of float32') from None
    return result


def _number(value: object) -> int | float | None:
    """A number, also from text: YAML 1.1 takes `1e3` (no point) for text."""
    if isinstance(value, bool):
        return None
    if isinstance(value, int | float):
        return value
    if isinstance(value, str):
        try:
            return float(value) if not value.strip().lstrip('+-').isdecimal() else int(value)
        except ValueError:
            return None
    return None


def _text(slot: Slot, value: object, path: str) -> str:
    if isinstance(value, dict | list | tuple):
        raise FieldValueError(f'{path}: {value!r} is no text; put it in quotes')
    if isinstance(value, bytes):
        text = value.decode('latin-1')
    else:
        text = '' if value is None else str(value)
    bound = getattr(slot, 'maximum_size', None)
    if bound is not None and len(text) > bound:
        raise FieldValueError(f'{path}: the text has {len(text)} characters, at most {bound} fit')
    return text
