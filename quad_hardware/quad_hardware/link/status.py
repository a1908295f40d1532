# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""How a link is, for those who look at it."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from ..protocol import ParserCounters
from .dialect import DialectCounters


class LinkState(Enum):
    """What a driver is doing."""

    CONNECTING = 'connecting'  # no port, or nobody answers
    FAILED = 'failed'  # an error of ours ended the conversation; it begins anew
    WAITING = 'waiting'  # a robot answered and has not reported yet
    RUNNING = 'running'
    STALE = 'stale'  # the port is open and no report came for a while
    REFUSED = 'refused'  # reports come, and for a while none of them could be
    STOPPED = 'stopped'


@dataclass(frozen=True, slots=True)
class LinkStatus:
    """How a link is at one moment."""

    state: LinkState  # what the driver is doing
    detail: str  # in words; why, when it is not running
    protocol: str  # what the robot speaks; empty while there is none
    baud: int  # speed of the line [bit/s]
    firmware: str  # version of the robot
    connections: int  # how often a robot was found
    age: float  # since the last report that was taken [s]; infinite before the first
    commands: int  # joint commands handed to the line
    dropped: int  # joint commands that were not sent, because the link was not running
    parser: ParserCounters  # what the parser saw in this connection
    dialect: DialectCounters  # what the dialect saw in this connection
    refused: int = 0  # reports that could not be, and were not taken
    latency: float | None = None  # latency timer of the adapter [s]; None where there is none
