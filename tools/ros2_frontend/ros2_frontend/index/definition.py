# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Interface definitions with the definitions of their fields' types folded in."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from message_definitions import nested_type


def expand(
    name: str, read: Callable[[str], str], comments: bool, nested_comments: bool, depth: int = 0
) -> Iterator[str]:
    """Yield the lines of `package/kind/Name`, each field of a message type followed by its lines.

    Args:
        name: The type.
        read: Gives the definition's text for such a name.
        comments: Whether to show comments and blank lines of the type itself.
        nested_comments: Whether to show those of the types of its fields.
        depth: How deep the definition stands; one tab each.
    """
    shown = nested_comments if depth else comments
    for line in read(name).splitlines():
        # rosidl, too, starts a comment at the first #
        text = line.rstrip() if shown else line.partition('#')[0].strip()
        if text or shown:
            yield '\t' * depth + text if text else ''
        nested = nested_type(line, name.partition('/')[0])
        if nested is not None:
            yield from expand(nested, read, comments, nested_comments, depth + 1)
