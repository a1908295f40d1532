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
