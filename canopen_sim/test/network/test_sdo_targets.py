# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Targets that no RPDO carries: confirmed before they act, refused in words, written once.

And drives whose EDS leaves something out, or that have none, and PDOs that lack something.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from itertools import cycle
from pathlib import Path
import re

from bus_rig import booted, JOINT, VirtualNetwork
from drive_samples import bus_config, drive_config, drive_dictionary, DRIVE_EDS, every_mode, PERIOD
import pytest

from arm_canopen import (
    DriveError,
    DriveState,
    load_bus,
    NodeConfig,
    OperationMode,
    Promise,
    SdoAbortError,
    SdoTimeoutError,
    Severity,
)
from arm_canopen.cia402.modes import Move
from arm_canopen.config import BootWrite, DEFAULT_DRIVE
from canopen_core.eds import load_eds
from canopen_core.standard import ObjectDictionary
from canopen_sim import Fault, FaultInjection

pytestmark = pytest.mark.slow

NODE_ID = 2
REQUEST, ANSWER = 0x600 + NODE_ID, 0x580 + NODE_ID
DOWNLOADS = frozenset({0x22, 0x23, 0x27, 0x2B, 0x2F})
POSITION, VELOCITY, VL_VELOCITY, TORQUE = 0x607A, 0x60FF, 0x6042, 0x6071
TARGETS = {
    OperationMode.PROFILE_POSITION: POSITION,
    OperationMode.VELOCITY: VL_VELOCITY,
    OperationMode.PROFILE_VELOCITY: VELOCITY,
    OperationMode.PROFILE_TORQUE: TORQUE,
}


def unmapped() -> NodeConfig:
    """Return a drive whose RPDOs carry controlword and mode only."""
    config = every_mode(drive_config(JOINT, NODE_ID))
    return replace(config, rpdos=config.rpdos[:1])


def running_in(mode: OperationMode) -> VirtualNetwork:
    """Boot such a drive, enable it, and select a mode."""
    net = booted(unmapped())
    net.enable(mode)
    return net


def refuse(net: VirtualNetwork, index: int) -> None:
    """Make the drive abort all transfers of an object."""
    fault = FaultInjection(Fault.SDO_ABORT, object=(index, 0), abort=0x08000022)
    net.devices[JOINT].faults.inject(fault, net.now)


def accept(net: VirtualNetwork) -> None:
    """Make the drive accept everything again."""
    net.devices[JOINT].faults.end(net.now)


def moving(mode: OperationMode, size: float = 0.3) -> float:
    """Return a target that moves a drive in a mode."""
    return 1000.0 * size if mode is OperationMode.PROFILE_TORQUE else size


def downloads(net: VirtualNetwork, since: float = 0.0) -> list[int]:
    """Return the objects that the master has written by SDO."""
    frames = net.frames(REQUEST, since=since)
    return [int.from_bytes(d[1:3], 'little') for d in frames if d[0] in DOWNLOADS]


def give(net: VirtualNetwork, target: float) -> Promise[str]:
    """Command a target as the service ~/target does."""
    commands = net.commands[JOINT]
    return commands.deliver(lambda: commands.set_target(target))


def test_a_refused_holding_value_keeps_the_mode() -> None:
    """The mode of before stays selected, and halted."""
    net = running_in(OperationMode.PROFILE_POSITION)
    net.devices[JOINT].store.find(VELOCITY).value = 3_000
    refuse(net, VELOCITY)
    before = net.motor()
    with pytest.raises(DriveError, match='0x60FF'):
        net.select(JOINT, OperationMode.PROFILE_VELOCITY)
    net.run(0.5)
    assert net.drives[JOINT].view.mode == OperationMode.PROFILE_POSITION
    assert net.motor() == pytest.approx(before, abs=1e-3)
    net.result(give(net, 0.2))
    net.run(2.0)
    assert net.motor() == pytest.approx(0.2, abs=1e-3)


def test_a_target_that_is_refused_at_the_end_of_a_halt_leaves_it_halted() -> None:
    """And the next one, which is taken, ends it."""
    net = running_in(OperationMode.PROFILE_VELOCITY)
    net.result(give(net, 0.4))
    net.run(1.0)
    net.do(JOINT, 'halt')
    refuse(net, VELOCITY)
    with pytest.raises(DriveError, match='present device state'):
        net.result(give(net, -0.3))
    net.run(1.0)
    assert net.drives[JOINT].halt.held
    assert abs(net.drives[JOINT].view.rate) < 0.01
    accept(net)
    net.result(give(net, -0.3))
    net.run(1.0)
    assert net.drives[JOINT].view.rate == pytest.approx(-0.3, abs=0.02)


@pytest.mark.parametrize('mode', TARGETS)
def test_a_refused_target_is_answered_with_the_reason(mode: OperationMode) -> None:
    """What the drive did before goes on, and the next target is executed.

    A drive that refuses the value that would hold it is not enabled.
    """
    net, index = running_in(mode), TARGETS[mode]
    refuse(net, index)
    with pytest.raises(DriveError, match='present device state'):
        net.result(give(net, moving(mode, 0.4)))
    net.run(1.0)
    assert net.motor() == pytest.approx(0.0, abs=1e-3)
    accept(net)
    assert 'target' in net.result(give(net, moving(mode)))
    net.run(3.0)
    assert net.motor() > 0.05
    if mode is OperationMode.PROFILE_POSITION:
        assert net.motor() == pytest.approx(0.3, abs=1e-3)
    net.do(JOINT, 'disable')
    net.devices[JOINT].store.find(index).value = 3_000  # as another client would leave it
    refuse(net, index)
    with pytest.raises(DriveError, match=f'0x{index:04X}.*present device state'):
        net.do(JOINT, 'enable')
    net.run(0.5)
    assert net.drives[JOINT].view.state is not DriveState.OPERATION_ENABLED
    accept(net)
    assert 'Operation enabled' in net.do(JOINT, 'enable')


@pytest.mark.parametrize('lost', [REQUEST, ANSWER])
@pytest.mark.parametrize('mode', TARGETS)
def test_a_target_that_is_not_answered_is_no_success(mode: OperationMode, lost: int) -> None:
    """The drive may have it: as the answer is an error, the axis is halted until the next one."""
    net = running_in(mode)
    net.run(0.1)
    net.lose(lost)
    with pytest.raises(DriveError, match='did not answer'):
        net.result(give(net, moving(mode, 0.4)))
    net.run(1.0)
    assert abs(net.drives[JOINT].view.rate) < 0.01
    assert lost == ANSWER or net.motor() == pytest.approx(0.0, abs=1e-3)
    net.lose()
    net.run(0.5)
    before = net.motor()
    net.result(give(net, moving(mode)))
    net.run(1.0)
    assert net.motor() > before + 0.02


@pytest.mark.parametrize('halted', [False, True])
def test_the_moves_behind_a_refused_one_are_dropped(*, halted: bool) -> None:
    """Each counts from the one before, so none would end where it should; a halt stays."""
    net = running_in(OperationMode.PROFILE_POSITION)
    commands, drive = net.commands[JOINT], net.drives[JOINT]
    if halted:
        net.do(JOINT, 'halt')
    refuse(net, POSITION)
    moves = (Move(0.1), Move(0.2, immediate=False), Move(0.2, relative=True, immediate=False))
    answers = [commands.deliver(partial(commands.move, move)) for move in moves]
    net.run_until(lambda: answers[0].done)
    assert isinstance(answers[0].error, DriveError)
    accept(net)
    net.run(2.0)
    assert all(answered.done for answered in answers)
    assert net.motor() == pytest.approx(0.0, abs=1e-3)
    assert drive.halt.held is halted
    assert not drive.halt.leaving
    with pytest.raises(DriveError, match='absolute position first'):
        commands.move(Move(0.1, relative=True))


def test_of_targets_that_come_faster_than_they_are_written_the_newest_counts() -> None:
    """Each is answered when the drive has the newest."""
    net = running_in(OperationMode.PROFILE_VELOCITY)
    begin = net.now
    answers = [give(net, 0.01 * n) for n in range(1, 30)]
    net.run(1.0)
    assert all('target' in answered.result() for answered in answers)
    assert len(downloads(net, since=begin)) <= 2
    assert net.drives[JOINT].view.rate == pytest.approx(0.29, abs=0.02)


def test_a_stream_whose_targets_are_refused_stops_the_axis() -> None:
    """Nobody waits for an answer, so it is a warning, and the stream has ended."""
    net = running_in(OperationMode.PROFILE_VELOCITY)
    commands = net.commands[JOINT]
    net.result(give(net, 0.2))
    net.run(0.5)
    refuse(net, VELOCITY)
    begin, refused = net.now, ''
    for _ in range(50):
        try:
            commands.stream_target(0.3)
        except DriveError as error:
            refused = str(error)
        net.run(PERIOD)
    assert 'was ended by a target that the drive did not take' in refused
    assert len(downloads(net, since=begin)) < 5
    net.run(1.0)
    assert abs(net.drives[JOINT].view.rate) < 0.01


def test_a_target_after_a_stream_is_not_stopped_by_what_was_under_way() -> None:
    """The drive refuses the last of the stream, which the single target has ended."""
    net = running_in(OperationMode.PROFILE_VELOCITY)
    net.run(0.1)  # the writer pauses after the value that holds it
    commands, node = net.commands[JOINT], net.network.nodes[JOINT]
    under_way: Promise[None] = Promise()

    async def refused(*address: object) -> None:
        await under_way

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(node.objects, 'write_object', refused)
        commands.stream_target(0.1)
        answered = give(net, 0.3)
    under_way.reject(SdoAbortError('0x60FF refused', 0x08000022))
    assert 'target' in net.result(answered)
    net.run(1.0)
    assert not net.drives[JOINT].halt.held
    assert net.drives[JOINT].view.rate == pytest.approx(0.3, abs=0.02)


def test_only_the_target_of_the_mode_is_written() -> None:
    """0x6042 and 0x6071 belong to whoever else uses them; a drive at rest fills no bus."""
    net = booted(unmapped())
    net.run(1.0)
    net.do(JOINT, 'init')
    assert not set(downloads(net)) & set(TARGETS.values())
    net.select(JOINT, OperationMode.PROFILE_VELOCITY)
    net.do(JOINT, 'disable')
    before, begin = net.wire.alters, net.now
    noise = cycle((b'\x00', b'\x05'))  # moved by hand
    net.alter(0x280 + NODE_ID, lambda data: next(noise) + data[1:])
    net.run(2.0)
    assert downloads(net, since=begin) == []
    net.wire.alters = before
    net.do(JOINT, 'enable')
    net.run(1.0)
    assert set(downloads(net)) & set(TARGETS.values()) == {VELOCITY}
    net.select(JOINT, OperationMode.PROFILE_POSITION)
    net.target(0.5)
    net.run(5.0)
    assert net.motor() == pytest.approx(0.5, abs=1e-3)
    begin = net.now
    net.run(2.0)
    assert net.frames(REQUEST, since=begin) == []
    assert net.reported(Severity.WARNING) == []


def test_a_controlword_that_is_refused_is_written_seldom() -> None:
    """Once, then ever less often, with one warning; taken again, it is written as it changes."""
    config = unmapped()
    mode_only = replace(config.rpdos[0], mapping=config.rpdos[0].mapping[1:])
    net = booted(replace(config, rpdos=(mode_only,)))
    net.do(JOINT, 'init')
    refuse(net, 0x6040)
    begin = net.now
    promise = net.begin(JOINT, 'disable')
    net.run(4.0)
    assert 2 <= downloads(net, since=begin).count(0x6040) <= 4
    assert len([text for text in net.reported(Severity.WARNING) if '0x6040' in text]) == 1
    accept(net)
    net.run_until(lambda: promise.done, 10.0)
    net.run_until(lambda: net.drives[JOINT].view.state is not DriveState.OPERATION_ENABLED, 10.0)


def test_of_values_behind_one_that_failed_only_the_newest_is_sent() -> None:
    """Whoever delivered one that was dropped is notified when the device has the newest."""
    net = booted(unmapped())
    node = net.network.nodes[JOINT]
    writer, sent = node.objects.writer(VELOCITY), []
    under_way: Promise[None] = Promise()

    async def write(index: int, subindex: int, value: int) -> None:
        sent.append(value)
        if len(sent) == 1:
            await under_way

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(node.objects, 'write_object', write)
        writer.write(1)
        writer.write(2)
        dropped = writer.deliver(3)
        writer.write(4)
        under_way.reject(SdoTimeoutError('did not answer'))
        net.run(0.2)
    assert sent == [1, 4]
    assert dropped.done
    assert dropped.error is None


def test_a_simulated_drive_has_the_modes_that_its_objects_allow() -> None:
    """0x6502 of EPOS, Kollmorgen and Elmo has no default; the drive is of use all the same."""
    dictionary = ObjectDictionary(
        replace(entry, default=None) if entry.index == 0x6502 else entry
        for entry in drive_dictionary().for_node(2)
        if entry.index not in (0x6071, 0x6042)
    )
    net = booted(replace(drive_config(JOINT, 2), dictionary=dictionary))
    reported = net.drives[JOINT].view.parameters.supported_modes
    assert reported
    has = {mode for mode in OperationMode if mode > 0 and reported & mode.support_bit}
    wanted = {OperationMode.PROFILE_POSITION, OperationMode.HOMING, OperationMode.PROFILE_VELOCITY}
    missing = {OperationMode.PROFILE_TORQUE, OperationMode.CYCLIC_TORQUE, OperationMode.VELOCITY}
    assert wanted <= has
    assert not missing & has
    net.enable(OperationMode.PROFILE_POSITION)
    net.target(0.3)
    net.run(5.0)
    assert net.drives[JOINT].view.position == pytest.approx(0.3, abs=1e-3)


def test_default_mappings_whose_lengths_have_a_flag_of_the_vendor_are_used(tmp_path: Path) -> None:
    """Bit 7 of the length in 0x1600 and 0x1A00 is ignored: by boot, PDOs and the comparison."""

    def flagged(match: re.Match[str]) -> str:
        return f'DefaultValue={match[1]}{int(match[2], 16) | 0x80:02X}'

    pattern = re.compile(r'DefaultValue=(0x60[0-9A-F]{4})(08|10|20)$', re.MULTILINE)
    eds, count = pattern.subn(flagged, DRIVE_EDS.read_text())
    assert count > 10
    (tmp_path / 'drive.eds').write_text(eds)
    (tmp_path / 'bus.yml').write_text(
        'master: {node_id: 1, driver: "ros2_canopen::MasterDriver", sync_period: 10000}\n'
        'joint1: {node_id: 2, driver: "ros2_canopen::Cia402Driver", dcf: drive.eds,\n'
        '  tpdo: {2: {transmission: 1}, 3: {transmission: 1}}, rpdo: {2: {enabled: true}, '
        '3: {enabled: true}}}\n'
    )
    bus = load_bus(tmp_path / 'bus.yml')
    net = VirtualNetwork(bus)
    net.boot()
    net.enable(OperationMode.PROFILE_POSITION)
    net.target(0.3)
    net.run(5.0)
    assert net.drives[JOINT].view.position == pytest.approx(0.3, abs=2e-3)
    held = net.result(net.network.nodes[JOINT].sdo.read(0x1A01, 1, 1.0))
    assert BootWrite(0x1A01, 1, b'\x10\x00\x41\x60', 'tpdo').fits(held)


def test_a_stream_needs_its_rpdo() -> None:
    """A target in every cycle does not go by SDO; the object to be mapped is named."""
    with pytest.raises(DriveError, match='0x607A is in no RPDO'):
        running_in(OperationMode.CYCLIC_POSITION)


@pytest.mark.parametrize('period', [0.02, 0.05, 0.2])
def test_a_position_without_a_tpdo_is_read_once_a_period(period: float) -> None:
    """As often as `period` of the device says, by SDO."""
    config = drive_config(JOINT, 2)
    config = replace(config, tpdos=config.tpdos[:1], poll_period=period)
    net = VirtualNetwork(bus_config(config))
    net.boot()
    begin = net.now
    net.run(2.0)
    requests = [data[:3] for data in net.frames(0x602, since=begin)]
    assert requests.count(b'\x40\x64\x60') == pytest.approx(2.0 / period, rel=0.1)


def test_a_drive_moves_by_the_default_dictionary() -> None:
    """The simulated drive, whose own EDS nobody has read, is booted, enabled and moved."""
    general = load_eds(DEFAULT_DRIVE).dictionary
    config = replace(drive_config('a', 2), dictionary=general.for_node(2), sdo_writes=())
    net = VirtualNetwork(bus_config(config), dictionaries={'a': drive_dictionary().for_node(2)})
    net.boot()
    net.enable(OperationMode.PROFILE_POSITION, 'a')
    net.commands['a'].set_target(0.5)
    net.run(10.0)
    assert net.drives['a'].view.position == pytest.approx(0.5, abs=1e-3)
    assert net.reported(Severity.ERROR) == []
