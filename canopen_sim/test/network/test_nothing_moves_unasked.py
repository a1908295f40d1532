# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Nothing moves unasked and nothing stops with a jerk, by the frames and by the motor.

Whatever the mapping: no frame raises an edge before every object that it commands has left.
CiA 402 gives each mode an RPDO of its own with the controlword in it, so that one object stands in
several frames. A device applies event-driven RPDOs as they come, and synchronous ones at SYNC in
an order of its own. So an edge (a new set-point, a power stage that is enabled, another mode, the
end of a halt) may leave together with a value only where a device cannot see it before the value.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from itertools import pairwise
import struct

from bus_rig import booted, JOINT, Sent, START, VirtualNetwork
from drive_samples import (
    bus_config,
    drive_config,
    every_mode,
    MOTION_WRITES,
    pdo,
    PERIOD,
    SCALE,
    sdo_write,
)
from hypothesis import example, given, Phase, settings
from hypothesis import strategies as st
import pytest

from arm_canopen import (
    CanopenError,
    DriveError,
    DriveState,
    NodeConfig,
    OperationMode,
    Severity,
)
from arm_canopen.config import PdoConfig, SdoWrite
from canopen_core.standard import (
    CobId,
    Controlword,
    NmtCommand,
    PdoCodec,
    POSITION_MODES,
    rpdo_default,
    SYNCHRONOUS_MAX,
    TORQUE_MODES,
)
from canopen_sim import DeviceHost
from canopen_sim.host import add_devices

pytestmark = pytest.mark.slow

NODE_ID = 2
STATE_PDO, POSITION_PDO = 0x180 + NODE_ID, 0x280 + NODE_ID
COMMAND_PDO, TARGET_PDO, STREAM_PDO = 0x200 + NODE_ID, 0x300 + NODE_ID, 0x400 + NODE_ID
SAG_INC = 40
PLACE = -1.25  # [rad] of a drive at power-on
STREAMED = [OperationMode.CYCLIC_POSITION, OperationMode.INTERPOLATED_POSITION]
MODES = [OperationMode.PROFILE_POSITION, OperationMode.PROFILE_VELOCITY, *STREAMED]


def loaded(**changes: object) -> VirtualNetwork:
    """Boot one drive that sags by SAG_INC while it is enabled."""
    net = VirtualNetwork(bus_config(drive_config(JOINT, NODE_ID, **changes)))
    net.droop(SAG_INC)
    net.boot()
    return net


def setpoints(net: VirtualNetwork, since: float) -> list[int]:
    """Return what the master commanded to the streamed mode that the drive was in, in [inc].

    One value for each SYNC at which the drive was enabled in one of these modes.
    """
    targets, mode, state, found = {TARGET_PDO: 0, STREAM_PDO: 0}, 0, 0, []
    for sent in net.wire.log:
        frame = sent.frame
        if frame.can_id in targets:
            targets[frame.can_id] = struct.unpack_from('<i', frame.data)[0]
        elif frame.can_id == STATE_PDO:
            state, mode = struct.unpack('<Hb', frame.data)
        elif frame.can_id == 0x080 and sent.time >= since and state & 0x6F == 0x27:
            if mode == OperationMode.CYCLIC_POSITION:
                found.append(targets[TARGET_PDO])
            elif mode == OperationMode.INTERPOLATED_POSITION:
                found.append(targets[STREAM_PDO])
    return found


def assert_smooth(setpoints: list[int], deceleration: float) -> None:
    """Check that a stream of set-points [inc] neither jumps nor stops with a jerk.

    Args:
        setpoints: One for each cycle.
        deceleration: Limit in [inc/s^2].
    """
    speeds = [(b - a) / PERIOD for a, b in pairwise(setpoints)]
    rounding = 2 / PERIOD  # [inc/s] two neighbours rounded away from each other
    for before, after in pairwise(speeds):
        assert abs(after - before) <= deceleration * PERIOD + rounding, (before, after)


@pytest.mark.parametrize('mode', STREAMED, ids=lambda mode: mode.name)
def test_a_loaded_axis_does_not_sag_when_the_mode_is_switched(mode: OperationMode) -> None:
    """The set-point that holds it stays the target, from streamed mode to streamed mode.

    Also for all the seconds in which a drive refuses its mode, and where the axis has not arrived,
    as it hangs a little below its set-point.
    """
    net = loaded()
    net.enable(mode)
    net.run(0.5)
    begin, rest = net.now, net.simulated().position
    for _ in range(10):
        for other in STREAMED:
            net.select(JOINT, other)
            net.run(0.05)
    assert net.simulated().position == pytest.approx(rest, abs=1)
    assert len(set(setpoints(net, begin))) == 1
    net.select(JOINT, mode)
    net.target(0.2)
    net.run(2.0)
    begin = net.now
    net.keep_mode(mode)
    with pytest.raises(DriveError, match='did not reach mode Profile position in 0x6061'):
        net.select(JOINT, OperationMode.PROFILE_POSITION)
    net.run(0.5)
    assert set(setpoints(net, begin)) == {round(0.2 * SCALE)}
    with pytest.raises(DriveError, match=r'not at its target.*was halted'):
        net.master.drive(JOINT).move_to(0.22)
    net.run(0.5)
    assert setpoints(net, net.now - 0.2)[-1] == round(0.22 * SCALE)


@pytest.mark.parametrize('other', [*MODES, None], ids=str)
@pytest.mark.parametrize('mode', STREAMED, ids=lambda mode: mode.name)
def test_a_switch_in_motion_brakes_first(mode: OperationMode, other: OperationMode | None) -> None:
    """A moving profile comes to rest within its limits before another mode is commanded."""
    if other is mode:
        return
    net = loaded()
    net.enable(mode)
    net.target(0.8)
    net.run(0.4)
    assert net.drives[JOINT].view.velocity > 0.5
    begin = net.now
    if other is None:
        net.do(JOINT, 'init')
    else:
        net.select(JOINT, other)
    net.run(0.5)
    assert_smooth(setpoints(net, begin - 0.1), 50_000)
    assert net.drives[JOINT].view.velocity == 0.0
    assert net.drives[JOINT].view.mode == (other or OperationMode.NO_MODE)


WRONG = {'scale_pos_from_dev': 0.001, 'offset_pos_from_dev': 0.7, 'offset_pos_to_dev': 333.0}


@pytest.mark.parametrize('scales', [{}, WRONG], ids=['', 'contradicting factors'])
@pytest.mark.parametrize('kept', [0, 8], ids=['', 'refuses mode 0'])
@pytest.mark.parametrize('mode', MODES, ids=lambda mode: mode.name)
def test_enabling_holds_the_motor_where_it_was_moved_by_hand(
    mode: OperationMode, kept: int, scales: dict[str, float]
) -> None:
    """Disabled, moved, enabled: it stays, in each mode, however wrong bus.yml is.

    Some drives refuse mode 0 and stay in mode 8: its target is preloaded all the same.
    """
    net = loaded(scales=scales, sdo_writes=(*MOTION_WRITES, sdo_write(0x607C, 0, 5_000)))
    drive = net.simulated()
    net.enable(mode)
    if mode is not OperationMode.PROFILE_VELOCITY and not scales:
        net.target(0.3)
        net.run(2.0)
    net.do(JOINT, 'disable')
    if kept:
        net.droop(0)
        net.keep_mode(kept)
        net.drives[JOINT].select(net.drives[JOINT].modes[OperationMode.NO_MODE])
    drive.count_from(drive.position - 1234, net.now)
    net.run(0.1)
    rest = drive.position
    net.do(JOINT, 'init' if kept else 'enable')
    net.run(1.0)
    assert drive.position == pytest.approx(rest, abs=1 if kept else SAG_INC + 1)
    assert net.drives[JOINT].view.mode == (kept or mode)


@pytest.mark.parametrize('mapped', [False, True])
@pytest.mark.parametrize(
    ('mode', 'offset', 'value'),
    [
        (OperationMode.CYCLIC_POSITION, 0x60B0, 1_000),
        (OperationMode.CYCLIC_VELOCITY, 0x60B1, 2_000),
        (OperationMode.CYCLIC_TORQUE, 0x60B2, 300),
    ],
)
def test_an_offset_of_the_drive_moves_nothing(
    mode: OperationMode, offset: int, value: int, *, mapped: bool
) -> None:
    """Each enable and each switch holds where the drive is, whatever it adds to its target."""
    config = every_mode(drive_config(JOINT, NODE_ID))
    if mapped:
        config = replace(config, rpdos=(*config.rpdos, pdo(4, 0x500 + NODE_ID, (offset, 0))))
    writes = (*MOTION_WRITES, sdo_write(offset, 0, value))
    net = booted(replace(config, sdo_writes=writes))
    drive = net.simulated()
    for _ in range(2):
        net.enable(mode)
        net.run(1.0)
        net.select(JOINT, OperationMode.PROFILE_POSITION)
        net.select(JOINT, mode)
        net.run(1.0)
        assert drive.position == pytest.approx(0.0, abs=1)
        net.do(JOINT, 'disable')
        if mapped:  # changed while the axis rests
            net.run(0.1)
            net.network.publish_objects(net.network.nodes[JOINT], {(offset, 0): -value})
            net.run(0.1)
    net.enable(mode)
    if mode is OperationMode.CYCLIC_POSITION:
        net.target(0.5)
        net.run(3.0)
        assert drive.position == pytest.approx(5_000, abs=1)


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
UNSHRUNK = (Phase.explicit, Phase.reuse, Phase.generate)
"""Each example takes half a second; a search for the smallest that fails takes minutes."""

CIA_402_DEFAULT = tuple(
    (((CONTROLWORD, 0), *others), 255)
    for others in ((), *(((i, 0),) for i in (MODE, POSITION, VELOCITY)))
)
"""RPDO 1 to 4 as most drives have them (CiA 402-2, 8.1)."""

Mapping = tuple[tuple[tuple[tuple[int, int], ...], int], ...]


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


@dataclass
class Reader:
    """What the frames of the master say of one drive, cycle by cycle."""

    rpdos: tuple[PdoConfig, ...]  # its RPDOs
    # values of the objects when the cycle before ended
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


@settings(max_examples=16, phases=UNSHRUNK)
@given(mappings(), st.permutations(tuple(TARGETS)), st.booleans())
@example(CIA_402_DEFAULT, list(TARGETS)[:3], False)
def test_nothing_jumps_in_any_mapping(
    mapping: Mapping, modes: list[OperationMode], enabled: bool
) -> None:
    """Each target is executed, and leaves before any edge, as frames and motor show it.

    Modes are switched, drives enabled and halts ended, with targets that have left before.
    """
    rpdos = tuple(
        pdo(n, rpdo_default(n, NODE_ID), *objects, transmission=transmission)
        for n, (objects, transmission) in enumerate(mapping, 1)
    )
    net = booted(drive_config(JOINT, NODE_ID, rpdos=rpdos))
    net.do(JOINT, 'init')
    for mode in modes:
        if not enabled:
            net.do(JOINT, 'disable')
        net.select(JOINT, mode)
        if not enabled:
            net.do(JOINT, 'enable')
        before = net.motor()
        net.run(0.2)
        assert net.motor() == pytest.approx(before, abs=1e-3)
        net.target(0.3)
        net.run(0.4)
        net.do(JOINT, 'halt')
        for target in (-0.2, 0.1):
            net.target(target)
            net.run(1.0)
            if mode in POSITION_MODES:
                assert net.motor() == pytest.approx(target, abs=1e-3)
            else:
                assert net.speed() == pytest.approx(target, abs=1e-3)
    assert list(Reader(rpdos).violations(net.wire.log)) == []
    shown = [struct.unpack_from('<i', data)[0] for data in net.frames(POSITION_PDO)]
    for before_inc, after_inc in pairwise(shown):
        assert abs(after_inc - before_inc) / SCALE < 0.03  # [rad] in a cycle at 1 rad/s


def kept_alive(config: NodeConfig | None = None) -> VirtualNetwork:
    """Return a network whose drive is enabled by a first master, which does not watch it."""
    config = config or every_mode(drive_config(JOINT, NODE_ID))
    net = booted(replace(config, reset_communication=False))
    net.do(JOINT, 'init')
    return net


def take_over(net: VirtualNetwork) -> float:
    """Let another master find the drive; return when it began in [s]."""
    net.replace_master()
    begin = net.now
    net.start()
    net.run_until(net.all_ready)
    return begin


@pytest.mark.parametrize('mode', STREAMED)
def test_a_drive_that_holds_goes_on_holding(mode: OperationMode) -> None:
    """No state is left, no position changes, and the new master commands it at once."""
    net = kept_alive()
    net.select(JOINT, mode)
    net.target(0.3)
    net.run(3.0)
    at_rest, begin, seen = net.motor(), net.now, []
    net.replace_master()
    net.start()
    for _ in range(1000):
        net.run(0.001)
        seen.append(net.motor())
    drive = net.drives[JOINT]
    assert net.network.nodes[JOINT].taken_over
    assert drive.view.state is DriveState.OPERATION_ENABLED
    assert drive.accepts_targets
    shown = [struct.unpack_from('<i', data)[0] for data in net.frames(POSITION_PDO, since=begin)]
    seen += [position / SCALE for position in shown]
    assert max(abs(position - at_rest) for position in seen) <= 1e-4
    assert all(word & 0x0F == 0x0F for word in net.controlwords(JOINT, since=begin))
    assert any('taken over enabled' in text for text in net.reported())
    net.target(0.5)
    net.run(3.0)
    assert drive.view.position == pytest.approx(0.5, abs=1e-3)
    net.network.send_nmt(NmtCommand.ENTER_PRE_OPERATIONAL, NODE_ID)
    net.run(0.5)
    net.network.send_nmt(NmtCommand.START, NODE_ID)
    net.run(1.0)
    assert drive.view.state is not DriveState.OPERATION_ENABLED, 'a stop by NMT ends the take-over'
    assert net.reported(Severity.ERROR) == []


@pytest.mark.parametrize(
    ('mode', 'way'),
    [
        *((mode, way) for mode in TORQUE_MODES for way in ('0x6077', 'no 0x6077')),
        (OperationMode.PROFILE_TORQUE, 'SDO'),
    ],
)
def test_a_torque_that_holds_a_load_is_taken_over_as_it_is(mode: OperationMode, way: str) -> None:
    """Whether a TPDO brings the torque, and an RPDO the target, or not."""
    config = every_mode(drive_config(JOINT, NODE_ID))
    if way != '0x6077':
        config = replace(config, tpdos=config.tpdos[:2])
    if way == 'SDO':
        config = replace(config, rpdos=config.rpdos[:2])
    net = kept_alive(config)
    net.select(JOINT, mode)
    net.simulated().set_load(150, net.now)
    net.target(150.0)
    net.run(1.0)
    net.do(JOINT, 'halt')
    net.target(150.0)
    net.run(0.5)
    begin = net.motor()
    assert net.speed() == pytest.approx(0.0, abs=1e-2)
    take_over(net)
    net.run(1.5)
    assert net.motor() == pytest.approx(begin, abs=1e-2)
    assert any('it stands' in text for text in net.reported())


@pytest.mark.parametrize(
    ('mode', 'target'),
    [
        (OperationMode.PROFILE_POSITION, 6.0),
        (OperationMode.PROFILE_VELOCITY, 1.0),
        *((mode, 100.0) for mode in TORQUE_MODES),
    ],
)
def test_a_drive_that_moves_is_halted_by_the_new_master(
    mode: OperationMode, target: float
) -> None:
    """What another master has begun does not go on, and the report says so."""
    net = kept_alive()
    net.select(JOINT, mode)
    net.target(target)
    net.run(1.0)
    begin = net.motor()
    take_over(net)
    net.run(1.5)
    assert net.speed() == pytest.approx(0.0, abs=1e-2)
    assert begin < net.motor() < 3.0
    assert net.drives[JOINT].view.state is DriveState.OPERATION_ENABLED
    assert not any('it holds' in text for text in net.reported())
    net.target(-target)
    net.run(0.5)
    assert net.speed() < -0.01


@pytest.mark.parametrize('enabled', [True, False])
def test_a_drive_that_stands_is_taken_over_as_it_is(*, enabled: bool) -> None:
    """In a profile mode it is not halted; one that is not enabled is not enabled."""
    net = kept_alive()
    net.select(JOINT, OperationMode.PROFILE_POSITION)
    if not enabled:
        net.do(JOINT, 'disable')
    begin = take_over(net)
    net.run(1.0)
    assert not any(word & Controlword.HALT for word in net.controlwords(JOINT, since=begin))
    assert any('it stands' in text for text in net.reported()) is enabled
    assert (net.simulated().state is DriveState.OPERATION_ENABLED) is enabled
    assert (net.drives[JOINT].goal is None) is not enabled


SCALES: dict[str, dict[str, float]] = {
    'scale': {},
    'turned': {'scale_pos_to_dev': -2000.0, 'scale_pos_from_dev': -0.0005},
    'offset': {'offset_pos_to_dev': 300.0, 'offset_pos_from_dev': -300.0 / SCALE},
    'factor group': {'scale_from_factor_group': True},
}


def switched_on_at(position: float, config: NodeConfig) -> VirtualNetwork:
    """Return a booted network whose drive stood at a position when it got power."""
    host, bus = DeviceHost(lambda frame: None), bus_config(config)
    add_devices(host, bus, {JOINT: position})
    net = VirtualNetwork(bus)
    net.simulated().count_from(host.devices[0].drives[0].position)
    net.boot()
    return net


@pytest.mark.parametrize('factor', [[], [sdo_write(0x6092, 1, 3_141_592)]], ids=['', '0x6092'])
@pytest.mark.parametrize('scales', SCALES.values(), ids=SCALES)
def test_the_master_reads_the_position_in_the_units_of_bus_yml(
    scales: dict[str, float], factor: list[SdoWrite]
) -> None:
    """Whatever scales it; an SDO that changes the factor group counts, too."""
    config = drive_config(JOINT, NODE_ID, scales=scales, sdo_writes=(*MOTION_WRITES, *factor))
    net = switched_on_at(PLACE, config)
    net.run(0.2)
    assert net.drives[JOINT].view.position == pytest.approx(PLACE, abs=1e-3)
    device, drive = net.devices[JOINT], net.simulated()
    held = drive.position
    for kept in (True, False):  # an absolute encoder, or one that counts from 0 at power-on
        device.switch_off(net.now)
        device.switch_on(net.now, position_kept=kept)
        assert drive.position == (held if kept else 0.0)


@pytest.mark.parametrize(('method', 'moves'), [(19, True), (35, False)])
def test_homing_begins_there(method: int, moves: bool) -> None:
    """Home is where the switch is, or where the drive is; it is 0 afterwards, as without."""
    net = switched_on_at(PLACE, drive_config(JOINT, NODE_ID))
    drive = net.simulated()
    start = drive.position - drive.origin
    net.result(net.home(method), 200.0)
    net.run(0.2)
    assert net.drives[JOINT].view.position == pytest.approx(0.0, abs=2e-3)
    assert (abs(drive.position - drive.origin - start) > 100) is moves


@pytest.mark.parametrize(
    ('positions', 'words'),
    [
        ({'joint7': 0.1}, "no drive 'joint7' in .*bus.yml; drives: joint1"),
        ({JOINT: float('nan')}, 'joint1: position nan'),
        ({JOINT: 3e5}, r'joint1: position 300000 is 3e\+09 increments'),
    ],
)
def test_what_no_drive_can_report_is_refused(positions: dict[str, float], words: str) -> None:
    """With name and value."""
    with pytest.raises(CanopenError, match=words):
        add_devices(
            DeviceHost(lambda frame: None), bus_config(drive_config(JOINT, NODE_ID)), positions
        )
