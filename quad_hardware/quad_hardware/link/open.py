# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Detects a robot: requests its firmware version, or waits for pushes, protocol by protocol."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
import select
import time
from typing import NamedTuple

from quad_description import PRESETS
from robot_primitives import setting

from ..exceptions import LinkError, NoAnswerError
from ..protocol import (
    Code,
    DEVELOPER,
    Frame,
    Kind,
    Model,
    model_of_firmware,
    Protocol,
    PROTOCOLS,
    Register,
    ROBOT_KINDS,
    StreamParser,
    V2,
)
from ..protocol.tables import DEVELOPER_FIRMWARE, PUSHED
from .dialect import Dialect
from .dialects import DeveloperDialect, V1Dialect, V2Dialect
from .port import SerialPort
from .vendor import VendorDialect, VendorParser, VendorPort

PSEUDO_TERMINALS = Path('/dev/pts')  # behind which a simulated robot is
ANSWER_TIME = 0.15  # [s] a robot takes a few milliseconds
ATTEMPTS = 2


class Value(NamedTuple):
    """Values that can be read in either protocol."""

    code: Code  # of protocol v2
    register: Register  # of protocol v1
    size: int  # of the answer [B]


AUTO = 'auto'
PROTOCOL_CHOICES: Mapping[str, tuple[Protocol, ...]] = {
    AUTO: PROTOCOLS,
    **{protocol.name: (protocol,) for protocol in PROTOCOLS},
}
MODEL_CHOICES: Mapping[str, Model | None] = {AUTO: None} | {model.value: model for model in Model}
"""What people call protocols, and models whose ranges scale protocol v1."""

FIRMWARE = Value(Code.VERSION, Register.FIRMWARE, 10)
BATTERY = Value(Code.BATTERY, Register.BATTERY, 1)


@dataclass(frozen=True, slots=True)
class LinkOptions:
    """Location of the robot, and the protocol options."""

    path: str  # device file
    protocols: tuple[Protocol, ...] = PROTOCOLS  # what to try, in this order
    baud: int = setting(0, 0, 4_000_000, 'speed [bit/s]; 0: that of the protocol')
    model: Model | None = None  # whose ranges scale bytes in protocol v1; None asks the firmware
    preset: str = ''  # that the URDF is of; a firmware of another one is refused
    rate: int = setting(50, 10, 100, 'reports a second [Hz]')
    vendor: bool = False  # go through the vendor's own library, and try nothing else
    vendor_method: str = ''  # name of its method that writes a servo angle


@dataclass(frozen=True, slots=True)
class Session:
    """An open connection to a robot, with its parser and dialect."""

    port: SerialPort  # the open port, owned by the holder of the session
    firmware: str  # version of the robot
    parser: StreamParser | VendorParser  # finds frames in its bytes
    dialect: Dialect  # how to talk to it
    model: Model | None = None  # whose ranges scale bytes in protocol v1; None in others


def open_session(options: LinkOptions) -> Session:
    """Find the robot: with the vendor's library if requested, else by probing.

    Raises:
        LinkError: No robot was found, or not a walking one; the message lists the attempts.
    """
    now = time.monotonic()
    if options.vendor:
        vendor = VendorPort(options.path)
        try:
            firmware = vendor.read_version()
            dialect = VendorDialect(vendor.dog, now, options.vendor_method)
            return Session(vendor, firmware, VendorParser(), dialect)
        except LinkError:
            vendor.close()
            raise
    connection = connect(options.path, options.protocols, options.baud)
    port, protocol, firmware = connection.port, connection.protocol, connection.firmware
    try:
        model = _model(firmware, protocol, options)
    except LinkError:
        port.close()
        raise
    parser = StreamParser(protocol, ROBOT_KINDS)
    return Session(port, firmware, parser, make_dialect(protocol, model, now, options.rate), model)


def make_dialect(protocol: Protocol, model: Model | None, now: float, rate: int = 50) -> Dialect:
    """Return the dialect for a protocol; except in v2, the model sets the ranges; rate in [Hz]."""
    if model is None:
        return V2Dialect(now, rate)
    return DeveloperDialect(now, model) if protocol is DEVELOPER else V1Dialect(now, model, rate)


def _model(firmware: str, protocol: Protocol, options: LinkOptions) -> Model | None:
    """Return the model whose ranges scale bytes; None in protocol v2."""
    known, preset = model_of_firmware(firmware), options.preset
    asked = options.model is None and known is not None and {known.value, preset} <= {*PRESETS}
    if asked and known and known.value != preset:
        raise LinkError(
            f'firmware {firmware!r} on {options.path} is of a {known.value}, and preset {preset} '
            f'has the limits of another robot: start with preset {known.value}, or keep it by '
            'the parameter or option model'
        )
    if protocol is V2:
        return None
    model = options.model or known
    if model is None:
        raise LinkError(
            f'firmware {firmware!r} is of no known quadruped (M mini, L lite, W or MW '
            'wheeled); name its ranges with the parameter or option model'
        )
    return model


@dataclass(frozen=True, slots=True)
class Connection:
    """A robot that answered."""

    port: SerialPort  # the open port, owned by the holder of the connection
    protocol: Protocol  # what the robot speaks
    firmware: str  # its version


def connect(path: str, protocols: Iterable[Protocol] = PROTOCOLS, baud: int = 0) -> Connection:
    """Open a port and request the firmware version, protocol by protocol.

    Args:
        protocols: Protocols to try, in this order.
        baud: Speed [bit/s]; 0 selects each protocol's own.

    Returns:
        The first connection with an answer.

    Raises:
        LinkError: The port cannot be opened or was lost.
        NoAnswerError: No robot answers; the message lists the attempts.
    """
    tried = []
    for protocol in protocols:
        speed = baud or protocol.baud
        tried.append(f'protocol {protocol.name} at {speed} baud')
        port = SerialPort(path, speed)
        try:
            answer = read_value(port, protocol, FIRMWARE)
        except LinkError:
            port.close()
            raise
        if answer is not None:
            return Connection(port, protocol, answer.rstrip(b'\0').decode('ascii', 'replace'))
        port.close()
    raise NoAnswerError(f'no robot answers on {path} ({", ".join(tried)}); {silence_cause(path)}')


def is_pseudo_terminal(path: str) -> bool:
    """Return whether a device file, or a link to one, belongs to a simulated robot."""
    return Path(path).resolve().is_relative_to(PSEUDO_TERMINALS)


def silence_cause(path: str) -> str:
    """Return what to check if nothing answers on a port."""
    if is_pseudo_terminal(path):
        return (
            'it is a pseudo-terminal: does the simulated robot behind it still start, and is this '
            'machine too busy?'
        )
    return 'is it switched on, and is this its port?'


def read_value(
    port: SerialPort,
    protocol: Protocol,
    value: Value,
    timeout: float = ANSWER_TIME,
    attempts: int = ATTEMPTS,
) -> bytes | None:
    """Read a value of a robot; return its bytes, None without an answer.

    Raises:
        LinkError: The port was lost.
    """
    request, size = Frame(Kind.READ, value.register, bytes((value.size,))), value.size
    if protocol is V2:
        request = Frame(Kind.READ, value.code)
    if protocol is DEVELOPER:  # it cannot be asked, and its next push has the charge
        request, size = Frame(Kind.WRITE, PUSHED.address), PUSHED.length
    answers = (_ask(port, protocol, request, size, timeout) for _ in range(attempts))
    answer = next((answer for answer in answers if answer is not None), None)
    if answer is not None and protocol is DEVELOPER:
        return DEVELOPER_FIRMWARE.encode() if value is FIRMWARE else answer[-value.size :]
    return answer


def _ask(
    port: SerialPort, protocol: Protocol, request: Frame, size: int, timeout: float
) -> bytes | None:
    """Return the payload of an answer within a time [s]; ignore payloads of other sizes [B]."""
    parser, wanted = StreamParser(protocol, ROBOT_KINDS), request.kind
    if wanted is Kind.READ:  # what is pushed comes unasked
        wanted = Kind.REPLY
        port.write(request.encode(protocol))
    deadline = time.monotonic() + timeout
    while (left := deadline - time.monotonic()) > 0:
        readable, _, _ = select.select([port], [], [], left)
        frames = parser.feed(port.read()) if readable else parser.expire()
        for frame in frames:
            if (
                frame.kind is wanted
                and frame.address == request.address
                and len(frame.payload) == size
            ):
                return frame.payload
    return None
