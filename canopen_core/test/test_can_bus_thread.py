# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The end of a thread that owns a bus, while others hand work over."""

from __future__ import annotations

from concurrent.futures import Future, ThreadPoolExecutor
from functools import partial
import sys
import threading

import pytest

from canopen_core import BusError
from canopen_core.can import BusThread, Frame, VirtualBus, VirtualWire

pytestmark = pytest.mark.slow

TIMEOUT = 10.0  # [s] deadline for what takes milliseconds
CALLERS, CALLS = 3, 2000


@pytest.mark.parametrize('attempt', range(5))  # what may go wrong does not do so each time
def test_all_that_is_handed_over_around_the_end_is_answered(
    attempt: int, request: pytest.FixtureRequest
) -> None:
    """Several threads refuse the work that is left, each of them what the others have not."""
    request.addfinalizer(partial(sys.setswitchinterval, sys.getswitchinterval()))
    sys.setswitchinterval(1e-6)
    begun, ending = threading.Event(), threading.Event()

    def serve() -> None:
        begun.wait(TIMEOUT)
        thread.do_work()
        ending.wait(TIMEOUT)

    def hand_over() -> list[Future[None]]:
        return [thread.call(lambda: None) for _ in range(CALLS)]

    thread = BusThread(VirtualBus('here', VirtualWire()), 'owner', serve, 'the owner')
    running: Future[None] = thread.run_later(lambda future: begun.set())
    thread.start()
    begun.set()
    with ThreadPoolExecutor(CALLERS) as pool:
        waiting = [future for _ in range(CALLERS) for future in hand_over()]
        callers = [pool.submit(hand_over) for _ in range(CALLERS)]
        ending.set()
        late = [future for caller in callers for future in caller.result()]
    thread.stop()
    for future in (running, *waiting, *late):
        assert future.exception(TIMEOUT) is None or isinstance(future.exception(), BusError)
    with pytest.raises(BusError, match='the owner has ended'):
        running.result(TIMEOUT)


def test_the_thread_does_not_wait_for_itself() -> None:
    """It would stand still for good, with all that it keeps going."""

    def serve() -> None:
        while not thread.stopping:
            thread.do_work()

    thread = BusThread(VirtualBus('here', VirtualWire()), 'owner', serve, 'the owner')
    thread.start()
    try:
        waits = thread.call(lambda: thread.call(lambda: None).result(TIMEOUT))
        with pytest.raises(BusError, match='cannot wait for itself'):
            waits.result(TIMEOUT)
    finally:
        thread.stop()


class DefectiveBus(VirtualBus):
    """A bus whose receiving fails twice."""

    failures = 2

    def receive(self, timeout: float) -> list[Frame]:
        """Fail, then read."""
        if self.failures:
            self.failures -= 1
            raise ZeroDivisionError
        return super().receive(timeout)


def test_a_defect_in_reading_the_bus_does_not_end_the_thread(
    caplog: pytest.LogCaptureFixture,
) -> None:
    """What its owner does each cycle goes on; it is reported once."""
    wire = VirtualWire()
    bus, other = DefectiveBus('here', wire), VirtualBus('there', wire)
    seen: list[Frame] = []

    def serve() -> None:
        while not seen:
            seen.extend(thread.receive(TIMEOUT))

    thread = BusThread(bus, 'owner', serve, 'the owner')
    other.send(Frame(0x181, b''))
    thread.start()
    thread._thread.join(TIMEOUT)
    assert [frame.can_id for frame in seen] == [0x181]
    assert [record.message for record in caplog.records] == ['a defect in reading here']
