# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""From YAML values to a message, with errors that name the field and what it takes.

The generated classes check nothing unless `ROS_PYTHON_CHECK_FIELDS=1`; a wrong type would end in
a crash when the message is sent. So every value is converted by the field's declared type here.
Unlike ros2cli, which calls the Python type on whatever comes, nothing is guessed that loses
something: `3.7` is no integer and `'false'` no bool.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
import importlib

from ..aliases import Message, Slot, Value
from ..cli.errors import FieldValueError
from ..cli.suggest import hint
from .from_text import parse_mapping
from .primitive import to_primitive

_HEADER = ('std_msgs', 'msg', 'Header')
_TIME = ('builtin_interfaces', 'msg', 'Time')


@dataclass(slots=True)
class Filler:
    """Fills messages and remembers the time stamps that were left to the moment of sending.

    Attributes:
        expand_now: Whether `header: auto` and `stamp: now` mean the time of sending.
        stamps: One setter for each such stamp; call it with a `builtin_interfaces/msg/Time`.
    """

    expand_now: bool = False
    stamps: list[Callable[[Message], None]] = field(default_factory=list)

    def fill(self, message: Message, values: object, path: str = '') -> None:
        """Set the fields of a message.

        Args:
            message: The message; fields that `values` does not name keep their value.
            values: A mapping of field names to values; None is an empty one.
            path: Where the message stands in a larger one, for error messages.

        Raises:
            FieldValueError: When a field does not exist or cannot take its value.
        """
        values = {} if values is None else values
        if not isinstance(values, Mapping):
            raise FieldValueError(
                f"{_at(path)}Value '{values}' is expected to be a dictionary "
                f'but is a {type(values).__name__}{_fields(message)}'
            )
        slots = dict(zip(message.get_fields_and_field_types(), message.SLOT_TYPES, strict=True))
        for name, value in values.items():
            if name not in slots:
                raise FieldValueError(_no_field(message, name, slots, path))
            self._set(message, name, slots[name], value, f'{path}.{name}' if path else name)

    def _set(self, message: Message, name: str, slot: Slot, value: object, path: str) -> None:
        type_name = _namespaced(slot)
        if self.expand_now and type_name == _HEADER and value == 'auto':
            self.stamps.append(partial(setattr, getattr(message, name), 'stamp'))
        elif self.expand_now and type_name == _TIME and value == 'now':
            self.stamps.append(partial(setattr, message, name))
        elif type_name:
            self.fill(getattr(message, name), value, path)
        elif hasattr(slot, 'value_type'):
            setattr(message, name, self._elements(slot, value, path))
        else:
            setattr(message, name, to_primitive(slot, value, path))

    def _elements(self, slot: Slot, value: object, path: str) -> list[Value]:
        values = list(value) if isinstance(value, list | tuple | bytes) else None
        if values is None:
            raise FieldValueError(f"{_at(path)}'{value}' is no sequence; write [ ... ]")
        _check_length(slot, len(values), path)
        return [
            self._element(slot.value_type, element, f'{path}[{index}]')
            for index, element in enumerate(values)
        ]

    def _element(self, value_type: Slot, value: object, path: str) -> Value:
        type_name = _namespaced(value_type)
        if not type_name:
            return to_primitive(value_type, value, path)
        package, kind, name = type_name
        message = getattr(importlib.import_module(f'{package}.{kind}'), name)()
        self.fill(message, value, path)
        return message


def _namespaced(slot: Slot) -> tuple[str, ...]:
    return tuple(slot.namespaced_name()) if hasattr(slot, 'namespaced_name') else ()


def _check_length(slot: Slot, length: int, path: str) -> None:
    size = getattr(slot, 'size', None)
    if size is not None and length != size:
        raise FieldValueError(f'{_at(path)}needs exactly {size} elements, not {length}')
    bound = getattr(slot, 'maximum_size', None)
    if bound is not None and length > bound:
        raise FieldValueError(f'{_at(path)}takes at most {bound} elements, not {length}')


def _no_field(message: Message, name: object, slots: Mapping[str, Slot], path: str) -> str:
    kind = type(message).__name__
    text = f"{_at(path)}'{kind}' object has no attribute '{name}'{_fields(message)}"
    return text + hint(str(name), slots)


def _fields(message: Message) -> str:
    fields = message.get_fields_and_field_types()
    if not fields:
        return f'\n{type(message).__name__} has no fields'
    listed = ', '.join(f'{name} ({type_})' for name, type_ in fields.items())
    return f'\n{type(message).__name__} has the fields: {listed}'


def _at(path: str) -> str:
    return f'{path}: ' if path else ''


def filled(
    message: Message, text: str, filler: Filler | None = None, *, what: str = 'field'
) -> Message:
    """Fill a message with values that a user typed.

    Args:
        message: The message; it is changed.
        text: The values as YAML.
        filler: Fills it; None for a plain one.
        what: What could not be populated, in ros2cli's words for the error.

    Returns:
        The same message.

    Raises:
        FieldValueError: The values do not fit the message.
    """
    values = parse_mapping(text)
    try:
        (filler or Filler()).fill(message, values)
    except FieldValueError as error:
        raise FieldValueError(f'Failed to populate {what}: {error}') from None
    return message
