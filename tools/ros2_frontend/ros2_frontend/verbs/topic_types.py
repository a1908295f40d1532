# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The message class of a topic: as named by the user, or as found in the graph."""

from __future__ import annotations

import sys

from ..aliases import InterfaceClass
from ..cli.errors import FrontendError, UnknownNameError
from ..cli.suggest import hint
from ..index.interfaces import class_of, Kind
from ..names import absolute, is_hidden
from ..ros.graph import Graph


def message_class(name: str) -> InterfaceClass:
    """Import a message class, by `package/msg/Name` or `package/Name`."""
    return class_of(name, Kind.MESSAGE, 'The passed message type is invalid')


def class_of_topic(topic: str, graph: Graph, *, forever: bool = False) -> InterfaceClass:
    """Return the message class that a topic carries, once it is there.

    Raises:
        UnknownNameError: The topic does not appear, unless it is waited for `forever`.
        FrontendError: It carries several types.
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
