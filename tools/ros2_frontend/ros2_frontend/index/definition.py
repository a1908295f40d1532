# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Interface definitions with the definitions of their fields' types folded in."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
import re

# a type of another message: `pkg/Name` or `Name` (same package), with an array suffix perhaps;
# https://docs.ros.org/en/jazzy/Concepts/Basic/About-Interfaces.html, section 2.1
_FIELD = re.compile(r'(?:(?P<package>[a-z]\w*)/)?(?:msg/)?(?P<name>[A-Z]\w*)(?:\[[^\]]*\])?\s+\w')


_SEPARATOR = '=' * 80  # between the definitions that a recording carries


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


def nested_type(line: str, package: str) -> str | None:
    """The message type of the field that a line declares.

    Args:
        line: A line of a definition.
        package: The package whose definition it is.

    Returns:
        `package/msg/Name`, or None for constants, primitive types and comments.
    """
    match = _FIELD.match(line.strip())
    if match is None:
        return None
    return f'{match["package"] or package}/msg/{match["name"]}'


def concatenated(name: str, read: Callable[[str], str]) -> str:
    """A definition with those of all messages in it behind, as recordings carry them (`ros2msg`).

    Args:
        name: `package/msg/Name`.
        read: Gives the definition's text for such a name.

    Returns:
        The texts, each nested one once and below a line with its name.
    """
    found: dict[str, str] = {}
    wanted = [name]
    while wanted:
        each = wanted.pop(0)
        if each in found:
            continue
        found[each] = read(each)
        package = each.partition('/')[0]
        nested = (nested_type(line, package) for line in found[each].splitlines())
        wanted += [type_ for type_ in nested if type_ is not None]
    top, *others = found.items()
    return '\n'.join([top[1], *(f'{_SEPARATOR}\nMSG: {type_}\n{text}' for type_, text in others)])
