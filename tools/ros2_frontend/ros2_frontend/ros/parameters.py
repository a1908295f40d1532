# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Parameters of other nodes, through their parameter services."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from ..aliases import Message, Value
from ..cli.errors import FieldValueError
from .calls import call
from .names import NodeName
from .session import Session

# rcl_interfaces/msg/ParameterType: constant -> field of ParameterValue, words of `param describe`,
# words of `param get`
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

# the same constants -> Python type, and whether it is a list of these; an empty list counts as
# the first kind of list, as in rclpy
_PYTHON_TYPES: Mapping[int, tuple[type, bool]] = {
    1: (bool, False),
    2: (int, False),
    3: (float, False),
    4: (str, False),
    6: (bool, True),
    7: (int, True),
    8: (float, True),
    9: (str, True),
}

TYPE_NAMES: Mapping[int, str] = {number: names[1] for number, names in _TYPES.items()}
LABELS: Mapping[int, str] = {number: names[2] for number, names in _TYPES.items()}


def value_of(value: Message, *, raw: bool = False) -> Value:
    """The Python value of a parameter.

    Args:
        value: A `rcl_interfaces/msg/ParameterValue`.
        raw: Whether arrays stay as the message keeps them; else they become lists.

    Returns:
        A bool, number, text or array; None when it is not set.
    """
    field = _TYPES[value.type][0]
    if not field:
        return None
    found = getattr(value, field)
    return found if raw or isinstance(found, bool | int | float | str) else list(found)


def parse_value(text: str) -> object:
    """The value that a user means.

    Args:
        text: What the user typed; YAML, or else a text.

    Returns:
        A bool, number, text or list. What is no parameter value in YAML (a mapping, an empty
        text) stays a text.
    """
    import yaml

    try:
        value: object = yaml.safe_load(text)
    except yaml.YAMLError:
        return text
    return value if isinstance(value, bool | int | float | str | list) else text


def parameter(name: str, value: object) -> Message:
    """A parameter to be set.

    Args:
        name: The parameter's name.
        value: A bool, number, text or list of one of these; None deletes the parameter. A list
            of integers and floating-point numbers counts as one of the latter.

    Returns:
        A `rcl_interfaces/msg/Parameter`.

    Raises:
        FieldValueError: When no parameter can have the value.
    """
    from rcl_interfaces.msg import Parameter, ParameterValue

    message = ParameterValue()
    if isinstance(value, list) and any(isinstance(element, float) for element in value):
        value = [float(e) if type(e) is int else e for e in value]
    for number, type_ in _PYTHON_TYPES.items():
        if _is_of(value, *type_):
            message.type = number
            setattr(message, _TYPES[number][0], value)
            return Parameter(name=name, value=message)
    if value is None:
        return Parameter(name=name, value=message)
    raise FieldValueError(f'{name}: no parameter can be {value!r}')


def _is_of(value: object, element: type, is_list: bool) -> bool:
    if is_list:
        return isinstance(value, list) and all(type(entry) is element for entry in value)
    return type(value) is element


def list_names(session: Session, node: NodeName, prefixes: Sequence[str] = ()) -> list[str]:
    """The names of a node's parameters.

    Args:
        session: The session whose node calls.
        node: The node.
        prefixes: Only those below one of these; all when empty.

    Returns:
        The names, sorted.

    Raises:
        NoAnswerError: When the node does not answer.
    """
    service = f'{node.full_name}/list_parameters'
    type_ = 'rcl_interfaces/srv/ListParameters'
    response = call(session, type_, service, prefixes=list(prefixes))
    return sorted(response.result.names)


def get_values(session: Session, node: NodeName, names: Iterable[str]) -> list[Message]:
    """The values of some parameters of a node.

    Args:
        session: The session whose node calls.
        node: The node.
        names: The parameters' names.

    Returns:
        A `rcl_interfaces/msg/ParameterValue` for each, or none at all when one is not declared.

    Raises:
        NoAnswerError: When the node does not answer.
    """
    service = f'{node.full_name}/get_parameters'
    response = call(session, 'rcl_interfaces/srv/GetParameters', service, names=list(names))
    return list(response.values)


def set_values(session: Session, node: NodeName, parameters: Iterable[Message]) -> list[Message]:
    """Set some parameters of a node, each by itself.

    Args:
        session: The session whose node calls.
        node: The node.
        parameters: `rcl_interfaces/msg/Parameter`.

    Returns:
        A `rcl_interfaces/msg/SetParametersResult` for each.

    Raises:
        NoAnswerError: When the node does not answer.
    """
    service = f'{node.full_name}/set_parameters'
    type_ = 'rcl_interfaces/srv/SetParameters'
    return list(call(session, type_, service, parameters=list(parameters)).results)


def describe(session: Session, node: NodeName, names: Iterable[str]) -> list[Message]:
    """The descriptions of some parameters of a node.

    Args:
        session: The session whose node calls.
        node: The node.
        names: The parameters' names.

    Returns:
        A `rcl_interfaces/msg/ParameterDescriptor` for each.

    Raises:
        NoAnswerError: When the node does not answer.
    """
    service = f'{node.full_name}/describe_parameters'
    type_ = 'rcl_interfaces/srv/DescribeParameters'
    return list(call(session, type_, service, names=list(names)).descriptors)
