# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""`ros2 topic list`, `info`, `type` and `find`."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Callable
import sys

from ..cli.commands import flag, FrontendError, hint, UnknownNameError
from ..index import class_of, Kind
from ..names import absolute, InterfaceClass, is_hidden, NamesAndTypes
from ..ros.graph import Graph, graph_verb
from .names import Names

TOPICS = Names('topic', Graph.topics)


def message_class(name: str) -> InterfaceClass:
    """Import a message class, by `package/msg/Name` or `package/Name`."""
    return class_of(name, Kind.MESSAGE, 'The passed message type is invalid')


def class_of_topic(topic: str, graph: Graph, *, forever: bool = False) -> InterfaceClass:
    """Return the message class of a topic, once the topic appears.

    Raises:
        UnknownNameError: The topic does not appear; with `forever`, the wait has no limit.
        FrontendError: The topic has several types.
    """
    name = absolute(topic)

    def look() -> list[str] | None:
        return dict(graph.topics(hidden=True)).get(name)

    types = graph.wait_for(look)
    if types is None:
        print(f'WARNING: topic [{topic}] does not appear to be published yet')
        near = hint(name, [other for other, _ in graph.topics(hidden=is_hidden(name))])
        if not forever:
            text = 'Could not determine the type for the passed topic'
            raise UnknownNameError(text + near)
        print(near.strip(), end='\n' if near else '', file=sys.stderr)
        types = graph.wait_until(look) or []
    if len(types) > 1:
        raise FrontendError(
            f"Cannot echo topic '{topic}', as it contains more than one type: [{', '.join(types)}]"
        )
    return message_class(types[0])


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
