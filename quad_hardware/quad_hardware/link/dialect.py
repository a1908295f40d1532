# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""How one talks to a robot: what is sent when, and what the answers mean.

A dialect is a state machine without clock, thread or port: time comes in, bytes come out.
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
    """What a driver is doing."""

    CONNECTING = 'connecting'  # no port, or no answer
    FAILED = 'failed'  # an error of ours ended the conversation; it begins anew
    WAITING = 'waiting'  # a robot answered and has not reported yet
    RUNNING = 'running'
    STALE = 'stale'  # the port is open and no report came for a while
    REFUSED = 'refused'  # reports come, and for a while none of them could be
    STOPPED = 'stopped'


@dataclass(slots=True)
class DialectCounters:
    """What a dialect has seen since its start."""

    states: int = 0  # reports of the robot
    lost: int = 0  # reports that never came, by their sequence numbers (v2)
    unanswered: int = 0  # requests without an answer in time (v1)
    refused: int = 0  # frames that the robot refused (v2)
    unusable: int = 0  # valid frames whose contents are not


@dataclass(slots=True)
class LinkStatus:
    """How a link is at one moment."""

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
        """Return a copy at an age of the last report [s]; its counters count no more."""
        counters = replace(self.parser), replace(self.dialect)
        return replace(self, age=age, parser=counters[0], dialect=counters[1])

    def reason(self, otherwise: str) -> str:
        """Return why it is not running; another reason where it runs again by now."""
        return otherwise if self.state is LinkState.RUNNING else self.detail


@dataclass(frozen=True, slots=True)
class Step:
    """What is to be done now."""

    send: bytes  # bytes to send, maybe none
    wake: float  # when to come back at the latest, on the clock of the caller [s]


class Dialect(ABC):
    """Conversation with one robot.

    The caller does :meth:`step` again when its ``wake`` has come, after :meth:`command` and after
    frames; and :meth:`handle_frame` for each frame.
    """

    def __init__(self, protocol: Protocol) -> None:
        """Begin a conversation."""
        self.protocol = protocol  # what the robot speaks
        self.can_release = True  # the torque of its servos can be switched off
        # what each motor can be sent [deg], where that is less than servos turn
        self.spans: Mapping[int, Span] = {}
        self.counters = DialectCounters()
        self._torque = b''  # bytes of a change that is still to be sent

    @property
    @abstractmethod
    def pending(self) -> bool:
        """Whether a command or a change of torque has not been given to the line yet."""

    @property
    def torque_pending(self) -> bool:
        """Whether a change of torque has not been given to the line yet."""
        return bool(self._torque)

    @abstractmethod
    def command(self, angles: Mapping[int, float]) -> None:
        """Set the finite angles [deg] by motor id that are sent at the next possible moment."""

    @abstractmethod
    def torque(self, *, on: bool) -> None:
        """Switch the torque of all servos at the next possible moment."""

    @abstractmethod
    def cancel_pending(self) -> None:
        """Forget a command and a change of torque that have not been sent yet."""

    @abstractmethod
    def step(self, now: float) -> Step:
        """Return what is to be sent now."""

    def handle_sent(self, frame: Any, now: float) -> Mapping[int, float]:  # noqa: ANN401
        """Process a frame that was sent in a recorded session, in the place of step.

        Returns:
            The servo angles that it sends, by motor id [deg]; none as a rule.
        """
        return {}

    @abstractmethod
    def handle_frame(self, frame: Any, now: float) -> Report | None:  # noqa: ANN401
        """Process a frame of the robot; return the report that it completes, if any."""


def vector(values: Iterable[float]) -> Vector:
    """Return three numbers as a vector."""
    x, y, z = values
    return x, y, z
