# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Python expressions and field paths over a message, as users type them."""

from __future__ import annotations

from collections.abc import Callable
import re

from ..aliases import Message, Value
from ..cli.errors import FrontendError, UnknownNameError
from ..cli.suggest import hint

_INDEX = re.compile(r'\[(-?\d+)\]')


def compile_filter(expression: str | None) -> Callable[[Message], bool]:
    """Make a predicate of a Python expression in `m`, the message.

    Args:
        expression: For example `m.position[0] > 1.0`; None accepts every message.

    Returns:
        The predicate. It raises FrontendError when the expression fails on a message.

    Raises:
        FrontendError: When the expression is no Python.
    """
    if not expression:
        return lambda _: True
    try:
        code = compile(expression, '--filter', 'eval')
    except SyntaxError as error:
        raise FrontendError(f"Invalid filter '{expression}': {error.msg}") from None

    def accepts(message: Message) -> bool:
        try:
            # the user's own expression, with the user's own rights
            return bool(eval(code, {'m': message}))  # noqa: S307
        except Exception as error:  # noqa: BLE001  # whatever the expression raises
            raise FrontendError(f"Filter '{expression}' failed: {error}") from None

    return accepts


def parse_path(text: str | None) -> list[str]:
    """Split the path of a field.

    Args:
        text: For example `pose.position` or `position.[0]`; None is the whole message.

    Returns:
        Its parts.

    Raises:
        FrontendError: When there is none.
    """
    if text is None:
        return []
    parts = [part for part in text.replace('[', '.[').split('.') if part]
    if not parts:
        raise FrontendError(f"Invalid field value '{text}'")
    return parts


def select(message: Message, path: list[str]) -> Value:
    """Follow a path into a message.

    Args:
        message: The message.
        path: The parts of the path; an index stands in brackets.

    Returns:
        The field's value.

    Raises:
        UnknownNameError: When it does not exist; it names the nearest field.
    """
    value = message
    for part in path:
        index = _INDEX.fullmatch(part)
        try:
            value = value[int(index[1])] if index else getattr(value, part)
        except (AttributeError, IndexError, TypeError) as error:
            fields = getattr(value, '_fields_and_field_types', {})
            near = hint(part, fields) or (f'\nIt has: {", ".join(fields)}' if fields else '')
            text = f"Invalid field '{'.'.join(path)}': {error}{near}"
            raise UnknownNameError(text) from None
    return value
