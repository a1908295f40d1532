# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The network: boot-up, NMT, SDO queues, SYNC cycle, process image.

Times are on the steady clock in [s]. The names exported here serve programs that talk to devices
without running a network.
"""

from .other_master import MasterFrames
from .scheduler import Promise, Scheduler
from .sdo_client import SdoClient

__all__ = ['MasterFrames', 'Promise', 'Scheduler', 'SdoClient']
