# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Messages as plain Python data, YAML and CSV, abbreviated as the options set.

The rules are those that `ros2 topic echo` shows: bytes become text of the same code points, long
values end in `...`, left-out values are named by type. Nothing here imports rclpy: a message is
anything with `get_fields_and_field_types()` and `SLOT_TYPES`.
"""

from __future__ import annotations

from array import array
from dataclasses import dataclass
from typing import Any

from ..names import Message

_ELLIPSIS = '...'
_SCALARS = (bool, int, float)

_ESCAPES = ('\\U', '\\N')


@dataclass(frozen=True, slots=True)
class Abbreviation:
    """What to leave out of a message.

    Attributes:
        length: Longest array or text that is shown in full; None shows all.
        no_arrays: Whether arrays are replaced by their type and length.
        no_texts: Whether texts are replaced by their length.
    """

    length: int | None = None
    no_arrays: bool = False
    no_texts: bool = False


FULL = Abbreviation()


def to_document(message: Message, abbreviation: Abbreviation = FULL) -> dict[str, Any]:
    """Turn a message into nested plain data, in the order of its definition."""
    fields = message.get_fields_and_field_types()
    return {
        name: _plain(getattr(message, name), slot, abbreviation)
        for name, slot in zip(fields, message.SLOT_TYPES, strict=True)
    }


def _plain(value: Any, slot: Any, cut: Abbreviation) -> Any:  # noqa: ANN401  # of any type
    if type(value) in _SCALARS:  # numpy's double is a float, too, but not for YAML
        return value
    if isinstance(value, str):
        return describe_text(value) if cut.no_texts else _shorten(value, cut.length)
    if isinstance(value, bytes):
        return _shorten(value.decode('latin-1'), cut.length)
    if is_array(value):
        if cut.no_arrays:
            return describe_array(value, slot)
        shown = value if cut.length is None else value[: cut.length]
        rest = [_ELLIPSIS] if len(shown) < len(value) else []
        return [*(_plain(each, None, cut) for each in shown), *rest]
    if hasattr(value, 'SLOT_TYPES'):
        return to_document(value, cut)
    return value.item()  # a numpy scalar


def _shorten(text: str, length: int | None) -> str:
    return text if length is None or len(text) <= length else text[:length] + _ELLIPSIS


def is_array(value: object) -> bool:
    """Whether a field's value is a list, `array.array` or numpy array; text and bytes are none."""
    return isinstance(value, list | tuple | array) or getattr(value, 'ndim', 0) > 0


def describe_text(value: str) -> str:
    """Return the stand-in for a text that is left out."""
    return f'<string length: <{len(value)}>>'


def describe_array(value: Any, slot: Any) -> str:  # noqa: ANN401  # of any type
    """Return the stand-in for an array that is left out; the slot is of its `SLOT_TYPES`."""
    element = _type_name(slot.value_type)
    if hasattr(slot, 'size'):
        return f'<array type: {element}[{slot.size}]>'
    bound = f'[{slot.maximum_size}]' if getattr(slot, 'maximum_size', None) is not None else ''
    return f'<sequence type: {element}{bound}, length: {len(value)}>'


def _type_name(value_type: Any) -> str:  # noqa: ANN401  # of rosidl_parser
    if hasattr(value_type, 'typename'):
        return str(value_type.typename)
    if hasattr(value_type, 'namespaced_name'):
        return '/'.join(value_type.namespaced_name())
    return 'wstring' if 'WString' in type(value_type).__name__ else 'string'


def to_csv(message: Message, abbreviation: Abbreviation = FULL) -> str:
    """Write all values of a message, depth first; texts are not quoted (as in ros2cli)."""
    fields = message.get_fields_and_field_types()
    cells = (
        _cell(getattr(message, name), slot, abbreviation)
        for name, slot in zip(fields, message.SLOT_TYPES, strict=True)
    )
    return ','.join(cells)


def _cell(value: Any, slot: Any, cut: Abbreviation) -> str:  # noqa: ANN401  # of any type
    if is_array(value):
        if cut.no_arrays and slot is not None:
            return describe_array(value, slot)
        shown = value if cut.length is None else value[: cut.length]
        cells = [_cell(element, None, cut) for element in shown]
        return ','.join([*cells, '...'] if len(shown) < len(value) else cells)
    if hasattr(value, 'SLOT_TYPES'):
        return to_csv(value, cut)
    if isinstance(value, str) and cut.no_texts:
        return describe_text(value)
    if isinstance(value, str | bytes) and cut.length is not None and len(value) > cut.length:
        rest: Any = b'...' if isinstance(value, bytes) else '...'
        value = value[: cut.length] + rest
    return str(value)


def to_yaml(document: object, flow_style: bool = False) -> str:
    """Write nested dicts, lists, numbers, bools and texts, with a final line feed.

    libyaml takes a quarter of PyYAML's time, but escapes characters beyond the basic plane and
    U+0085, which PyYAML (and so ros2cli) prints.
    """
    import yaml

    text = ''
    for dumper in (getattr(yaml, 'CSafeDumper', yaml.SafeDumper), yaml.SafeDumper):
        text = yaml.dump(
            document,
            Dumper=dumper,
            allow_unicode=True,
            width=2**31 - 1,
            default_flow_style=flow_style,
            sort_keys=False,
        )
        if not any(each in text for each in _ESCAPES):
            break
    return text
