# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Conversation with a robot: what to send when, and how to interpret its answers.

A dialect is a state machine without clock, thread or port: it takes the time and returns bytes.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from enum import Enum
import math
from typing import Any

from quad_description.rotations import Vector

from ..protocol import ParserCounters, Protocol, Span
from ..report import Report


class LinkState(Enum):
    """State of a driver."""

    CONNECTING = 'connecting'  # no port, or no answer
    FAILED = 'failed'  # an error of ours ended the conversation; it begins anew
    WAITING = 'waiting'  # a robot answered and has not reported yet
    RUNNING = 'running'
    STALE = 'stale'  # the port is open and no report came for a while
    REFUSED = 'refused'  # reports come, and for a while none of them could be
    STOPPED = 'stopped'


@dataclass(slots=True)
class DialectCounters:
    """Counters of a dialect since its start."""

    states: int = 0  # reports of the robot
    lost: int = 0  # reports that never came, by their sequence numbers (v2)
    unanswered: int = 0  # requests without an answer in time (v1)
    refused: int = 0  # frames that the robot refused (v2)
    unusable: int = 0  # valid frames whose contents are not


@dataclass(slots=True)
class LinkStatus:
    """Snapshot of the state of a link."""

    state: LinkState = LinkState.CONNECTING  # what the driver is doing
    detail: str = ''  # in words; why, when it is not running
    protocol: str = ''  # what the robot speaks; empty while there is none
    baud: int = 0  # speed of the line [bit/s]
    firmware: str = ''  # version of the robot
    connections: int = 0  # how often a robot was found
    age: float = math.inf  # since the last report that was taken [s]
    commands: int = 0  # joint commands handed to the line
    dropped: int = 0  # joint commands that were not sent, because the link was not running
    refused: int = 0  # reports that could not be, and were not taken
    refusal: str = ''  # why the last of them could not be
    latency: float | None = None  # latency timer of the adapter [s]; None where there is none
    # what parser and dialect saw in this connection
    parser: ParserCounters = field(default_factory=ParserCounters)
    dialect: DialectCounters = field(default_factory=DialectCounters)

    def at(self, age: float) -> LinkStatus:
        """Return a copy with the age of the last report [s]; its counters are frozen."""
        counters = replace(self.parser), replace(self.dialect)
        return replace(self, age=age, parser=counters[0], dialect=counters[1])

    def reason(self, otherwise: str) -> str:
        """Return why the link is not running; if it is, return the alternative text."""
        return otherwise if self.state is LinkState.RUNNING else self.detail


@dataclass(frozen=True, slots=True)
class Step:
    """Bytes to send now, and the time of the next step."""

    send: bytes  # bytes to send, maybe none
    wake: float  # when to come back at the latest, on the clock of the caller [s]


class Dialect(ABC):
    """Conversation with one robot in one protocol.

    Call :meth:`step` at its ``wake`` time, after :meth:`command` and after received frames; call
    :meth:`handle_frame` for each frame.
    """

    def __init__(self, protocol: Protocol) -> None:
        """Start a conversation."""
        self.protocol = protocol  # what the robot speaks
        self.can_release = True  # the torque of its servos can be switched off
        # what each motor can be sent [deg], where that is less than servos turn
        self.spans: Mapping[int, Span] = {}
        self.counters = DialectCounters()
        self._torque = b''  # bytes of a change that is still to be sent

    @property
    @abstractmethod
    def pending(self) -> bool:
        """Whether a command or a change of torque has not been sent yet."""

    @property
    def torque_pending(self) -> bool:
        """Whether a change of torque has not been sent yet."""
        return bool(self._torque)

    @abstractmethod
    def command(self, angles: Mapping[int, float]) -> None:
        """Set finite angles [deg] by motor id, to send at the next opportunity."""

    @abstractmethod
    def torque(self, *, on: bool) -> None:
        """Switch the torque of all servos at the next opportunity."""

    @abstractmethod
    def cancel_pending(self) -> None:
        """Discard a command and a change of torque that have not been sent yet."""

    @abstractmethod
    def step(self, now: float) -> Step:
        """Return the bytes to send now."""

    def handle_sent(self, frame: Any, now: float) -> Mapping[int, float]:  # noqa: ANN401
        """Process a frame sent in a recorded session, instead of calling step.

        Returns:
            The servo angles in the frame, by motor id [deg]; usually none.
        """
        return {}

    @abstractmethod
    def handle_frame(self, frame: Any, now: float) -> Report | None:  # noqa: ANN401
        """Process a frame of the robot; return the report that it completes, or None."""


def vector(values: Iterable[float]) -> Vector:
    """Return the first three numbers as a vector."""
    x, y, z = values
    return x, y, z
