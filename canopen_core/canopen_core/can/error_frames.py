# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The error frames of a CAN controller (linux/can/error.h)."""

from __future__ import annotations

from enum import Enum

from .frame import Frame

ERROR_CLASSES: tuple[tuple[int, str], ...] = (
    (0x001, 'transmit timeout'),
    (0x002, 'arbitration lost'),
    (0x004, 'controller problem'),
    (0x008, 'protocol violation'),
    (0x010, 'transceiver problem'),
    (0x020, 'no acknowledge'),
    (0x040, 'bus off'),
    (0x080, 'bus error'),
    (0x100, 'controller restarted'),
)
"""Bit of the identifier and its meaning."""

CONTROLLER_PROBLEMS: tuple[tuple[int, str], ...] = (
    (0x01, 'receive buffer overflow'),
    (0x02, 'transmit buffer overflow'),
    (0x04, 'receive errors at warning level'),
    (0x08, 'transmit errors at warning level'),
    (0x10, 'receive error passive'),
    (0x20, 'transmit error passive'),
    (0x40, 'error active again'),
)
"""Bit of data[1] and its meaning, for a controller problem."""

PROTOCOL_VIOLATIONS: tuple[tuple[int, str], ...] = (
    (0x01, 'single bit'),
    (0x02, 'frame format'),
    (0x04, 'bit stuffing'),
    (0x08, 'dominant bit not sent'),
    (0x10, 'recessive bit not sent'),
    (0x20, 'bus overload'),
    (0x40, 'active error announcement'),
    (0x80, 'on transmission'),
)
"""Bit of data[2] and its meaning, for a protocol violation."""

_CONTROLLER = 0x004
_PROTOCOL = 0x008
_NO_ACKNOWLEDGE = 0x020
_BUS_OFF = 0x040
_RESTARTED = 0x100
_COUNTERS = 0x200  # data[6] and data[7] are the transmit and receive error counters
_WARNING_LEVEL, _PASSIVE, _ACTIVE_AGAIN = 0x0C, 0x30, 0x40  # of CONTROLLER_PROBLEMS


class ControllerState(Enum):
    """Error state of a CAN controller (ISO 11898-1, fault confinement); the value is in words."""

    ACTIVE = 'error active'
    WARNING = 'error warning'
    PASSIVE = 'error passive'
    BUS_OFF = 'bus off'


def controller_state(frame: Frame) -> ControllerState | None:
    """Return the state that an error frame reports, None when it reports none."""
    if frame.can_id & _BUS_OFF:
        return ControllerState.BUS_OFF
    if frame.can_id & _RESTARTED:
        return ControllerState.ACTIVE
    problem = frame.data[1] if frame.can_id & _CONTROLLER and len(frame.data) > 1 else 0
    if problem & _PASSIVE:
        return ControllerState.PASSIVE
    if problem & _WARNING_LEVEL:
        return ControllerState.WARNING
    return ControllerState.ACTIVE if problem & _ACTIVE_AGAIN else None


def error_counters(frame: Frame) -> tuple[int, int] | None:
    """Return the transmit and the receive error counter, None when the frame has none."""
    if not frame.can_id & _COUNTERS or len(frame.data) < 8:
        return None
    return frame.data[6], frame.data[7]


def is_unacknowledged(frame: Frame) -> bool:
    """Whether an error frame reports that no other station has acknowledged a frame."""
    return bool(frame.can_id & _NO_ACKNOWLEDGE)


def error_text(frame: Frame) -> str:
    """Describe an error frame, e.g. ``controller problem (transmit error passive)``."""
    data = frame.data.ljust(8, b'\0')
    parts = []
    for bit, text in ERROR_CLASSES:
        if not frame.can_id & bit:
            continue
        details = _details(bit, data)
        parts.append(f'{text} ({details})' if details else text)
    if frame.can_id & _COUNTERS:
        parts.append(f'{data[6]} transmit and {data[7]} receive errors counted')
    return ', '.join(parts) or f'error class 0x{frame.can_id:X}'


def _details(error_class: int, data: bytes) -> str:
    if error_class == _CONTROLLER:
        return _named(CONTROLLER_PROBLEMS, data[1])
    if error_class == _PROTOCOL:
        return _named(PROTOCOL_VIOLATIONS, data[2])
    return ''


def _named(table: tuple[tuple[int, str], ...], bits: int) -> str:
    return ', '.join(text for bit, text in table if bits & bit)
