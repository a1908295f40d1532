# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""`ros2 topic list`, `info`, `type` and `find`."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from collections.abc import Callable

from ..aliases import NamesAndTypes
from ..cli.arguments import add_graph_arguments
from ..ros.graph import open_graph
from ..ros.names import absolute
from .names import (
    add_find_arguments,
    add_hidden_flag,
    add_list_arguments,
    print_found,
    print_names,
    print_types,
    types_of,
)

_NOUN = 'topics'


class List:
    """Output a list of available topics."""

    def add_arguments(self, parser: ArgumentParser) -> None:
        """Add the command's own arguments."""
        add_list_arguments(parser, _NOUN)
        add_hidden_flag(parser, _NOUN)
        parser.add_argument(
            '-v', '--verbose', action='store_true', help='List full details about each topic'
        )

    def main(self, args: Namespace) -> None:
        """Print the topics."""
        with open_graph(args) as graph:
            graph.settle()
            topics = graph.topics(args.include_hidden_topics)
            if args.verbose and topics and not args.count:
                print(
                    _block('Published', 'publisher', topics, graph.session.node.count_publishers)
                )
                print(
                    _block(
                        'Subscribed', 'subscriber', topics, graph.session.node.count_subscribers
                    )
                )
                return
        print_names(topics, args)


def _block(title: str, noun: str, topics: NamesAndTypes, count_of: Callable[[str], int]) -> str:
    lines = [f'{title} topics:']
    for name, types in topics:
        count = count_of(name)
        if count:
            plural = 's' if count > 1 else ''
            lines.append(f' * {name} [{", ".join(types)}] {count} {noun}{plural}')
    return '\n'.join(lines) + '\n'


class Info:
    """Print information about a topic."""

    def add_arguments(self, parser: ArgumentParser) -> None:
        """Add the command's own arguments."""
        add_graph_arguments(parser)
        parser.add_argument(
            'topic_name', help="Name of the ROS topic to get info (e.g. '/chatter')"
        )
        parser.add_argument(
            '--verbose',
            '-v',
            action='store_true',
            help='Prints detailed information like the node name, node namespace, topic type, '
            'topic type hash, GUID and QoS Profile of the publishers and subscribers to this '
            'topic',
        )

    def main(self, args: Namespace) -> None:
        """Print type and counts, or every endpoint.

        Raises:
            UnknownNameError: When there is no such topic.
        """
        name = absolute(args.topic_name)
        with open_graph(args) as graph:
            types = types_of(name, graph, graph.topics, f"Unknown topic '{args.topic_name}'")
            graph.settle()
            publishers, subscriptions = graph.publishers(name), graph.subscriptions(name)
        end = '\n\n' if args.verbose else '\n'
        print(f'Type: {types[0] if len(types) == 1 else types}', end=end)
        for title, endpoints in (('Publisher', publishers), ('Subscription', subscriptions)):
            print(f'{title} count: {len(endpoints)}', end=end)
            for endpoint in endpoints if args.verbose else ():
                print(endpoint, end=end)


class Type:
    """Print a topic's type."""

    def add_arguments(self, parser: ArgumentParser) -> None:
        """Add the command's own arguments."""
        add_graph_arguments(parser)
        parser.add_argument(
            'topic_name', help="Name of the ROS topic to get type (e.g. '/chatter')"
        )

    def main(self, args: Namespace) -> int:
        """Print the types.

        Returns:
            The exit code: 1 when there is no such topic.
        """
        with open_graph(args) as graph:
            return print_types(args.topic_name, graph, graph.topics, args.include_hidden_topics)


class Find:
    """Output a list of available topics of a given type."""

    def add_arguments(self, parser: ArgumentParser) -> None:
        """Add the command's own arguments."""
        add_find_arguments(parser, _NOUN, 'std_msgs/msg/String')
        add_hidden_flag(parser, _NOUN)

    def main(self, args: Namespace) -> None:
        """Print the topics that have the type."""
        with open_graph(args) as graph:
            graph.settle()
            topics = graph.topics(args.include_hidden_topics)
        print_found(topics, args.topic_type, args.count)
