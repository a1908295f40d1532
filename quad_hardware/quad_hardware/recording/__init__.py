# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What went over a serial line: kept in memory, written as a log, read again."""

from .fault_watch import FaultWatch, LossWatch
from .serial_log import (
    Entry,
    Opened,
    read_serial_log,
    SerialLogFile,
    SerialMemory,
    StateEntered,
    Transfer,
)

__all__ = [
    'Entry',
    'FaultWatch',
    'LossWatch',
    'Opened',
    'SerialLogFile',
    'SerialMemory',
    'StateEntered',
    'Transfer',
    'read_serial_log',
]
