# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Simulated devices whose computer stood still."""

from __future__ import annotations

from functools import partial
import math
import threading
import time

from can_addresses import free_virtual
from device_rig import drive_dictionary, NODE_ID, with_defaults
import pytest

from canopen_core.can import Frame, open_bus
from canopen_core.standard import CobId, nmt_frame, NmtCommand, tpdo_default
from canopen_sim import DeviceRunner, runner
from canopen_sim.runner import newest_process_data

TIMEOUT = 10.0  # [s]
MASTER_ID = 1
WATCHED = 0.3  # [s]
EMERGENCY = CobId.EMCY + NODE_ID


def test_of_process_data_the_newest_is_kept_and_of_services_all() -> None:
    """In the order of arrival."""
    sync, old, new = Frame(0x080), Frame(0x205, b'\1'), Frame(0x205, b'\2')
    start, read, other = Frame(0x000, b'\1\5'), Frame(0x605, bytes(8)), Frame(0x7E5, bytes(8))
    batch = [sync, old, start, read, Frame(0x705, b'\5'), other]
    batch += [Frame(0x080), new, read, other, start]
    assert newest_process_data(batch) == [
        *(start, read, Frame(0x705, b'\5'), other),
        *(Frame(0x080), new, read, other, start),
    ]


def test_a_device_that_stood_still_does_not_live_through_what_it_missed(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """It answers one SYNC and not all of the past, and its log says how many it passed over."""
    monkeypatch.setattr(runner, 'STALL', 0.0)
    name = free_virtual()
    with open_bus(name) as bus, open_bus(name) as master:
        devices = DeviceRunner(bus)
        dictionary = with_defaults(drive_dictionary(), {(0x1800, 2): 1})  # on each SYNC
        devices.host.add(NODE_ID, dictionary)
        devices.start()
        gate = threading.Event()
        try:
            devices.call(lambda: None).result(TIMEOUT)
            devices.call(lambda: gate.wait(TIMEOUT))
            master.send(Frame(CobId.NMT, nmt_frame(NmtCommand.START, NODE_ID)))
            for _ in range(20):
                master.send(Frame(CobId.SYNC))
            gate.set()
            devices.call(lambda: None).result(TIMEOUT)
            devices.call(lambda: None).result(TIMEOUT)
        finally:
            gate.set()
            devices.stop()
        answers = [f for f in master.receive(0.0) if f.can_id == tpdo_default(1, NODE_ID)]
    assert len(answers) == 1
    assert any(isinstance(record.args, tuple) and 19 in record.args for record in caplog.records)


@pytest.mark.parametrize(
    ('stalls', 'heartbeat'),
    [
        ([WATCHED + 0.2], math.inf),
        ([WATCHED + 0.2], 0.05),
        ([WATCHED + 0.15] * 3, math.inf),
    ],
    ids=['longer', 'with a heartbeat', 'several'],
)
def test_a_device_that_stood_still_reports_no_silence(
    stalls: list[float], heartbeat: float
) -> None:
    """It received nothing meanwhile; a master that is silent while it runs is noticed in time."""
    name = free_virtual()
    with open_bus(name) as bus, open_bus(name) as master:
        devices = DeviceRunner(bus)
        watch = {(0x1016, 1): MASTER_ID << 16 | round(WATCHED * 1000)}
        devices.host.add(NODE_ID, with_defaults(drive_dictionary(), watch))
        devices.start()

        def stand_still(seconds: float) -> None:
            rest = max(0.0, seconds - heartbeat)
            threading.Event().wait(seconds - rest)
            if rest:
                master.send(Frame(CobId.HEARTBEAT + MASTER_ID, b'\5'))
            threading.Event().wait(rest)

        try:
            devices.call(lambda: None).result(TIMEOUT)
            master.send(Frame(CobId.HEARTBEAT + MASTER_ID, b'\5'))
            devices.call(lambda: None).result(TIMEOUT)
            begun = time.monotonic()
            for stall in stalls:
                devices.call(partial(stand_still, stall)).result(TIMEOUT)
                devices.call(lambda: None).result(TIMEOUT)
            while not (lost := [f for f in master.receive(TIMEOUT) if f.can_id == EMERGENCY]):
                assert time.monotonic() - begun < TIMEOUT
            running = lost[0].timestamp - begun - sum(stalls)
            assert WATCHED * 0.9 < running < TIMEOUT / 2.0
        finally:
            devices.stop()
