# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The serial link: port, detection, conversation and its thread."""

from .dialect import Dialect, LinkState, LinkStatus
from .driver import Driver, QUIET_TIME, STALE_TIME
from .open import (
    AUTO,
    BATTERY,
    connect,
    FIRMWARE,
    LinkOptions,
    make_dialect,
    MODEL_CHOICES,
    PROTOCOL_CHOICES,
    read_value,
    Session,
    Value,
)
from .port import DEFAULT_PORT, latency_problem, latency_timer, SerialPort

__all__ = [
    'AUTO',
    'BATTERY',
    'DEFAULT_PORT',
    'FIRMWARE',
    'MODEL_CHOICES',
    'PROTOCOL_CHOICES',
    'QUIET_TIME',
    'STALE_TIME',
    'Dialect',
    'Driver',
    'LinkOptions',
    'LinkState',
    'LinkStatus',
    'SerialPort',
    'Session',
    'Value',
    'connect',
    'latency_problem',
    'latency_timer',
    'make_dialect',
    'read_value',
]
