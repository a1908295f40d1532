# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The thread of the network: nothing that one caller or one frame does harms the others."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import Future
from pathlib import Path
import threading

import pytest

from arm_canopen.can.frame import Frame
from arm_canopen.can.virtual import VirtualBus, VirtualWire
from arm_canopen.config.master_model import MasterConfig
from arm_canopen.config.model import BusConfig
from arm_canopen.exceptions import BusError
from arm_canopen.master.network import Network
from arm_canopen.master.runner import NetworkThread
from arm_canopen.master.scheduler import Promise

PATIENCE = 10.0  # [s] deadline for what takes milliseconds


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


def test_a_caller_that_gives_up_does_not_hold_up_the_others(bench: Bench) -> None:
    """A cancelled future is passed over."""
    gate = threading.Event()
    bench.thread.call(lambda: gate.wait(PATIENCE))
    given_up: Future[None] = bench.thread.call(lambda: None)
    after = bench.thread.call(lambda: 42)
    assert given_up.cancel()
    gate.set()
    assert after.result(PATIENCE) == 42


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

    bench.thread.call(lambda: setattr(bench.network, 'on_frame', take)).result(PATIENCE)
    gate = threading.Event()
    bench.thread.call(lambda: gate.wait(PATIENCE))
    for number in (1, 2, 3):
        bench.other.send(Frame(0x180 + number, b''))
    gate.set()
    assert done.wait(PATIENCE)
    assert seen == [0x181, 0x182, 0x183]
    assert 'a defect in the CANopen master, at the frame' in caplog.text


def test_an_error_of_a_call_belongs_to_its_caller(bench: Bench) -> None:
    """It reaches the future, and the thread goes on."""
    with pytest.raises(ZeroDivisionError):
        bench.thread.call(lambda: 1 // 0).result(PATIENCE)

    def broken() -> Promise[None]:
        raise KeyError('x')

    with pytest.raises(KeyError):
        bench.thread.run(broken).result(PATIENCE)
    assert bench.thread.call(lambda: 1).result(PATIENCE) == 1


def test_nobody_waits_for_a_thread_that_has_ended(bench: Bench) -> None:
    """What runs, and what is asked for afterwards, ends with the reason."""
    never: Promise[None] = Promise()
    running = bench.thread.run(lambda: never)
    bench.thread.call(lambda: None).result(PATIENCE)
    bench.thread.stop()
    for future in (running, bench.thread.call(lambda: None)):
        with pytest.raises(BusError, match='the CANopen master has ended'):
            future.result(PATIENCE)
    never.resolve(None)
