# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""`ros2 topic list`, `info`, `type` and `find`."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Callable

from ..aliases import NamesAndTypes
from ..cli.verb import flag
from ..ros.graph import Graph, graph_verb
from .names import Names

TOPICS = Names('topic', Graph.topics)


@graph_verb(
    *TOPICS.list_arguments(),
    flag('-v', '--verbose', help='List full details about each topic'),
)
def list_names(graph: Graph, args: Namespace) -> None:
    """Print the topics."""
    node = graph.session.node
    topics = TOPICS.shown(graph, args) if args.verbose and not args.count else []
    if not topics:
        TOPICS.print_list(graph, args)
        return
    print(_block('Published', 'publisher', topics, node.count_publishers))
    print(_block('Subscribed', 'subscriber', topics, node.count_subscribers))


def _block(title: str, noun: str, topics: NamesAndTypes, count_of: Callable[[str], int]) -> str:
    lines = [f'{title} topics:']
    for name, types in topics:
        count = count_of(name)
        if count:
            plural = 's' if count > 1 else ''
            lines.append(f' * {name} [{", ".join(types)}] {count} {noun}{plural}')
    return '\n'.join(lines) + '\n'


@graph_verb(
    TOPICS.name_argument('get info', '/chatter'),
    flag(
        '--verbose',
        '-v',
        help='Prints detailed information like the node name, node namespace, topic type, '
        'topic type hash, GUID and QoS Profile of the publishers and subscribers to this topic',
    ),
)
def info(graph: Graph, args: Namespace) -> None:
    """Print type and counts, or every endpoint."""
    end = '\n\n' if args.verbose else '\n'
    name = TOPICS.print_info_type(graph, args, end)
    ends = (('Publisher', graph.publishers), ('Subscription', graph.subscriptions))
    for title, endpoints_of in ends:
        endpoints = endpoints_of(name)
        print(f'{title} count: {len(endpoints)}', end=end)
        for endpoint in endpoints if args.verbose else ():
            print(endpoint, end=end)


@graph_verb(TOPICS.name_argument('get type', '/chatter'))
def type_of(graph: Graph, args: Namespace) -> int:
    """Print the types of a topic."""
    return TOPICS.print_type(graph, args)


@graph_verb(TOPICS.type_argument('std_msgs/msg/String'), *TOPICS.list_arguments(types=False))
def find(graph: Graph, args: Namespace) -> None:
    """Print the topics that have a type."""
    TOPICS.print_found(graph, args)
