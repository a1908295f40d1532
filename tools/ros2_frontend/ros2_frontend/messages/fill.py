# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Converts YAML values to messages; the generated classes reject values that do not fit.

Their checks are off by default, and a wrong type would crash when the message is sent. Unlike
ros2cli, which calls the Python type on any value, it never converts with a loss: `3.7` is no
integer and `'false'` no bool.
"""

from __future__ import annotations

from array import array
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import partial
import importlib
from typing import Any

from ..cli.commands import FieldValueError, hint, UnknownNameError
from ..names import Message

_ELLIPSIS = '...'
_SCALARS = (bool, int, float)

_ESCAPES = ('\\U', '\\N')


@dataclass(frozen=True, slots=True)
class Abbreviation:
    """Options that shorten the text of a message."""

    length: int | None = None  # longest array or text that is shown in full; None shows all
    no_arrays: bool = False  # whether arrays are replaced by their type and length
    no_texts: bool = False  # whether texts are replaced by their length


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
    """Return the placeholder for an omitted text."""
    return f'<string length: <{len(value)}>>'


def describe_array(value: Any, slot: Any) -> str:  # noqa: ANN401  # of any type
    """Return the placeholder for an omitted array; `slot` is its entry of `SLOT_TYPES`."""
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


_HEADER = ('std_msgs', 'msg', 'Header')
_TIME = ('builtin_interfaces', 'msg', 'Time')
_FLOATS = ('float', 'double', 'long double')
_SECTION = 'ros__parameters'
_ALL_NODES = '/**'
_SEPARATOR = '.'


def parse_mapping(text: str) -> dict[str, Any]:
    """Read a YAML mapping, e.g. `{ target: 10.0 }`; an empty text is an empty mapping.

    Raises:
        FieldValueError: The text is no YAML mapping; `target:10.0` (no blank) is the usual
            mistake.
    """
    import yaml

    try:
        values = yaml.safe_load(text)
    except yaml.YAMLError as error:
        raise FieldValueError(f"The passed value is not valid YAML: '{text}'\n{error}") from None
    if values is None:
        return {}
    if not isinstance(values, dict):
        slip = ' (YAML wants a space after the colon)' if ':' in text else ''
        raise FieldValueError(
            f'The passed value needs to be a dictionary in YAML format{slip}: {text}'
        )
    return values


@dataclass(slots=True)
class Filler:
    """Fills messages, and records the time stamps to set at the time of sending."""

    expand_now: bool = False  # whether `header: auto` and `stamp: now` mean the time of sending
    # one setter for each such stamp; call it with a `builtin_interfaces/msg/Time`
    stamps: list[Callable[[Message], None]] = field(default_factory=list)

    def fill(self, message: Message, values: object, path: str = '') -> None:
        """Set the fields of a message that the mapping `values` names; None sets none.

        `path` is the position of the message in a larger one, for error messages.
        """
        values = {} if values is None else values
        kind, fields = type(message).__name__, message.get_fields_and_field_types()
        listed = ', '.join(f'{name} ({type_})' for name, type_ in fields.items())
        known = f'\n{kind} has ' + (f'the fields: {listed}' if fields else 'no fields')
        at = f'{path}: ' if path else ''
        if not isinstance(values, dict):
            raise FieldValueError(
                f"{at}Value '{values}' is expected to be a dictionary "
                f'but is a {type(values).__name__}{known}'
            )
        slots = dict(zip(fields, message.SLOT_TYPES, strict=True))
        message._check_fields = True  # noqa: SLF001  # the variable would count at import only
        for name, value in values.items():
            if name not in slots:
                near = hint(str(name), slots)
                raise FieldValueError(
                    f"{at}'{kind}' object has no attribute '{name}'{known}{near}"
                )
            try:
                self._set(message, name, slots[name], value, f'{path}.{name}' if path else name)
            except AssertionError as error:
                raise FieldValueError(f'{at}{error}, not {value!r}') from None

    def _set(self, message: Message, name: str, slot: Any, value: object, path: str) -> None:  # noqa: ANN401
        type_name = _namespaced(slot)
        if self.expand_now and type_name == _HEADER and value == 'auto':
            self.stamps.append(partial(setattr, getattr(message, name), 'stamp'))
        elif self.expand_now and type_name == _TIME and value == 'now':
            self.stamps.append(partial(setattr, message, name))
        elif type_name:
            self.fill(getattr(message, name), value, path)
        elif hasattr(slot, 'value_type') and isinstance(value, list | tuple | bytes):
            element = partial(self._element, slot.value_type)
            elements = [element(each, f'{path}[{index}]') for index, each in enumerate(value)]
            setattr(message, name, elements)
        else:
            setattr(message, name, _converted(slot, value))

    def _element(self, type_: Any, value: object, path: str) -> object:  # noqa: ANN401
        name = _namespaced(type_)
        if not name:
            return _converted(type_, value)
        message = getattr(importlib.import_module('.'.join(name[:2])), name[2])()
        self.fill(message, value, path)
        return message


def _namespaced(slot: Any) -> tuple[str, ...]:  # noqa: ANN401  # of rosidl_parser
    return tuple(slot.namespaced_name()) if hasattr(slot, 'namespaced_name') else ()


def _converted(slot: Any, value: object) -> object:  # noqa: ANN401  # of rosidl_parser
    """Convert a value of another YAML type if that loses nothing, else return it unchanged."""
    kind = getattr(slot, 'typename', None)
    if kind is None:
        if isinstance(value, bytes):
            return value.decode('latin-1')
        return (
            value
            if isinstance(value, dict | list | tuple)
            else str('' if value is None else value)
        )
    if isinstance(value, str) and kind not in {'boolean', 'octet'}:
        try:  # YAML 1.1 takes `1e3` (no point) for text
            value = int(value) if value.strip().lstrip('+-').isdecimal() else float(value)
        except ValueError:
            return value
    if kind == 'boolean' and value in (0, 1):
        return bool(value)
    if kind == 'octet' and isinstance(value, int) and 0 <= value <= 255:
        return bytes([value])
    if kind in _FLOATS and type(value) is int:
        return float(value)
    if isinstance(value, float) and value.is_integer() and kind not in _FLOATS:
        return int(value)
    return value


def filled(
    message: Message, text: str, filler: Filler | None = None, *, what: str = 'field'
) -> Message:
    """Fill a message with values that a user typed as YAML, and return it.

    Raises:
        FieldValueError: The values do not fit; `what` could not be populated, as ros2cli says.
    """
    values = parse_mapping(text)
    try:
        (filler or Filler()).fill(message, values)
    except FieldValueError as error:
        raise FieldValueError(f'Failed to populate {what}: {error}') from None
    return message


def dump(node: str, values: Mapping[str, object]) -> str:
    """Return a parameter file for one node, keys sorted; a dot in a name starts a level."""
    import yaml

    tree: dict[str, Any] = {}
    for name, value in values.items():
        *levels, last = name.split(_SEPARATOR)
        branch = tree
        for level in levels:
            branch = branch.setdefault(level, {})
        branch[last] = value
    text: str = yaml.safe_dump({node: {_SECTION: tree}})
    return text


def values_for(node: str, text: str, *, use_wildcard: bool = True) -> dict[str, object]:
    """Read the parameters of one node, and by default those for all (`/**`), from a file's text.

    Entries of the node override those for all nodes. (rclpy's reader parses a quoted '5' as a
    number.)

    Raises:
        UnknownNameError: The file has nothing for the node.
        FieldValueError: It is no parameter file.
    """
    sections = parse_mapping(text)
    wanted = [*([_ALL_NODES] if use_wildcard else []), node.lstrip('/'), node]
    found = [key for key in wanted if key in sections]
    if not found:
        names = ', '.join(str(key) for key in sections)
        raise UnknownNameError(
            f'Param file does not contain parameters for {node}, only for nodes: {names}'
            + hint(node, [str(key) for key in sections])
        )
    values: dict[str, object] = {}
    for key in found:
        section = sections[key]
        if not isinstance(section, dict) or not isinstance(section.get(_SECTION), dict):
            raise FieldValueError(
                f"YAML file is not a valid ROS parameter file for node {key}: '{_SECTION}' "
                'is missing below it'
            )
        values.update(_flatten('', section[_SECTION]))
    return values


def _flatten(prefix: str, tree: Mapping[str, object]) -> Iterator[tuple[str, object]]:
    for name, value in tree.items():
        if isinstance(value, dict):
            yield from _flatten(f'{prefix}{name}{_SEPARATOR}', value)
        else:
            yield f'{prefix}{name}', value
