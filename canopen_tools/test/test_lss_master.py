# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The LSS master with simulated devices: finding, selecting, numbering."""

from __future__ import annotations

from collections.abc import Coroutine, Iterable
import heapq
from itertools import count
from typing import Any, TypeVar

from device_rig import drive_dictionary, with_defaults
from hypothesis import given, settings
from hypothesis import strategies as st
import pytest

from arm_canopen import LssError, Promise, Scheduler
from canopen_core.can import Frame
from canopen_core.standard import lss, UNCONFIGURED
from canopen_sim import DeviceHost
from canopen_tools import FrameDescriber
from canopen_tools.lss_master import LssMaster

pytestmark = pytest.mark.slow

T = TypeVar('T')

FIRST = lss.Address(0x555, 0x1234, 0x10002, 0xCAFE)
SECOND = FIRST._replace(serial=0xCAFF)
NUMBER = st.integers(0, 0xFFFF_FFFF)
ADDRESS = st.builds(lss.Address, NUMBER, NUMBER, NUMBER, NUMBER)


class LssNetwork:
    """A master and simulated devices on a bus that takes some time, in virtual time."""

    def __init__(self, addresses: Iterable[lss.Address]) -> None:
        """Switch devices of these identities on, without a node id."""
        # how late frames of the devices arrive in [s], one after another; 1 ms after these
        self.delays: list[float] = []
        self._scheduler = Scheduler(1.0)
        self._order = count()
        self._way: list[tuple[float, int, Frame]] = []
        self._host = DeviceHost(self._answer)
        for address in addresses:
            values = {(0x1018, part + 1): number for part, number in enumerate(address)}
            self._host.add(UNCONFIGURED, with_defaults(drive_dictionary(), values))
        self._host.advance(1.0)
        self.master = LssMaster(self._scheduler, self._send)

    def run(self, coroutine: Coroutine[Promise[Any], None, T]) -> T:
        """Run a service to its end."""
        task = self._scheduler.spawn(coroutine)
        while not task.done:
            deadline = self._scheduler.next_deadline()
            arrival = self._way[0][0] if self._way else float('inf')
            assert deadline is not None
            now = min(deadline, arrival)
            self._scheduler.set_time(now)
            while self._way and self._way[0][0] <= now:
                self.master.receive(heapq.heappop(self._way)[2]._replace(timestamp=now))
            self._host.advance(now)
            self._scheduler.advance(now)
        return task.result()

    def _send(self, frame: Frame) -> None:
        self._host.receive(frame, self._scheduler.now)

    def _answer(self, frame: Frame) -> None:
        delay = self.delays.pop(0) if self.delays else 0.001
        heapq.heappush(self._way, (self._scheduler.now + delay, next(self._order), frame))


@settings(max_examples=30)
@given(st.sets(ADDRESS, max_size=3))
def test_fast_scan_finds_every_device(addresses: set[lss.Address]) -> None:
    """Whatever their numbers, one call after another finds each once, lowest first."""
    network = LssNetwork(addresses)
    found = [network.run(network.master.fast_scan()) for _ in range(len(addresses) + 1)]
    assert found == [*sorted(addresses), None]


@settings(max_examples=30)
@given(st.data())
def test_fast_scan_is_not_misled_by_slow_devices(data: st.DataObject) -> None:
    """Answers of two devices may be some milliseconds apart: none counts for the next step."""
    network = LssNetwork([FIRST, SECOND._replace(revision=0x10003)])
    network.delays = data.draw(
        st.lists(st.floats(0.0005, 0.009), min_size=300, max_size=300), label='delays'
    )
    assert network.run(network.master.fast_scan()) == FIRST


def test_refusals_are_reported() -> None:
    """What no device can take is refused before it is sent, what this one cannot by its code."""
    network = LssNetwork([FIRST])
    master = network.master
    with pytest.raises(LssError, match='node id 17: no device answers; none is in the config'):
        network.run(master.set_node_id(17))
    master.switch_all(lss.State.CONFIGURATION)
    for node_id in (0, 128, 254):
        with pytest.raises(LssError, match=f'{node_id} is no node id'):
            network.run(master.set_node_id(node_id))
    with pytest.raises(LssError, match='300 kbit/s is no bit rate of LSS; take 1000, 800, 500'):
        network.run(master.set_bit_rate(300_000))
    for bit_rate in lss.BIT_RATES.values():
        network.run(master.set_bit_rate(bit_rate))


@pytest.mark.parametrize(
    ('code', 'text'), [(1, 'not supported'), (255, 'an error of its own'), (7, 'LSS error 7')]
)
def test_error_codes_of_a_device(code: int, text: str) -> None:
    """A device says why it does not store."""
    scheduler = Scheduler()
    sent: list[Frame] = []
    master = LssMaster(scheduler, sent.append)
    task = scheduler.spawn(master.store())
    master.receive(Frame(lss.RESPONSE, lss.with_bytes(lss.Command.STORE, code).encode()))
    scheduler.advance(0.1)
    with pytest.raises(LssError, match=text):
        task.result()


def test_slow_devices_get_more_time() -> None:
    """Answers that come later than a step lasts spoil one search, not the next one."""
    network = LssNetwork([FIRST])
    network.delays = [0.08] * 1000
    assert network.run(network.master.fast_scan()) == FIRST


def test_a_device_that_is_too_slow_is_reported() -> None:
    """A scan that loses its device says which number it was at, and what may be the reason."""
    network = LssNetwork([FIRST])
    network.delays = [0.25] * 1000
    with pytest.raises(LssError, match=r'no longer answers .vendor id .*; is it slower than 200'):
        network.run(network.master.fast_scan())


def test_frames_that_are_no_answer_are_passed_over() -> None:
    """Neither other identifiers nor other commands nor late answers count."""
    scheduler = Scheduler()
    sent: list[Frame] = []
    master = LssMaster(scheduler, sent.append)
    task = scheduler.spawn(master.has_unconfigured())
    answer = lss.with_bytes(lss.Command.UNCONFIGURED_IDENTIFIED).encode()
    for frame in (
        Frame(0x7E5, answer),
        Frame(lss.RESPONSE, answer[:7]),
        Frame(lss.RESPONSE, answer, is_extended=True),
        Frame(lss.RESPONSE, lss.with_bytes(lss.Command.IDENTIFIED).encode()),
    ):
        master.receive(frame)
    scheduler.advance(1.0)
    assert task.result() is False


@pytest.mark.parametrize(
    ('message', 'data'),
    [
        (lss.with_bytes(lss.Command.SWITCH_GLOBAL, 1), '04 01 00 00 00 00 00 00'),
        (lss.with_number(lss.Command.SELECT_VENDOR, 0x12345678), '40 78 56 34 12 00 00 00'),
        (lss.with_bytes(lss.Command.CONFIGURE_NODE_ID, 17), '11 11 00 00 00 00 00 00'),
        (lss.with_bytes(lss.Command.CONFIGURE_BIT_TIMING, 0, 2), '13 00 02 00 00 00 00 00'),
        (lss.with_bytes(lss.Command.STORE), '17 00 00 00 00 00 00 00'),
        (lss.FastScan().message(), '51 00 00 00 00 80 00 00'),
        (lss.FastScan(0xCAFE, 5, 3, 0).message(), '51 FE CA 00 00 05 03 00'),
    ],
)
def test_bytes_of_messages(message: lss.Message, data: str) -> None:
    """As CiA 305 draws them: specifier, parameters little-endian, padded to 8 bytes."""
    assert message.encode() == bytes.fromhex(data)


@given(st.binary(min_size=8, max_size=8))
def test_any_8_bytes_are_a_message(data: bytes) -> None:
    """Reading and writing are inverse; reserved specifiers are reported as such."""
    message = lss.decode(data)
    assert message is not None
    assert message.encode() == data
    assert (data[0] in set(lss.Command)) == ('unknown' not in message.text)


@given(st.binary().filter(lambda data: len(data) != 8))
def test_other_lengths_are_none(data: bytes) -> None:
    """A message has 8 bytes; the monitor has words for what is none."""
    assert lss.decode(data) is None
    assert FrameDescriber().describe(Frame(lss.REQUEST, data)).text


@given(
    st.builds(
        lss.FastScan,
        st.integers(0, 0xFFFF_FFFF),
        st.integers(0, 0xFF),
        st.integers(0, 0xFF),
        st.integers(0, 0xFF),
    )
)
def test_a_step_of_fast_scan_survives(step: lss.FastScan) -> None:
    """What a master sends is what a device reads."""
    message = lss.decode(step.message().encode())
    assert message is not None
    assert lss.fast_scan(message) == step


def test_tables_are_complete() -> None:
    """Every command has words; the standard table has no doubles."""
    assert len({command.text for command in lss.Command}) == len(lss.Command)
    assert set(lss.BIT_RATES) == set(range(9))
    assert len(set(lss.BIT_RATES.values())) == len(lss.BIT_RATES)
    assert str(lss.Address(1, 2, 3, 0xCAFE)).endswith(' 0x0000CAFE')
