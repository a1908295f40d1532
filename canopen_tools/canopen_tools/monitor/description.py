# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The meaning of one frame as a value."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import Enum
import re
from typing import TypeAlias

from canopen_core.can import EXTENDED_ID_MAX, Frame


class FrameKind(Enum):
    """Services of CANopen (CiA 301, 7.2; CiA 305), and what is none of them."""

    NMT = 'nmt'
    SYNC = 'sync'
    EMCY = 'emcy'
    TIME = 'time'
    PDO = 'pdo'
    SDO = 'sdo'
    HEARTBEAT = 'heartbeat'
    ERROR = 'error'  # error frame of the CAN controller
    OTHER = 'other'


@dataclass(frozen=True, slots=True)
class Description:
    """What a frame means."""

    kind: FrameKind  # its service
    # The service as a person writes it, e.g. ``TPDO1``; ``SDO >`` goes to the device and ``SDO <``
    # comes from it.
    label: str
    node: str = ''  # name of the device it comes from or goes to, empty when it is for all
    text: str = ''  # the content in words, empty when there is nothing to add
    is_alert: bool = False  # it reports something wrong: an emergency, an abort, an error
    node_id: int = 0  # id of the device, 0 when it is for all

    def __str__(self) -> str:
        """Write it in one line."""
        head = f'{self.label} {self.node}'.rstrip()
        return f'{head}  {self.text}' if self.text else head


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
