# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Typed model of a bus in SI units, used by the master, the configuration checks and the boot.

It consists of plain values and imports nothing that reads files.
"""

from canopen_core import Place

from .bus import BusConfig, Identity, MasterConfig, NodeConfig, PdoConfig, SdoWrite
from .drive import DriveConfig, RecoveryPolicy

__all__ = [
    'BusConfig',
    'DriveConfig',
    'Identity',
    'MasterConfig',
    'NodeConfig',
    'PdoConfig',
    'Place',
    'RecoveryPolicy',
    'SdoWrite',
]
