# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Numbers of the standards that have a meaning in words."""

from __future__ import annotations

from enum import IntEnum
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from typing_extensions import Self


class CodeWithText(IntEnum):
    """Codes, each with its meaning as ``text``."""

    text: str

    def __new__(cls, code: int, text: str = '') -> Self:
        """Make a member of a row; a member by its code alone has the text of its row."""
        member = int.__new__(cls, code)
        member._value_ = code
        member.text = text
        return member
