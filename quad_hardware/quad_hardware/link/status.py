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
    """How a link is at one moment.

    Attributes:
        state: What the driver is doing.
        detail: In words; why, when it is not running.
        protocol: What the robot speaks; empty while there is none.
        baud: Speed of the line [bit/s].
        firmware: Version of the robot.
        connections: How often a robot was found.
        age: Since the last report that was taken [s]; infinite before the first.
        commands: Joint commands handed to the line.
        dropped: Joint commands that were not sent, because the link was not running.
        parser: What the parser saw in this connection.
        dialect: What the dialect saw in this connection.
        refused: Reports that could not be, and were not taken.
        latency: Latency timer of the adapter [s]; None where there is none.
    """

    state: LinkState
    detail: str
    protocol: str
    baud: int
    firmware: str
    connections: int
    age: float
    commands: int
    dropped: int
    parser: ParserCounters
    dialect: DialectCounters
    refused: int = 0
    latency: float | None = None
