# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""100,000 random frames into a whole network: nothing breaks, hangs or moves unasked."""

from __future__ import annotations

import random

from bus_rig import VirtualNetwork
from drive_samples import bus_config, drive_config, PERIOD
import pytest

from arm_canopen import DriveState, OperationMode
from canopen_core.can import Frame
from canopen_core.standard import ALL_NODES, NmtCommand, NmtState

pytestmark = pytest.mark.slow

FRAMES = 50_000  # for each test
BURST = 100  # frames between two looks
RECOVERY_TIME = 30.0  # [s] in which the master has booted the devices again
TARGET = 0.4  # [rad]
NODE_IDS = (2, 3)
COMMANDING = frozenset(
    base + node_id for base in (0x200, 0x300, 0x400, 0x500, 0x600) for node_id in NODE_IDS
)
"""Identifiers that command a drive: whoever sends there may move it."""


def make_network() -> VirtualNetwork:
    """Return a booted network with two drives."""
    names = [drive_config(f'joint{node_id}', node_id) for node_id in NODE_IDS]
    network = VirtualNetwork(bus_config(*names))
    network.boot()
    return network


def random_frame(source: random.Random, *, commanding: bool) -> Frame:
    """Return any frame; half of them have an identifier that somebody listens to."""
    while True:
        can_id = source.randrange(0x800)
        if source.random() < 0.5:
            base = source.choice((0x000, 0x080, 0x100, *range(0x180, 0x800, 0x80)))
            can_id = (base + source.choice((0, 1, *NODE_IDS))) & 0x7FF
        if commanding or can_id not in COMMANDING:
            break
    data = source.randbytes(source.choice((0, 1, 2, 4, 6, 8, 8, 8)))
    if can_id == 0 and source.random() < 0.5:
        data = bytes((source.choice((1, 2, 0x80, 0x81, 0x82)), source.choice((0, *NODE_IDS))))
    kind = source.random()
    return Frame(
        can_id, b'' if kind < 0.02 else data, is_remote=kind < 0.02, is_extended=0.02 < kind < 0.03
    )


def make_noise(network: VirtualNetwork, source: random.Random, *, commanding: bool) -> None:
    """Send a burst, as fast as the bus carries it, and let time pass."""
    for _ in range(BURST):
        network.send_as('noise', random_frame(source, commanding=commanding))
    network.run(source.choice((0.001, 0.01, 0.02)))
    del network.wire.log[:]
    del network.feedback_times[:]


def test_anything_on_the_bus() -> None:
    """Frames at every identifier, NMT and SDO included: the master boots all again by itself.

    Nothing is enabled then. Parameters that the noise has written by SDO are in the devices until
    they are reset, as after any other master; then they move as on the first day.
    """
    source = random.Random(0)
    network = make_network()
    for _ in range(FRAMES // BURST):
        make_noise(network, source, commanding=True)
    assert network.network.unknown_frames > FRAMES // 10
    network.run_until(network.all_ready, RECOVERY_TIME)
    assert_cyclic(network)
    positions = motors(network)
    network.run(5.0)
    assert network.all_ready()
    assert motors(network) == positions
    for name, drive in network.drives.items():
        assert drive.view.fresh
        assert drive.view.state is not DriveState.OPERATION_ENABLED
        assert not drive.accepts_targets
        network.do(name, 'recover')  # what the noise has left behind faults no drive for good
        network.do(name, 'disable')
    network.network.send_nmt(NmtCommand.RESET_NODE, ALL_NODES)
    network.run_until(lambda: not any(node.online for node in network.network.nodes.values()))
    network.run_until(network.all_ready, RECOVERY_TIME)
    for name in network.drives:
        network.do(name, 'recover')
        network.select(name, OperationMode.CYCLIC_POSITION)
        network.commands[name].set_target(TARGET)
    network.run(3.0)
    assert motors(network) == pytest.approx([TARGET] * len(NODE_IDS), abs=1e-3)


def motors(network: VirtualNetwork) -> list[float]:
    """Return where the motors really are in [rad]."""
    return [network.motor(name) for name in network.devices]


def assert_cyclic(network: VirtualNetwork) -> None:
    """Check that SYNC and the RPDOs of each device leave in every cycle."""
    begin = network.now
    network.run(1.0)
    for can_id in (0x080, *(0x200 + node_id for node_id in NODE_IDS)):
        assert len(network.frames(can_id, since=begin)) == pytest.approx(1.0 / PERIOD, abs=2)


def test_noise_moves_nothing() -> None:
    """Frames at all identifiers that command no drive: no drive is enabled, nothing moves."""
    source = random.Random(100)
    network = make_network()
    states: set[NmtState] = set()
    for _ in range(FRAMES // BURST):
        make_noise(network, source, commanding=False)
        for name, device in network.devices.items():
            states.add(device.nmt_state)
            network.simulated(name).advance(network.now)
            assert network.motor(name) == 0.0
            assert not device.store.integer(0x6040).value & 0x08
    assert states == {NmtState.PRE_OPERATIONAL, NmtState.OPERATIONAL, NmtState.STOPPED}
