# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Whatever the mapping: no frame raises an edge before every object that it commands has left.

CiA 402 gives each mode an RPDO of its own with the controlword in it, so that one object stands in
several frames. A device applies event-driven RPDOs as they come, and synchronous ones at SYNC in
an order of its own. So an edge (a new set-point, a power stage that is enabled, another mode, the
end of a halt) may leave together with a value only where a device cannot see it before the value.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import pairwise
import math
import struct

from bus_rig import Sent, START, VirtualNetwork
from drive_samples import bus_config, drive_config, pdo, SCALE
from hypothesis import given, Phase, settings
from hypothesis import strategies as st
import pytest

from arm_canopen import OperationMode
from arm_canopen.config import NodeConfig, PdoConfig
from arm_canopen.standard import CobId, PdoCodec, rpdo_default, SYNCHRONOUS_MAX

pytestmark = pytest.mark.slow

JOINT, NODE_ID = 'joint1', 2
CONTROLWORD, MODE, POSITION, VELOCITY, INTERPOLATION = 0x6040, 0x6060, 0x607A, 0x60FF, 0x60C1
NEW_SET_POINT, HALT, ENABLED = 0x10, 0x100, 0x0F
TARGETS = {
    OperationMode.PROFILE_POSITION: POSITION,
    OperationMode.CYCLIC_POSITION: POSITION,
    OperationMode.PROFILE_VELOCITY: VELOCITY,
    OperationMode.INTERPOLATED_POSITION: INTERPOLATION,
}
OBJECTS = ((CONTROLWORD, 0), (MODE, 0), (POSITION, 0), (VELOCITY, 0), (INTERPOLATION, 1))
BITS = {CONTROLWORD: 16, MODE: 8, POSITION: 32, VELOCITY: 32, INTERPOLATION: 32}

STANDS_AFTER = 0.3  # [s] more than a drive takes to begin a move
UNSHRUNK = (Phase.explicit, Phase.reuse, Phase.generate)
"""Each example takes half a second; a search for the smallest that fails takes minutes."""

Mapping = tuple[tuple[tuple[tuple[int, int], ...], int], ...]

CIA_402_DEFAULT: Mapping = (
    (((CONTROLWORD, 0),), 255),
    (((CONTROLWORD, 0), (MODE, 0)), 255),
    (((CONTROLWORD, 0), (POSITION, 0)), 255),
    (((CONTROLWORD, 0), (VELOCITY, 0)), 255),
)
"""RPDO 1 to 4 as most drives have them (CiA 402-2, 8.1)."""


@st.composite
def mappings(draw: st.DrawFn) -> Mapping:
    """Any distribution of the objects over RPDOs; each is in one of them, or in several."""
    rpdos: list[list[tuple[int, int]]] = [[] for _ in range(draw(st.integers(3, 4)))]
    once = [(entry, {draw(st.integers(0, len(rpdos) - 1))}) for entry in OBJECTS]
    again = [(entry, draw(st.sets(st.integers(0, len(rpdos) - 1)))) for entry in OBJECTS]
    for entry, places in (*once, *again):
        for place in places:
            fits = [rpdo for rpdo in (rpdos[place], *rpdos) if _bits(rpdo) + BITS[entry[0]] <= 64]
            if fits and entry not in fits[0]:
                fits[0].append(entry)
    used = [tuple(draw(st.permutations(rpdo))) for rpdo in rpdos if rpdo]
    return tuple((rpdo, draw(st.sampled_from((0, 1, 255)))) for rpdo in used)


def _bits(rpdo: list[tuple[int, int]]) -> int:
    return sum(BITS[index] for index, _ in rpdo)


def drive_with(mapping: Mapping) -> NodeConfig:
    """Return a drive with this mapping."""
    rpdos = tuple(
        pdo(n, rpdo_default(n, NODE_ID), *objects, transmission=transmission)
        for n, (objects, transmission) in enumerate(mapping, 1)
    )
    return drive_config(JOINT, NODE_ID, rpdos=rpdos)


def booted(mapping: Mapping) -> VirtualNetwork:
    """Return a network with such a drive, enabled."""
    net = VirtualNetwork(bus_config(drive_with(mapping)))
    net.boot()
    net.do(JOINT, 'init')
    return net


def motor(net: VirtualNetwork) -> float:
    """Return where the motor really is in [rad]."""
    drive = net.devices[JOINT].drive
    assert drive is not None
    return drive.position / SCALE


def go(net: VirtualNetwork, *targets: float) -> list[float]:
    """Command targets of mode 1, one after another; return where each ended in [rad]."""
    ends = []
    for target in targets:
        net.commands[JOINT].set_target(target)
        rest(net)
        ends.append(round(motor(net), 3))
    return ends


def rest(net: VirtualNetwork) -> None:
    """Let the drive go wherever it goes, until it has stood for a while."""
    end, before = net.now + 3.0, math.nan
    while net.now < end and before != (before := motor(net)):
        net.run(STANDS_AFTER)


@dataclass
class Reader:
    """What the frames of the master say of one drive, cycle by cycle.

    Attributes:
        rpdos: Its RPDOs.
        values: Values of the objects when the cycle before ended.
    """

    rpdos: tuple[PdoConfig, ...]
    values: dict[int, int] = field(default_factory=dict)

    def violations(self, log: list[Sent]) -> Iterator[str]:
        """Name each edge that a device may see before what it commands."""
        by_id = {rpdo.cob_id: rpdo for rpdo in self.rpdos}
        cycle: list[tuple[PdoConfig, dict[int, int]]] = []
        for sent in log:
            rpdo = by_id.get(sent.frame.can_id)
            if rpdo is not None and sent.sender == 'master':
                numbers = PdoCodec(rpdo.mapping).unpack(sent.frame.data)
                indexes = [mapped.index for mapped in rpdo.mapping]
                cycle.append((rpdo, {i: int(n) for i, n in zip(indexes, numbers, strict=True)}))
            elif sent.frame.can_id == CobId.SYNC:
                yield from self._judge(cycle, sent.time)
                for _, values in cycle:
                    self.values.update(values)
                cycle = []

    def _judge(self, cycle: list[tuple[PdoConfig, dict[int, int]]], time: float) -> Iterator[str]:
        if CONTROLWORD not in self.values:  # it waits until the state of the drive is known
            return
        for at, (rpdo, values) in enumerate(cycle):
            for edge, target in self._edges(values):
                for other, (carrier, carried) in enumerate(cycle):
                    if carried.get(target, self.values[target]) == self.values[target]:
                        continue  # it left before this cycle
                    if other != at and not (other < at and carrier.transmission > SYNCHRONOUS_MAX):
                        yield (
                            f'{time - START:.3f} s: RPDO {rpdo.number}: {edge}, while the new '
                            f'0x{target:04X} is in RPDO {carrier.number}'
                        )

    def _edges(self, values: dict[int, int]) -> Iterator[tuple[str, int]]:
        """Name the edges that a frame raises, each with the object that it commands."""
        word, before = values.get(CONTROLWORD), self.values[CONTROLWORD]
        mode = values.get(MODE, self.values[MODE])
        if mode != self.values[MODE] and mode in TARGETS:
            yield f'mode {mode}', TARGETS[OperationMode(mode)]
        target = TARGETS.get(OperationMode(self.values[MODE]))
        if word is None or target is None:
            return
        if word & ~before & NEW_SET_POINT and mode == OperationMode.PROFILE_POSITION:
            yield 'new set-point', target
        if word & ENABLED == ENABLED != before & ENABLED:
            yield 'enabled', target
        if before & ~word & HALT and mode == OperationMode.PROFILE_VELOCITY:
            yield 'end of the halt', target  # cyclic targets go on from where they were


def assert_edges_come_after_their_objects(net: VirtualNetwork) -> None:
    """Read all that the master has sent."""
    config = net.network.nodes[JOINT].config
    assert list(Reader(config.rpdos).violations(net.wire.log)) == []


def test_the_default_mapping_of_the_profile_executes_each_target() -> None:
    """Each one ends where it was sent, not where the one before was."""
    net = booted(CIA_402_DEFAULT)
    net.select(JOINT, OperationMode.PROFILE_POSITION)
    assert go(net, 0.5, 1.0, 1.5, 0.0) == [0.5, 1.0, 1.5, 0.0]
    assert_edges_come_after_their_objects(net)


@settings(max_examples=25, phases=UNSHRUNK)
@given(mappings())
def test_targets_are_executed_in_every_mapping(mapping: Mapping) -> None:
    """In mode 1, also after a halt, in mode 8 and back, by position of the motor and by frames."""
    net = booted(mapping)
    net.select(JOINT, OperationMode.PROFILE_POSITION)
    assert go(net, 0.5, 0.1) == [0.5, 0.1]
    net.commands[JOINT].set_target(1.0)
    net.run(0.3)
    net.do(JOINT, 'halt')
    assert go(net, 0.2) == [0.2]
    net.select(JOINT, OperationMode.CYCLIC_POSITION)
    assert go(net, 0.4) == [0.4]
    net.select(JOINT, OperationMode.PROFILE_POSITION)
    assert go(net, 0.3) == [0.3]
    assert_edges_come_after_their_objects(net)


SWITCHES = (
    OperationMode.PROFILE_POSITION,
    OperationMode.CYCLIC_POSITION,
    OperationMode.PROFILE_VELOCITY,
    OperationMode.INTERPOLATED_POSITION,
)


@settings(max_examples=25, phases=UNSHRUNK)
@given(mappings(), st.permutations(SWITCHES), st.booleans())
def test_nothing_jumps_in_any_mapping(
    mapping: Mapping, modes: list[OperationMode], enabled: bool
) -> None:
    """Modes are switched, drives enabled and halts ended with targets that have left before."""
    net = booted(mapping)
    for mode in modes:
        if not enabled:
            net.do(JOINT, 'disable')
        net.select(JOINT, mode)
        if not enabled:
            net.do(JOINT, 'enable')
        before = motor(net)
        net.run(0.2)
        assert motor(net) == pytest.approx(before, abs=1e-3)
        net.commands[JOINT].set_target(0.3)
        net.run(0.4)
        net.do(JOINT, 'halt')
        net.commands[JOINT].set_target(-0.2)
        net.run(0.4)
    assert_edges_come_after_their_objects(net)
    for before_inc, after_inc in pairwise(positions(net)):
        assert abs(after_inc - before_inc) / SCALE < 0.03  # [rad] in a cycle at 1 rad/s


def positions(net: VirtualNetwork) -> list[int]:
    """Return the positions that the drive reported, one for each SYNC."""
    return [struct.unpack_from('<i', data)[0] for data in net.frames(0x280 + NODE_ID)]
