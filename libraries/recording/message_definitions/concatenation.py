# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A definition with those of all messages in it."""

from __future__ import annotations

from collections.abc import Callable
import re

# a type of another message: `pkg/Name` or `Name` (same package), with an array suffix perhaps;
# https://docs.ros.org/en/jazzy/Concepts/Basic/About-Interfaces.html, section 2.1
_FIELD = re.compile(r'(?:(?P<package>[a-z]\w*)/)?(?:msg/)?(?P<name>[A-Z]\w*)(?:\[[^\]]*\])?\s+\w')

_SEPARATOR = '=' * 80


def nested_type(line: str, package: str) -> str | None:
    """The message type of the field that a line declares.

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
