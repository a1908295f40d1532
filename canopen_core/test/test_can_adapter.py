# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Python-can in both directions: its drivers as our bus, and our buses in its tools."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
import errno
import os
from pathlib import Path
import subprocess
import sys
from time import monotonic, time
import tty

import can
from can.interfaces import BACKENDS
from can_addresses import DEADLINE, free_multicast, free_virtual, receive_count, unstamped
import pytest

from canopen_core import BusError
from canopen_core.can import Bus, Frame, open_bus
from canopen_core.can.adapter import AdapterBus, to_message
from canopen_core.can.plugin import ArmCanopenBus

SLCAN_OPENING = 2.0  # [s] for which the driver of slcan sleeps


class ScriptedDriver(can.BusABC):
    """A driver that delivers prepared messages, and refuses to send."""

    def __init__(self, messages: list[can.Message]) -> None:
        super().__init__('scripted')
        self.messages = messages
        self.cause: OSError | None = None

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        return (self.messages.pop(0) if self.messages else None), True

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """Refuse."""
        raise can.CanOperationError('bus off') from self.cause


@pytest.fixture
def messages() -> list[can.Message]:
    """Give what the scripted driver delivers."""
    return []


@pytest.fixture
def opened_with(monkeypatch: pytest.MonkeyPatch, messages: list[can.Message]) -> dict[str, object]:
    """Put a scripted driver in place of all drivers, and note what it was opened with."""
    options: dict[str, object] = {}

    def open_driver(**given: object) -> can.BusABC:
        options.update(given)
        return ScriptedDriver(messages)

    monkeypatch.setattr(can, 'Bus', open_driver)
    return options


def test_a_name_is_interface_channel_and_bit_rate(opened_with: dict[str, object]) -> None:
    """The parts of the name reach the driver, own messages are not requested."""
    for kind, channel, bitrate in (
        ('pcan', 'PCAN_USBBUS1', 500_000),
        ('slcan', '/dev/ttyUSB0', 1_000_000),
        ('kvaser', '0', None),
        ('socketcand', 'can0:localhost:29536', None),
        ('slcan', 'user@host', 125_000),
    ):
        name = f'{kind}:{channel}@{bitrate}' if bitrate else f'{kind}:{channel}'
        opened_with.clear()
        with open_bus(name) as bus:
            assert bus.name == name
        found = [opened_with.get(key) for key in ('interface', 'channel', 'bitrate')]
        assert found == [kind, channel, bitrate]
        assert opened_with['receive_own_messages'] is False


def test_what_cannot_be_opened_says_why() -> None:
    """A wrong bit rate, an unknown interface, or the driver's own reason."""
    for name, reason in (
        *((f'pcan:X@{rate}', 'no bit rate') for rate in ('', 'fast', '0', '-1')),
        ('paecan:PCAN_USBBUS1', r'no interface paecan; it has .*pcan'),
        ('slcan:/nowhere/tty@500000', 'cannot open slcan:/nowhere/tty'),
    ):
        with pytest.raises(BusError, match=reason):
            open_bus(name)


def _message(**fields: object) -> can.Message:
    return can.Message(arbitration_id=0x181, is_extended_id=False, **fields)  # type: ignore[arg-type]


@pytest.mark.usefixtures('opened_with')
def test_echoes_and_fd_messages_are_not_delivered(messages: list[can.Message]) -> None:
    """Drivers that echo mark it; CAN FD messages are counted and dropped.

    A frame that the driver refuses is counted, and its error becomes ours, with its reason.
    """
    messages += [_message(is_rx=False), _message(is_fd=True, data=bytes(64)), _message(data=b'1')]
    with open_bus('pcan:X') as bus:
        frames = bus.receive(0.0)
        assert [frame[:2] for frame in frames] == [(0x181, b'1')]
        assert bus.counters.malformed == 1
        with pytest.raises(BusError, match='bus off'):
            bus.send(Frame(1))
        assert (bus.counters.sent, bus.counters.send_errors) == (0, 1)


@pytest.mark.usefixtures('opened_with')
@pytest.mark.parametrize('age', [0.0, 0.5, -5.0, 4e8], ids=['now', 'recent', 'future', 'uptime'])
def test_stamps_of_drivers_become_steady_time(messages: list[can.Message], age: float) -> None:
    """Wall clock stamps are moved over; those that count from something else become now."""
    before, expected = monotonic(), age if age == 0.5 else 0.0
    messages.append(_message(timestamp=time() - age))
    with open_bus('pcan:X') as bus:
        (frame,) = bus.receive(0.0)
    # a busy machine may pause between two looks at the clocks
    assert before - 0.2 <= frame.timestamp + expected <= monotonic() + 0.2


class SerialAdapter:
    """The far end of the serial line of an slcan adapter."""

    def __init__(self) -> None:
        """Open the line."""
        self._ours, theirs = os.openpty()
        tty.setraw(theirs)
        self.tty = os.ttyname(theirs)
        self.name = f'slcan:{self.tty}'
        self._theirs = theirs

    def write(self, *lines: bytes) -> None:
        """Send lines to the computer."""
        os.write(self._ours, b''.join(line + b'\r' for line in lines))

    def read(self, text: bytes) -> None:
        """Read until a text from the computer comes."""
        received = b''
        while text not in received:
            received += os.read(self._ours, 1000)

    def close(self) -> None:
        """Close both ends."""
        os.close(self._ours)
        os.close(self._theirs)


@pytest.fixture
def serial_adapter() -> Iterator[SerialAdapter]:
    """Open a serial line."""
    adapter = SerialAdapter()
    yield adapter
    adapter.close()


DAMAGED = [b't18', b't1x11AA', b't1811ZZ', b't\xff811AA', b'T0000', b't1814AABB']
LINES = 20 * DAMAGED  # more than may be damaged in a row


def receive(bus: Bus, count: int, deadline: float) -> list[tuple[int, bytes]]:
    """Return identifiers and data of as many frames."""
    frames: list[Frame] = []
    while len(frames) < count and monotonic() < deadline:
        frames += bus.receive(0.1)
    return [(frame.can_id, frame.data) for frame in frames]


def fill(bus: Bus) -> float:
    """Send until that is refused; return how long the last one took in [s]."""
    for _ in range(10_000):
        began = monotonic()
        try:
            bus.send(Frame(0x201, bytes(8)))
        except BusError:
            break
    return monotonic() - began


def test_a_serial_adapter_that_fails_is_said_to_and_used_again(
    serial_adapter: SerialAdapter,
) -> None:
    """A damaged line costs no other frame, and is counted: truncated, or without digits.

    Nothing but damage, as of a wrong rate of the line, is no silent bus: it is reported until a
    good frame comes. One that takes no more bytes blocks no caller, and takes frames as soon as
    it reads again.
    """
    with open_bus(serial_adapter.name) as bus:
        deadline = monotonic() + 3 * DEADLINE
        for damaged in LINES:
            serial_adapter.write(b't1811AA', damaged, b't1821BB')
        frames = receive(bus, 2 * len(LINES), deadline)
        assert frames == [(0x181, b'\xaa'), (0x182, b'\xbb')] * len(LINES)
        assert bus.counters.malformed == len(LINES)

        serial_adapter.write(*[b't18'] * 150)
        with pytest.raises(BusError, match=r'damaged messages only, 100 in a row \(IndexError'):
            receive(bus, 1, deadline)
        serial_adapter.write(b't1811AA')
        frames = []
        while not frames and monotonic() < deadline:
            with suppress(BusError):
                frames = receive(bus, 1, deadline)
        assert frames == [(0x181, b'\xaa')]

        assert fill(bus) < 1.0
        errors, sent = bus.counters.send_errors, bus.counters.sent
        assert errors == 1
        while bus.counters.sent == sent:  # a terminal takes more when half of it was read
            assert monotonic() < deadline
            serial_adapter.read(b't201')
            with suppress(BusError):
                bus.send(Frame(0x201))
        assert fill(bus) < 1.0


def failure(bus: Bus) -> str:
    """Receive once; return why that failed, or nothing."""
    try:
        bus.receive(0.02)
    except BusError as error:
        return str(error)
    return ''


def fails(bus: Bus, text: str, deadline: float) -> bool:
    """Receive until that fails with a text."""
    while monotonic() < deadline:
        if text in failure(bus):
            return True
    return False


def test_an_adapter_that_is_plugged_in_again_is_used_again(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """Meanwhile no call waits for its driver, which takes 2 s to open it; then both ways work."""
    plug = tmp_path / 'ttyACM0'
    first, second = SerialAdapter(), SerialAdapter()
    plug.symlink_to(first.tty)
    deadline = monotonic() + 20.0
    with open_bus(f'slcan:{plug}@500000') as bus:
        first.close()
        plug.unlink()
        assert fails(bus, 'it is opened again when it is back', deadline)
        with pytest.raises(BusError, match='went away'):
            bus.send(Frame(1))
        assert fails(bus, 'is it plugged in', deadline)
        plug.symlink_to(second.tty)
        longest, gone = 0.0, True
        while gone and monotonic() < deadline:
            began = monotonic()
            gone = bool(failure(bus))
            longest = max(longest, monotonic() - began)
        second.write(b't1811AA')
        assert receive(bus, 1, deadline) == [(0x181, b'\xaa')]
        assert longest < SLCAN_OPENING
        bus.send(Frame(0x201, b'\xbb'))
        second.read(b't2011BB\r')
    assert [record.message for record in caplog.records] == [f'{bus.name} is back']
    second.close()


@pytest.mark.parametrize('gone', [errno.ENODEV, errno.EIO])
def test_an_adapter_whose_loss_only_sending_shows_is_opened_again(
    gone: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Drivers as that of gs_usb receive nothing from a device that is gone, and raise nothing."""
    opened: list[ScriptedDriver] = []

    def open_driver(**given: object) -> can.BusABC:
        opened.append(ScriptedDriver([_message(data=b'1')]))
        opened[-1].cause = OSError(gone, os.strerror(gone)) if len(opened) == 1 else None
        return opened[-1]

    monkeypatch.setattr(can, 'Bus', open_driver)
    with open_bus('gs_usb:0@1000000') as bus:
        assert len(bus.receive(0.0)) == 1
        with pytest.raises(BusError, match='bus off'):
            bus.send(Frame(1))
        frames: list[Frame] = []
        deadline = monotonic() + 10.0
        while not frames and monotonic() < deadline:
            with suppress(BusError):
                frames = bus.receive(0.02)
        assert len(frames) == 1
        with pytest.raises(BusError, match='bus off'):  # an error of the bus, not of the device
            bus.send(Frame(1))
        assert bus.receive(0.0) == []
    assert len(opened) == 2


def test_an_adapter_may_be_closed_while_it_is_gone() -> None:
    """Its loss is reported; whatever its opening comes to is released, too."""
    bus = AdapterBus('test', 'virtual', free_virtual(), None)
    bus._bus.shutdown()
    with pytest.raises(BusError, match='went away'):
        bus.receive(0.1)
    with suppress(BusError):
        bus.receive(0.0)
    bus.close()
    with pytest.raises(BusError, match='closed'):
        bus.receive(0.0)


PACKAGE = Path(__file__).parents[1]


@pytest.fixture
def name() -> str:
    """Name an in-process bus of one's own."""
    return free_virtual()


@pytest.fixture
def ours(name: str) -> Iterator[Bus]:
    """Open our side."""
    with open_bus(name) as bus:
        yield bus


@pytest.fixture
def theirs(name: str, monkeypatch: pytest.MonkeyPatch) -> Iterator[can.BusABC]:
    """Open python-can's side by the name of the interface, as its tools do."""
    monkeypatch.setitem(BACKENDS, 'arm_canopen', (ArmCanopenBus.__module__, 'ArmCanopenBus'))
    with can.Bus(interface='arm_canopen', channel=name, ignore_config=True) as bus:
        yield bus


def test_a_notifier_receives_our_frames_with_wall_clock_stamps(
    ours: Bus, theirs: can.BusABC
) -> None:
    """Listeners of python-can get each frame, stamped near now."""
    reader = can.BufferedReader()
    notifier = can.Notifier(theirs, [reader], timeout=0.05)
    before = time()
    for number in range(20):
        ours.send(Frame(number, bytes([number])))
    messages = [reader.get_message(DEADLINE) for _ in range(20)]
    notifier.stop(DEADLINE)
    assert [m.arbitration_id for m in messages if m] == list(range(20))
    assert all(m and before - 0.01 <= m.timestamp <= time() + 0.01 for m in messages)


def test_messages_of_python_can_reach_our_bus(ours: Bus, theirs: can.BusABC) -> None:
    """Sending through python-can is sending on our bus; set_filters keeps all else out."""
    frames = [Frame(0x181, b'\x01'), Frame(0x12345, is_extended=True), Frame(1, is_remote=True)]
    for frame in frames:
        theirs.send(to_message(frame))
    assert unstamped(receive_count(ours, len(frames))) == frames
    theirs.set_filters([{'can_id': 0x180, 'can_mask': 0x780}])
    for can_id in (0x080, 0x185, 0x601):
        ours.send(Frame(can_id))
    message = theirs.recv(DEADLINE)
    assert message
    assert message.arbitration_id == 0x185
    assert theirs.recv(0) is None


def test_what_cannot_be_is_refused_in_python_cans_words(name: str, theirs: can.BusABC) -> None:
    """CAN FD, own messages and unknown buses raise python-can's exceptions."""
    with pytest.raises(can.CanOperationError, match='FD'):
        theirs.send(can.Message(is_fd=True, data=bytes(12)))
    with pytest.raises(can.CanInitializationError, match='own messages'):
        ArmCanopenBus(name, receive_own_messages=True)
    with pytest.raises(can.CanInitializationError, match='no IP address'):
        ArmCanopenBus('udp_multicast:nowhere')


@pytest.mark.slow
def test_the_tools_of_python_can_find_it_by_its_entry_point(tmp_path: Path) -> None:
    """`python -m can.logger -i arm_canopen` works once the package is installed."""
    metadata = [sys.executable, 'setup.py', '-q', 'egg_info', '--egg-base', str(tmp_path)]
    subprocess.run(metadata, cwd=PACKAGE, check=True, capture_output=True, timeout=60)
    name = free_multicast()
    environment = os.environ | {
        'PYTHONPATH': os.pathsep.join(
            [str(tmp_path), str(PACKAGE), os.environ.get('PYTHONPATH', '')]
        )
    }
    command = [sys.executable, '-u', '-m', 'can.logger', '-i', 'arm_canopen', '-c', name]
    with (
        open_bus(name) as bus,
        subprocess.Popen(
            command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
        ) as logger,
    ):
        assert logger.stdout
        output: list[str] = []
        try:
            for line in logger.stdout:
                output.append(line)
                if line.startswith('Can Logger'):  # it prints this when it listens
                    bus.send(Frame(0x181, b'\xca\xfe'))
                if 'ca fe' in line:
                    break
        finally:
            logger.terminate()
    assert any('181' in line and 'ca fe' in line for line in output), ''.join(output)
