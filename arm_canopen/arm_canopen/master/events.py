# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Events that the network reports to its owner: in words, with the device concerned."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum, IntEnum
from typing import TypeAlias


class Severity(IntEnum):
    """Severity of an event, in ascending order."""

    INFO = 0
    WARNING = 1
    ERROR = 2


class EventKind(Enum):
    """Kind of an event."""

    NMT_STATE = 'nmt state'
    BOOT = 'boot'
    BOOT_FAILED = 'boot failed'
    SDO = 'sdo'
    HEARTBEAT_LATE = 'heartbeat late'
    HEARTBEAT_LOST = 'heartbeat lost'
    EMERGENCY = 'emergency'
    PDO = 'pdo'
    DRIVE = 'drive'
    BUS = 'bus'
    CYCLE = 'cycle'


@dataclass(frozen=True, slots=True)
class Event:
    """An event on the network."""

    kind: EventKind  # kind of event
    severity: Severity  # severity
    node: str  # name of the device, empty when it concerns the bus
    text: str  # description

    def __str__(self) -> str:
        """Format the event as a log line."""
        return f'{self.node}: {self.text}' if self.node else self.text


Report: TypeAlias = Callable[[Event], None]
