# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""How much a master leaves in the transmit queue of a bus that takes no frames."""

from __future__ import annotations

import socket

from drive_samples import bus_config, drive_config
import pytest

from arm_canopen import BusError, CanopenMaster, open_bus
from canopen_core.can import Bus, Frame


def send_for_ever(bus: Bus) -> None:
    """Send until the bus refuses."""
    while True:
        bus.send(Frame(1))


def test_two_cycles_of_a_master_wait_for_a_bus_that_takes_none(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Nobody wants the set-points of half a second ago when the cable is plugged in again."""
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    ours.setblocking(False)
    monkeypatch.setattr('canopen_core.can.socketcan._open_socket', lambda name: ours)
    config = bus_config(*(drive_config(f'joint{number}', number) for number in range(2, 9)))
    with theirs, open_bus('can0') as bus:
        CanopenMaster(config, bus)
        with pytest.raises(BusError, match='transmit queue of can0 is full'):
            send_for_ever(bus)
        cycle = 1 + 7 * 3  # SYNC and RPDOs
        assert 2 * cycle <= bus.counters.sent <= 4 * cycle
