# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Layer setting services in words (CiA 305, 4.3)."""

from __future__ import annotations

LSS_MASTER = 0x7E5  # COB-ID of requests
LSS_SLAVE = 0x7E4  # COB-ID of answers

COMMANDS: dict[int, str] = {
    0x04: 'switch state global',
    0x11: 'configure node id',
    0x13: 'configure bit timing',
    0x15: 'activate bit timing',
    0x17: 'store configuration',
    0x40: 'switch state selective: vendor id',
    0x41: 'switch state selective: product code',
    0x42: 'switch state selective: revision number',
    0x43: 'switch state selective: serial number',
    0x44: 'switch state selective: done',
    0x46: 'identify remote slave: vendor id',
    0x47: 'identify remote slave: product code',
    0x48: 'identify remote slave: lowest revision number',
    0x49: 'identify remote slave: highest revision number',
    0x4A: 'identify remote slave: lowest serial number',
    0x4B: 'identify remote slave: highest serial number',
    0x4C: 'identify non-configured remote slave',
    0x4F: 'identify slave',
    0x50: 'identify non-configured slave',
    0x51: 'fastscan',
    0x5A: 'inquire vendor id',
    0x5B: 'inquire product code',
    0x5C: 'inquire revision number',
    0x5D: 'inquire serial number',
    0x5E: 'inquire node id',
}
"""Command specifier and service (CiA 305, 4.3.3)."""


def lss_text(data: bytes) -> str:
    """Say an LSS message in words; its parameters stay bytes."""
    if not data:
        return 'empty message'
    return COMMANDS.get(data[0], f'unknown command 0x{data[0]:02X}')
