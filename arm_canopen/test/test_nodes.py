# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Nodes of the master: end, log, output thread, node id, and objects as 32 raw bits."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from pathlib import Path
import struct
import threading
from types import SimpleNamespace
from typing import Any

from config_samples import added, load_text
from hypothesis import assume, given
from hypothesis import strategies as st
from isolation import Isolation
import pytest
import rclpy
from rclpy.logging import get_logger
from rclpy.node import Node

from arm_canopen import (
    BusConfig,
    BusError,
    CanopenError,
    CanopenMaster,
    CodecError,
    DriveError,
    Event,
    EventKind,
    MasterProcess,
    Severity,
)
from arm_canopen.config import MasterConfig
from arm_canopen.master.runner import NetworkThread
from arm_canopen.nodes import master
from arm_canopen.nodes.device_node import (
    bytes_from_raw,
    DeviceNode,
    number_from_raw,
    raw_from_bytes,
    raw_from_number,
)
from arm_canopen.nodes.output_thread import OutputThread, WAITING_MAX
from canopen_core.can import VirtualBus, VirtualWire
from canopen_core.standard import (
    byte_length,
    DataType,
    decode,
    encode,
    integer_range,
    MappedObject,
    SIGNED_BITS,
)


def test_node_id_is_that_of_the_device(isolation: Isolation) -> None:
    """A parameter for all nodes of the process does not give a device another node id."""
    config = SimpleNamespace(name='gripper', namespace='', remappings={}, node_id=7)
    device: Any = SimpleNamespace(config=config, objects=None)
    nobody: Any = None  # the services are not called
    rclpy.init(args=['--ros-args', '-p', 'node_id:=99'], domain_id=isolation.domain_id)
    try:
        node = DeviceNode(device, nobody, OutputThread(get_logger('gripper')))
        assert node.get_parameter('node_id').value == 7
        node.destroy_node()
    finally:
        rclpy.shutdown()


STREAMS = 5


class Log:
    """A logger that keeps what it gets."""

    def __init__(self) -> None:
        self.warnings: list[str] = []
        self.errors: list[str] = []
        self.warning, self.error = self.warnings.append, self.errors.append


class Slow:
    """An output thread that is held up by its first piece of work, as by a slow DDS.

    Attributes:
        done: What was run, in order.
    """

    def __init__(self) -> None:
        self.log = Log()
        self.done: list[object] = []
        self.thread = OutputThread(self.log)  # type: ignore[arg-type]
        self._gate = threading.Event()
        held_up = threading.Event()

        def hold_up() -> None:
            held_up.set()
            self._gate.wait(DEADLINE)

        self.thread.post(hold_up)
        self.thread.start()
        assert held_up.wait(DEADLINE)

    def release(self) -> None:
        """Let it work again."""
        self._gate.set()

    def go_on(self) -> None:
        """Let it work off everything, and end it."""
        self.release()
        self.thread.stop()


@pytest.fixture
def slow() -> Iterator[Slow]:
    """A thread that is held up."""
    made = Slow()
    yield made
    made.go_on()


def test_streams_do_not_grow_while_ros_is_slow(slow: Slow) -> None:
    """Of each the newest arrives in the end, and what was left out is counted in the log."""
    for number in range(20 * WAITING_MAX):
        for stream in range(STREAMS):
            slow.thread.post_stream(stream, partial(slow.done.append, (stream, number)))
    assert slow.thread.waiting <= WAITING_MAX + STREAMS
    slow.go_on()
    newest: dict[object, object] = dict(pair for pair in slow.done if isinstance(pair, tuple))
    assert newest == dict.fromkeys(range(STREAMS), 20 * WAITING_MAX - 1)
    left_out = 20 * WAITING_MAX * STREAMS - len(slow.done)
    assert len(slow.log.warnings) == 1
    assert slow.log.warnings[0].startswith(f'{left_out} messages were left out')


def test_a_stream_never_goes_back(slow: Slow) -> None:
    """Where the queue empties and fills again while the newest waits, nothing overtakes it."""
    reached, gate = threading.Event(), threading.Event()

    def hold_up_again() -> None:
        reached.set()
        gate.wait(DEADLINE)

    slow.thread.post(lambda: None)
    slow.thread.post(hold_up_again)
    for _ in range(WAITING_MAX - 2):
        slow.thread.post(lambda: None)
    slow.thread.post_stream('stream', partial(slow.done.append, 1))
    slow.release()
    assert reached.wait(DEADLINE)
    slow.thread.post_stream('stream', partial(slow.done.append, 2))
    slow.thread.post_stream('stream', partial(slow.done.append, 3))
    gate.set()
    slow.go_on()
    assert slow.done in ([3], [1, 2, 3])


def test_answers_are_never_left_out(slow: Slow) -> None:
    """However much of streams waits before them."""
    for number in range(2 * WAITING_MAX):
        slow.thread.post_stream('stream', lambda: None)
        slow.thread.post(partial(slow.done.append, number))
    slow.go_on()
    assert slow.done == list(range(2 * WAITING_MAX))


def test_nothing_is_left_out_while_ros_keeps_up(slow: Slow) -> None:
    """Every element of a stream arrives, in order; a defect of one is logged and ends no other."""
    slow.thread.post(lambda: slow.done.append(1 // 0))
    for number in range(WAITING_MAX - 2):
        slow.thread.post_stream('stream', partial(slow.done.append, number))
    slow.go_on()
    assert slow.done == list(range(WAITING_MAX - 2))
    assert not slow.log.warnings
    assert 'ZeroDivisionError' in slow.log.errors[0]


DEADLINE = 10.0  # [s] for what takes milliseconds
CONFIG = BusConfig(Path('bus.yml'), MasterConfig(1, cycle_period=0.005), ())


def end_by_defect(thread: NetworkThread) -> None:
    """Make the cycle fail by a defect."""

    def record(late: float, skipped: int) -> None:
        raise ZeroDivisionError('injected')

    thread._statistics.record = record  # type: ignore[method-assign]


@pytest.fixture
def node(isolation: Isolation) -> Iterator[Node]:
    """A node for the master."""
    rclpy.init(domain_id=isolation.domain_id)
    made = Node('master')
    yield made
    made.destroy_node()
    rclpy.shutdown()


def test_stop_ends_both_threads_after_the_cycle_has_died(node: Node) -> None:
    """It says that the drives could not be stopped, and raises nothing."""
    bus = VirtualBus('here', VirtualWire())
    process = MasterProcess(node, CONFIG, bus, diagnostics_period=60.0)
    source: Any = SimpleNamespace(axes=())
    before = set(threading.enumerate())
    process.start()
    started = set(threading.enumerate()) - before
    assert {thread.name for thread in started} == {'canopen', 'ros output'}
    end_by_defect(process._thread)
    (cycle,) = [thread for thread in started if thread.name == 'canopen']
    cycle.join(DEADLINE)
    assert not cycle.is_alive()
    with pytest.raises(BusError):
        process.attach(source).result(DEADLINE)
    process.stop()
    assert not any(thread.is_alive() for thread in started)
    bus.close()


def test_a_defect_that_ends_the_cycle_ends_the_program_with_its_reason(node: Node) -> None:
    """No process is left that answers and leads no drive."""
    bus = VirtualBus('here', VirtualWire())
    process = MasterProcess(node, CONFIG, bus, diagnostics_period=60.0)

    def extend(_: object) -> list[Node]:
        node.create_timer(0.01, lambda: end_by_defect(process._thread))  # when it runs
        return []

    with pytest.raises(CanopenError, match='has ended by a defect: ZeroDivisionError: injected'):
        master._serve([process], threading.Event(), extend)
    bus.close()


def test_a_defect_that_ends_the_cycle_ends_a_boot(tmp_path: Path) -> None:
    """Its caller is given the reason, and waits no longer; the drives could not be stopped."""
    bus = VirtualBus('here', VirtualWire())
    made = CanopenMaster(load_text(tmp_path, added('joint1', '')), bus)
    end_by_defect(made.thread)
    with pytest.raises(BusError, match='has ended by a defect: ZeroDivisionError: injected'):
        made.boot(DEADLINE)
    with pytest.raises(DriveError, match='could not be stopped'):
        made.close()
    bus.close()


def test_all_are_operational_after_the_last_of_them(
    node: Node, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """The log has the line of each device before the one of all; warnings count for none."""
    config = load_text(tmp_path, added('joint1', ''))
    bus = VirtualBus('here', VirtualWire())
    process = MasterProcess(node, config, bus, diagnostics_period=60.0)
    for device in config.nodes:
        process._master._report(Event(EventKind.BOOT, Severity.WARNING, device.name, 'watches'))
    for device in config.nodes:
        process._network.nodes[device.name].online = True
        process._master._report(Event(EventKind.BOOT, Severity.INFO, device.name, 'operational'))
    process._master._report(Event(EventKind.BOOT, Severity.WARNING, device.name, 'operational'))
    process._output.start()
    process._output.stop()
    lines = capfd.readouterr().err.splitlines()
    count = len(config.nodes)
    assert ['operational' in line for line in lines[-count - 2 :]] == [True] * (count + 2)
    assert f'all {count} devices operational' in lines[-2]
    assert 'devices operational' not in ''.join(lines[:-2])
    bus.close()


RAW = st.integers(0, 0xFFFF_FFFF)
SMALL = [t for t in DataType if (byte_length(t) or 9) <= 4]
LARGE = [t for t in DataType if t not in SMALL]
SMALL_INTEGERS = [t for t in SMALL if integer_range(t) is not None]


@st.composite
def integers(draw: st.DrawFn) -> tuple[DataType, int]:
    """Draw an integer type of up to 32 bits and a value that fits it."""
    data_type = draw(st.sampled_from(SMALL_INTEGERS))
    low, high = integer_range(data_type) or (0, 0)
    return data_type, draw(st.integers(low, high))


@given(st.binary(max_size=20))
def test_up_to_four_bytes_are_little_endian(data: bytes) -> None:
    """The 32 bits are the bytes, zero-extended; nothing is cut off in silence."""
    if len(data) <= 4:
        assert raw_from_bytes(data) == struct.unpack('<I', data.ljust(4, b'\0'))[0]
        return
    with pytest.raises(CodecError, match=f'{len(data)} bytes'):
        raw_from_bytes(data)


@pytest.mark.parametrize('data_type', LARGE, ids=lambda data_type: data_type.name)
def test_larger_types_are_refused(data_type: DataType) -> None:
    """What has more than 32 bits, or no fixed length, is not for this message."""
    with pytest.raises(CodecError, match=data_type.name):
        bytes_from_raw(data_type, 0)


@given(integers())
def test_numbers_may_come_as_they_are_or_with_all_32_bits(sample: tuple[DataType, int]) -> None:
    """Zero-extended, sign-extended as a C program would send them, or as a PDO is published."""
    data_type, value = sample
    mapped = MappedObject(0x2000, 0, data_type)
    published = raw_from_number(mapped, value)
    assert 0 <= published <= 0xFFFF_FFFF
    for raw in (raw_from_bytes(encode(data_type, value)), value & 0xFFFF_FFFF, published):
        assert decode(data_type, bytes_from_raw(data_type, raw)) == value
        assert number_from_raw(mapped, raw) == value


@given(st.sampled_from(SMALL_INTEGERS), RAW)
def test_what_does_not_fit_is_refused(data_type: DataType, raw: int) -> None:
    """Only zero-extended and sign-extended values are values."""
    low, high = integer_range(data_type) or (0, 0)
    bits = 8 * (byte_length(data_type) or 0)
    values = {raw, raw - (1 << bits), raw - (1 << 32)} if data_type in SIGNED_BITS else {raw}
    assume(not any(low <= value <= high for value in values))
    with pytest.raises(CodecError, match='does not fit'):
        bytes_from_raw(data_type, raw)
    with pytest.raises(CodecError, match='does not fit'):
        number_from_raw(MappedObject(0x2000, 0, data_type), raw)


@given(st.floats(width=32, allow_nan=False))
def test_real_numbers_travel_as_their_bits(value: float) -> None:
    """REAL32 is carried bit by bit."""
    mapped = MappedObject(0x2000, 0, DataType.REAL32)
    raw = raw_from_number(mapped, value)
    assert raw == struct.unpack('<I', struct.pack('<f', value))[0]
    assert number_from_raw(mapped, raw) == value
    assert bytes_from_raw(DataType.REAL32, raw) == struct.pack('<f', value)
