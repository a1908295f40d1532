# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The meaning of one frame as a value."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum


class FrameKind(Enum):
    """Services of CANopen (CiA 301, 7.2; CiA 305), and what is none of them."""

    NMT = 'nmt'
    SYNC = 'sync'
    EMCY = 'emcy'
    TIME = 'time'
    PDO = 'pdo'
    SDO = 'sdo'
    HEARTBEAT = 'heartbeat'
    LSS = 'lss'
    ERROR = 'error'  # error frame of the CAN controller
    OTHER = 'other'


@dataclass(frozen=True, slots=True)
class Description:
    """What a frame means.

    Attributes:
        kind: Its service.
        label: The service as a person writes it, e.g. ``TPDO1``; ``SDO >`` goes to the device and
            ``SDO <`` comes from it.
        node: Name of the device it comes from or goes to, empty when it is for all.
        text: The content in words, empty when there is nothing to add.
        is_alert: It reports something wrong: an emergency, an abort, an error.
        node_id: Id of the device, 0 when it is for all.
    """

    kind: FrameKind
    label: str
    node: str = ''
    text: str = ''
    is_alert: bool = False
    node_id: int = 0

    def __str__(self) -> str:
        """Write it in one line."""
        head = f'{self.label} {self.node}'.rstrip()
        return f'{head}  {self.text}' if self.text else head
