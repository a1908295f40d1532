# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The thread of the network: no caller or frame harms another; its figures and send queue."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import Future
from itertools import repeat
from pathlib import Path
import socket
import threading
import time

from drive_samples import bus_config, drive_config
from hypothesis import given
from hypothesis import strategies as st
import pytest

from arm_canopen import BusConfig, BusError, CanopenMaster, open_bus, Promise
from arm_canopen.config import MasterConfig
from arm_canopen.master.network import Network
from arm_canopen.master.runner import Clock, CycleStatistics, NetworkThread
from canopen_core.can import Frame, VirtualBus, VirtualWire
from canopen_core.standard import CobId

CYCLES = st.lists(st.tuples(st.floats(-0.001, 0.1), st.integers(0, 5)), min_size=1, max_size=60)


@given(CYCLES, st.integers(1, 50))
def test_percentiles_are_those_of_the_window(cycles: list[tuple[float, int]], window: int) -> None:
    """At least half (99 %) of the last cycles were not later than p50 (p99), and p99 occurred.

    Counts do not forget what the window has forgotten; before the first cycle all figures are 0.
    """
    statistics = CycleStatistics(0.01, window)
    none = statistics.figures()
    assert (none.cycles, none.jitter_p50, none.jitter_p99, none.jitter_max) == (0,) * 4
    for late, skipped in cycles:
        statistics.record(late, skipped)
    figures = statistics.figures()
    overruns = sum(skipped for _, skipped in cycles)
    assert (figures.cycles, figures.overruns, figures.period) == (len(cycles), overruns, 0.01)
    last = [late for late, _ in cycles[-window:]]
    assert figures.jitter_max == max(last)
    assert figures.jitter_p50 <= figures.jitter_p99 <= figures.jitter_max
    for percentile, share in ((figures.jitter_p50, 0.5), (figures.jitter_p99, 0.99)):
        assert percentile in last
        assert sum(value <= percentile for value in last) >= share * len(last) - 1
        assert sum(value >= percentile for value in last) >= (1.0 - share) * len(last) - 1


def test_two_cycles_of_a_master_wait_for_a_bus_that_takes_none(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Set-points of half a second ago are not sent when the cable is plugged in again."""
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    ours.setblocking(False)
    monkeypatch.setattr('canopen_core.can.socketcan._open_socket', lambda name: ours)
    config = bus_config(*(drive_config(f'joint{number}', number) for number in range(2, 9)))
    with theirs, open_bus('can0') as bus:
        CanopenMaster(config, bus)
        with pytest.raises(BusError, match='transmit queue of can0 is full'):
            any(map(bus.send, repeat(Frame(1))))
        cycle = 1 + 7 * 3  # SYNC and RPDOs
        assert 2 * cycle <= bus.counters.sent <= 4 * cycle


TIMEOUT = 10.0  # [s] deadline for what takes milliseconds


class Bench:
    """A network without devices, its thread, and another station on its bus."""

    def __init__(self) -> None:
        """Open both ends."""
        wire = VirtualWire()
        self.bus, self.other = VirtualBus('here', wire), VirtualBus('there', wire)
        config = BusConfig(Path('bus.yml'), MasterConfig(1, cycle_period=0.005), ())
        self.network = Network(config, self.bus.send, lambda event: None)
        self.thread = NetworkThread(self.bus, self.network)

    def close(self) -> None:
        """End all."""
        self.thread.stop()
        self.bus.close()
        self.other.close()


@pytest.fixture
def bench() -> Iterator[Bench]:
    """A running bench."""
    made = Bench()
    made.thread.start()
    yield made
    made.close()


def test_a_call_that_fails_or_is_cancelled_concerns_its_caller_alone(bench: Bench) -> None:
    """An error reaches the future, a cancelled one is passed over, and the thread goes on."""
    gate = threading.Event()
    bench.thread.call(lambda: gate.wait(TIMEOUT))
    given_up: Future[None] = bench.thread.call(lambda: None)

    def broken() -> Promise[None]:
        raise KeyError('x')

    failing = bench.thread.call(lambda: 1 // 0)
    breaking = bench.thread.run(broken)
    after = bench.thread.call(lambda: 42)
    assert given_up.cancel()
    gate.set()
    assert after.result(TIMEOUT) == 42
    with pytest.raises(ZeroDivisionError):
        failing.result(TIMEOUT)
    with pytest.raises(KeyError):
        breaking.result(TIMEOUT)


def test_a_defect_at_one_frame_does_not_lose_the_next(
    bench: Bench, caplog: pytest.LogCaptureFixture
) -> None:
    """Of a batch every frame is taken, whatever one of them does."""
    seen: list[int] = []
    done = threading.Event()

    def take(frame: Frame) -> None:
        seen.append(frame.can_id)
        if frame.can_id == 0x181:
            raise ZeroDivisionError
        if frame.can_id == 0x183:
            done.set()

    bench.thread.call(lambda: setattr(bench.network, 'on_frame', take)).result(TIMEOUT)
    gate = threading.Event()
    bench.thread.call(lambda: gate.wait(TIMEOUT))
    for number in (1, 2, 3):
        bench.other.send(Frame(0x180 + number, b''))
    gate.set()
    assert done.wait(TIMEOUT)
    assert seen == [0x181, 0x182, 0x183]
    assert 'a defect in the CANopen master, at the frame' in caplog.text


def test_nobody_waits_for_a_thread_that_has_ended(bench: Bench) -> None:
    """What runs, and what is requested afterwards, ends with the reason."""
    never: Promise[None] = Promise()
    running = bench.thread.run(lambda: never)
    bench.thread.call(lambda: None).result(TIMEOUT)
    bench.thread.stop()
    for future in (running, bench.thread.call(lambda: None)):
        with pytest.raises(BusError, match='the CANopen master has ended'):
            future.result(TIMEOUT)
    never.resolve(None)


class SlowBus(VirtualBus):
    """A bus in virtual time, on a computer that takes long for each look at it.

    Attributes:
        now: The time in [s].
        look: What a look takes in [s].
    """

    def __init__(self, look: float) -> None:
        super().__init__('here', VirtualWire())
        self.now = 100.0  # [s]
        self.look = look

    def receive(self, timeout: float) -> list[Frame]:
        """Advance the time."""
        self.now += timeout + self.look
        return super().receive(0.0)


@pytest.mark.parametrize('look', [0.1, 0.6, 1.1, 3.3])  # of the period
def test_each_cycle_that_begins_late_updates_the_set_points(look: float) -> None:
    """However late: where SYNC goes on, so do the drives and their motion."""
    period = 0.01
    bus = SlowBus(look * period)
    master = MasterConfig(1, sync_period=period, cycle_period=period)
    done = threading.Event()
    order: list[str] = []

    def send(frame: Frame) -> None:
        if frame.can_id == CobId.SYNC:
            order.append('sync')
        if len(order) > 40:
            done.set()

    network = Network(BusConfig(Path('bus.yml'), master, ()), send, lambda event: None)
    network.on_cycle = lambda now, period: order.append('update')
    thread = NetworkThread(bus, network, Clock(now=lambda: bus.now))
    thread.start()
    assert done.wait(TIMEOUT)
    thread.stop()
    assert order[:40] == ['sync', 'update'] * 20


def test_published_jitter_is_that_of_sync_on_the_bus() -> None:
    """A listener never sees SYNC later against its grid than the figures say, whatever runs."""
    wire = VirtualWire()
    bus, listener = VirtualBus('here', wire), VirtualBus('there', wire)
    period = 0.01
    master = MasterConfig(1, sync_period=period, cycle_period=period)
    order: list[str] = []

    def send(frame: Frame) -> None:
        if frame.can_id == CobId.SYNC:
            order.append('sync')
        bus.send(frame)

    def work(now: float, period: float) -> None:
        order.append('work')
        time.sleep(0.4 * period * (len(order) % 4 == 0))

    network = Network(BusConfig(Path('bus.yml'), master, ()), send, lambda event: None)
    network.on_cycle = work
    thread = NetworkThread(bus, network)
    thread.start()
    arrivals: list[float] = []
    end = time.monotonic() + TIMEOUT
    while len(arrivals) < 100 and time.monotonic() < end:
        arrivals += [f.timestamp for f in listener.receive(1.0) if f.can_id == CobId.SYNC]
    figures = thread.call(thread.figures).result(TIMEOUT)
    thread.stop()
    arrivals += [f.timestamp for f in listener.receive(0.0) if f.can_id == CobId.SYNC]
    bus.close()
    listener.close()
    assert order[: len(order) // 2 * 2] == ['sync', 'work'] * (len(order) // 2)
    seen = arrivals[: figures.cycles]
    # a listener does not know the grid; on that of the SYNC that was least late it holds for all
    grids = [sorted((arrival - origin) % period for arrival in seen) for origin in seen]
    last = len(seen) - 1
    published = (figures.jitter_p50, figures.jitter_p99, figures.jitter_max)
    ranks = (last // 2, last * 99 // 100, last)
    assert any(
        all(ours > late[rank] - 1e-6 for ours, rank in zip(published, ranks, strict=True))
        for late in grids
    )
