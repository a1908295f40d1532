# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A master looks for another one before it sends anything."""

from __future__ import annotations

from collections import Counter
from time import monotonic

from bus_rig import VirtualNetwork
from drive_samples import bus_config, drive_config
import pytest

from arm_canopen import OtherMasterError, Severity
from arm_canopen.can import Frame, VirtualBus, VirtualWire
from arm_canopen.master.other_master import (
    describe,
    listen,
    LISTENING_TIME,
    MasterFrames,
    refuse_other_master,
)

pytestmark = pytest.mark.slow

BUS = bus_config(drive_config('a', 2), drive_config('b', 3))


class SharedBus(VirtualBus):
    """A bus on which somebody else sends a frame again and again, whenever it is read."""

    def __init__(self, frame: Frame) -> None:
        """Connect both."""
        wire = VirtualWire()
        super().__init__('here', wire)
        self._other = VirtualBus('there', wire)
        self._frame = frame

    def receive(self, timeout: float) -> list[Frame]:
        """Receive what the other one sends now."""
        self._other.send(self._frame)
        return super().receive(timeout)


@pytest.mark.parametrize(
    ('frame', 'words'),
    [
        (Frame(0x080), 'SYNC (0x080)'),
        (Frame(0x701, b'\x05'), 'the heartbeat 0x701 of node id 1'),
        (Frame(0x203, bytes(3)), 'RPDO 1 (0x203) of b'),
        (Frame(0x000, b'\x82\x00'), 'the NMT command RESET_COMMUNICATION to all nodes'),
        (Frame(0x000, b'\x01\x02'), 'the NMT command START to node 2'),
    ],
    ids=['sync', 'heartbeat', 'rpdo', 'nmt_all', 'nmt_one'],
)
def test_a_master_that_runs_is_refused_by_name(frame: Frame, words: str) -> None:
    """The refusal names frame, sender and remedies, and nothing was sent."""
    with SharedBus(frame) as bus:
        with pytest.raises(OtherMasterError, match='another master is on here') as refusal:
            refuse_other_master(bus, BUS, monotonic)
        assert bus.counters.sent == 0
    assert words in str(refusal.value)
    assert 'beside_master:=true' in str(refusal.value)


@pytest.mark.parametrize(
    'frame',
    [
        Frame(0x702, b'\x05'),
        Frame(0x701, is_remote=True),
        Frame(0x182, bytes(3)),
        Frame(0x602, bytes(8)),
        Frame(0x7E5, bytes(8)),
        Frame(0x080, is_extended=True),
    ],
    ids=['device', 'guarding', 'tpdo', 'sdo', 'lss', 'extended'],
)
def test_devices_and_tools_are_no_master(frame: Frame) -> None:
    """What a device or a tool that only reads may send does not hold up the start."""
    with SharedBus(frame) as bus:
        refuse_other_master(bus, BUS, monotonic)
        assert bus.counters.received > 0


def test_the_last_words_of_a_master_that_ended_do_not_count() -> None:
    """What waited in the interface before the listening began is ignored."""
    wire = VirtualWire()
    with VirtualBus('here', wire) as bus, VirtualBus('there', wire) as ended:
        for _ in range(20):
            ended.send(Frame(0x080))
        assert not listen(bus, BUS, monotonic)


def test_a_sync_of_somebody_else_is_no_sign_where_the_master_sends_none() -> None:
    """With sync_period 0 a device may be the SYNC producer."""
    silent = bus_config(drive_config('a', 2), sync_period=0.0)
    assert MasterFrames(silent).read(Frame(0x080)) is None
    assert MasterFrames(BUS).read(Frame(0x080))


def test_the_virtual_master_shows_itself_within_the_listening_time() -> None:
    """Whatever moment one looks at a running master, it is detected."""
    net = VirtualNetwork(BUS)
    net.boot()
    net.run(1.0)
    signs = MasterFrames(BUS)
    for number in range(20):
        begin = net.now + number * 0.0013
        net.run(LISTENING_TIME + 0.03)
        frames = [
            sent.frame
            for sent in net.wire.log
            if sent.sender == 'master' and begin <= sent.time < begin + LISTENING_TIME
        ]
        assert any(signs.read(frame) for frame in frames)
        assert not any(signs.read(sent.frame) for sent in net.wire.log if sent.sender != 'master')


def test_beside_another_master_no_command_is_for_all() -> None:
    """Its devices are not in bus.yml, so each of ours is addressed by its id."""
    config = bus_config(drive_config('a', 2), drive_config('b', 3))
    net = VirtualNetwork(config, beside_master=True)
    net.boot()
    assert net.frames(0x000)[:2] == [b'\x82\x02', b'\x82\x03']
    net.send_as('other', Frame(0x080))
    net.run(0.05)
    assert all(command[1] for command in net.frames(0x000))
    assert not net.reported(Severity.ERROR)
    assert any('another master is on this bus' in text for text in net.reported(Severity.WARNING))


def test_the_clearest_evidence_is_named_first() -> None:
    """Many RPDOs do not hide the SYNC, nor that an NMT command."""
    signs = MasterFrames(BUS)
    frames = [*[Frame(0x202, bytes(3))] * 9, *[Frame(0x080)] * 3, Frame(0x000, b'\x01\x00')]
    found = Counter(sign for frame in frames if (sign := signs.read(frame)) is not None)
    assert describe(found) == (
        'the NMT command START to all nodes 1 times, SYNC (0x080) 3 times, '
        'RPDO 1 (0x202) of a 9 times'
    )
