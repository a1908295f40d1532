# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Names in the ROS graph, and type aliases for untyped objects of rclpy and messages."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, TypeAlias

Message: TypeAlias = Any
"""An instance of a generated class: a message, request, response, goal, result or feedback."""
InterfaceClass: TypeAlias = Any  # a generated class: of a message, a service or an action
Handle: TypeAlias = Any
"""An object of rclpy: node, client, publisher, future, goal handle, QoS profile, endpoint."""
NamesAndTypes: TypeAlias = list[tuple[str, list[str]]]
"""Topics, services or actions with the types they are used with."""


@dataclass(frozen=True, slots=True, order=True)
class NodeName:
    """The name of a node: `/ns/name`, its last part, and its namespace (or `/`)."""

    full_name: str
    name: str
    namespace: str

    @classmethod
    def of(cls, name: str, namespace: str) -> NodeName:
        """Make the name of a node from its two parts."""
        return cls(f'{namespace.rstrip("/")}/{name}', name, namespace)

    @classmethod
    def parse(cls, text: str) -> NodeName:
        """Split a name that a user typed; a missing leading slash is added."""
        full_name = absolute(text)
        namespace, _, name = full_name.rpartition('/')
        return cls(full_name, name, namespace or '/')

    @property
    def hidden(self) -> bool:
        """Whether tools leave the node out by default (leading underscore)."""
        return self.name.startswith('_')


def absolute(name: str) -> str:
    """Return the name of a node, topic, service or action with its leading slash."""
    return name if name.startswith('/') else f'/{name}'


def is_hidden(name: str) -> bool:
    """Whether some part of the name of a topic or service starts with an underscore."""
    return any(part.startswith('_') for part in name.split('/'))
