# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The end of a master whose cycle has ended before it."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
import threading

from config_samples import added, load_text
from isolation import Isolation
import pytest
import rclpy
from rclpy.node import Node

from arm_canopen import (
    BusConfig,
    BusError,
    CanopenError,
    CanopenMaster,
    DriveError,
    Event,
    EventKind,
    MasterProcess,
    Severity,
)
from arm_canopen.config import MasterConfig
from arm_canopen.master.runner import NetworkThread
from arm_canopen.nodes import master
from canopen_core.can import VirtualBus, VirtualWire

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
    made.destroy_node()  # type: ignore[no-untyped-call]
    rclpy.shutdown()


def test_stop_ends_both_threads_after_the_cycle_has_died(node: Node) -> None:
    """It says that the drives could not be stopped, and raises nothing."""
    bus = VirtualBus('here', VirtualWire())
    process = MasterProcess(node, CONFIG, bus, diagnostics_period=60.0)
    before = set(threading.enumerate())
    process.start()
    started = set(threading.enumerate()) - before
    assert {thread.name for thread in started} == {'canopen', 'ros output'}
    end_by_defect(process._thread)
    (cycle,) = [thread for thread in started if thread.name == 'canopen']
    cycle.join(DEADLINE)
    assert not cycle.is_alive()
    with pytest.raises(BusError):
        process.attach(NoSource()).result(DEADLINE)
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


class NoSource:
    """A motion source without axes."""

    axes = ()

    def update(self, *_: object) -> tuple[()]:
        """Answer nothing."""
        return ()

    def released(self, *_: object) -> None:
        """Lose nothing."""
