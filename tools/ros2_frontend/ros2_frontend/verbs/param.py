# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""`ros2 param`: the parameters of nodes that run."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Sequence
from pathlib import Path
import re
import sys

from ..aliases import Message
from ..cli.arguments import positive_float
from ..cli.errors import FrontendError, NoAnswerError
from ..cli.suggest import hint
from ..cli.verb import argument, flag
from ..messages.parameter_file import dump, values_for
from ..ros.graph import Graph, graph_verb
from ..ros.names import NodeName
from ..ros.parameters import (
    describe,
    get_values,
    LABELS,
    list_names,
    parameter,
    parse_value,
    set_values,
    TYPE_NAMES,
    value_of,
)
from ..ros.session import Session
from .node_argument import find_node, node_verb, OPTIONAL_NODE

_NAME = argument('parameter_name', help='Name of the parameter')
_TIMEOUT = argument(
    '--timeout',
    dest='spin_time',
    metavar='N',
    type=positive_float,
    help='Wait for N seconds until node becomes available (default: until the graph is complete)',
)


@node_verb(_NAME, flag('--hide-type', help='Hide the type information'), _TIMEOUT)
def get(session: Session, node: NodeName, args: Namespace) -> None:
    """Print the value.

    Raises:
        FrontendError: When the node has no such parameter.
    """
    values = get_values(session, node, [args.parameter_name])
    if not values:
        raise FrontendError('Parameter not set' + _near(session, node, args.parameter_name))
    value = value_of(values[0], raw=True)
    if args.hide_type:
        print(value)
    else:
        print(LABELS[values[0].type], *([] if value is None else [value]))


@node_verb(_NAME, argument('value', help='Value of the parameter'), _TIMEOUT)
def set_value(session: Session, node: NodeName, args: Namespace) -> None:
    """Set the value; a refusal is reported on stderr, with exit code 0 as in ros2cli."""
    wanted = parameter(args.parameter_name, parse_value(args.value))
    _write(session, node, wanted, 'Set parameter successful', 'Setting parameter failed')


@node_verb(_NAME, _TIMEOUT)
def delete(session: Session, node: NodeName, args: Namespace) -> None:
    """Delete the parameter; a refusal is reported on stderr, with exit code 0 as in ros2cli."""
    nothing = parameter(args.parameter_name, None)
    _write(session, node, nothing, 'Deleted parameter successfully', 'Deleting parameter failed')


def _write(session: Session, node: NodeName, wanted: Message, success: str, failure: str) -> None:
    result = set_values(session, node, [wanted])[0]
    near = '' if result.successful else _near(session, node, wanted.name)
    _report(result, success if result.successful else failure, near)


def _report(result: Message, text: str, near: str = '') -> None:
    reason = f': {result.reason}' if result.reason else ''
    print(f'{text}{reason}{near}', file=sys.stdout if result.successful else sys.stderr)


def _near(session: Session, node: NodeName, name: str) -> str:
    """A hint when the node has no parameter of the name."""
    names = list_names(session, node)
    return '' if name in names else hint(name, names)


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
    """Print the names, below their node's when no node is named.

    Raises:
        UnknownNameError: When there is no such node.
        FrontendError: When the filter is no regular expression.
    """
    pattern = _compile(args.filter)
    for node in _nodes(args, graph):
        try:
            names = list_names(graph.session, node, args.param_prefixes)
        except NoAnswerError as error:
            print(error, file=sys.stderr)
            continue
        names = [name for name in names if pattern.match(name)]
        if names and not args.node_name:
            print(f'{node.full_name}:')
        _print_names(graph.session, node, names, args.param_type)


def _compile(text: str | None) -> re.Pattern[str]:
    try:
        return re.compile(text or '')
    except re.error as error:
        raise FrontendError(f"Invalid --filter '{text}': {error}") from None


def _nodes(args: Namespace, graph: Graph) -> Sequence[NodeName]:
    """The named node, or all that offer the service."""
    if args.node_name:
        return [find_node(args.node_name, graph, args.include_hidden_nodes)]
    graph.settle()
    services = dict(graph.services(hidden=True))
    nodes = sorted(set(graph.nodes(args.include_hidden_nodes)))
    return [node for node in nodes if f'{node.full_name}/list_parameters' in services]


def _print_names(session: Session, node: NodeName, names: Sequence[str], with_type: bool) -> None:
    if not with_type:
        for name in names:
            print(f'  {name}')
        return
    for descriptor in describe(session, node, names):
        print(f'  {descriptor.name} (type: {TYPE_NAMES[descriptor.type]})')


@node_verb(argument('parameter_names', nargs='+', help='Names of the parameters'))
def describe_names(session: Session, node: NodeName, args: Namespace) -> None:
    """Print the descriptors of parameters."""
    for descriptor in describe(session, node, args.parameter_names):
        _print_descriptor(descriptor)


def _print_descriptor(descriptor: Message) -> None:
    print('Parameter name:', descriptor.name)
    print('  Type:', TYPE_NAMES[descriptor.type])
    if descriptor.description:
        print('  Description:', descriptor.description)
    print('  Constraints:')
    if descriptor.read_only:
        print('    Read only: true')
    for range_ in [*descriptor.floating_point_range, *descriptor.integer_range][:1]:
        print('    Min value:', range_.from_value)
        print('    Max value:', range_.to_value)
        if range_.step:
            print('    Step:', range_.step)
    if descriptor.additional_constraints:
        print('    Additional constraints:', descriptor.additional_constraints)


@node_verb()
def dump_file(session: Session, node: NodeName, _: Namespace) -> None:
    """Print all parameters as a file that `load` and `--params-file` read."""
    names = list_names(session, node)
    values = [value_of(value) for value in get_values(session, node, names)]
    print(dump(node.full_name, dict(zip(names, values, strict=True))))


@node_verb(
    argument('parameter_file', help='Parameter file'),
    flag(
        '--no-use-wildcard',
        help="Do not load parameters in the '/**' namespace into the node",
    ),
)
def load(session: Session, node: NodeName, args: Namespace) -> None:
    """Set all parameters of a file that are for the node; report each result.

    Raises:
        FrontendError: When the file cannot be read or has nothing for the node.
    """
    try:
        text = Path(args.parameter_file).read_text(encoding='utf-8')
    except OSError as error:
        raise FrontendError(f"{error.strerror}: '{args.parameter_file}'") from None
    wanted = values_for(node.full_name, text, use_wildcard=not args.no_use_wildcard)
    results = set_values(session, node, [parameter(name, each) for name, each in wanted.items()])
    for name, result in zip(wanted, results, strict=True):
        outcome = 'successful' if result.successful else 'failed'
        _report(result, f'Set parameter {name} {outcome}')
