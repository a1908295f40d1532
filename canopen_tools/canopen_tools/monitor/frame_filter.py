# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Which frames a person wants to see."""

from __future__ import annotations

from collections.abc import Callable, Sequence
import re
from typing import TypeAlias

from arm_canopen.can import EXTENDED_ID_MAX, Frame

from .description import Description, FrameKind

_Test: TypeAlias = Callable[[Frame, Description], bool]
_IDENTIFIER = re.compile(r'(?:0x)?([0-9A-Fa-f]{1,8})(?::(?:0x)?([0-9A-Fa-f]{1,8}))?')
_NODE = 'node:'
_NOT = '^'


class FrameFilter:
    """Shows frames that fit one of its terms, and none that fits a term with ``^`` before it.

    =====================  ==================================================================
    ``sdo``, ``emcy`` ...   a service, by the names of :class:`FrameKind`
    ``node:panda_joint1``  a device by name, or by number as in ``node:2``
    ``181``, ``180:780``   an identifier in hexadecimal, with a mask behind the colon
    =====================  ==================================================================
    """

    def __init__(self, terms: Sequence[str] = ()) -> None:
        """Read terms of the table above; several may stand in one, with commas.

        Raises:
            ValueError: A term is none of these.
        """
        words = [word.strip() for term in terms for word in term.split(',') if word.strip()]
        self._wanted = [_test(word) for word in words if not word.startswith(_NOT)]
        self._unwanted = [_test(word[1:]) for word in words if word.startswith(_NOT)]

    def shows(self, frame: Frame, description: Description) -> bool:
        """Return whether a frame is to be shown."""
        if any(test(frame, description) for test in self._unwanted):
            return False
        return not self._wanted or any(test(frame, description) for test in self._wanted)


def _test(word: str) -> _Test:
    lowered = word.lower()
    kinds = {kind.value: kind for kind in FrameKind}
    if lowered in kinds:
        return lambda _, description: description.kind is kinds[lowered]
    if lowered.startswith(_NODE):
        node = word[len(_NODE) :]
        if node.isdecimal():
            return lambda _, description: description.node_id == int(node)
        return lambda _, description: description.node == node
    match = _IDENTIFIER.fullmatch(word)
    if match is None:
        raise ValueError(
            f'unknown filter {word!r}; choose one of {", ".join(kinds)}, `node:NAME`, '
            'or an identifier such as 181 or 180:780'
        )
    can_id = int(match[1], 16)
    mask = int(match[2], 16) if match[2] else EXTENDED_ID_MAX
    return lambda frame, _: frame.can_id & mask == can_id & mask
