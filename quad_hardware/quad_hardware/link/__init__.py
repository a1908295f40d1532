# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The serial line: port, probing, conversation and the thread that keeps it going."""

from .dialect import Dialect, DialectCounters, LinkState, LinkStatus
from .driver import Driver, QUIET_TIME, STALE_TIME
from .port import DEFAULT_PORT, latency_problem, latency_timer, Port, SerialPort
from .probe import connect, Connection, read_battery, read_firmware, send_request
from .session import FrameParser, LinkOptions, make_dialect, Session

__all__ = [
    'DEFAULT_PORT',
    'QUIET_TIME',
    'STALE_TIME',
    'Connection',
    'Dialect',
    'DialectCounters',
    'Driver',
    'FrameParser',
    'LinkOptions',
    'LinkState',
    'LinkStatus',
    'Port',
    'SerialPort',
    'Session',
    'connect',
    'latency_problem',
    'latency_timer',
    'make_dialect',
    'read_battery',
    'read_firmware',
    'send_request',
]
