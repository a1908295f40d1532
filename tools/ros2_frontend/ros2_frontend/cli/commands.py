# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Declaration of verbs, the command tree as data, and the parser of one command line.

Each command names the module and verb that implement it, so that `ros2 --help` imports none and
`ros2 topic list` only its own. Summaries are those of ros2cli (Jazzy).
"""

from __future__ import annotations

from argparse import ArgumentParser, ArgumentTypeError, Namespace, RawDescriptionHelpFormatter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
import importlib
import math
from typing import Any, TypeVar

_ALIKE = 0.75  # types of two packages are 0.6 alike in their middle parts


class FrontendError(RuntimeError):
    """A failure that ends the command with exit code 1 and this message."""


class UnknownNameError(FrontendError, LookupError):
    """The given name is unknown, e.g. ``topic info /chater``."""


class FieldValueError(FrontendError, ValueError):
    """A value does not fit the message, e.g. an unknown field or text for a number."""


class NoAnswerError(FrontendError, TimeoutError):
    """A service did not appear or did not answer in time."""


def hint(name: str, known: Iterable[str]) -> str:
    """Return a line that suggests up to three similar names; empty without any."""
    from difflib import get_close_matches

    near = [f"'{each}'" for each in get_close_matches(name, list(known), cutoff=_ALIKE)]
    return f'\nDid you mean {" or ".join(near)}?' if near else ''


Argument = Callable[[Any], object]
"""Adds one argument, or a set of them, to a parser of argparse or one of its groups."""

Main = Callable[[Namespace], 'int | None']
"""Executes the verb; returns the exit code, None for 0. Raises FrontendError for the user."""


N = TypeVar('N', int, float)


def argument(*names: str, **options: object) -> Argument:
    """Declare an argument with the options of argparse."""
    return lambda parser: parser.add_argument(*names, **options)


def flag(*names: str, **options: object) -> Argument:
    """Declare a switch."""
    return argument(*names, action='store_true', **options)


def exclusive(*arguments: Argument) -> Argument:
    """Allow at most one of several."""

    def add(parser: Any) -> None:  # noqa: ANN401  # as in argparse
        group = parser.add_mutually_exclusive_group()
        for each in arguments:
            each(group)

    return add


@dataclass(frozen=True, slots=True)
class Verb:
    """A verb of `ros2`: its arguments, in the order of the help page, and its function."""

    arguments: tuple[Argument, ...]
    main: Main


def verb(*arguments: Argument) -> Callable[[Main], Verb]:
    """Decorate a function as a verb."""
    return lambda main: Verb(arguments, main)


def _number(
    kind: Callable[[str], N], what: str, accepts: Callable[[N], bool]
) -> Callable[[str], N]:
    def parse(text: str) -> N:
        try:
            value = kind(text)
        except ValueError:
            value = kind('-1')
        if not accepts(value):
            raise ArgumentTypeError(f'value must be {what}')
        return value

    return parse


unsigned_int = _number(int, 'non-negative integer', lambda value: value >= 0)
positive_int = _number(int, 'a positive integer', lambda value: value > 0)
positive_float = _number(float, 'a positive float', lambda value: 0.0 < value < math.inf)
unsigned_float = _number(float, 'a non-negative float', lambda value: 0.0 <= value < math.inf)

GRAPH_ARGUMENTS = (
    argument(
        '--spin-time',
        type=positive_float,
        metavar='SPIN_TIME',
        help='Time [s] to wait for discovery (default: 0.5, or 3.2 where DDS is open to others)',
    ),
    flag('-s', '--use-sim-time', help='Enable ROS simulation time'),
    flag('--no-daemon', help='Accepted and without effect: there is no daemon'),
)
"""Options of every verb that reads the ROS graph."""


def content(name: str, help_: str, stdin_help: str) -> Argument:
    """Declare the values of a message, given as an argument or on standard input."""
    return exclusive(
        argument(name, nargs='?', default='{}', help=help_), flag('--stdin', help=stdin_help)
    )


PROGRAM = 'ros2'

COMMANDS: Mapping[str, tuple[str, str]] = {
    'action': ('Various action related sub-commands', ''),
    'action info': ('Print information about an action', 'action:info'),
    'action list': ('Output a list of action names', 'action:list_names'),
    'action send_goal': ('Send an action goal', 'send_goal:send_goal'),
    'action type': ("Print a action's type", 'action:type_of'),
    'bag': ('Various rosbag related sub-commands', ''),
    'bag info': ('Print information about a bag to the screen', 'bag_info:info'),
    'bag play': ('Play back ROS data from a bag', 'bag_play:play'),
    'bag record': ('Record ROS data to a bag', 'bag_record:record'),
    'bag reindex': ('Reconstruct metadata file for a bag', 'bag_info:reindex'),
    'doctor': ('Check ROS setup and other potential issues', 'doctor:doctor'),
    'interface': ('Show information about ROS interfaces', ''),
    'interface list': ('List all interface types available', 'interface:list_all'),
    'interface package': (
        'Output a list of available interface types within one package',
        'interface:package',
    ),
    'interface packages': (
        'Output a list of packages that provide interfaces',
        'interface:packages',
    ),
    'interface proto': ('Output an interface prototype', 'interface:proto'),
    'interface show': ('Output the interface definition', 'interface:show'),
    'launch': ('Not among the wheels of ROS: names what to run instead', 'run:launch'),
    'lifecycle': ('Various lifecycle related sub-commands', ''),
    'lifecycle get': ('Get lifecycle state for one or more nodes', 'lifecycle:get'),
    'lifecycle list': ('Output a list of available transitions', 'lifecycle:list_transitions'),
    'lifecycle nodes': ('Output a list of nodes with lifecycle', 'lifecycle:nodes'),
    'lifecycle set': ('Trigger lifecycle state transition', 'lifecycle:set_state'),
    'node': ('Various node related sub-commands', ''),
    'node info': ('Output information about a node', 'node:info'),
    'node list': ('Output a list of available nodes', 'node:list_names'),
    'param': ('Various param related sub-commands', ''),
    'param delete': ('Delete parameter', 'param:delete'),
    'param describe': (
        'Show descriptive information about declared parameters',
        'param:describe_names',
    ),
    'param dump': (
        'Show all of the parameters of a node in a YAML file format',
        'param:dump_file',
    ),
    'param get': ('Get parameter', 'param:get'),
    'param list': ('Output a list of available parameters', 'param:list_all'),
    'param load': ('Load parameter file for a node', 'param:load'),
    'param set': ('Set parameter', 'param:set_value'),
    'pkg': ('Various package related sub-commands', ''),
    'pkg executables': ('Output a list of package specific executables', 'pkg:list_executables'),
    'pkg list': ('Output a list of available packages', 'pkg:list_names'),
    'pkg prefix': ('Output the prefix path of a package', 'pkg:prefix'),
    'pkg xml': ('Output the XML of the package manifest or a specific tag', 'pkg:xml'),
    'run': ('Run a package specific executable', 'run:run'),
    'service': ('Various service related sub-commands', ''),
    'service call': ('Call a service', 'service_call:call'),
    'service find': ('Output a list of available services of a given type', 'service:find'),
    'service info': ('Print information about a service', 'service:info'),
    'service list': ('Output a list of available services', 'service:list_names'),
    'service type': ("Output a service's type", 'service:type_of'),
    'topic': ('Various topic related sub-commands', ''),
    'topic bw': ('Display bandwidth used by topic', 'topic_rate:bw'),
    'topic delay': ('Display delay of topic from timestamp in header', 'topic_rate:delay'),
    'topic echo': ('Output messages from a topic', 'topic_echo:echo'),
    'topic find': ('Output a list of available topics of a given type', 'topic:find'),
    'topic hz': ('Print the average receiving rate to screen', 'topic_rate:hz'),
    'topic info': ('Print information about a topic', 'topic:info'),
    'topic list': ('Output a list of available topics', 'topic:list_names'),
    'topic pub': ('Publish a message to a topic', 'topic_pub:pub'),
    'topic type': ("Print a topic's type", 'topic:type_of'),
    'wtf': ('Use `wtf` as alias to `doctor`', 'doctor:doctor'),
}
"""Help line of each command, and its `module:verb` in `ros2_frontend.verbs`; empty for a group of
verbs."""
_WITH_HIDDEN_NAMES = ('service', 'topic')


def build(argv: Sequence[str]) -> tuple[ArgumentParser, ArgumentParser, Verb | None]:
    """Build the parser for one command line; only the named command gets its arguments.

    Returns:
        The root parser; the parser whose help is shown if no verb is named; the named verb, None
        for `ros2` or `ros2 topic` alone.
    """
    words = [word for word in argv if not word.startswith('-')][:2]
    root = ArgumentParser(
        prog=PROGRAM,
        description=f'{PROGRAM} is an extensible command-line tool for ROS 2.',
        formatter_class=RawDescriptionHelpFormatter,
    )
    root.add_argument(
        '--use-python-default-buffering',
        action='store_true',
        help='Do not force line buffering in stdout and instead use the python default '
        'buffering, which might be affected by PYTHONUNBUFFERED/-u and depends on whatever '
        'stdout is interactive or not',
    )
    parser, name = root, ''
    for word in words:
        parsers = _add_commands(parser, name)
        name = f'{name} {word}'.lstrip()
        if name not in COMMANDS:
            return root, parser, None
        parser, target = parsers[word], COMMANDS[name][1]
        if target:
            module, _, attribute = target.partition(':')
            loaded = importlib.import_module(f'ros2_frontend.verbs.{module}')
            verb: Verb = getattr(loaded, attribute)
            for add in verb.arguments:
                add(parser)
            return root, parser, verb
        if word in _WITH_HIDDEN_NAMES:
            help_ = f'Consider hidden {word}s as well'
            parser.add_argument(f'--include-hidden-{word}s', action='store_true', help=help_)
    _add_commands(parser, name)
    return root, parser, None


def _add_commands(parser: ArgumentParser, group: str) -> dict[str, ArgumentParser]:
    """Add sub-parsers and the list of them that the help page shows."""
    commands = {
        name.removeprefix(group).lstrip(): text
        for name, (text, _) in COMMANDS.items()
        if name.rpartition(' ')[0] == group
    }
    width = max(map(len, commands))
    # not required: without a verb the group's help is shown, with exit code 0
    subparsers = parser.add_subparsers(
        title='Commands',
        description='\n'.join(f'{name.ljust(width)}  {text}' for name, text in commands.items()),
        metavar=f'Call `{f"{PROGRAM} {group}".rstrip()} <command> -h` for more detailed usage.',
        required=False,
    )
    return {
        name: subparsers.add_parser(
            name, description=text, formatter_class=RawDescriptionHelpFormatter
        )
        for name, text in commands.items()
    }
