# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The serial line: port, probing, conversation and the thread that keeps it going."""

from .dialect import DialectCounters
from .driver import Driver, STALE_TIME
from .latency import latency_problem, latency_timer
from .port import DEFAULT_PORT, Port, SerialPort
from .probe import connect, Connection, read_battery, read_firmware, send_request
from .session import LinkOptions, Session
from .status import LinkState, LinkStatus

__all__ = [
    'DEFAULT_PORT',
    'STALE_TIME',
    'Connection',
    'DialectCounters',
    'Driver',
    'LinkOptions',
    'LinkState',
    'LinkStatus',
    'Port',
    'SerialPort',
    'Session',
    'connect',
    'latency_problem',
    'latency_timer',
    'read_battery',
    'read_firmware',
    'send_request',
]
