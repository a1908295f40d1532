# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""`ros2 param`: parameters of running nodes."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
import re
import sys
from typing import Any

from ..cli.commands import (
    argument,
    FieldValueError,
    flag,
    FrontendError,
    NoAnswerError,
    positive_float,
)
from ..messages.fill import dump, values_for
from ..names import Message, NodeName
from ..ros.graph import call, Graph, graph_verb
from .node import find_node, node_verb, OPTIONAL_NODE

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
    """Return the label that `get` prints for a `ParameterValue`, and its value."""
    field, _, label = _TYPES[value.type]
    return label, getattr(value, field) if field else None


def parse_value(text: str) -> object:
    """Parse a value as YAML; anything else, such as a mapping or a date, stays a text."""
    import yaml

    try:
        value: object = yaml.safe_load(text)
    except yaml.YAMLError:
        return text
    return value if isinstance(value, bool | int | float | str | list) else text


def parameter(name: str, value: object) -> Message:
    """Make the `rcl_interfaces/msg/Parameter` that sets a parameter; None deletes it.

    A mixed list of integers and floating-point numbers becomes a list of floats.

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
    """Return the sorted parameter names of a node; with prefixes, only those below one."""
    response = _call('list_parameters', graph, node, prefixes=list(prefixes))
    return sorted(response.result.names)


def get_values(graph: Graph, node: NodeName, names: Iterable[str]) -> list[Message]:
    """Return a `ParameterValue` for each name; an empty list if one is not declared."""
    return list(_call('get_parameters', graph, node, names=list(names)).values)


def set_values(graph: Graph, node: NodeName, parameters: Iterable[Message]) -> list[Message]:
    """Set each `Parameter` separately; return a `SetParametersResult` for each."""
    return list(_call('set_parameters', graph, node, parameters=list(parameters)).results)


def describe(graph: Graph, node: NodeName, names: Iterable[str]) -> list[Message]:
    """Return a `ParameterDescriptor` for each name."""
    return list(_call('describe_parameters', graph, node, names=list(names)).descriptors)


_NAME = argument('parameter_name', help='Name of the parameter')
_TIMEOUT = argument(
    '--timeout',
    dest='spin_time',
    metavar='N',
    type=positive_float,
    help='Wait for N seconds until node becomes available (default: as --spin-time)',
)


@node_verb(_NAME, flag('--hide-type', help='Hide the type information'), _TIMEOUT)
def get(graph: Graph, node: NodeName, args: Namespace) -> None:
    """Print the value."""
    values = get_values(graph, node, [args.parameter_name])
    if not values:
        raise FrontendError('Parameter not set')
    label, value = labelled(values[0])
    if args.hide_type:
        print(value)
    else:
        print(label, *([] if value is None else [value]))


@node_verb(_NAME, argument('value', help='Value of the parameter'), _TIMEOUT)
def set_value(graph: Graph, node: NodeName, args: Namespace) -> None:
    """Set the value; a refusal is reported on stderr, with exit code 0 as in ros2cli."""
    wanted = parameter(args.parameter_name, parse_value(args.value))
    _write(graph, node, wanted, 'Set parameter successful', 'Setting parameter failed')


@node_verb(_NAME, _TIMEOUT)
def delete(graph: Graph, node: NodeName, args: Namespace) -> None:
    """Delete the parameter; a refusal is reported on stderr, with exit code 0 as in ros2cli."""
    nothing = parameter(args.parameter_name, None)
    _write(graph, node, nothing, 'Deleted parameter successfully', 'Deleting parameter failed')


def _write(graph: Graph, node: NodeName, wanted: Message, success: str, failure: str) -> None:
    result = set_values(graph, node, [wanted])[0]
    _report(result, success if result.successful else failure)


def _report(result: Message, text: str) -> None:
    reason = f': {result.reason}' if result.reason else ''
    print(f'{text}{reason}', file=sys.stdout if result.successful else sys.stderr)


@graph_verb(
    *OPTIONAL_NODE,
    argument(
        '--filter',
        help='Only parameters matching the regex expression will be showed. '
        'Supports `re` regex syntax.',
    ),
    argument(
        '--param-prefixes',
        nargs='+',
        default=[],
        help='Only list parameters with the provided prefixes',
    ),
    flag('--param-type', help='Print parameter types with parameter names'),
)
def list_all(graph: Graph, args: Namespace) -> None:
    """Print the names; if no node is named, grouped by node."""
    try:
        pattern = re.compile(args.filter or '')
    except re.error as error:
        raise FrontendError(f"Invalid --filter '{args.filter}': {error}") from None
    for node in _nodes(args, graph):
        try:
            names = list_names(graph, node, args.param_prefixes)
        except NoAnswerError as error:
            print(error, file=sys.stderr)
            continue
        names = [name for name in names if pattern.match(name)]
        if names and not args.node_name:
            print(f'{node.full_name}:')
        if args.param_type:
            for each in describe(graph, node, names):
                print(f'  {each.name} (type: {TYPE_NAMES[each.type]})')
        else:
            print(*(f'  {name}\n' for name in names), sep='', end='')


def _nodes(args: Namespace, graph: Graph) -> Sequence[NodeName]:
    """Return the named node, or all nodes that offer the service."""
    if args.node_name:
        return [find_node(args.node_name, graph, args.include_hidden_nodes)]
    graph.settle()
    services = dict(graph.services(hidden=True))
    nodes = sorted(set(graph.nodes(args.include_hidden_nodes)))
    return [node for node in nodes if f'{node.full_name}/list_parameters' in services]


@node_verb(argument('parameter_names', nargs='+', help='Names of the parameters'))
def describe_names(graph: Graph, node: NodeName, args: Namespace) -> None:
    """Print the descriptors of parameters."""
    for each in describe(graph, node, args.parameter_names):
        print('Parameter name:', each.name)
        print('  Type:', TYPE_NAMES[each.type])
        if each.description:
            print('  Description:', each.description)
        print('  Constraints:')
        if each.read_only:
            print('    Read only: true')
        for range_ in [*each.floating_point_range, *each.integer_range][:1]:
            print('    Min value:', range_.from_value)
            print('    Max value:', range_.to_value)
            if range_.step:
                print('    Step:', range_.step)
        if each.additional_constraints:
            print('    Additional constraints:', each.additional_constraints)


@node_verb()
def dump_file(graph: Graph, node: NodeName, _: Namespace) -> None:
    """Print all parameters as a file that `load` and `--params-file` read."""
    from rclpy.parameter import parameter_value_to_python

    names = list_names(graph, node)
    values = [parameter_value_to_python(value) for value in get_values(graph, node, names)]
    print(dump(node.full_name, dict(zip(names, values, strict=True))))


@node_verb(
    argument('parameter_file', help='Parameter file'),
    flag(
        '--no-use-wildcard',
        help="Do not load parameters in the '/**' namespace into the node",
    ),
)
def load(graph: Graph, node: NodeName, args: Namespace) -> None:
    """Set all parameters of a file that are for the node; report each result."""
    try:
        text = Path(args.parameter_file).read_text(encoding='utf-8')
    except OSError as error:
        raise FrontendError(f"{error.strerror}: '{args.parameter_file}'") from None
    wanted = values_for(node.full_name, text, use_wildcard=not args.no_use_wildcard)
    results = set_values(graph, node, [parameter(name, each) for name, each in wanted.items()])
    for name, result in zip(wanted, results, strict=True):
        outcome = 'successful' if result.successful else 'failed'
        _report(result, f'Set parameter {name} {outcome}')
