# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Layer setting services of simulated devices, byte by byte and with python-canopen's master."""

from __future__ import annotations

import struct
from typing import Any

import can
import canopen
from device_rig import drive_dictionary, NODE_ID, Rig, with_defaults
import pytest

from canopen_core.can import Frame
from canopen_core.standard import NmtCommand, NmtState
from canopen_sim import DeviceHost, Fault

REQUEST, RESPONSE = 0x7E5, 0x7E4
IDENTITY = (0x555, 0x1234, 0x10002, 0xCAFE)
DICTIONARY = with_defaults(
    drive_dictionary(), {(0x1018, part + 1): value for part, value in enumerate(IDENTITY)}
)


def make_rig(node_id: int = 255) -> Rig:
    """Return a device with a known identity; without a node id by default."""
    return Rig(DICTIONARY, node_id=node_id)


def query(rig: Rig, command: int, *data: int, word: int | None = None) -> bytes | None:
    """Send a request; return the answer, None without one."""
    payload = bytes(data) if word is None else struct.pack('<I', word)
    rig.take()
    rig.send(REQUEST, (bytes((command,)) + payload).ljust(8, b'\0'))
    answers = rig.take(RESPONSE)
    assert len(answers) <= 1
    return answers[0] if answers else None


def select(rig: Rig, identity: tuple[int, ...] = IDENTITY) -> bytes | None:
    """Switch the device with an identity to the configuration state."""
    answers = [query(rig, 0x40 + part, word=number) for part, number in enumerate(identity)]
    assert answers[:3] == [None] * 3
    return answers[3]


def test_unconfigured_device_waits_for_its_id() -> None:
    """No boot-up message, no obedience to NMT; with an id it boots as soon as LSS lets go."""
    rig = make_rig()
    rig.run(5.0)
    assert rig.sent == []
    for command in NmtCommand:
        rig.send(0, bytes((command, 0)))
    assert rig.sent == []
    assert select(rig) == b'\x44' + bytes(7)
    assert query(rig, 0x5E) == b'\x5e\xff' + bytes(6)
    assert query(rig, 0x11, 17) == b'\x11' + bytes(7)
    rig.take()
    rig.send(REQUEST, b'\x04\x00' + bytes(6))
    assert rig.take() == [b'\x00']
    assert rig.device.node_id == 17
    rig.node_id = 17
    assert rig.get(0x1000) == 0x20192
    assert rig.get(0x1800, 1) & 0x7FF == 0x191
    assert rig.get(0x1014) & 0x7FF == 0x091
    assert rig.nmt_state == NmtState.PRE_OPERATIONAL


def test_another_id_from_the_next_reset_on() -> None:
    """A device that has an id keeps it until its communication is reset."""
    rig = make_rig(NODE_ID)
    query(rig, 0x04, 1)
    query(rig, 0x11, 42)
    query(rig, 0x04, 0)
    assert rig.get(0x1000) == 0x20192
    rig.take()
    rig.nmt(NmtCommand.RESET_COMMUNICATION)
    assert [frame for _, frame in rig.sent] == [Frame(0x72A, b'\x00')]
    rig.node_id = 42
    assert rig.get(0x1000) == 0x20192
    rig.put(0x1017, 100)
    rig.take()
    rig.run(1.0)
    assert {frame.can_id for _, frame in rig.sent} == {0x72A}


@pytest.mark.parametrize('stored', [True, False])
def test_id_after_a_power_cut(stored: bool) -> None:
    """Only what was stored lasts."""
    rig = make_rig(NODE_ID)
    query(rig, 0x04, 1)
    query(rig, 0x11, 42)
    if stored:
        assert query(rig, 0x17) == b'\x17' + bytes(7)
    rig.nmt(NmtCommand.RESET_COMMUNICATION)
    rig.inject(Fault.REBOOT)
    rig.take()
    rig.run(0.1)
    assert [frame.can_id for _, frame in rig.sent] == [0x72A if stored else 0x700 + NODE_ID]


def test_only_a_selected_device_is_configured() -> None:
    """A waiting one answers nothing; node ids and bit rates out of range are error code 1."""
    rig = make_rig()
    assert select(rig, (0x555, 0x1234, 0x10002, 0xBABE)) is None
    for command in (0x11, 0x13, 0x17, 0x5A, 0x5E):
        assert query(rig, command, 3) is None
    for size in range(8):  # an LSS message has 8 bytes
        rig.send(REQUEST, b'\x4c\0\0\0\0\0\0\0'[:size])
    assert rig.take() == []
    query(rig, 0x04, 1)
    inquiries = [query(rig, command) for command in (0x5A, 0x5B, 0x5C, 0x5D)]
    assert inquiries == [
        struct.pack('<BI3x', 0x5A + part, number) for part, number in enumerate(IDENTITY)
    ]
    for node_id in (0, 128, 254):
        assert query(rig, 0x11, node_id) == b'\x11\x01' + bytes(6)
    for table, rate, error in ((0, 0, 0), (0, 8, 0), (0, 5, 0), (0, 9, 1), (1, 0, 1)):
        assert query(rig, 0x13, table, rate) == bytes((0x13, error)) + bytes(6)


@pytest.mark.parametrize(
    ('changed', 'found'), [({}, True), ({1: 1}, False), ({3: 0x10000}, False), ({4: 1}, False)]
)
def test_identify(changed: dict[int, int], found: bool) -> None:
    """A device answers when vendor and product are its own and revision and serial in range."""
    rig = make_rig(NODE_ID)
    numbers = [0x555, 0x1234, 0x10000, 0x10002, 0xCAFE, 0xCAFE]
    for position, value in changed.items():
        numbers[position] = value
    if 4 in changed:
        numbers[4], numbers[5] = 0xCAFF, 0xFFFF
    answers = [query(rig, 0x46 + part, word=number) for part, number in enumerate(numbers)]
    assert answers[:5] == [None] * 5
    assert (answers[5] is not None) is found
    assert query(rig, 0x4C) is None
    assert query(make_rig(), 0x4C) == b'\x50' + bytes(7)


class Wire:
    """python-canopen's side of a bus with simulated devices in virtual time."""

    def __init__(self, host: DeviceHost, sent: list[Frame]) -> None:
        """Send to a host; what it sends is collected in ``sent``."""
        make_network: Any = canopen.Network  # python-canopen has no types
        self.network = make_network()
        self.network.bus = self
        self.network.subscribe(RESPONSE, self.network.lss.on_message_received)
        self.network.lss.RESPONSE_TIMEOUT = 0.001
        self._host, self._sent = host, sent

    def send(self, message: can.Message, timeout: float | None = None) -> None:
        """Deliver a frame of python-canopen, and its answers."""
        del timeout
        self._host.receive(Frame(message.arbitration_id, bytes(message.data)), 1.0)
        while self._sent:
            frame = self._sent.pop(0)
            self.network.notify(frame.can_id, bytearray(frame.data), 1.0)


def test_python_canopen_finds_and_numbers_devices() -> None:
    """Fast scan finds one unconfigured device after the other; each gets an id and boots."""
    sent: list[Frame] = []
    host = DeviceHost(sent.append)
    serials = [0xCAFE, 0xCAFF, 0x12345678]
    for serial in serials:
        host.add(255, with_defaults(DICTIONARY, {(0x1018, 4): serial}))
    host.advance(1.0)
    assert sent == []
    wire = Wire(host, sent)
    lss = wire.network.lss
    found = []
    for node_id in range(10, 10 + len(serials)):
        success, identity = lss.fast_scan()
        assert success
        found.append(tuple(identity))
        assert lss.inquire_node_id() == 255
        lss.configure_node_id(node_id)
        lss.store_configuration()
        lss.send_switch_state_global(lss.WAITING_STATE)
    assert sorted(found) == [(*IDENTITY[:3], serial) for serial in sorted(serials)]
    assert sorted(device.node_id for device in host.devices) == [10, 11, 12]
    assert {device.nmt_state for device in host.devices} == {NmtState.PRE_OPERATIONAL}
    assert not lss.fast_scan()[0]
    assert lss.send_switch_state_selective(*IDENTITY[:3], 0x12345678)
    assert lss.inquire_lss_address(0x5D) == 0x12345678
