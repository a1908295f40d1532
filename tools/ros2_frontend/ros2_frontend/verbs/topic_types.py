# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The message class of a topic: as named by the user, or as found in the graph."""

from __future__ import annotations

import sys

from ..aliases import InterfaceClass
from ..cli.errors import FrontendError, UnknownNameError
from ..cli.suggest import hint
from ..index.interfaces import class_of, Kind
from ..ros.graph import Graph
from ..ros.names import absolute, is_hidden

_BAD_TYPE = 'The passed message type is invalid'


def message_class(name: str) -> InterfaceClass:
    """Import a message class.

    Args:
        name: `package/msg/Name` or `package/Name`.

    Returns:
        The generated class.

    Raises:
        BadTypeError: When it is not installed or no message.
    """
    return class_of(name, Kind.MESSAGE, _BAD_TYPE)


def class_of_topic(topic: str, graph: Graph) -> InterfaceClass:
    """The message class that a topic carries, once it is there.

    Args:
        topic: The topic's name as typed.
        graph: The graph to wait in.

    Returns:
        The generated class.

    Raises:
        UnknownNameError: When the topic does not appear.
        FrontendError: When it carries several types.
    """
    types = graph.wait_for(lambda: _types(topic, graph))
    if types is None:
        _warn(topic)
        raise UnknownNameError(
            'Could not determine the type for the passed topic' + _near(topic, graph)
        )
    return _only_class(topic, types)


def await_class_of_topic(topic: str, graph: Graph) -> InterfaceClass:
    """The message class that a topic carries; waits for the topic until Ctrl-C.

    Args:
        topic: The topic's name as typed.
        graph: The graph to wait in.

    Returns:
        The generated class.

    Raises:
        FrontendError: When it carries several types.
    """
    types = graph.wait_for(lambda: _types(topic, graph))
    if types is None:
        _warn(topic)
        near = _near(topic, graph).strip()
        if near:
            print(near, file=sys.stderr)
        types = graph.wait_until(lambda: _types(topic, graph))
    return _only_class(topic, types or [])


def _types(topic: str, graph: Graph) -> list[str] | None:
    return dict(graph.topics(hidden=True)).get(absolute(topic))


def _only_class(topic: str, types: list[str]) -> InterfaceClass:
    if len(types) > 1:
        raise FrontendError(
            f"Cannot echo topic '{topic}', as it contains more than one type: [{', '.join(types)}]"
        )
    return message_class(types[0])


def _warn(topic: str) -> None:
    print(f'WARNING: topic [{topic}] does not appear to be published yet')


def _near(topic: str, graph: Graph) -> str:
    name = absolute(topic)
    return hint(name, [other for other, _ in graph.topics(hidden=is_hidden(name))])
