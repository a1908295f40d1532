# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Why a device did not boot, by the letters of CiA 302-2 (7.4, process boot NMT slave)."""

from __future__ import annotations

from enum import Enum


class BootFault(Enum):
    """A reason; the value is its letter."""

    NO_ANSWER = 'B'
    DEVICE_TYPE = 'C'
    VENDOR = 'D'
    NO_GUARDING = 'F'
    CONFIGURATION = 'J'
    NO_HEARTBEAT = 'K'
    RUNNING = 'L'
    PRODUCT = 'M'
    REVISION = 'N'
    SERIAL = 'O'

    @property
    def text(self) -> str:
        """The reason in words."""
        return BOOT_FAULT_TEXTS[self]

    def __str__(self) -> str:
        """Return the letter with where it is from, as manuals of masters list it."""
        return f'CiA 302-2 boot error {self.value}: {self.text}'


BOOT_FAULT_TEXTS: dict[BootFault, str] = {
    BootFault.NO_ANSWER: 'no answer to the read of 0x1000',
    BootFault.DEVICE_TYPE: 'device type 0x1000 differs',
    BootFault.VENDOR: 'vendor id 0x1018:01 differs',
    BootFault.NO_GUARDING: 'no answer to node guarding',
    BootFault.CONFIGURATION: 'configuration failed',
    BootFault.NO_HEARTBEAT: 'no heartbeat',
    BootFault.RUNNING: 'was operational already',
    BootFault.PRODUCT: 'product code 0x1018:02 differs',
    BootFault.REVISION: 'revision number 0x1018:03 differs',
    BootFault.SERIAL: 'serial number 0x1018:04 differs',
}
