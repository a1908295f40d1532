# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Arguments that all bring-ups share: time-out, network, namespace, ROS arguments."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
import math
import os
import re
import sys

from dds_network import NETWORK_VARIABLE, NetworkChoiceError, open_dds

from .spec import StartError


def seconds_from(least: float, *, finite: bool = True) -> Callable[[str], float]:
    """Return an argparse type for a time of at least ``least`` in [s]; 0 allows any above 0.

    ``inf`` means no limit; it is rejected if the time must be ``finite``.
    """

    def read(text: str) -> float:
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not (value > 0 and value >= least) or (finite and math.isinf(value)):
            bound = f'of at least {least:g}' if least else 'above 0'
            raise argparse.ArgumentTypeError(f'{text} is no number of seconds {bound}')
        return value

    return read


def add_timeout(parser: argparse.ArgumentParser) -> None:
    """Declare ``--timeout``."""
    parser.add_argument(
        '--timeout',
        metavar='S',
        type=seconds_from(0.0, finite=False),
        default=30.0,
        help='longest time until all is ready in [s]; inf for no limit (default: %(default)s)',
    )


def add_network(parser: argparse.ArgumentParser) -> None:
    """Declare ``--network``."""
    parser.add_argument(
        '--network',
        metavar='NAMES',
        help='open DDS to other machines: network interfaces, or addresses of peers, separated by '
        'commas; without authentication: any client there can command the robot (default: '
        f'the variable {NETWORK_VARIABLE}, else this host only)',
    )


def apply_network(arguments: argparse.Namespace) -> None:
    """Restrict DDS of this process and its children to the user's choice, and print it.

    Raises:
        StartError: There is no such interface or peer.
    """
    try:
        sys.stdout.write(f'{open_dds(os.environ, arguments.network)}\n')
    except NetworkChoiceError as error:
        raise StartError(f'--network: {error}') from error


_BEGIN, _END = '--ros-args', '--'
_REMAPS = frozenset({'-r', '--remap'})
_PARAMETERS = frozenset({'-p', '--param'})
_NAMESPACE_RULE = re.compile(r'(?:[^:]*:)?__ns:=(.*)')
_NAME_RULE = re.compile(r'(?:[^:]*:)?__(?:node|name):=')
_NODE_PARAMETER = re.compile(r'([\w/*]+):([^:=]+:=.*)', re.ASCII | re.DOTALL)
_NAMESPACE = re.compile(r'/?[A-Za-z_]\w*(?:/[A-Za-z_]\w*)*', re.ASCII)


@dataclass(frozen=True, slots=True)
class RosOptions:
    """The options of all nodes of a bring-up."""

    namespace: str = ''  # their namespace without a slash at either end; empty for the root
    arguments: tuple[str, ...] = ()  # what stood behind ``--ros-args``, but for the namespace

    @property
    def frame_prefix(self) -> str:
        """Prefix of TF frame names, so that two robots can share /tf."""
        return f'{self.namespace}/' if self.namespace else ''

    @property
    def frame_parameters(self) -> dict[str, str]:
        """The parameter with that prefix, for nodes that declare it; empty without a prefix."""
        return {'frame_prefix': self.frame_prefix} if self.frame_prefix else {}

    @property
    def node_arguments(self) -> tuple[str, ...]:
        """Return the arguments of a node that follow its ``--ros-args``.

        Raises:
            StartError: ``-p NODE:NAME:=VALUE`` is used in a namespace, where rcl finds no such
                node.
        """
        words = ['-r', f'__ns:=/{self.namespace}'] if self.namespace else []
        for option, value in _pairs(self.arguments):
            of_node = _NODE_PARAMETER.fullmatch(value) if option in _PARAMETERS else None
            if of_node is not None:
                value = f'{self._in_root(of_node[1], value)}:{of_node[2]}'  # noqa: PLW2901
            words += [option, value] if value else [option]
        return tuple(words)

    @property
    def hint(self) -> str:
        """Text to append to ``ros2 run`` for a node in this namespace; begins with a blank."""
        return f' --ros-args -r __ns:=/{self.namespace}' if self.namespace else ''

    def resolve(self, name: str) -> str:
        """Return the fully qualified name of a relative name."""
        return f'/{self.frame_prefix}{name}'

    def node_name(self, name: str) -> str:
        """Return the fully qualified name of a node in a parameter file or argument.

        A name that includes the namespace stays, as does a pattern, which is for full names.
        """
        full = f'/{name.strip("/")}'
        inside = full.startswith(('/*', f'/{self.namespace}/'))
        return full if inside or not self.namespace else self.resolve(full[1:])

    def _in_root(self, node: str, value: str) -> str:
        """Return the name of a node as ``-p`` of rcl requires it: without slashes."""
        full = self.node_name(node)
        if '/' in full[1:] or '*' in full:
            raise StartError(
                f'-p {value}: ROS takes only nodes of the root namespace there; write it into a'
                f' file as {full}: ros__parameters:, and give that with --params-file'
            )
        return full[1:]

    def within(self, namespace: str) -> RosOptions:
        """Return these options in another namespace, unless the user has named one."""
        return self if self.namespace else replace(self, namespace=namespace.strip('/'))


def add_namespace(parser: argparse.ArgumentParser) -> None:
    """Declare ``--namespace``."""
    parser.add_argument(
        '--namespace',
        metavar='NS',
        type=_namespace,
        help='namespace of all nodes, topics and services, and prefix of all TF frames; each '
        'robot of a ROS domain has its own (default: none). What stands behind --ros-args '
        'reaches every node',
    )


def parse_with_ros(
    parser: argparse.ArgumentParser, argv: Sequence[str]
) -> tuple[argparse.Namespace, RosOptions]:
    """Parse a command line; ROS arguments in it become options of the nodes."""
    own, ros = split_ros_arguments(argv)
    arguments = parser.parse_args(own)
    try:
        return arguments, _options(arguments.namespace or '', ros)
    except (StartError, argparse.ArgumentTypeError) as error:
        parser.error(str(error))


def split_ros_arguments(argv: Sequence[str]) -> tuple[list[str], list[str]]:
    """Return a program's own arguments, and those between ``--ros-args`` and ``--``."""
    own: list[str] = []
    ros: list[str] = []
    current = own
    for word in argv:
        if word == _BEGIN:
            current = ros
        elif word == _END and current is ros:
            current = own
        else:
            current.append(word)
    return own, ros


def _options(namespace: str, words: Sequence[str]) -> RosOptions:
    kept: list[str] = []
    for option, value in _pairs(words):
        rule = _NAMESPACE_RULE.fullmatch(value) if option in _REMAPS else None
        if option in _REMAPS and _NAME_RULE.match(value):
            raise StartError(
                f'{option} {value} would give several nodes one name; use --namespace'
            )
        if rule is None:
            kept += [option, *([value] if value else [])]
            continue
        named = _namespace(rule[1])
        if namespace not in {'', named}:
            raise StartError(f'--namespace {namespace} and {option} {value} contradict each other')
        namespace = named
    return RosOptions(namespace, tuple(kept))


def _pairs(words: Sequence[str]) -> Iterator[tuple[str, str]]:
    """Yield each option with its value; flags have none."""
    rest = iter([*words, ''])
    word = next(rest)
    while word:
        value = next(rest)
        if word.startswith('--') and value.startswith('-'):  # --disable-rosout-logs and the like
            yield word, ''
            word = value
        else:
            yield word, value
            word = next(rest, '')


def _namespace(text: str) -> str:
    if not _NAMESPACE.fullmatch(text):
        raise argparse.ArgumentTypeError(
            f'{text!r} is no ROS namespace; letters, digits and _, e.g. left or cell/left'
        )
    return text.strip('/')
