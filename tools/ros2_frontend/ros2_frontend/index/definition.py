# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Interface definitions with the definitions of their fields' types folded in."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
import sys

# a package of this checkout; it need not be built, as `ros2` itself need not be
sys.path.append(str(Path(__file__).resolve().parents[4] / 'libraries' / 'message_definitions'))

from message_definitions import concatenated, nested_type

__all__ = ['Comments', 'concatenated', 'expand', 'strip_comment']


@dataclass(frozen=True, slots=True)
class Comments:
    """Which comments (and blank lines) to show.

    Attributes:
        top: Those of the interface itself.
        nested: Those of the types of its fields.
    """

    top: bool = True
    nested: bool = False


def expand(
    name: str, read: Callable[[str], str], comments: Comments, depth: int = 0
) -> Iterator[str]:
    """The lines of a definition, each field of a message type followed by that type's lines.

    Args:
        name: `package/kind/Name`.
        read: Gives the definition's text for such a name.
        comments: Which comments to show.
        depth: How deep the definition stands; one tab each.

    Yields:
        Lines without line feed.
    """
    shown = comments.nested if depth else comments.top
    for line in read(name).splitlines():
        text = line.rstrip() if shown else strip_comment(line)
        if text or shown:
            yield '\t' * depth + text if text else ''
        nested = nested_type(line, name.partition('/')[0])
        if nested is not None:
            yield from expand(nested, read, comments, depth + 1)


def strip_comment(line: str) -> str:
    """A line of a definition without its comment.

    Args:
        line: The line.

    Returns:
        What stands before the first `#`, which is where rosidl starts the comment, too.
    """
    return line.partition('#')[0].strip()
