# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The socketcan bus: the kernel's frame layout, and what goes wrong with interfaces."""

from __future__ import annotations

from collections.abc import Iterator
import errno
import itertools
import logging
import os
import socket
import struct
import subprocess

from can_addresses import receive_count, unstamped
from can_strategies import frames
from hypothesis import given
from hypothesis import strategies as st
import pytest

from canopen_core import BusError
from canopen_core.can import Bus, CanInterface, error_text, Frame, missing_interface_text, open_bus
from canopen_core.can.socketcan import failure_text, pack, SocketCanBus, unpack

_numbers = itertools.count()


@given(frames(), st.floats(0.0, 1e9))
def test_unpack_inverts_pack(frame: Frame, stamp: float) -> None:
    """A frame survives the kernel's layout."""
    assert unpack(pack(frame), stamp) == frame._replace(timestamp=stamp)


def test_the_layout_is_the_kernels() -> None:
    """Identifier with flags, length, three bytes of padding, eight bytes (linux/can.h).

    The controller's notes keep their class bits; sending one is a mistake.
    """
    for frame, packed in (
        (Frame(0x181, b'\x27\x06'), (0x181, 2, b'\x27\x06')),
        (Frame(0x181, is_extended=True), (0x8000_0181, 0, b'')),
        (Frame(0x701, is_remote=True), (0x4000_0701, 0, b'')),
    ):
        assert pack(frame) == struct.pack('=IB3x8s', *packed)
    read = unpack(struct.pack('=IB3x8s', 0x2000_0040, 8, bytes(8)), 1.0)
    assert read == Frame(0x40, bytes(8), 1.0, is_error=True)
    with pytest.raises(ValueError, match='error frame'):
        pack(read)


def test_a_missing_interface_names_what_exists_and_how_to_make_it() -> None:
    """For virtual and real ones; a slip is no fault of the kernel, and no cable is missing."""
    there = {'can_arm': CanInterface('can_arm', True, 1000)}
    for name, words in (
        ('vcan0', 'this host has: can_arm'),
        ('vcan0', 'ip link add dev vcan0 type vcan'),
        ('can0', 'ip link set up can0 type can bitrate'),
    ):
        assert words in missing_interface_text(name, there)
    slips = {'cna0': 'can0', 'vcna0': 'vcan0', 'udp_multicats': 'udp_multicast', 'ato': 'auto'}
    for slip, meant in (slips | {'can_amr': 'can_arm'}).items():
        text = missing_interface_text(slip, there)
        assert f"no bus is called '{slip}' (is '{meant}' meant?)" in text
        assert 'CAN interfaces of this host: can_arm; other buses: udp_multicast' in text
        assert 'plug' not in text
    assert 'this host has: none' in missing_interface_text('can0', {})


def test_failures_of_the_interface_name_the_remedy() -> None:
    """Each error number of the kernel becomes a sentence a person can act on."""
    for code, remedy in (
        (errno.ENETDOWN, 'ip link set up can0'),
        (errno.ENOBUFS, 'txqueuelen 1000'),
        (errno.EAGAIN, 'no device acknowledges'),
        (errno.ENODEV, 'plug the adapter in'),
        (errno.ENXIO, 'reopen the bus'),
        (errno.EPERM, 'not permitted'),
    ):
        text = failure_text('can0', OSError(code, os.strerror(code)))
        assert 'can0' in text
        assert remedy in text


def test_a_kernel_without_can_names_the_multicast_bus(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where AF_CAN is unknown the message says so, and what works instead."""
    real_socket = socket.socket

    def no_can(family: int = -1, *arguments: int) -> socket.socket:
        if family == socket.AF_CAN:
            raise OSError(errno.EAFNOSUPPORT, os.strerror(errno.EAFNOSUPPORT))
        return real_socket(family, *arguments)

    monkeypatch.setattr(socket, 'socket', no_can)
    with pytest.raises(BusError, match=r'no CAN.*modprobe.*udp_multicast'):
        open_bus('can0')
    with pytest.raises(BusError, match=r"no bus is called 'cna0' \(is 'can0' meant"):
        open_bus('cna0')


@pytest.fixture
def kernel(monkeypatch: pytest.MonkeyPatch) -> Iterator[socket.socket]:
    """Give the far end of the socket that can0 opens."""
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    ours.setblocking(False)
    monkeypatch.setattr('canopen_core.can.socketcan._open_socket', lambda name: ours)
    with theirs:
        yield theirs


def test_a_full_transmit_queue_is_reported_and_not_waited_for(kernel: socket.socket) -> None:
    """Refused frames are counted and raise at once; when there is room again sending goes on.

    A read of another length than that of a frame is counted, and does not end the bus.
    """
    with SocketCanBus('can0') as bus:
        with pytest.raises(BusError, match='transmit queue of can0 is full'):
            send_for_ever(bus)
        accepted = bus.counters.sent
        assert bus.counters.send_errors == 1
        for _ in range(accepted):
            assert kernel.recv(16) == pack(Frame(1))
        bus.send(Frame(2))
        assert bus.counters.sent == accepted + 1
        kernel.send(b'short')
        kernel.send(pack(Frame(3, b'\x01')))
        assert unstamped(receive_count(bus, 1)) == [Frame(3, b'\x01')]
        assert bus.counters.malformed == 1


def send_for_ever(bus: Bus) -> None:
    """Send until the bus refuses."""
    while True:
        bus.send(Frame(1))


def receive_for_ever(bus: Bus) -> None:
    """Receive until the bus refuses."""
    while True:
        bus.receive(1.0)


def ip_link(*words: str) -> subprocess.CompletedProcess[str]:
    """Run `ip link`."""
    return subprocess.run(['ip', 'link', *words], capture_output=True, text=True, check=False)


@pytest.fixture
def vcan() -> Iterator[str]:
    """Make a virtual CAN interface of one's own, switched off."""
    name = f'vcan{os.getpid() % 10000}{next(_numbers)}'
    try:
        made = ip_link('add', 'dev', name, 'type', 'vcan')
    except FileNotFoundError:
        pytest.skip('there is no ip command')
    if made.returncode:
        pytest.skip(f'cannot make a vcan interface: {made.stderr.strip()}')
    yield name
    ip_link('del', name)


@pytest.mark.vcan
def test_an_interface_that_is_down_is_refused_with_the_command(vcan: str) -> None:
    """Opening names the command; after it, opening works."""
    with pytest.raises(BusError, match=f'{vcan} is down; `ip link set up {vcan}`'):
        open_bus(vcan)
    ip_link('set', 'up', vcan)
    open_bus(vcan).close()


@pytest.mark.vcan
def test_an_interface_may_go_down_and_come_back(vcan: str) -> None:
    """Both directions say that it is down, and work again when it is up."""
    ip_link('set', 'up', vcan)
    with open_bus(vcan) as bus, open_bus(vcan) as other:
        ip_link('set', 'down', vcan)
        with pytest.raises(BusError, match='is down'):
            bus.send(Frame(1))
        with pytest.raises(BusError, match='is down'):
            other.receive(1.0)
        ip_link('set', 'up', vcan)
        bus.send(Frame(2))
        assert unstamped(receive_count(other, 1)) == [Frame(2)]


@pytest.mark.vcan
def test_an_interface_that_is_taken_away_is_named(vcan: str) -> None:
    """An unplugged adapter is reported by receive and by send."""
    ip_link('set', 'up', vcan)
    with open_bus(vcan) as bus:
        ip_link('del', vcan)
        with pytest.raises(BusError, match=vcan):
            receive_for_ever(bus)
        with pytest.raises(BusError, match=f'{vcan} is gone'):
            bus.send(Frame(1))


@pytest.mark.vcan
def test_an_adapter_that_is_plugged_in_again_is_used_again(vcan: str) -> None:
    """Both directions work on the new interface of the old name, and no loss is made up."""
    ip_link('set', 'up', vcan)
    with open_bus(vcan) as bus:
        ip_link('del', vcan)
        with pytest.raises(BusError, match=vcan):
            receive_for_ever(bus)
        with pytest.raises(BusError, match=vcan):
            bus.receive(0.0)
        ip_link('add', 'dev', vcan, 'type', 'vcan')
        ip_link('set', 'up', vcan)
        bus.receive(0.0)
        with open_bus(vcan) as other:
            other.send(Frame(1))
            assert unstamped(receive_count(bus, 1)) == [Frame(1)]
            bus.send(Frame(2))
            assert unstamped(receive_count(other, 1)) == [Frame(2)]
        assert bus.counters.lost == 0


@pytest.mark.vcan
def test_few_frames_wait_in_the_transmit_queue_of_the_kernel(vcan: str) -> None:
    """A bus that carries next to nothing holds as many as were set, and no hundreds."""
    ip_link('set', vcan, 'up', 'txqueuelen', '1000')
    slow = ['root', 'tbf', 'rate', '8kbit', 'burst', '100', 'limit', '1000000']
    made = subprocess.run(['tc', 'qdisc', 'add', 'dev', vcan, *slow], check=False)
    if made.returncode:
        pytest.skip('no tc, or no tbf in this kernel')
    with open_bus(vcan) as bus:
        bus.limit_queue(60)
        with pytest.raises(BusError, match='transmit queue'):
            send_for_ever(bus)
        assert 60 <= bus.counters.sent <= 90


@pytest.mark.vcan
def test_a_short_transmit_queue_is_warned_of(vcan: str, caplog: pytest.LogCaptureFixture) -> None:
    """A queue shorter than one cycle of an arm is reported with the command that corrects it."""
    ip_link('set', vcan, 'up', 'txqueuelen', '10')
    with caplog.at_level(logging.WARNING), open_bus(vcan):
        pass
    assert f'ip link set {vcan} txqueuelen 1000' in caplog.text


@pytest.mark.vcan
def test_a_missing_interface_is_refused_where_the_kernel_has_can(vcan: str) -> None:
    """Opening a name that does not exist lists those that do."""
    with pytest.raises(BusError, match=f'no CAN interface can99 .*{vcan}'):
        open_bus('can99')


def test_classes_and_details_are_named() -> None:
    """What the controller reports is reported as linux/can/error.h defines it."""
    for can_id, data, text in (
        (0x040, bytes(8), 'bus off'),
        (0x020, bytes(8), 'no acknowledge'),
        (0x004, b'', 'controller problem'),
        (0x004, b'\0\x30', 'controller problem (receive error passive, transmit error passive)'),
        (0x088, b'\0\0\x84', 'protocol violation (bit stuffing, on transmission), bus error'),
        (0x240, bytes(6) + b'\x80\x05', 'bus off, 128 transmit and 5 receive errors counted'),
        (0x1000, bytes(8), 'error class 0x1000'),
    ):
        assert error_text(Frame(can_id, data, is_error=True)) == text


@given(st.integers(0, 0x1FFF_FFFF), st.binary(max_size=8))
def test_every_error_frame_has_a_text(can_id: int, data: bytes) -> None:
    """Unknown bits and short frames are reported too, and never crash."""
    assert error_text(Frame(can_id, data, is_error=True))
