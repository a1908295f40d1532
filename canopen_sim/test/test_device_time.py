# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""TIME messages and the synchronous window of a simulated device."""

from __future__ import annotations

from datetime import datetime, timedelta, timezone
import struct

from device_rig import drive_dictionary, NODE_ID, Rig
import pytest

from canopen_core.standard import (
    AbortCode,
    DataType,
    NmtCommand,
    ObjectDictionary,
    ObjectEntry,
)

NOON = datetime(2026, 11, 21, 12, 0, 0, 500_000, tzinfo=timezone.utc)


@pytest.fixture
def rig() -> Rig:
    """A drive that takes TIME, and has a synchronous window object."""
    entries = [entry for entry in drive_dictionary() if entry.index not in (0x1007, 0x1012)]
    rig = Rig(
        ObjectDictionary(
            [
                *entries,
                ObjectEntry(0x1007, 0, 'Window', DataType.UNSIGNED32, default=0),
                ObjectEntry(0x1012, 0, 'TIME', DataType.UNSIGNED32, default=0x8000_0100),
            ]
        )
    )
    rig.take()
    return rig


def time_message(time: datetime) -> bytes:
    """Return a TIME message (CiA 301: milliseconds of the day, days since 1984)."""
    elapsed = time - datetime(1984, 1, 1, tzinfo=timezone.utc)
    milliseconds = (elapsed - timedelta(days=elapsed.days)) // timedelta(milliseconds=1)
    return struct.pack('<IH', milliseconds, elapsed.days)


def test_time_goes_on_from_the_message(rig: Rig) -> None:
    """The device knows the time from the first message on, and forgets it with a reset."""
    clock = rig.device.clock
    rig.send(0x100, bytes(5))
    rig.send(0x101, time_message(NOON))
    assert clock.at(rig.now) is None  # of another length, and of another identifier
    rig.send(0x100, time_message(NOON))
    rig.run(2.5)
    time = clock.at(rig.now)
    assert time is not None
    assert abs(time - NOON - timedelta(seconds=2.5)) < timedelta(milliseconds=1)
    rig.nmt(NmtCommand.RESET_NODE)
    assert rig.refused(0x1012, 0x8000_0181) == AbortCode.VALUE_RANGE  # changed while in use
    rig.put(0x1012, 0x0000_0100)
    rig.send(0x100, time_message(NOON))
    assert clock.at(rig.now) is None
    rig.put(0x1012, 0x8000_0181)
    rig.send(0x181, time_message(NOON))
    assert clock.at(rig.now) == NOON


def test_synchronous_window(rig: Rig) -> None:
    """A synchronous RPDO that comes after the window is discarded; without one it counts."""
    rig.put(0x1007, 2000)  # [us]
    rig.put(0x1400, 1, 2)
    rig.nmt(NmtCommand.START)
    rig.sync()
    rig.run(0.001)
    rig.send(0x200 + NODE_ID, b'\x06\x00')
    rig.sync()
    assert rig.get(0x6040) == 6
    rig.run(0.003)
    rig.send(0x200 + NODE_ID, b'\x00\x00')
    rig.sync()
    assert rig.get(0x6040) == 6
    rig.put(0x1007, 0)
    rig.run(0.003)
    rig.send(0x200 + NODE_ID, b'\x00\x00')
    rig.sync()
    assert rig.get(0x6040) == 0
