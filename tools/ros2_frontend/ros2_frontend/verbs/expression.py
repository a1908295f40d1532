# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Python expressions and field paths over a message, as users type them."""

from __future__ import annotations

from collections.abc import Callable
import re
from typing import Any

from ..cli.errors import FrontendError, UnknownNameError
from ..names import Message

_INDEX = re.compile(r'\[(-?\d+)\]')


def compile_filter(expression: str | None) -> Callable[[Message], bool]:
    """Make a predicate of a Python expression in `m`, the message; None accepts every message.

    Raises:
        FrontendError: The expression is no Python; from the predicate: it fails on a message.
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
    """Split the path of a field, e.g. `pose.position` or `position.[0]`; None is the message.

    Raises:
        FrontendError: There is none in the text.
    """
    if text is None:
        return []
    parts = [part for part in text.replace('[', '.[').split('.') if part]
    if not parts:
        raise FrontendError(f"Invalid field value '{text}'")
    return parts


def select(message: Message, path: list[str]) -> Any:  # noqa: ANN401  # a field of any type
    """Follow the parts of a path into a message.

    Raises:
        UnknownNameError: The field does not exist; it names those that do.
    """
    value = message
    for part in path:
        index = _INDEX.fullmatch(part)
        try:
            value = value[int(index[1])] if index else getattr(value, part)
        except (AttributeError, IndexError, TypeError) as error:
            fields = ', '.join(getattr(value, '_fields_and_field_types', ()))
            known = f'\nIt has: {fields}' if fields else ''
            text = f"Invalid field '{'.'.join(path)}': {error}{known}"
            raise UnknownNameError(text) from None
    return value
