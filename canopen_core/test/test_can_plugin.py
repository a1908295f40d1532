# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Our buses from the outside: python-can's Notifier and tools, and python-canopen."""

from __future__ import annotations

from collections.abc import Iterator
import os
from pathlib import Path
import subprocess
import sys
from time import time

import can
from can.interfaces import BACKENDS
from can_addresses import free_multicast, free_virtual
from can_receiving import DEADLINE, receive_count, unstamped
import canopen
import pytest

from canopen_core.can import Bus, Frame, open_bus
from canopen_core.can.adapter import to_message
from canopen_core.can.plugin import ArmCanopenBus

pytestmark = pytest.mark.slow

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
    """Sending through python-can is sending on our bus."""
    frames = [Frame(0x181, b'\x01'), Frame(0x12345, is_extended=True), Frame(1, is_remote=True)]
    for frame in frames:
        theirs.send(to_message(frame))
    assert unstamped(receive_count(ours, len(frames))) == frames


def test_filters_of_python_can_work(ours: Bus, theirs: can.BusABC) -> None:
    """set_filters keeps everything else out."""
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


def test_python_canopen_runs_on_it(ours: Bus, theirs: can.BusABC) -> None:
    """python-canopen's network sends NMT over our bus and follows a heartbeat from it."""
    network = canopen.Network(theirs)
    network.connect()
    try:
        node = network.add_node(5, canopen.ObjectDictionary())  # type: ignore[no-untyped-call]
        node.nmt.send_command(0x01)
        assert unstamped(receive_count(ours, 1)) == [Frame(0x000, b'\x01\x05')]
        ours.send(Frame(0x705, b'\x7f'))
        assert node.nmt.wait_for_heartbeat(DEADLINE) == 'PRE-OPERATIONAL'
    finally:
        network.disconnect()


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
