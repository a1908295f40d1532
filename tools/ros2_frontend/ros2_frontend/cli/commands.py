# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The tree of commands, as data.

A command names the module and class that do it, so that `ros2 --help` imports none of them and
`ros2 topic list` imports only its own. Summaries are those of ros2cli (Jazzy).
"""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from collections.abc import Mapping
from dataclasses import dataclass, field
import importlib
from typing import Protocol


class Verb(Protocol):
    """What the class of a command has to offer."""

    def add_arguments(self, parser: ArgumentParser) -> None:
        """Add the command's own arguments.

        Args:
            parser: The command's parser.
        """

    def main(self, args: Namespace) -> int | None:
        """Do the command.

        Args:
            args: The parsed arguments.

        Returns:
            The exit code; None is 0.

        Raises:
            FrontendError: When it cannot be done; the message is for the user.
        """


@dataclass(frozen=True, slots=True)
class Command:
    """A command, or a verb of a group.

    Attributes:
        summary: One line for the help page.
        target: `module:class` below `ros2_frontend.verbs`.
    """

    summary: str
    target: str

    def load(self) -> Verb:
        """Import the module and make the verb.

        Returns:
            The verb, ready for `add_arguments`.
        """
        module, _, name = self.target.partition(':')
        verb: Verb = getattr(importlib.import_module(f'ros2_frontend.verbs.{module}'), name)()
        return verb


@dataclass(frozen=True, slots=True)
class Group:
    """A command that has verbs.

    Attributes:
        summary: One line for the help page.
        verbs: The verbs by name.
        flags: Switches of the group itself, by option: their help.
    """

    summary: str
    verbs: Mapping[str, Command]
    flags: Mapping[str, str] = field(default_factory=dict)


_HIDDEN_TOPICS = {'--include-hidden-topics': 'Consider hidden topics as well'}
_HIDDEN_SERVICES = {'--include-hidden-services': 'Consider hidden services as well'}

COMMANDS: Mapping[str, Command | Group] = {
    'action': Group(
        'Various action related sub-commands',
        {
            'info': Command('Print information about an action', 'action:Info'),
            'list': Command('Output a list of action names', 'action:List'),
            'send_goal': Command('Send an action goal', 'send_goal:SendGoal'),
            'type': Command("Print a action's type", 'action:Type'),
        },
    ),
    'doctor': Command('Check ROS setup and other potential issues', 'doctor:Doctor'),
    'interface': Group(
        'Show information about ROS interfaces',
        {
            'list': Command('List all interface types available', 'interface:List'),
            'package': Command(
                'Output a list of available interface types within one package',
                'interface:Package',
            ),
            'packages': Command(
                'Output a list of packages that provide interfaces', 'interface:Packages'
            ),
            'proto': Command('Output an interface prototype', 'interface:Proto'),
            'show': Command('Output the interface definition', 'interface:Show'),
        },
    ),
    'lifecycle': Group(
        'Various lifecycle related sub-commands',
        {
            'get': Command('Get lifecycle state for one or more nodes', 'lifecycle:Get'),
            'list': Command('Output a list of available transitions', 'lifecycle:List'),
            'nodes': Command('Output a list of nodes with lifecycle', 'lifecycle:Nodes'),
            'set': Command('Trigger lifecycle state transition', 'lifecycle:Set'),
        },
    ),
    'node': Group(
        'Various node related sub-commands',
        {
            'info': Command('Output information about a node', 'node:Info'),
            'list': Command('Output a list of available nodes', 'node:List'),
        },
    ),
    'param': Group(
        'Various param related sub-commands',
        {
            'delete': Command('Delete parameter', 'param:Delete'),
            'describe': Command(
                'Show descriptive information about declared parameters', 'param_show:Describe'
            ),
            'dump': Command(
                'Show all of the parameters of a node in a YAML file format', 'param_file:Dump'
            ),
            'get': Command('Get parameter', 'param:Get'),
            'list': Command('Output a list of available parameters', 'param_show:List'),
            'load': Command('Load parameter file for a node', 'param_file:Load'),
            'set': Command('Set parameter', 'param:Set'),
        },
    ),
    'pkg': Group(
        'Various package related sub-commands',
        {
            'executables': Command(
                'Output a list of package specific executables', 'pkg:Executables'
            ),
            'list': Command('Output a list of available packages', 'pkg:List'),
            'prefix': Command('Output the prefix path of a package', 'pkg:Prefix'),
            'xml': Command('Output the XML of the package manifest or a specific tag', 'pkg:Xml'),
        },
    ),
    'run': Command('Run a package specific executable', 'run:Run'),
    'service': Group(
        'Various service related sub-commands',
        {
            'call': Command('Call a service', 'service_call:Call'),
            'find': Command('Output a list of available services of a given type', 'service:Find'),
            'info': Command('Print information about a service', 'service:Info'),
            'list': Command('Output a list of available services', 'service:List'),
            'type': Command("Output a service's type", 'service:Type'),
        },
        _HIDDEN_SERVICES,
    ),
    'topic': Group(
        'Various topic related sub-commands',
        {
            'bw': Command('Display bandwidth used by topic', 'topic_rate:Bw'),
            'delay': Command(
                'Display delay of topic from timestamp in header', 'topic_rate:Delay'
            ),
            'echo': Command('Output messages from a topic', 'topic_echo:Echo'),
            'find': Command('Output a list of available topics of a given type', 'topic:Find'),
            'hz': Command('Print the average receiving rate to screen', 'topic_rate:Hz'),
            'info': Command('Print information about a topic', 'topic:Info'),
            'list': Command('Output a list of available topics', 'topic:List'),
            'pub': Command('Publish a message to a topic', 'topic_pub:Pub'),
            'type': Command("Print a topic's type", 'topic:Type'),
        },
        _HIDDEN_TOPICS,
    ),
    'wtf': Command('Use `wtf` as alias to `doctor`', 'doctor:Doctor'),
}
