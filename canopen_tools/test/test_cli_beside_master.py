# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``canopen`` beside a running master: it disturbs nobody, and agrees with what was booted."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
import shutil
import threading
import time

from can_addresses import free_virtual
from config_samples import ARTICLE_BUS
from device_rig import EDS
import pytest

from arm_canopen import Event, EventKind, load_bus, SdoError, Severity
from arm_canopen.master.network import Network
from arm_canopen.master.runner import NetworkThread
from canopen_core.can import open_bus
from canopen_sim import DeviceRunner
from canopen_tools.cli.main import main

DEADLINE = 20.0  # [s]


class Robot:
    """The article's master and two of its joints, on a bus of this process."""

    def __init__(self, folder: Path) -> None:
        self.name = free_virtual()  # name of the bus
        shutil.copy(EDS, folder / 'cia402_slave.eds')
        text = ARTICLE_BUS.read_text('utf-8')
        self.bus_yml = folder / 'bus.yml'  # its configuration
        self.bus_yml.write_text(text[: text.index('  panda_joint3:')], 'utf-8')
        config = load_bus(self.bus_yml)
        self.events: list[Event] = []  # what the master reported
        self._buses = [open_bus(self.name) for _ in range(2)]
        self._devices = DeviceRunner(self._buses[0])
        for node in config.nodes:
            self._devices.host.add(node.node_id, node.dictionary)
        self.network = Network(config, self._buses[1].send, self.events.append)  # the master
        self.thread = NetworkThread(self._buses[1], self.network)  # the master's thread
        self._devices.start()
        self.thread.start()
        self._await_boot()

    @property
    def complaints(self) -> list[str]:
        """What the master reported as warnings or errors, but for a computer that is too busy."""
        return [
            str(event)
            for event in self.events
            if event.severity >= Severity.WARNING and event.kind is not EventKind.CYCLE
        ]

    def all_online(self) -> bool:
        """Return whether every device is booted and has not been lost."""
        return all(node.online for node in self.network.nodes.values())

    def end(self) -> None:
        """End everything."""
        self.thread.stop()
        self._devices.stop()
        for bus in self._buses:
            bus.close()

    def _await_boot(self) -> None:
        end = time.monotonic() + DEADLINE
        while not self.thread.call(self.all_online).result(DEADLINE):
            assert time.monotonic() < end, [str(event) for event in self.events]
            time.sleep(0.01)


@pytest.fixture
def robot(tmp_path: Path) -> Iterator[Robot]:
    """A robot that runs."""
    made = Robot(tmp_path)
    yield made
    made.end()


def test_the_booted_devices_are_as_the_files_say(
    robot: Robot, capsys: pytest.CaptureFixture[str]
) -> None:
    """Diff finds nothing that the master has not written, and scan nobody else."""
    arguments = ['--can', robot.name, '--bus-config', str(robot.bus_yml)]
    for name in ('panda_joint1', 'panda_joint2'):
        assert main(['diff', name, *arguments]) == 0, capsys.readouterr().out
    assert main(['scan', *arguments, '--listen', '1.2']) == 0
    rows = capsys.readouterr().out.splitlines()[-3:-1]
    assert [row.split() for row in rows] == [
        ['2', 'panda_joint1', 'operational'],
        ['3', 'panda_joint2', 'operational'],
    ]
    assert robot.complaints == []


def test_the_master_is_not_disturbed(robot: Robot) -> None:
    """While it reads and writes all the time, others read, and nothing of it fails."""
    stop = threading.Event()
    failures: list[SdoError] = []
    transfers = 0

    def keep_busy() -> None:
        nonlocal transfers
        node = robot.network.nodes['panda_joint1']
        while not stop.is_set():
            try:
                robot.thread.run(lambda: node.sdo.read(0x6083, 0, 1.0)).result(DEADLINE)
                transfers += 1
            except SdoError as error:
                failures.append(error)
            stop.wait(0.03)

    thread = threading.Thread(target=keep_busy)
    thread.start()
    try:
        arguments = ['--can', robot.name, '--bus-config', str(robot.bus_yml)]
        former = '--ask'  # codespell:ignore ask
        assert main(['scan', *arguments, former, '--listen', '0.2']) == 0
        assert main(['diff', 'panda_joint1', *arguments]) == 0
    finally:
        stop.set()
        thread.join()
    assert transfers > 5
    assert failures == []
    assert robot.complaints == []
    assert robot.thread.call(robot.all_online).result(DEADLINE)
