# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Nothing moves unasked and nothing stops with a jerk: what is on the bus, and where the motor is.

The drive of these tests sags under a load: where it is powered, its position is some increments
below the target that holds it.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
import struct

from bus_rig import VirtualNetwork
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
import pytest

from arm_canopen import DriveError, DriveState, OperationMode
from arm_canopen.can import Frame

pytestmark = pytest.mark.slow

JOINT = 'joint1'
NODE_ID = 2
STATE_PDO, POSITION_PDO = 0x180 + NODE_ID, 0x280 + NODE_ID
COMMAND_PDO, TARGET_PDO, STREAM_PDO = 0x200 + NODE_ID, 0x300 + NODE_ID, 0x400 + NODE_ID
SAG_INC = 40
STREAMED = [OperationMode.CYCLIC_POSITION, OperationMode.INTERPOLATED_POSITION]
MODES = [OperationMode.PROFILE_POSITION, OperationMode.PROFILE_VELOCITY, *STREAMED]


def by_name(mode: OperationMode) -> str:
    """Name a mode in the id of a test."""
    return mode.name


class Loaded:
    """A booted network with one drive that sags by SAG_INC while it is enabled."""

    def __init__(self, **changes: object) -> None:
        """Boot it."""
        self.net = VirtualNetwork(bus_config(drive_config(JOINT, NODE_ID, **changes)))
        self.net.wire.alters = self._sag
        self.net.boot()

    def _sag(self, sender: str, frame: Frame) -> Frame:
        if frame.can_id != POSITION_PDO or not self.powered:
            return frame
        position, velocity = struct.unpack('<ii', frame.data)
        return frame._replace(data=struct.pack('<ii', position - SAG_INC, velocity))

    @property
    def powered(self) -> bool:
        """The drive is enabled."""
        drive = self.net.devices[JOINT].drive
        assert drive is not None
        return drive.state is DriveState.OPERATION_ENABLED

    @property
    def position(self) -> float:
        """Where the motor is in [inc]."""
        drive = self.net.devices[JOINT].drive
        assert drive is not None
        return drive.position

    @property
    def mode(self) -> OperationMode:
        """Mode of operation that the drive displays."""
        return OperationMode(self.net.drives[JOINT].objects.mode_display)

    def enable(self, mode: OperationMode) -> None:
        """Enable the drive and select a mode."""
        self.net.do(JOINT, 'init')
        self.net.select(JOINT, mode)

    def move(self, mode: OperationMode) -> None:
        """Let it move in a mode."""
        self.enable(mode)
        self.net.commands[JOINT].set_target(0.8)
        self.net.run(0.4)
        assert self.net.drives[JOINT].view.velocity > 0.5

    def setpoints(self, since: float) -> list[int]:
        """Return what the master commanded to the streamed mode that the drive was in, in [inc].

        One value for each SYNC at which the drive was enabled in one of these modes.
        """
        targets, mode, state, found = {TARGET_PDO: 0, STREAM_PDO: 0}, 0, 0, []
        for sent in self.net.wire.log:
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


@pytest.mark.parametrize('mode', STREAMED, ids=by_name)
def test_a_loaded_axis_does_not_sag_when_the_mode_is_switched(mode: OperationMode) -> None:
    """The set-point that holds it stays the target, from streamed mode to streamed mode."""
    loaded = Loaded()
    loaded.enable(mode)
    loaded.net.run(0.5)
    begin, rest = loaded.net.now, loaded.position
    for _ in range(10):
        for other in STREAMED:
            loaded.net.select(JOINT, other)
            loaded.net.run(0.05)
    assert loaded.position == pytest.approx(rest, abs=1)
    assert len(set(loaded.setpoints(begin))) == 1


@pytest.mark.parametrize('mode', STREAMED, ids=by_name)
def test_a_mode_switch_that_the_drive_refuses_leaves_it_where_it_is(mode: OperationMode) -> None:
    """For all the seconds of the time-out the set-point that holds the load does not change."""
    loaded = Loaded()
    loaded.enable(mode)
    loaded.net.commands[JOINT].set_target(0.2)
    loaded.net.run(2.0)
    begin = loaded.net.now

    def stuck(sender: str, frame: Frame) -> Frame:
        if frame.can_id == COMMAND_PDO:
            return frame._replace(data=frame.data[:2] + bytes((mode,)))
        return loaded._sag(sender, frame)

    loaded.net.wire.alters = stuck
    with pytest.raises(DriveError, match='did not reach mode Profile position in 0x6061'):
        loaded.net.select(JOINT, OperationMode.PROFILE_POSITION)
    loaded.net.run(0.5)
    assert set(loaded.setpoints(begin)) == {round(0.2 * SCALE)}
    loaded.net.commands[JOINT].set_target(0.1)
    loaded.net.run(2.0)
    assert loaded.setpoints(begin)[-1] == round(0.1 * SCALE)


@pytest.mark.parametrize('other', [*MODES, None], ids=str)
@pytest.mark.parametrize('mode', STREAMED, ids=by_name)
def test_a_switch_in_motion_brakes_first(mode: OperationMode, other: OperationMode | None) -> None:
    """A moving profile comes to rest within its limits before another mode is commanded."""
    if other is mode:
        return
    loaded = Loaded()
    loaded.move(mode)
    begin = loaded.net.now
    if other is None:
        loaded.net.do(JOINT, 'init')
    else:
        loaded.net.select(JOINT, other)
    loaded.net.run(0.5)
    assert_smooth(loaded.setpoints(begin - 0.1), 50_000)
    assert loaded.net.drives[JOINT].view.velocity == 0.0
    assert loaded.mode == (other or OperationMode.NO_MODE)


@pytest.mark.parametrize('mode', MODES, ids=by_name)
def test_enabling_holds_the_motor_where_it_was_moved_by_hand(mode: OperationMode) -> None:
    """Disabled, moved, enabled: it stays, in each mode."""
    loaded = Loaded()
    loaded.enable(mode)
    if mode is not OperationMode.PROFILE_VELOCITY:
        loaded.net.commands[JOINT].set_target(0.3)
        loaded.net.run(2.0)
    loaded.net.do(JOINT, 'disable')
    drive = loaded.net.devices[JOINT].drive
    assert drive is not None
    drive.count_from(drive.position - 1234, loaded.net.now)
    loaded.net.run(0.1)
    rest = loaded.position
    loaded.net.do(JOINT, 'enable')
    loaded.net.run(1.0)
    assert loaded.position == pytest.approx(rest, abs=SAG_INC + 1)


def test_a_drive_that_keeps_its_mode_does_not_jump_when_it_is_enabled() -> None:
    """Some drives refuse mode 0 and stay in mode 8: its target is preloaded all the same."""
    loaded = Loaded()
    loaded.enable(OperationMode.CYCLIC_POSITION)
    loaded.net.commands[JOINT].set_target(0.3)
    loaded.net.run(2.0)
    loaded.net.do(JOINT, 'disable')

    def keep_mode_8(sender: str, frame: Frame) -> Frame:
        return frame._replace(data=frame.data[:2] + b'\x08') if frame.can_id == 0x202 else frame

    loaded.net.wire.alters = keep_mode_8
    drive = loaded.net.devices[JOINT].drive
    assert drive is not None
    loaded.net.drives[JOINT].control.select(
        loaded.net.drives[JOINT].control.modes[OperationMode.NO_MODE]
    )
    drive.count_from(drive.position - 1234, loaded.net.now)
    loaded.net.run(0.1)
    rest = loaded.position
    loaded.net.do(JOINT, 'init')
    loaded.net.run(1.0)
    assert loaded.mode is OperationMode.CYCLIC_POSITION
    assert loaded.position == pytest.approx(rest, abs=1)


@pytest.mark.parametrize('mode', MODES, ids=by_name)
def test_factors_that_contradict_each_other_move_nothing(mode: OperationMode) -> None:
    """However wrong the factors in bus.yml are, the preloaded target is where the drive is."""
    scales = {'scale_pos_from_dev': 0.001, 'offset_pos_from_dev': 0.7, 'offset_pos_to_dev': 333.0}
    loaded = Loaded(scales=scales, sdo_writes=(*MOTION_WRITES, sdo_write(0x607C, 0, 5_000)))
    drive = loaded.net.devices[JOINT].drive
    assert drive is not None
    drive.count_from(drive.position + 7_000, loaded.net.now)
    loaded.net.run(0.1)
    loaded.enable(mode)
    loaded.net.run(1.0)
    assert loaded.position == pytest.approx(7_000, abs=SAG_INC + 1)


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
    net = VirtualNetwork(bus_config(replace(config, sdo_writes=writes)))
    net.boot()
    drive = net.devices[JOINT].drive
    assert drive is not None
    for _ in range(2):
        net.do(JOINT, 'init')
        net.select(JOINT, mode)
        net.run(1.0)
        net.select(JOINT, OperationMode.PROFILE_POSITION)
        net.select(JOINT, mode)
        net.run(1.0)
        assert drive.position == pytest.approx(0.0, abs=1)
        net.do(JOINT, 'disable')
    net.do(JOINT, 'init')
    net.select(JOINT, mode)
    if mode is OperationMode.CYCLIC_POSITION:
        net.commands[JOINT].set_target(0.5)
        net.run(3.0)
        assert drive.position == pytest.approx(5_000, abs=1)


@pytest.mark.parametrize('cycles', range(12))
def test_halt_while_it_is_being_enabled_leaves_it_disabled(cycles: int) -> None:
    """Whatever step the enabling had reached: after halt it does not go on by itself."""
    net = VirtualNetwork(bus_config(drive_config(JOINT, NODE_ID)))
    net.boot()
    running = net.begin(JOINT, 'enable')
    net.run(cycles * PERIOD / 2)
    if running.done:
        return
    net.do(JOINT, 'halt', preempt=True)
    net.run(2.0)
    assert net.drives[JOINT].view.state is DriveState.SWITCH_ON_DISABLED


@pytest.mark.parametrize('option', [1, 2, 5, 6])
@pytest.mark.parametrize('mode', MODES, ids=by_name)
@pytest.mark.parametrize('halted', [False, True])
def test_shutdown_never_lets_a_moving_axis_go(
    mode: OperationMode, option: int, halted: bool
) -> None:
    """Whatever 0x605A says, and also in the middle of a quick stop: rest first, then no power."""
    writes = (*MOTION_WRITES, sdo_write(0x6085, 0, 20_000), sdo_write(0x605A, 0, option))
    loaded = Loaded(sdo_writes=writes)
    loaded.move(mode)
    if halted:
        loaded.net.begin(JOINT, 'quick_stop', preempt=True)
        loaded.net.run(0.05)
        assert loaded.net.drives[JOINT].view.velocity > 0.1
    drive = loaded.net.devices[JOINT].drive
    assert drive is not None
    fastest = 0.0
    running = loaded.net.begin(JOINT, 'shutdown', preempt=True)
    while not running.done:
        loaded.net.run(PERIOD / 3)
        if drive.state is DriveState.SWITCH_ON_DISABLED:
            fastest = max(fastest, abs(drive.velocity))
    assert drive.state is DriveState.SWITCH_ON_DISABLED
    assert fastest <= 0.02 * SCALE
    assert not [text for text in loaded.net.reported() if 'did not come to rest' in text]


def test_shutdown_of_a_drive_that_is_off_or_faulted_ends_at_once() -> None:
    """It is seen to stand without power, so nothing has to be waited for."""
    loaded = Loaded()
    assert 'Switch on disabled' in loaded.net.do(JOINT, 'shutdown', timeout=0.1)
    loaded.enable(OperationMode.PROFILE_POSITION)
    drive = loaded.net.devices[JOINT].drive
    assert drive is not None
    drive.raise_fault(0x4210, loaded.net.now)
    loaded.net.run(0.5)
    assert 'Fault' in loaded.net.do(JOINT, 'shutdown', timeout=0.1)


@pytest.mark.parametrize('gone', [True, False], ids=['no power', 'moves on'])
def test_shutdown_of_a_lost_drive_is_no_success_unless_its_rest_is_seen(gone: bool) -> None:
    """A device without an answer may move; one whose heartbeat alone is lost is stopped by SDO."""
    loaded = Loaded()
    loaded.move(OperationMode.PROFILE_VELOCITY)
    drive = loaded.net.devices[JOINT].drive
    assert drive is not None
    if gone:
        loaded.net.power_off(JOINT)
        loaded.net.run(1.0)
        with pytest.raises(DriveError, match='not disabled; cut its power: offline'):
            loaded.net.do(JOINT, 'shutdown', timeout=5.0)
        return
    lost = {base + NODE_ID for base in (0x180, 0x280, 0x700)}
    loaded.net.wire.loses = lambda sender, frame: frame.can_id in lost
    loaded.net.run(0.4)
    answer = loaded.net.do(JOINT, 'shutdown', timeout=5.0)
    assert 'Switch on disabled' in answer
    assert abs(drive.velocity) < 1e-3 * SCALE
    assert drive.state is DriveState.SWITCH_ON_DISABLED
