# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Destroys a node whose constructor raises, so that it leaves the graph."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import wraps
from typing import Concatenate, ParamSpec, TypeVar

from rclpy.node import Node

AnyNode = TypeVar('AnyNode', bound=Node)
Arguments = ParamSpec('Arguments')
Constructor = Callable[Concatenate[AnyNode, Arguments], None]


def destroyed_when_refused(
    construct: Constructor[AnyNode, Arguments],
) -> Constructor[AnyNode, Arguments]:
    """Decorate the ``__init__`` of a node: when it raises, the node is destroyed first.

    rclpy enters a node into the graph at the beginning of its constructor, and its participant
    answers as long as the process lives, whatever became of the object.
    """

    @wraps(construct)
    def guarded(node: AnyNode, /, *args: Arguments.args, **options: Arguments.kwargs) -> None:
        with destroyed_if_refused(node):
            construct(node, *args, **options)

    return guarded


@contextmanager
def destroyed_if_refused(node: AnyNode) -> Iterator[AnyNode]:
    """Destroy a node when what follows raises; else it stays.

    For functions that make nodes of the class ``Node`` and then read their parameters; in an
    ``ExitStack`` where there are several.
    """
    try:
        yield node
    except BaseException:
        _destroy(node)
        raise


def _destroy(node: Node) -> None:
    try:
        node.destroy_node()
    except AttributeError:  # not even the constructor of Node came to its end
        with suppress(AttributeError):
            node.handle.destroy_when_not_in_use()
