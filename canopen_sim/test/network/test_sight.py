# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A drive that cannot be seen, or is not where its set-points are: it is stopped, once."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
import re
import struct
from typing import TypeAlias

from bus_rig import booted, JOINT, Leader, VirtualNetwork
from drive_samples import (
    bus_config,
    drive_config,
    DRIVE_EDS,
    every_mode,
    PERIOD,
    SCALE,
    sdo_write,
    with_defaults,
)
import pytest

from arm_canopen import (
    BusConfig,
    DriveError,
    DriveState,
    load_bus,
    NodeConfig,
    OperationMode,
    RefusalCause,
    Severity,
)
from arm_canopen.cia402.modes.cyclic_position import Following, FollowingWatch
from arm_canopen.cia402.motion_group import stop_all
from arm_canopen.config import boot_writes, check_bus
from arm_canopen.config.model.bus import with_event_timer
from arm_canopen.master.process_image import ReceivedTpdo, SyncRound
from canopen_core import Place
from canopen_core.standard import ObjectDictionary, Statusword
from canopen_sim import Fault, FaultInjection

pytestmark = pytest.mark.slow

TIME_OUT = 0.5  # [s] of silence
NODE_ID = 2
STATE_PDO, POSITION_PDO = TPDOS = (0x180 + NODE_ID, 0x280 + NODE_ID)
STREAMED = pytest.mark.parametrize(
    'mode',
    [OperationMode.CYCLIC_POSITION, OperationMode.INTERPOLATED_POSITION],
    ids=lambda m: m.name,
)


class Led:
    """A drive that follows a motion source at 1 rad/s."""

    def __init__(
        self, mode: OperationMode, source: Leader, config: NodeConfig | None = None
    ) -> None:
        self.net = booted(config or drive_config(JOINT, NODE_ID))
        self.net.enable(mode)
        self.source = source
        self.net.master.attach(source)
        self.net.run(0.8)
        assert self.net.speed() == pytest.approx(1.0, rel=0.05)

    def velocities(self, duration: float = 2.0) -> list[float]:
        """Advance the time by a duration in [s]; return the velocities meanwhile in [rad/s]."""
        found = []
        for _ in range(round(duration / PERIOD)):
            self.net.run(PERIOD)
            found.append(self.net.speed())
        return found


@pytest.mark.parametrize('lost', [TPDOS, TPDOS[:1], TPDOS[1:]], ids=['all', 'state', 'position'])
@STREAMED
def test_a_drive_of_which_a_tpdo_is_missing_is_taken_from_its_source(
    mode: OperationMode, lost: Sequence[int]
) -> None:
    """Within the time-out it brakes on its ramp; the cause is data, and no target is taken."""
    led = Led(mode, Leader())
    led.net.lose(*lost)
    assert min(led.velocities(TIME_OUT + 1.5)) > -0.02
    assert led.net.speed() == pytest.approx(0.0, abs=1e-3)
    assert led.source.losses[JOINT].cause is RefusalCause.SILENT
    with pytest.raises(DriveError, match='TPDO'):
        led.net.target(0.0)


@STREAMED
def test_a_source_that_goes_on_moves_a_silent_drive_no_further(mode: OperationMode) -> None:
    """What is granted for stopping on the path ends after a second, whatever the source does."""
    led = Led(mode, Leader(heeds=False))
    led.net.lose(*TPDOS)
    led.net.run(TIME_OUT + 1.0 + 0.3)
    rest = led.net.motor()
    led.net.run(2.0)
    assert led.net.motor() == pytest.approx(rest, abs=2 * PERIOD * 1e-2)


def test_a_drive_that_cannot_be_seen_is_not_enabled() -> None:
    """Neither is its old state taken for the present one."""
    led = Led(OperationMode.CYCLIC_POSITION, Leader())
    led.net.do(JOINT, 'disable', preempt=True)
    led.net.lose(*TPDOS)
    led.net.run(1.0)
    with pytest.raises(DriveError, match='no TPDOs for'):
        led.net.do(JOINT, 'enable')
    assert led.net.simulated().state is not DriveState.OPERATION_ENABLED


def test_feedback_is_that_of_the_sync_it_is_stamped_with() -> None:
    """Position, velocity and effort of /joint_states come from the same TPDOs."""
    net, reported, sent = Led(OperationMode.CYCLIC_POSITION, Leader()).net, [], []

    def note(sync_time: float) -> None:
        reported.append(net.drives[JOINT].view.position)
        (data,) = net.frames(POSITION_PDO, since=sync_time)
        sent.append(struct.unpack_from('<i', data)[0] / SCALE)

    net.network.on_feedback = note
    net.run(0.3)
    assert len(reported) == pytest.approx(30, abs=1)
    assert reported[-1] - reported[0] > 0.25  # it moves
    assert reported == pytest.approx(sent, abs=1e-9)


def show(net: VirtualNetwork, word: Callable[[int], int], frames: int = 1_000_000) -> None:
    """Change the statusword of some TPDOs."""
    left = iter(range(frames))

    def shown(data: bytes) -> bytes:
        (true,) = struct.unpack_from('<H', data)
        return struct.pack('<H', true if next(left, None) is None else word(true)) + data[2:]

    net.wire.alters = lambda sender, frame: frame
    net.alter(STATE_PDO, shown)


@pytest.mark.parametrize(
    ('word', 'mode', 'target'),
    [
        (0x022B, OperationMode.PROFILE_POSITION, 5.0),
        (0x0209, OperationMode.PROFILE_VELOCITY, 1.0),
        (0x022B, OperationMode.CYCLIC_POSITION, 5.0),
    ],
)
def test_a_statusword_of_no_state_stops_an_axis_only_where_it_lasts(
    word: int, mode: OperationMode, target: float
) -> None:
    """One counts as a lost TPDO; then the axis brakes, is named, and stays disabled."""
    net = booted(every_mode(drive_config(JOINT, NODE_ID)))
    net.enable(mode)
    net.target(target)
    net.run(0.8)
    moving, since = net.speed(), net.now
    show(net, lambda shown: word, 3)
    net.run(0.3)
    assert net.speed() == pytest.approx(moving, rel=0.3)
    assert net.drives[JOINT].stays_enabled
    assert 0 not in net.controlwords(JOINT, since=since)
    assert not net.reported(Severity.WARNING)
    show(net, lambda shown: word, 50)
    while abs(net.speed()) > 0.05:
        net.run(PERIOD)
        assert 0 not in net.controlwords(JOINT, since=since)  # no power is taken in motion
    net.run(3.0)
    assert net.simulated().state is DriveState.SWITCH_ON_DISABLED
    (report,) = net.reported(Severity.ERROR)
    assert f'0x{word:04X}' in report
    with pytest.raises(DriveError, match='enable it'):
        net.target(0.0)


def test_an_axis_that_loses_its_power_unseen_is_not_enabled_again() -> None:
    """The safe torque off ends with its statuswords of no state; set-points go on."""
    led = Led(OperationMode.CYCLIC_POSITION, Leader(heeds=False))
    net, since = led.net, led.net.now
    show(net, lambda shown: 0x0209)
    net.devices[JOINT].faults.inject(FaultInjection(Fault.STO, duration=3.0), net.now)
    net.run(1.0)
    assert '0x0209' in net.drives[JOINT].describe()
    assert led.source.losses[JOINT].cause is RefusalCause.STATE_UNKNOWN
    net.run(3.0)
    show(net, lambda shown: shown)
    net.run(2.0)
    assert net.simulated().state is DriveState.SWITCH_ON_DISABLED
    assert 0x7 not in net.controlwords(JOINT, since=since)
    assert '0x0209' in net.reported(Severity.ERROR)[0]


def test_a_drive_that_never_shows_a_state_is_named_and_not_known_to_stand() -> None:
    """One without bit 5 shows no state while it is disabled."""
    net = VirtualNetwork(bus_config(drive_config(JOINT, NODE_ID)))
    show(net, lambda shown: 0x0211)
    net.start()
    net.run(3.0)
    with pytest.raises(DriveError, match='0x0211'):
        net.do(JOINT, 'init')
    assert not net.controlwords(JOINT)
    report = net.result(
        net.network.scheduler.spawn(stop_all([net.commands[JOINT]], net.network.scheduler)), 60.0
    )
    assert JOINT in ''.join(report.failed)
    assert not report.unpowered


def with_window(window_inc: int | None) -> NodeConfig:
    """Return a drive with a following error window (0x6065) in [inc], or without the object."""
    config = drive_config(JOINT, NODE_ID)
    if window_inc is not None:
        return replace(config, sdo_writes=(*config.sdo_writes, sdo_write(0x6065, 0, window_inc)))
    entries = (entry for entry in config.dictionary if entry.index != 0x6065)
    return replace(config, dictionary=ObjectDictionary(entries))


def enabled(config: NodeConfig, mode: OperationMode) -> VirtualNetwork:
    """Return a network with one drive that is enabled in a mode."""
    net = booted(config)
    net.enable(mode)
    return net


@STREAMED
@pytest.mark.parametrize('window_inc', [1000, None, 0, 0xFFFF_FFFF])
def test_a_droop_under_load_ends_in_one_stop(window_inc: int | None, mode: OperationMode) -> None:
    """Set-points that stand are not moved; the axis is stopped and disabled, named once."""
    net = enabled(with_window(window_inc), mode)
    net.droop(1500)
    before = net.motor()
    net.run(10.0)
    assert net.motor() == pytest.approx(before, abs=1e-3)
    assert net.simulated().state is DriveState.SWITCH_ON_DISABLED
    assert len(net.reported(Severity.ERROR)) == 1, net.reported(Severity.ERROR)
    assert 'does not follow its set-points' in net.reported(Severity.ERROR)[0]


@STREAMED
def test_a_droop_within_the_window_of_the_drive_is_left_alone(mode: OperationMode) -> None:
    """0x6065 says how far it may be away; nothing creeps meanwhile."""
    net = enabled(with_window(2000), mode)
    net.droop(1500)
    before = net.motor()
    net.run(5.0)
    assert net.motor() == pytest.approx(before, abs=1e-3)
    assert net.simulated().state is DriveState.OPERATION_ENABLED
    assert not net.reported(Severity.ERROR)
    net.target(0.5)
    net.run(3.0)
    assert net.motor() == pytest.approx(0.5, abs=1e-3)
    assert not net.reported(Severity.ERROR)


@STREAMED
def test_an_axis_that_droops_and_is_stopped_on_its_way_creeps_once_at_most(
    mode: OperationMode,
) -> None:
    """It is held where it is; the load may pull it from there once, and then it is disabled."""
    net = enabled(with_window(None), mode)
    net.target(5.0)
    net.run(0.5)
    net.droop(1500)
    lost = {0x200 + NODE_ID, 0x300 + NODE_ID, 0x400 + NODE_ID}
    net.lose(*lost)
    net.run(1.0)
    assert len(net.reported(Severity.ERROR)) == 1
    stood = net.motor()
    net.lose()
    net.run(5.0)
    assert abs(net.motor() - stood) < 0.15 + 0.01
    assert net.simulated().state is DriveState.SWITCH_ON_DISABLED
    assert len(net.reported(Severity.ERROR)) == 2


@pytest.mark.parametrize(('duration', 'stops'), [(0.3, False), (2.0, True)])
def test_the_following_error_of_the_drive_counts(duration: float, *, stops: bool) -> None:
    """Bit 13 of mode 8, where it lasts; a drive may show it in passing."""
    net = enabled(with_window(None), OperationMode.CYCLIC_POSITION)
    end = net.now + duration

    show(net, lambda word: word | Statusword.FOLLOWING_ERROR * (net.now <= end))
    net.run(3.0)
    assert (net.simulated().state is DriveState.SWITCH_ON_DISABLED) is stops
    refusal = net.drives[JOINT].refusal
    assert (refusal is not None and refusal.cause is RefusalCause.NOT_ENABLED) is stops
    assert len(net.reported(Severity.ERROR)) == stops


OfTime: TypeAlias = Callable[[float], float]


def judged(setpoint: OfTime, position: OfTime, duration: float = 3.0) -> tuple[Following, float]:
    """Return the first verdict that is not that it follows, and when it came in [s]."""
    watch = FollowingWatch()
    for cycle in range(round(duration / PERIOD)):
        now = cycle * PERIOD
        where = setpoint(now), position(now)
        verdict = watch.judge(now, *where, margin=0.1, window=0.1, error=False, received=cycle)
        if verdict is not Following.FOLLOWS:
            return verdict, now
    return Following.FOLLOWS, duration


def test_verdicts() -> None:
    """Left behind is only who stands while the set-points move; the rest must not last."""
    verdicts: dict[str, tuple[OfTime, OfTime, Following, float]] = {
        'stuck': (lambda t: t, lambda t: 0.0, Following.LEFT_BEHIND, 0.6),
        'slow': (lambda t: t, lambda t: 0.95 * t - 0.05, Following.FOLLOWS, 3.0),
        'lag': (lambda t: t, lambda t: t - 0.4, Following.FOLLOWS, 3.0),
        'far behind': (lambda t: t, lambda t: t - 0.8, Following.LASTING_ERROR, 1.0),
        'droop': (lambda t: 1.0, lambda t: 0.8, Following.LASTING_ERROR, 1.0),
        'creep': (lambda t: 1.0, lambda t: 0.95 - 0.1 * t, Following.LASTING_ERROR, 1.5),
        'transient': (
            *(lambda t: 1.0, lambda t: 0.85 if 1.0 < t < 1.9 else 1.0),
            *(Following.FOLLOWS, 3.0),
        ),
        'noise': (lambda t: 1e-4 * t, lambda t: 0.3, Following.LASTING_ERROR, 1.0),
    }
    for case, (setpoint, position, verdict, time) in verdicts.items():
        found, when = judged(setpoint, position)
        assert found is verdict, case
        assert when == pytest.approx(time, abs=0.05), case


def test_an_axis_that_was_led_on_unseen_is_judged_by_its_first_positions() -> None:
    """Set-points that moved meanwhile have left it behind; a droop may pass.

    A sight that is too short to judge, one position and silence again, forgets nothing.
    """
    for setpoint, position, verdict in (
        (0.5, 0.0, Following.LEFT_BEHIND),
        (0.5, 0.45, Following.FOLLOWS),
        (0.0, -0.5, Following.FOLLOWS),
    ):
        watch = FollowingWatch()
        judge = partial(watch.judge, margin=0.1, window=0.1, error=False)
        for cycle in range(10):
            assert judge(cycle * PERIOD, 0.0, 0.0, received=cycle) is Following.FOLLOWS
        stuck = verdict is Following.LEFT_BEHIND
        for received, now in ((10, 1.0), (11, 2.0)):
            watch.lose_sight()
            watch.lose_sight()
            first = judge(now, setpoint, position, received=received)
            assert first is (Following.UNDECIDED if stuck else verdict)
        assert judge(2.01, setpoint, position, received=12) is verdict


@pytest.mark.parametrize('late', [False, True], ids=['pause of the master', 'late frames'])
@STREAMED
def test_drives_are_not_blamed_for_a_pause(mode: OperationMode, *, late: bool) -> None:
    """No SYNC asked them meanwhile, or their frames come late: the motion goes on where it was.

    The first position that comes is old, and a set-point there would make the axis jump.
    """
    config = replace(with_window(0xFFFF_FFFF), heartbeat_producer=0.0, heartbeat_timeout=0.0)
    led = Led(mode, Leader(), config)
    if late:
        led.net.wire.stall(led.net.now, TIME_OUT + 0.05)
    else:
        led.net.now += TIME_OUT + 0.2  # nothing of the master runs
    found = led.velocities()
    assert min(found) > -0.02
    assert not led.net.reported(Severity.ERROR)
    if not late:
        assert max(found) < 1.5
        assert not led.source.losses
        assert 'has not answered' not in str(led.net.reported(Severity.WARNING))


def on_change(transmission: int = 255, *, timer: bool = True) -> NodeConfig:
    """Return a drive whose TPDOs come on change, with or without event timers in its EDS."""
    config = drive_config(JOINT, NODE_ID)
    entries = [
        entry
        for entry in config.dictionary
        if timer or not (entry.subindex == 5 and 0x1800 <= entry.index < 0x1A00)
    ]
    dictionary = ObjectDictionary(entries)
    tpdos = tuple(
        with_event_timer(replace(tpdo, transmission=transmission), dictionary)
        for tpdo in config.tpdos
    )
    return replace(config, tpdos=tpdos, dictionary=dictionary)


@STREAMED
def test_a_drive_whose_tpdos_stop_to_come_on_change_is_not_fresh(mode: OperationMode) -> None:
    """It is halted on its own ramp, as one that answers SYNC; at rest it stays fresh."""
    led = Led(mode, Leader(), on_change())
    led.net.lose(*TPDOS)
    velocities = led.velocities()
    assert min(velocities) > -0.02  # it is not thrown back to where it was seen last
    assert velocities[-1] == pytest.approx(0.0, abs=1e-3)
    assert led.source.losses[JOINT].cause is RefusalCause.SILENT
    led.net.lose()
    led.net.run(3.0)
    assert led.net.drives[JOINT].accepts_targets
    assert not [text for text in led.net.reported(Severity.WARNING) if 'goes unnoticed' in text]


UNNOTICED = pytest.mark.parametrize(
    'config', [on_change(timer=False), on_change(0)], ids=['no timer', 'type 0']
)


@STREAMED
@UNNOTICED
def test_an_axis_is_not_held_at_a_position_of_unknown_age(
    config: NodeConfig, mode: OperationMode
) -> None:
    """Where nothing shows that it is old, the drive is stopped by its own ramp, and disabled.

    Its position is read before it is enabled: the motor does not go back to the last that came.
    """
    led = Led(mode, Leader(), config)
    (warning,) = [text for text in led.net.reported(Severity.WARNING) if 'goes unnoticed' in text]
    assert 'TPDO 1, 2' in warning
    led.net.lose(*TPDOS)
    shown = led.net.motor()
    velocities = led.velocities()
    assert min(velocities) > -0.02
    assert velocities[-1] == pytest.approx(0.0, abs=1e-3)
    led.net.run(8.0)
    assert led.net.simulated().state is DriveState.SWITCH_ON_DISABLED
    rest = led.net.motor()
    assert abs(rest - shown) > 0.05
    led.net.lose()
    led.net.do(JOINT, 'enable')
    assert max(map(abs, led.velocities(1.0))) < 0.02
    assert led.net.motor() == pytest.approx(rest, abs=1e-3)


@UNNOTICED
def test_a_change_that_got_lost_is_read_before_a_drive_is_enabled(config: NodeConfig) -> None:
    """Else it would count as enabled for good, by the last TPDO that came.

    A fault is named by enable, and reset at once by recover.
    """
    net = enabled(config, OperationMode.PROFILE_POSITION)
    for verb in ('enable', 'recover', 'init'):
        net.lose(*TPDOS)
        net.devices[JOINT].faults.inject(FaultInjection(Fault.STO, duration=0.5), net.now)
        net.run(1.0)
        assert net.simulated().state is not DriveState.OPERATION_ENABLED
        net.lose()
        assert 'Operation enabled' in net.do(JOINT, verb), verb
        assert net.simulated().state is DriveState.OPERATION_ENABLED
    net.lose(*TPDOS, 0x080 + NODE_ID)
    net.devices[JOINT].faults.inject(FaultInjection(Fault.OVER_CURRENT), net.now)
    net.run(1.0)
    net.lose()
    with pytest.raises(DriveError, match='is faulted; recover it first'):
        net.do(JOINT, 'enable')
    assert 'Operation enabled' in net.do(JOINT, 'recover')


@pytest.mark.parametrize('verb', ['halt', 'quick_stop', 'shutdown'])
@UNNOTICED
def test_a_stop_is_seen_by_sdo_where_its_tpdos_get_lost(config: NodeConfig, verb: str) -> None:
    """It is answered when the drive stands, in its true state, and not before."""
    led = Led(OperationMode.CYCLIC_POSITION, Leader(), config)
    led.net.lose(*TPDOS)
    answer = led.net.do(JOINT, verb, preempt=True)
    assert led.net.speed() == pytest.approx(0.0, abs=1e-2)
    assert led.net.simulated().state.title in answer


@UNNOTICED
def test_a_stop_that_cannot_be_seen_at_all_is_not_answered_as_one(config: NodeConfig) -> None:
    """Neither TPDO nor SDO shows that it moves, and its last position stood."""
    state, position = config.tpdos[:2]
    unseen = replace(position, mapping=position.mapping[:1])  # without 0x606C
    config = replace(
        config,
        tpdos=(state, unseen, *config.tpdos[2:]),
        heartbeat_producer=0.0,
        heartbeat_timeout=0.0,
    )
    net = enabled(config, OperationMode.PROFILE_VELOCITY)
    net.run(1.0)
    net.lose(*TPDOS, 0x580 + NODE_ID)
    net.target(1.0)
    net.run(1.5)
    assert net.speed() == pytest.approx(1.0, abs=1e-2)
    halt = net.begin(JOINT, 'halt', preempt=True)
    net.run_until(lambda: halt.done, 20.0)
    with pytest.raises(DriveError, match='standstill'):
        halt.result()


def test_a_device_that_refuses_its_event_timer_is_named_until_it_takes_it() -> None:
    """It boots, and is not taken for silent when it only rests; from then on a loss is noticed.

    Refused again at the next boot it is not named again, but it is once it took it meanwhile.
    """
    net = VirtualNetwork(replace(bus_config(on_change()), locations={(JOINT,): Place()}))
    refused = FaultInjection(Fault.SDO_ABORT, object=(0x1800, 5), abort=0x06090030)
    net.start()
    for refuses, named in ((True, True), (True, False), (False, False), (True, True)):
        begin = len(net.reported(Severity.WARNING))
        net.power_off(JOINT)
        net.run(0.5)
        device = net.power_on(JOINT)
        if refuses:
            device.faults.inject(refused, net.now)
        net.run_until(net.all_ready)
        reported = net.reported(Severity.WARNING)[begin:]
        assert any('TPDO 1: its loss goes unnoticed' in text for text in reported) is named
        net.run(2.0)
        assert net.drives[JOINT].view.fresh
        net.lose(0x180 + NODE_ID)
        net.run(1.0)
        assert net.drives[JOINT].view.fresh is refuses
        net.lose()


def test_the_timer_of_the_eds_is_no_longer_than_ours() -> None:
    """A loss is noticed after 0.3 s, unless the device sends less often (0x1800:03 in 0.1 ms)."""
    config = drive_config(JOINT, NODE_ID)
    tpdo = replace(config.tpdos[0], transmission=255)
    for timer, inhibit, expected in (
        (0, 0, 0.1),
        (50, 0, 0.05),
        (10_000, 0, 0.1),
        (10_000, 2000, 0.4),
        (50, 2000, 0.4),
    ):
        defaults = {(0x1800, 5): timer, (0x1800, 3): inhibit}
        dictionary = with_defaults(config.dictionary, defaults)
        assert with_event_timer(tpdo, dictionary).event_time == pytest.approx(expected)


def test_a_drive_in_operation_is_taken_over_and_gets_its_event_timer() -> None:
    """Its PDOs are those of the bus.yml all the same; its loss is noticed from then on."""
    timed = replace(on_change(), reset_communication=False)
    untimed = tuple(replace(tpdo, event_time=None) for tpdo in timed.tpdos)
    net = booted(replace(timed, tpdos=untimed))
    net.do(JOINT, 'init')
    net._config = replace(bus_config(timed), locations={(JOINT,): Place()})
    net.replace_master()
    net.start()
    net.run(2.0)
    assert net.network.nodes[JOINT].taken_over
    assert net.drives[JOINT].view.fresh
    net.lose(*TPDOS)
    net.run(1.0)
    assert not net.drives[JOINT].view.fresh


def bus_with(
    tmp_path: Path, tpdos: str, sync_period: int = 10_000, *, eds: Path | str = DRIVE_EDS
) -> BusConfig:
    """Return the bus of a drive with these TPDOs, and a time between two SYNCs in [us]."""
    file = tmp_path / 'bus.yml'
    master = f'{{node_id: 1, driver: ros2_canopen::MasterDriver, sync_period: {sync_period}}}'
    file.write_text(
        f'master: {master}\n'
        f'joint1:\n  node_id: 2\n  dcf: {eds}\n'
        f'  driver: ros2_canopen::Cia402Driver\n{tpdos}'
    )
    return load_bus(file)


def test_the_event_timer_by_default(tmp_path: Path) -> None:
    """It is set where it is needed and nobody has chosen, and tried only."""
    for keys, time in (
        ('transmission: 255', 0.1),
        ('transmission: 254, inhibit_time: 2000', 0.4),
        ('transmission: 255, event_timer: 30', 0.03),
        ('transmission: 255, event_timer: 0', 0.0),
        ('transmission: 0', None),
        ('transmission: 1', None),
    ):
        bus = bus_with(tmp_path, f'  tpdo:\n    1: {{{keys}}}\n')
        (node,) = bus.nodes
        assert node.tpdos[0].event_time == time, keys
        writes = [write for write in boot_writes(bus, node) if write.address == (0x1800, 5)]
        times = [struct.unpack('<H', write.data)[0] / 1000 for write in writes]
        assert times == ([] if time is None else [time]), keys
        assert [write.requested for write in writes] == ['event_timer' in keys] * len(writes)


def test_check_and_boot_name_what_may_get_lost(tmp_path: Path) -> None:
    """The one before anything runs, at the place of the key, the other when it does."""
    for keys, *lossy in (
        ('transmission: 255', False, False),
        ('transmission: 255, event_timer: 0', True, True),
        ('transmission: 0', True, True),
        ('transmission: 1', False, True),
        ('from EDS: 252', True, True),
        ('from EDS: 253', True, True),
    ):
        for expected, sync_period in zip(lossy, (10_000, 0), strict=True):
            if keys.startswith('from EDS'):
                eds = DRIVE_EDS.read_text().split('[1800sub2]')
                eds[1] = re.sub('DefaultValue=.*', f'DefaultValue={keys[-3:]}', eds[1], count=1)
                (tmp_path / 'other.eds').write_text('[1800sub2]'.join(eds))
                bus = bus_with(tmp_path, '', sync_period, eds='other.eds')
            else:
                bus = bus_with(tmp_path, f'  tpdo:\n    1: {{{keys}}}\n', sync_period)
            found = [str(problem) for problem in check_bus(bus).warnings]
            named = any('the loss of TPDO 1' in text for text in found)
            sync = SyncRound(lambda: None, period=bus.master.sync_period)
            unnoticed = ReceivedTpdo(bus.nodes[0].tpdos[0], sync).loss_unnoticed
            assert named is unnoticed is expected, (keys, sync_period)
