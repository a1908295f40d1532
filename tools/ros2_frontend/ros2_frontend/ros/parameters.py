# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Parameters of other nodes, by their services.

rclpy's own client makes endpoints of six services for each call; its reader of files takes the
text '5' for a number, and its reader of values lets a mapping crash the call.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from ..cli.errors import FieldValueError
from ..names import Message, NodeName
from .graph import call, Graph

# rcl_interfaces/msg/ParameterType -> field of ParameterValue, type in words, what `get` prints
_TYPES: Mapping[int, tuple[str, str, str]] = {
    0: ('', 'not set', 'Parameter not set.'),
    1: ('bool_value', 'boolean', 'Boolean value is:'),
    2: ('integer_value', 'integer', 'Integer value is:'),
    3: ('double_value', 'double', 'Double value is:'),
    4: ('string_value', 'string', 'String value is:'),
    5: ('byte_array_value', 'byte array', 'Byte values are:'),
    6: ('bool_array_value', 'boolean array', 'Boolean values are:'),
    7: ('integer_array_value', 'integer array', 'Integer values are:'),
    8: ('double_array_value', 'double array', 'Double values are:'),
    9: ('string_array_value', 'string array', 'String values are:'),
}
TYPE_NAMES: Mapping[int, str] = {number: names[1] for number, names in _TYPES.items()}


def labelled(value: Message) -> tuple[str, Any]:
    """Return what `get` prints before a `ParameterValue`, and its value as the message has it."""
    field, _, label = _TYPES[value.type]
    return label, getattr(value, field) if field else None


def parse_value(text: str) -> object:
    """Return the value that a user means: YAML, or else a text, as a mapping or a date is."""
    import yaml

    try:
        value: object = yaml.safe_load(text)
    except yaml.YAMLError:
        return text
    return value if isinstance(value, bool | int | float | str | list) else text


def parameter(name: str, value: object) -> Message:
    """Make the `rcl_interfaces/msg/Parameter` that sets a parameter; None deletes it.

    A list of integers and floating-point numbers counts as one of the latter.

    Raises:
        FieldValueError: No parameter can have the value.
    """
    from rclpy.parameter import Parameter

    if isinstance(value, list) and any(isinstance(element, float) for element in value):
        value = [float(each) if type(each) is int else each for each in value]
    type_ = Parameter.Type.BOOL_ARRAY if value == [] else None
    try:
        return Parameter(name, type_, value).to_parameter_msg()
    except (TypeError, ValueError):
        raise FieldValueError(f'{name}: no parameter can be {value!r}') from None


def _call(service: str, graph: Graph, node: NodeName, **fields: object) -> Message:
    words = ''.join(word.capitalize() for word in service.split('_'))
    return call(graph, f'rcl_interfaces/srv/{words}', f'{node.full_name}/{service}', **fields)


def list_names(graph: Graph, node: NodeName, prefixes: Sequence[str] = ()) -> list[str]:
    """Return the names of a node's parameters, sorted; only those below one of the prefixes."""
    response = _call('list_parameters', graph, node, prefixes=list(prefixes))
    return sorted(response.result.names)


def get_values(graph: Graph, node: NodeName, names: Iterable[str]) -> list[Message]:
    """Return a `ParameterValue` for each name, or none at all when one is not declared."""
    return list(_call('get_parameters', graph, node, names=list(names)).values)


def set_values(graph: Graph, node: NodeName, parameters: Iterable[Message]) -> list[Message]:
    """Set each `Parameter` by itself; return a `SetParametersResult` for each."""
    return list(_call('set_parameters', graph, node, parameters=list(parameters)).results)


def describe(graph: Graph, node: NodeName, names: Iterable[str]) -> list[Message]:
    """Return a `ParameterDescriptor` for each name."""
    return list(_call('describe_parameters', graph, node, names=list(names)).descriptors)
