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
import math
from pathlib import Path
import struct

from bus_rig import booted, JOINT, Sent, START, VirtualNetwork
from drive_samples import (
    bus_config,
    drive_config,
    DRIVE_EDS,
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
    BusConfig,
    CanopenError,
    DriveError,
    DriveState,
    load_bus,
    OperationMode,
    Severity,
)
from arm_canopen.config import PdoConfig
from canopen_core.standard import (
    CobId,
    Controlword,
    NmtCommand,
    PdoCodec,
    rpdo_default,
    SYNCHRONOUS_MAX,
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
    """The set-point that holds it stays the target, from streamed mode to streamed mode."""
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


@pytest.mark.parametrize('mode', STREAMED, ids=lambda mode: mode.name)
def test_a_loaded_axis_does_not_sag_when_it_has_not_arrived(mode: OperationMode) -> None:
    """The set-point on which it hangs is kept, as it stands a little below it only."""
    net = loaded()
    net.enable(mode)
    net.run(0.5)
    target = net.drives[JOINT].setpoint + 0.02
    with pytest.raises(DriveError, match=r'not at its target.*was halted'):
        net.master.drive(JOINT).move_to(target)
    net.run(0.5)
    assert setpoints(net, net.now - 0.2)[-1] == round(target * SCALE)


@pytest.mark.parametrize('mode', STREAMED, ids=lambda mode: mode.name)
def test_a_mode_switch_that_the_drive_refuses_leaves_it_where_it_is(mode: OperationMode) -> None:
    """For all the seconds of the time-out the set-point that holds the load does not change."""
    net = loaded()
    net.enable(mode)
    net.target(0.2)
    net.run(2.0)
    begin = net.now

    net.keep_mode(mode)
    with pytest.raises(DriveError, match='did not reach mode Profile position in 0x6061'):
        net.select(JOINT, OperationMode.PROFILE_POSITION)
    net.run(0.5)
    assert set(setpoints(net, begin)) == {round(0.2 * SCALE)}
    net.target(0.1)
    net.run(2.0)
    assert setpoints(net, begin)[-1] == round(0.1 * SCALE)


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


@pytest.mark.parametrize('mode', MODES, ids=lambda mode: mode.name)
def test_enabling_holds_the_motor_where_it_was_moved_by_hand(mode: OperationMode) -> None:
    """Disabled, moved, enabled: it stays, in each mode."""
    net = loaded()
    net.enable(mode)
    if mode is not OperationMode.PROFILE_VELOCITY:
        net.target(0.3)
        net.run(2.0)
    net.do(JOINT, 'disable')
    drive = net.simulated()
    drive.count_from(drive.position - 1234, net.now)
    net.run(0.1)
    rest = net.simulated().position
    net.do(JOINT, 'enable')
    net.run(1.0)
    assert net.simulated().position == pytest.approx(rest, abs=SAG_INC + 1)


def test_a_drive_that_keeps_its_mode_does_not_jump_when_it_is_enabled() -> None:
    """Some drives refuse mode 0 and stay in mode 8: its target is preloaded all the same."""
    net = loaded()
    net.enable(OperationMode.CYCLIC_POSITION)
    net.target(0.3)
    net.run(2.0)
    net.do(JOINT, 'disable')

    net.droop(0)
    net.keep_mode(8)
    drive = net.simulated()
    net.drives[JOINT].select(net.drives[JOINT].modes[OperationMode.NO_MODE])
    drive.count_from(drive.position - 1234, net.now)
    net.run(0.1)
    rest = net.simulated().position
    net.do(JOINT, 'init')
    net.run(1.0)
    assert net.drives[JOINT].view.mode == OperationMode.CYCLIC_POSITION
    assert net.simulated().position == pytest.approx(rest, abs=1)


@pytest.mark.parametrize('mode', MODES, ids=lambda mode: mode.name)
def test_factors_that_contradict_each_other_move_nothing(mode: OperationMode) -> None:
    """However wrong the factors in bus.yml are, the preloaded target is where the drive is."""
    scales = {'scale_pos_from_dev': 0.001, 'offset_pos_from_dev': 0.7, 'offset_pos_to_dev': 333.0}
    net = loaded(scales=scales, sdo_writes=(*MOTION_WRITES, sdo_write(0x607C, 0, 5_000)))
    drive = net.simulated()
    drive.count_from(drive.position + 7_000, net.now)
    net.run(0.1)
    net.enable(mode)
    net.run(1.0)
    assert net.simulated().position == pytest.approx(7_000, abs=SAG_INC + 1)


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


def mapped(mapping: Mapping) -> VirtualNetwork:
    """Return a network with an enabled drive that has this mapping."""
    rpdos = tuple(
        pdo(n, rpdo_default(n, NODE_ID), *objects, transmission=transmission)
        for n, (objects, transmission) in enumerate(mapping, 1)
    )
    net = booted(drive_config(JOINT, NODE_ID, rpdos=rpdos))
    net.do(JOINT, 'init')
    return net


def go(net: VirtualNetwork, *targets: float) -> list[float]:
    """Command targets of mode 1, one after another; return where each ended in [rad]."""
    ends = []
    for target in targets:
        net.target(target)
        rest(net)
        ends.append(round(net.motor(), 3))
    return ends


def rest(net: VirtualNetwork) -> None:
    """Run until the drive has stood for a while, wherever it goes."""
    end, before = net.now + 3.0, math.nan
    while net.now < end and before != (before := net.motor()):
        net.run(STANDS_AFTER)


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


def assert_edges_come_after_their_objects(net: VirtualNetwork) -> None:
    """Read all that the master has sent."""
    config = net.network.nodes[JOINT].config
    assert list(Reader(config.rpdos).violations(net.wire.log)) == []


@settings(max_examples=25, phases=UNSHRUNK)
@given(mappings())
@example(CIA_402_DEFAULT)
def test_targets_are_executed_in_every_mapping(mapping: Mapping) -> None:
    """In mode 1, also after a halt, in mode 8 and back, by position of the motor and by frames."""
    net = mapped(mapping)
    net.select(JOINT, OperationMode.PROFILE_POSITION)
    assert go(net, 0.5, 0.1) == [0.5, 0.1]
    net.target(1.0)
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
    net = mapped(mapping)
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
        net.target(-0.2)
        net.run(0.4)
    assert_edges_come_after_their_objects(net)
    for before_inc, after_inc in pairwise(positions(net)):
        assert abs(after_inc - before_inc) / SCALE < 0.03  # [rad] in a cycle at 1 rad/s


def positions(net: VirtualNetwork) -> list[int]:
    """Return the positions that the drive reported, one for each SYNC."""
    return [struct.unpack_from('<i', data)[0] for data in net.frames(0x280 + NODE_ID)]


LOAD = 0.2  # share of the rated torque
CYCLIC = [OperationMode.CYCLIC_POSITION, OperationMode.INTERPOLATED_POSITION]


def kept_alive() -> VirtualNetwork:
    """Return a network whose drive is enabled by a first master, which does not watch it."""
    net = booted(replace(every_mode(drive_config('a', 2)), reset_communication=False))
    net.do('a', 'init')
    return net


def motor_positions(net: VirtualNetwork, duration: float) -> list[float]:
    """Return where the motor was in each millisecond of a time in [s]."""
    seen = []
    for _ in range(round(duration * 1000)):
        net.run(0.001)
        seen.append(float(net.devices['a'].store.find(0x6064).value))
    return seen


@pytest.mark.parametrize('mode', CYCLIC)
def test_a_drive_that_holds_goes_on_holding(mode: OperationMode) -> None:
    """No state is left, no position changes, and the new master commands it at once."""
    net = kept_alive()
    net.select('a', mode)
    net.commands['a'].set_target(0.3)
    net.run(3.0)
    at_rest = motor_positions(net, 0.01)[-1]
    begin = net.now
    net.replace_master()
    net.start()
    seen = motor_positions(net, 1.0)
    drive = net.drives['a']
    assert net.network.nodes['a'].taken_over
    assert drive.view.state is DriveState.OPERATION_ENABLED
    assert drive.accepts_targets
    assert max(abs(position - at_rest) for position in seen) <= 1
    assert all(word & 0x0F == 0x0F for word in net.controlwords('a', since=begin))
    assert any('taken over enabled' in text for text in net.reported())
    net.commands['a'].set_target(0.5)
    net.run(3.0)
    assert drive.view.position == pytest.approx(0.5, abs=1e-3)


@pytest.mark.parametrize(
    ('mode', 'way'),
    [
        (OperationMode.PROFILE_TORQUE, '0x6077'),
        (OperationMode.PROFILE_TORQUE, 'no 0x6077'),
        (OperationMode.PROFILE_TORQUE, 'SDO'),
        (OperationMode.CYCLIC_TORQUE, '0x6077'),
        (OperationMode.CYCLIC_TORQUE, 'no 0x6077'),
    ],
)
def test_a_torque_that_holds_a_load_is_taken_over_as_it_is(mode: OperationMode, way: str) -> None:
    """Whether a TPDO brings the torque, and an RPDO the target, or not."""
    config = every_mode(drive_config('a', 2))
    if way != '0x6077':
        config = replace(config, tpdos=config.tpdos[:2])
    if way == 'SDO':
        config = replace(config, rpdos=config.rpdos[:2])
    net = booted(replace(config, reset_communication=False))
    net.do('a', 'init')
    net.select('a', mode)
    net.simulated('a').set_load(150, net.now)
    net.commands['a'].set_target(150.0)
    net.run(1.0)
    net.do('a', 'halt')
    net.commands['a'].set_target(150.0)
    net.run(0.5)
    begin, speed = net.motor('a'), net.speed('a')
    assert speed == pytest.approx(0.0, abs=1e-2)
    net.replace_master()
    net.start()
    net.run_until(net.all_ready)
    net.run(1.5)
    assert net.motor('a') == pytest.approx(begin, abs=1e-2)
    assert any('it stands' in text for text in net.reported())


@pytest.mark.parametrize(
    ('mode', 'target'),
    [
        (OperationMode.PROFILE_POSITION, 6.0),
        (OperationMode.PROFILE_VELOCITY, 1.0),
        (OperationMode.PROFILE_TORQUE, 100.0),
        (OperationMode.CYCLIC_TORQUE, 100.0),
    ],
)
def test_a_drive_that_moves_is_halted_by_the_new_master(
    mode: OperationMode, target: float
) -> None:
    """What another master has begun does not go on, and the report says so."""
    net = kept_alive()
    net.select('a', mode)
    net.commands['a'].set_target(target)
    net.run(1.0)
    begin = net.motor('a')
    net.replace_master()
    net.start()
    net.run_until(net.all_ready)
    net.run(1.5)
    assert net.speed('a') == pytest.approx(0.0, abs=1e-2)
    assert begin < net.motor('a') < 3.0
    assert net.drives['a'].view.state is DriveState.OPERATION_ENABLED
    assert not any('it holds' in text for text in net.reported())
    net.commands['a'].set_target(-target)
    net.run(0.5)
    assert net.speed('a') < -0.01


def test_a_drive_that_stands_in_a_profile_mode_is_not_halted() -> None:
    """It is taken over as it is; nothing is warned of."""
    net = kept_alive()
    net.select('a', OperationMode.PROFILE_POSITION)
    net.replace_master()
    begin = net.now
    net.start()
    net.run_until(net.all_ready)
    net.run(1.0)
    assert not any(word & Controlword.HALT for word in net.controlwords('a', since=begin))
    assert any('it stands' in text for text in net.reported())


def test_a_drive_that_is_not_enabled_is_not_enabled() -> None:
    """Taking over requests nothing."""
    net = kept_alive()
    net.do('a', 'disable')
    net.replace_master()
    net.start()
    net.run(1.0)
    assert net.drives['a'].view.state is not DriveState.OPERATION_ENABLED
    assert net.drives['a'].goal is None


def test_what_was_taken_over_is_led_anew_after_a_stop() -> None:
    """A stop by NMT ends the take-over: after the next start the drive is not enabled."""
    net = kept_alive()
    net.select('a', OperationMode.CYCLIC_POSITION)
    net.replace_master()
    net.start()
    net.run(0.5)
    net.network.send_nmt(NmtCommand.ENTER_PRE_OPERATIONAL, 2)
    net.run(0.5)
    net.network.send_nmt(NmtCommand.START, 2)
    net.run(1.0)
    assert net.drives['a'].view.state is not DriveState.OPERATION_ENABLED
    assert net.reported(Severity.ERROR) == []


SCALES = {
    'default': '',
    'scale': 'scale_pos_to_dev: 57295.78, scale_pos_from_dev: 1.745329e-5,',
    'turned': 'scale_pos_to_dev: -2000, scale_pos_from_dev: -0.0005,',
    'offset': 'offset_pos_to_dev: 300, offset_pos_from_dev: -0.3,',
    'factor group': 'scale_from_factor_group: true,',
    'factor group of bus.yml': 'scale_from_factor_group: true, '
    'sdo: [{index: 0x6092, sub_index: 1, value: 3141592}],',
}


def bus_of(folder: Path, keys: str = '', eds: Path = DRIVE_EDS) -> BusConfig:
    """Write and read a bus with one drive."""
    path = folder / 'bus.yml'
    path.write_text(f"""
master: {{node_id: 1, driver: "ros2_canopen::MasterDriver", sync_period: 10000}}
{JOINT}:
  {{{keys} node_id: 2, driver: "ros2_canopen::Cia402Driver", dcf: {eds},
  heartbeat_producer: 100, tpdo: {{
    1: {{cob_id: auto, transmission: 1, mapping: [{{index: 0x6041}}, {{index: 0x6061}}]}},
    2: {{cob_id: auto, transmission: 1, mapping: [{{index: 0x6064}}, {{index: 0x606C}}]}}}},
  rpdo: {{
    1: {{cob_id: auto, mapping: [{{index: 0x6040}}, {{index: 0x6060}}]}},
    2: {{cob_id: auto, mapping: [{{index: 0x607A}}, {{index: 0x60FF}}]}},
    3: {{cob_id: auto, mapping: [{{index: 0x60C1, sub_index: 1}}]}}}}}}
""")
    return load_bus(path)


def network(bus: BusConfig, positions: dict[str, float]) -> VirtualNetwork:
    """Return a booted network whose drives stood at positions when they got power."""
    host = DeviceHost(lambda frame: None)
    add_devices(host, bus, positions)
    net = VirtualNetwork(bus)
    for node in bus.nodes:
        places = [drive.position for drive in host.device(node.node_id).drives]
        for drive, place in zip(net.devices[node.name].drives, places, strict=True):
            drive.count_from(place)
    net.boot()
    return net


@pytest.mark.parametrize('keys', SCALES.values(), ids=SCALES)
def test_the_master_reads_the_position_in_the_units_of_bus_yml(tmp_path: Path, keys: str) -> None:
    """Whatever scales it; an SDO that changes the factor group counts, too."""
    bus = bus_of(tmp_path, keys)
    net = network(bus, {JOINT: PLACE})
    net.run(0.2)
    assert net.drives[JOINT].view.position == pytest.approx(PLACE, abs=1e-3)
    assert net.devices[JOINT].drives[0].position != 0.0


@pytest.mark.parametrize(('method', 'moves'), [(19, True), (35, False)])
def test_homing_begins_there(tmp_path: Path, method: int, moves: bool) -> None:
    """Home is where the switch is, or where the drive is; it is 0 afterwards, as without."""
    writes = (
        f'{{index: 0x6098, sub_index: 0, value: {method}}}, '
        '{index: 0x6099, sub_index: 1, value: 1000}, {index: 0x6099, sub_index: 2, value: 200}, '
        '{index: 0x609A, sub_index: 0, value: 20000}'
    )
    net = network(bus_of(tmp_path, f'sdo: [{writes}],'), {JOINT: PLACE})
    drive = net.devices[JOINT].drives[0]
    start = drive.position - drive.origin
    net.do(JOINT, 'init')
    net.do(JOINT, 'home')
    net.run(0.2)
    assert net.drives[JOINT].view.position == pytest.approx(0.0, abs=2e-3)
    assert (abs(drive.position - drive.origin - start) > 100) is moves


def test_it_stays_over_a_loss_of_power_with_an_absolute_encoder(tmp_path: Path) -> None:
    """One that counts begins with 0."""
    device = network(bus_of(tmp_path), {JOINT: PLACE}).devices[JOINT]
    for kept, place in ((True, 1000 * PLACE), (False, 0.0)):
        device.switch_off(30.0)
        device.switch_on(30.0, position_kept=kept)
        assert device.drives[0].position == place


def test_each_axis_of_a_device_has_its_own(tmp_path: Path) -> None:
    """By the name of its channel; one that is not given reports 0."""
    keys = 'num_channels: 2, channel_names: [table_x, table_y],'
    net = network(
        bus_of(tmp_path, keys, DRIVE_EDS.with_name('cia402_two_axes.eds')), {'table_y': 0.5}
    )
    assert [drive.position for drive in net.devices[JOINT].drives] == [0.0, 500.0]


@given(st.floats(-2e6, 2e6))
def test_any_position_is_met_within_half_an_increment(place: float) -> None:
    """Up to the range of 0x6064."""
    host = DeviceHost(lambda frame: None)
    drive = drive_config(
        JOINT, NODE_ID, scales={'scale_pos_to_dev': 1e3, 'scale_pos_from_dev': 1e-3}
    )
    add_devices(host, bus_config(drive), {JOINT: place})
    assert host.devices[0].drives[0].position / 1000 == pytest.approx(place, abs=0.5001e-3)


@pytest.mark.parametrize(
    ('positions', 'words'),
    [
        ({'joint7': 0.1}, "no drive 'joint7' in .*bus.yml; drives: joint1"),
        ({JOINT: float('nan')}, 'joint1: position nan'),
        ({JOINT: 3e6}, r'joint1: position 3e\+06 is 3e\+09 increments'),
    ],
)
def test_what_no_drive_can_report_is_refused(
    tmp_path: Path, positions: dict[str, float], words: str
) -> None:
    """With name and value."""
    with pytest.raises(CanopenError, match=words):
        add_devices(DeviceHost(lambda frame: None), bus_of(tmp_path), positions)
