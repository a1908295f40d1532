# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Finds out which protocol a robot speaks: by its firmware version, at 2 Mbaud, then at 115200."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
import select
import time

from ..exceptions import LinkError, NoAnswerError
from ..protocol import (
    Code,
    Frame,
    Kind,
    Protocol,
    PROTOCOLS,
    Register,
    ROBOT_KINDS,
    StreamParser,
    V2,
)
from .port import SerialPort

PSEUDO_TERMINALS = Path('/dev/pts')  # behind which a simulated robot is
ANSWER_TIME = 0.15  # [s] a robot takes a few milliseconds
ATTEMPTS = 2
FIRMWARE_SIZE, BATTERY_SIZE = 10, 1  # [B]


@dataclass(frozen=True, slots=True)
class Connection:
    """A robot that answered."""

    port: SerialPort  # the open port, owned by whoever holds the connection
    protocol: Protocol  # what the robot speaks
    firmware: str  # its version


def connect(path: str, protocols: Iterable[Protocol] = PROTOCOLS, baud: int = 0) -> Connection:
    """Open a port and request the firmware version, in one protocol after the other.

    Args:
        protocols: What to try, in this order.
        baud: Speed [bit/s]; 0 takes each protocol's own.

    Returns:
        The first that answers.

    Raises:
        LinkError: The port cannot be opened or was lost.
        NoAnswerError: Nobody answers; the message says what was tried.
    """
    tried = []
    for protocol in protocols:
        speed = baud or protocol.baud
        tried.append(f'protocol {protocol.name} at {speed} baud')
        port = SerialPort(path, speed)
        try:
            firmware = read_firmware(port, protocol)
        except LinkError:
            port.close()
            raise
        if firmware is not None:
            return Connection(port, protocol, firmware)
        port.close()
    raise NoAnswerError(f'no robot answers on {path} ({", ".join(tried)}); {silence_cause(path)}')


def silence_cause(path: str) -> str:
    """Return what to look at where nobody answers on a port.

    Args:
        path: Device file, or a link to one.
    """
    if Path(path).resolve().is_relative_to(PSEUDO_TERMINALS):
        return (
            'it is a pseudo-terminal: does the simulated robot behind it still start, and is this '
            'machine too busy?'
        )
    return 'is it switched on, and is this its port?'


def read_firmware(port: SerialPort, protocol: Protocol) -> str | None:
    """Return the firmware version of a robot, None when it does not answer.

    Raises:
        LinkError: The port was lost.
    """
    if protocol is V2:
        request = Frame(Kind.READ, Code.VERSION)
    else:
        request = Frame(Kind.READ, Register.FIRMWARE, bytes((FIRMWARE_SIZE,)))
    for _ in range(ATTEMPTS):
        answer = send_request(port, protocol, request, FIRMWARE_SIZE, ANSWER_TIME)
        if answer is not None:
            return answer.rstrip(b'\0').decode('ascii', 'replace')
    return None


def read_battery(port: SerialPort, protocol: Protocol) -> int | None:
    """Return the charge of a robot [%], None when it does not answer.

    Raises:
        LinkError: The port was lost.
    """
    request = Frame(Kind.READ, Register.BATTERY, bytes((BATTERY_SIZE,)))
    if protocol is V2:
        request = Frame(Kind.READ, Code.BATTERY)
    for _ in range(ATTEMPTS):
        answer = send_request(port, protocol, request, BATTERY_SIZE, ANSWER_TIME)
        if answer is not None:
            return answer[0]
    return None


def send_request(
    port: SerialPort, protocol: Protocol, request: Frame, size: int, timeout: float
) -> bytes | None:
    """Send a request and wait for its answer.

    Args:
        size: Length of the answer [B]; others are passed over.
        timeout: How long to wait [s].

    Returns:
        Payload of the answer, None when there is none in time.

    Raises:
        LinkError: The port was lost.
    """
    parser = StreamParser(protocol, ROBOT_KINDS)
    port.write(request.encode(protocol))
    deadline = time.monotonic() + timeout
    while (left := deadline - time.monotonic()) > 0:
        readable, _, _ = select.select([port], [], [], left)
        frames = parser.feed(port.read()) if readable else parser.expire()
        for frame in frames:
            if (
                frame.kind is Kind.REPLY
                and frame.address == request.address
                and len(frame.payload) == size
            ):
                return frame.payload
    return None
