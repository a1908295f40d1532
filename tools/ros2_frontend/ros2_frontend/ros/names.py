# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Names in the ROS graph: full names, hidden names, nodes."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, order=True)
class NodeName:
    """The name of a node in the graph.

    Attributes:
        full_name: Namespace and name, `/ns/name`.
        name: The last part.
        namespace: What stands before it, `/` at the root.
    """

    full_name: str
    name: str
    namespace: str

    @classmethod
    def of(cls, name: str, namespace: str) -> NodeName:
        """Make the name of a node from its two parts.

        Args:
            name: The node's base name.
            namespace: Its namespace, with a leading slash.

        Returns:
            The name.
        """
        return cls(f'{namespace.rstrip("/")}/{name}', name, namespace)

    @classmethod
    def parse(cls, text: str) -> NodeName:
        """Split a name that a user typed; a missing leading slash is added.

        Args:
            text: For example `talker` or `/ns/talker`.

        Returns:
            The name.
        """
        full_name = absolute(text)
        namespace, _, name = full_name.rpartition('/')
        return cls(full_name, name, namespace or '/')

    @property
    def hidden(self) -> bool:
        """Whether tools leave the node out by default (REP-144 style leading underscore)."""
        return self.name.startswith('_')


def absolute(name: str) -> str:
    """Give a name its leading slash.

    Args:
        name: A node, topic, service or action name as typed.

    Returns:
        The absolute name.
    """
    return name if name.startswith('/') else f'/{name}'


def is_hidden(name: str) -> bool:
    """Whether a topic or service is hidden: some part of it starts with an underscore.

    Args:
        name: The absolute name.

    Returns:
        True for `/_a`, `/a/_b/c`.
    """
    return any(part.startswith('_') for part in name.split('/'))
