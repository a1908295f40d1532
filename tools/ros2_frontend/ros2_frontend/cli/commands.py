# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The tree of commands, as data.

A command names the module and the verb that do it, so that `ros2 --help` imports none of them and
`ros2 topic list` imports only its own. Summaries are those of ros2cli (Jazzy).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
import importlib

from .verb import Verb


@dataclass(frozen=True, slots=True)
class Command:
    """A command, or a verb of a group.

    Attributes:
        summary: One line for the help page.
        target: `module:verb` below `ros2_frontend.verbs`.
    """

    summary: str
    target: str

    def load(self) -> Verb:
        """Import the module of the verb."""
        module, _, name = self.target.partition(':')
        verb: Verb = getattr(importlib.import_module(f'ros2_frontend.verbs.{module}'), name)
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
            'info': Command('Print information about an action', 'action:info'),
            'list': Command('Output a list of action names', 'action:list_names'),
            'send_goal': Command('Send an action goal', 'send_goal:send_goal'),
            'type': Command("Print a action's type", 'action:type_of'),
        },
    ),
    'bag': Group(
        'Various rosbag related sub-commands',
        {
            'info': Command('Print information about a bag to the screen', 'bag_info:info'),
            'play': Command('Play back ROS data from a bag', 'bag_play:play'),
            'record': Command('Record ROS data to a bag', 'bag_record:record'),
            'reindex': Command('Reconstruct metadata file for a bag', 'bag_info:reindex'),
        },
    ),
    'doctor': Command('Check ROS setup and other potential issues', 'doctor:doctor'),
    'interface': Group(
        'Show information about ROS interfaces',
        {
            'list': Command('List all interface types available', 'interface:list_all'),
            'package': Command(
                'Output a list of available interface types within one package',
                'interface:package',
            ),
            'packages': Command(
                'Output a list of packages that provide interfaces', 'interface:packages'
            ),
            'proto': Command('Output an interface prototype', 'interface:proto'),
            'show': Command('Output the interface definition', 'interface:show'),
        },
    ),
    'launch': Command('Not among the wheels of ROS: names what to run instead', 'launch:launch'),
    'lifecycle': Group(
        'Various lifecycle related sub-commands',
        {
            'get': Command('Get lifecycle state for one or more nodes', 'lifecycle:get'),
            'list': Command(
                'Output a list of available transitions', 'lifecycle:list_transitions'
            ),
            'nodes': Command('Output a list of nodes with lifecycle', 'lifecycle:nodes'),
            'set': Command('Trigger lifecycle state transition', 'lifecycle:set_state'),
        },
    ),
    'node': Group(
        'Various node related sub-commands',
        {
            'info': Command('Output information about a node', 'node:info'),
            'list': Command('Output a list of available nodes', 'node:list_names'),
        },
    ),
    'param': Group(
        'Various param related sub-commands',
        {
            'delete': Command('Delete parameter', 'param:delete'),
            'describe': Command(
                'Show descriptive information about declared parameters', 'param:describe_names'
            ),
            'dump': Command(
                'Show all of the parameters of a node in a YAML file format', 'param:dump_file'
            ),
            'get': Command('Get parameter', 'param:get'),
            'list': Command('Output a list of available parameters', 'param:list_all'),
            'load': Command('Load parameter file for a node', 'param:load'),
            'set': Command('Set parameter', 'param:set_value'),
        },
    ),
    'pkg': Group(
        'Various package related sub-commands',
        {
            'executables': Command(
                'Output a list of package specific executables', 'pkg:list_executables'
            ),
            'list': Command('Output a list of available packages', 'pkg:list_names'),
            'prefix': Command('Output the prefix path of a package', 'pkg:prefix'),
            'xml': Command('Output the XML of the package manifest or a specific tag', 'pkg:xml'),
        },
    ),
    'run': Command('Run a package specific executable', 'run:run'),
    'service': Group(
        'Various service related sub-commands',
        {
            'call': Command('Call a service', 'service_call:call'),
            'find': Command('Output a list of available services of a given type', 'service:find'),
            'info': Command('Print information about a service', 'service:info'),
            'list': Command('Output a list of available services', 'service:list_names'),
            'type': Command("Output a service's type", 'service:type_of'),
        },
        _HIDDEN_SERVICES,
    ),
    'topic': Group(
        'Various topic related sub-commands',
        {
            'bw': Command('Display bandwidth used by topic', 'topic_rate:bw'),
            'delay': Command(
                'Display delay of topic from timestamp in header', 'topic_rate:delay'
            ),
            'echo': Command('Output messages from a topic', 'topic_echo:echo'),
            'find': Command('Output a list of available topics of a given type', 'topic:find'),
            'hz': Command('Print the average receiving rate to screen', 'topic_rate:hz'),
            'info': Command('Print information about a topic', 'topic:info'),
            'list': Command('Output a list of available topics', 'topic:list_names'),
            'pub': Command('Publish a message to a topic', 'topic_pub:pub'),
            'type': Command("Print a topic's type", 'topic:type_of'),
        },
        _HIDDEN_TOPICS,
    ),
    'wtf': Command('Use `wtf` as alias to `doctor`', 'doctor:doctor'),
}
