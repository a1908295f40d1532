# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""An axis that is beside its set-points: it is stopped once, and no set-point goes after it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
import struct

from bus_rig import VirtualNetwork
from drive_samples import bus_config, drive_config, PERIOD, SCALE, sdo_write
import pytest

from arm_canopen import DriveState, OperationMode, RefusalCause, Severity
from arm_canopen.can import Frame
from arm_canopen.cia402.following_watch import Following, FollowingWatch
from arm_canopen.config import NodeConfig
from arm_canopen.standard import ObjectDictionary, Statusword

pytestmark = pytest.mark.slow

JOINT, NODE_ID = 'joint1', 2
STATE_PDO, POSITION_PDO = 0x180 + NODE_ID, 0x280 + NODE_ID
MODES = pytest.mark.parametrize(
    'mode',
    [OperationMode.CYCLIC_POSITION, OperationMode.INTERPOLATED_POSITION],
    ids=lambda m: m.name,
)


def with_window(window_inc: int | None) -> NodeConfig:
    """Return a drive with a following error window (0x6065) in [inc], or without the object."""
    config = drive_config(JOINT, NODE_ID)
    if window_inc is not None:
        return replace(config, sdo_writes=(*config.sdo_writes, sdo_write(0x6065, 0, window_inc)))
    entries = (entry for entry in config.dictionary if entry.index != 0x6065)
    return replace(config, dictionary=ObjectDictionary(entries))


class Loaded:
    """A drive whose position droops below what it is commanded, while it has power."""

    def __init__(self, config: NodeConfig, mode: OperationMode) -> None:
        """Enable it without its load."""
        self.droop_inc = 0
        self.net = VirtualNetwork(bus_config(config))
        self.net.wire.alters = self._droops
        self.net.boot()
        self.net.do(JOINT, 'init')
        self.net.select(JOINT, mode)

    def _droops(self, sender: str, frame: Frame) -> Frame:
        powered = self.state in (DriveState.OPERATION_ENABLED, DriveState.QUICK_STOP_ACTIVE)
        if frame.can_id != POSITION_PDO or not powered:
            return frame
        position, velocity = struct.unpack('<ii', frame.data)
        return frame._replace(data=struct.pack('<ii', position - self.droop_inc, velocity))

    @property
    def state(self) -> DriveState:
        """State of the simulated drive."""
        drive = self.net.devices[JOINT].drive
        assert drive is not None
        return drive.state

    @property
    def demand(self) -> float:
        """Where the simulated drive holds the axis in [rad]."""
        drive = self.net.devices[JOINT].drive
        assert drive is not None
        return drive.position / SCALE

    @property
    def errors(self) -> list[str]:
        """What was reported as an error."""
        return self.net.reported(Severity.ERROR)


@MODES
@pytest.mark.parametrize('window_inc', [1000, None, 0, 0xFFFF_FFFF])
def test_a_droop_under_load_ends_in_one_stop(window_inc: int | None, mode: OperationMode) -> None:
    """Set-points that stand are not moved; the axis is stopped and disabled, named once."""
    loaded = Loaded(with_window(window_inc), mode)
    loaded.droop_inc = 1500
    before = loaded.demand
    loaded.net.run(10.0)
    assert loaded.demand == pytest.approx(before, abs=1e-3)
    assert loaded.state is DriveState.SWITCH_ON_DISABLED
    assert len(loaded.errors) == 1, loaded.errors
    assert 'does not follow its set-points' in loaded.errors[0]


@MODES
def test_a_droop_within_the_window_of_the_drive_is_left_alone(mode: OperationMode) -> None:
    """0x6065 says how far it may be away; nothing creeps meanwhile."""
    loaded = Loaded(with_window(2000), mode)
    loaded.droop_inc = 1500
    before = loaded.demand
    loaded.net.run(5.0)
    assert loaded.demand == pytest.approx(before, abs=1e-3)
    assert loaded.state is DriveState.OPERATION_ENABLED
    assert not loaded.errors
    loaded.net.commands[JOINT].set_target(0.5)
    loaded.net.run(3.0)
    assert loaded.demand == pytest.approx(0.5, abs=1e-3)
    assert not loaded.errors


@MODES
def test_an_axis_that_droops_and_is_stopped_on_its_way_creeps_once_at_most(
    mode: OperationMode,
) -> None:
    """It is held where it is; the load may pull it from there once, and then it is disabled."""
    loaded = Loaded(with_window(None), mode)
    loaded.net.commands[JOINT].set_target(5.0)
    loaded.net.run(0.5)
    loaded.droop_inc = 1500
    lost = {0x200 + NODE_ID, 0x300 + NODE_ID, 0x400 + NODE_ID}
    loaded.net.wire.loses = lambda sender, frame: frame.can_id in lost
    loaded.net.run(1.0)
    assert len(loaded.errors) == 1
    stood = loaded.demand
    loaded.net.wire.loses = lambda sender, frame: False
    loaded.net.run(5.0)
    assert abs(loaded.demand - stood) < 0.15 + 0.01
    assert loaded.state is DriveState.SWITCH_ON_DISABLED
    assert len(loaded.errors) == 2


@pytest.mark.parametrize(('duration', 'stops'), [(0.3, False), (2.0, True)])
def test_the_following_error_of_the_drive_counts(duration: float, *, stops: bool) -> None:
    """Bit 13 of mode 8, where it lasts; a drive may show it in passing."""
    loaded = Loaded(with_window(None), OperationMode.CYCLIC_POSITION)
    end = loaded.net.now + duration

    def show(sender: str, frame: Frame) -> Frame:
        if frame.can_id != STATE_PDO or loaded.net.now > end:
            return frame
        word, mode = struct.unpack('<Hb', frame.data)
        return frame._replace(data=struct.pack('<Hb', word | Statusword.FOLLOWING_ERROR, mode))

    loaded.net.wire.alters = show
    loaded.net.run(3.0)
    assert (loaded.state is DriveState.SWITCH_ON_DISABLED) is stops
    refusal = loaded.net.drives[JOINT].control.refusal
    assert (refusal is not None and refusal.cause is RefusalCause.NOT_ENABLED) is stops
    assert len(loaded.errors) == stops


def judged(
    setpoint: Callable[[float], float], position: Callable[[float], float], duration: float = 3.0
) -> tuple[Following, float]:
    """Return the first verdict that is not that it follows, and when it came in [s]."""
    watch = FollowingWatch()
    for cycle in range(round(duration / PERIOD)):
        now = cycle * PERIOD
        where = setpoint(now), position(now)
        verdict = watch.judge(now, *where, margin=0.1, window=0.1, error=False)
        if verdict is not Following.FOLLOWS:
            return verdict, now
    return Following.FOLLOWS, duration


@pytest.mark.parametrize(
    ('setpoint', 'position', 'verdict', 'time'),
    [
        (lambda t: t, lambda t: 0.0, Following.LEFT_BEHIND, 0.6),
        (lambda t: t, lambda t: 0.95 * t - 0.05, Following.FOLLOWS, 3.0),
        (lambda t: t, lambda t: t - 0.4, Following.FOLLOWS, 3.0),
        (lambda t: t, lambda t: t - 0.8, Following.LASTING_ERROR, 1.0),
        (lambda t: 1.0, lambda t: 0.8, Following.LASTING_ERROR, 1.0),
        (lambda t: 1.0, lambda t: 0.95 - 0.1 * t, Following.LASTING_ERROR, 1.5),
        (lambda t: 1.0, lambda t: 0.85 if 1.0 < t < 1.9 else 1.0, Following.FOLLOWS, 3.0),
        (lambda t: 1e-4 * t, lambda t: 0.3, Following.LASTING_ERROR, 1.0),
    ],
    ids=['stuck', 'slow', 'lag', 'far behind', 'droop', 'creep', 'transient', 'noise'],
)
def test_verdicts(
    setpoint: Callable[[float], float],
    position: Callable[[float], float],
    verdict: Following,
    time: float,
) -> None:
    """Left behind is only who stands while the set-points move; the rest must not last."""
    found, when = judged(setpoint, position)
    assert found is verdict
    assert when == pytest.approx(time, abs=0.05)


@pytest.mark.parametrize(
    ('setpoint', 'position', 'verdict'),
    [
        (0.5, 0.0, Following.LEFT_BEHIND),
        (0.5, 0.45, Following.FOLLOWS),
        (0.0, -0.5, Following.FOLLOWS),
    ],
    ids=['stuck', 'followed', 'droop'],
)
def test_an_axis_that_was_led_on_unseen_is_judged_by_its_first_position(
    setpoint: float, position: float, verdict: Following
) -> None:
    """Set-points that moved meanwhile have left it behind; a droop may pass."""
    watch = FollowingWatch()
    limits = {'margin': 0.1, 'window': 0.1}
    for cycle in range(10):
        seen = watch.judge(cycle * PERIOD, 0.0, 0.0, error=False, **limits)
        assert seen is Following.FOLLOWS
    watch.lose_sight()
    watch.lose_sight()
    assert watch.judge(1.0, setpoint, position, error=False, **limits) is verdict
