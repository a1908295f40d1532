# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A robot that was found: its port, what finds frames in its bytes, and how to talk to it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
import time
from typing import Any, TypeVar
from typing import Protocol as Interface

from ..exceptions import LinkError
from ..protocol import (
    Frame,
    Model,
    model_of_firmware,
    ParserCounters,
    Protocol,
    PROTOCOLS,
    ROBOT_KINDS,
    StreamParser,
    V2,
)
from .dialect import Dialect
from .port import Port
from .probe import connect, Connection
from .v1_dialect import V1Dialect
from .v2_dialect import V2Dialect
from .vendor import VendorDialect, VendorParser, VendorPort


@dataclass(frozen=True, slots=True)
class LinkOptions:
    """Where the robot is, and how to talk to it."""

    path: str  # device file
    protocols: tuple[Protocol, ...] = PROTOCOLS  # what to try, in this order
    baud: int = 0  # speed [bit/s]; 0 takes each protocol's own
    model: Model | None = None  # whose ranges scale bytes in protocol v1; None asks the firmware
    rate: int = 50  # reports a second [Hz]
    vendor: bool = False  # go through the vendor's own library, and try nothing else
    vendor_method: str = ''  # name of its method that writes a servo angle


Found_co = TypeVar('Found_co', covariant=True)


class FrameParser(Interface[Found_co]):
    """What finds frames in bytes.

    Attributes:
        pending: Bytes that wait for the rest of their frame.
        counters: A copy of its counters.
    """

    @property
    def pending(self) -> int:
        """Bytes that wait for the rest of their frame."""

    @property
    def counters(self) -> ParserCounters:
        """A copy of the counters."""

    def feed(self, data: bytes) -> Sequence[Found_co]:
        """Take bytes and return the frames that they complete."""

    def expire(self) -> Sequence[Found_co]:
        """Give up waiting for the rest of a frame."""


@dataclass(frozen=True, slots=True)
class Session:
    """A robot that was found."""

    port: Port  # the open port, owned by whoever holds the session
    firmware: str  # version of the robot
    parser: FrameParser[Any]  # finds frames in its bytes
    dialect: Dialect[Any]  # how to talk to it
    model: Model | None = None  # whose ranges scale bytes in protocol v1; None in others


def open_session(options: LinkOptions) -> Session:
    """Find the robot: by the vendor's library where that is wanted, else by asking it.

    Raises:
        LinkError: There is no robot, or it is none that walks; the message says what was tried.
    """
    if options.vendor:
        return _open_vendor(options)
    connection = connect(options.path, options.protocols, options.baud)
    try:
        model = _model(connection, options)
    except LinkError:
        connection.port.close()
        raise
    parser = StreamParser(connection.protocol, ROBOT_KINDS)
    dialect = make_dialect(model, time.monotonic(), options.rate)
    return Session(connection.port, connection.firmware, parser, dialect, model)


def _open_vendor(options: LinkOptions) -> Session:
    port = VendorPort(options.path)
    try:
        firmware = port.read_version()
        dialect = VendorDialect(port.dog, time.monotonic(), options.vendor_method)
        return Session(port, firmware, VendorParser(), dialect)
    except LinkError:
        port.close()
        raise


def make_dialect(model: Model | None, now: float, rate: int = 50) -> Dialect[Frame]:
    """Return how to talk to a robot.

    Args:
        model: Whose ranges scale bytes in protocol v1; None speaks v2.
        rate: Reports a second [Hz].
    """
    return V2Dialect(now, rate) if model is None else V1Dialect(now, model, rate)


def _model(connection: Connection, options: LinkOptions) -> Model | None:
    """Return whose ranges scale bytes in protocol v1; None in v2, which has no need of them."""
    if connection.protocol is V2:
        return None
    model = options.model or model_of_firmware(connection.firmware)
    if model is None:
        raise LinkError(
            f'firmware {connection.firmware!r} is of no known quadruped (M mini, L lite, W or MW '
            'wheeled); name its ranges with the parameter or option model'
        )
    return model
