# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The fault matrix: each fault in each mode, in motion, and what comes of it.

What the master says, what the drives do, how it recovers; and that nothing moves unasked before,
in between and after. Two drives move: the fault meets the first, and the second is the witness.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
import re
from typing import Any

from bus_rig import MODES, VirtualNetwork, with_modes
from diagnostic_msgs.msg import DiagnosticStatus
from drive_samples import (
    bus_config,
    drive_config,
    drive_dictionary,
    every_mode,
    MOTION_WRITES,
    pdo,
    SCALE,
    sdo_write,
)
import pytest

from arm_canopen import (
    DriveError,
    DriveState,
    EventKind,
    OperationMode,
    Refusal,
    RefusalCause,
    SdoError,
    Setpoint,
    Severity,
)
from arm_canopen.config import SdoWrite
from arm_canopen.nodes.diagnostics import drive_diagnostic
from canopen_core.can import Frame
from canopen_core.standard import (
    COMMANDED_STATES,
    DataType,
    NmtCommand,
    ObjectDictionary,
    ObjectEntry,
    POSITION_MODES,
    TORQUE_MODES,
    VELOCITY_MODES,
)
from canopen_sim import Device, FaultInjection, ServoModel
from canopen_sim import Drive as SimulatedDrive
from canopen_sim import Fault as Deviation

pytestmark = pytest.mark.slow

FAULTY, WITNESS = 'joint1', 'joint2'
NODE_ID = 2  # of the faulty one
SPEED = 0.5  # [rad/s]
FAR = 0.9  # [rad]
CYCLE = 0.02  # [s] twice the usual one: half the frames to compute
SETTLING = 1.0  # [s] for a fault to be noticed and every ramp to end
STANDING = 0.03  # [rad/s]
CREEP = 0.002  # [rad] that a motor without torque may still roll
TORQUE = 200.0  # [per mille] of the rated one


def target_of(mode: OperationMode) -> float:
    """Return a target that sets a drive in motion."""
    if mode in TORQUE_MODES:
        return TORQUE
    return SPEED if mode in VELOCITY_MODES else FAR


class Arm:
    """Two drives and their master."""

    def __init__(
        self,
        heartbeat_timeout: float = 0.3,
        *deviations: FaultInjection,
        **faulty: Any,
    ) -> None:
        """Boot them.

        Args:
            heartbeat_timeout: Consumer time of both sides in [s].
            *deviations: How the first drive deviates from the standard.
            **faulty: What its configuration has otherwise, as of drive_config().
        """
        watching: dict[str, Any] = {
            'scales': {'position_mode': int(OperationMode.CYCLIC_POSITION)},
            'heartbeat_consumer': True,
            'heartbeat_timeout': heartbeat_timeout,
            'sdo_writes': (*MOTION_WRITES, sdo_write(0x60C2, 1, round(1000 * CYCLE))),
        }
        faulty['scales'] = watching['scales'] | faulty.get('scales', {})
        self.net = VirtualNetwork(
            bus_config(
                every_mode(drive_config(FAULTY, 2, **watching | faulty)),
                every_mode(drive_config(WITNESS, 3, **watching)),
                heartbeat_producer=0.1,
                heartbeat_timeout=heartbeat_timeout,
                sync_period=CYCLE,
                cycle_period=CYCLE,
            )
        )
        for deviation in deviations:
            self.net.devices[FAULTY].faults.inject(deviation, self.net.now)
        self.net.boot()
        self.coasted = 0.0  # [rad/s] greatest speed without power of the faulty drive
        cycle = self.net.network.on_cycle

        def watch(now: float, period: float) -> None:
            cycle(now, period)
            device = self.net.devices.get(FAULTY)
            if device is not None and device.drive is not None:
                self._watch_power(device.drive)

        self.net.network.on_cycle = watch

    def _watch_power(self, drive: SimulatedDrive) -> None:
        if drive.state not in {DriveState.OPERATION_ENABLED, DriveState.QUICK_STOP_ACTIVE}:
            self.coasted = max(self.coasted, abs(drive.velocity) / SCALE)

    def state(self, name: str = FAULTY) -> DriveState:
        """Return the state in which a simulated drive really is."""
        return self.net.simulated(name).state

    def move(self, mode: OperationMode) -> None:
        """Set both drives in motion in a mode."""
        for name in self.net.drives:
            self.net.enable(mode, name)
        for name in self.net.drives:
            self.net.target(target_of(mode), name)
        self.net.run(0.6)
        assert all(self.net.motor(name) > 0.05 for name in self.net.drives)

    def stop(self, name: str, mode: OperationMode) -> None:
        """Stop a drive, which stays enabled."""
        if mode not in POSITION_MODES:
            self.net.do(name, 'halt', preempt=True)
        self.net.run(SETTLING)

    def diagnostic(self) -> tuple[bytes, str]:
        """Return level and summary of the faulty drive in /diagnostics."""
        status = self.net.drives[FAULTY].status()
        return drive_diagnostic('bus', status).level, status.summary

    def strike(self, what: Deviation | str) -> None:
        """Let a fault happen to the first device, to the master or to the bus."""
        if isinstance(what, Deviation):
            fault = FaultInjection(what, duration=0.05 if what is Deviation.REBOOT else 0.0)
            self.net.devices[FAULTY].faults.inject(fault, self.net.now)
            return
        self.net.wire.loses = lambda sender, frame: what == BUS_DOWN or sender == 'master'
        self.net.wire.refuses = 'the interface is down' if what == BUS_DOWN else ''

    def end_faults(self) -> None:
        """End all faults: everything is powered again, and reaches everybody."""
        self.net.devices[FAULTY].faults.end(self.net.now)
        self.net.lose()
        self.net.wire.refuses = ''

    def stands(self, *names: str, duration: float = 0.5) -> None:
        """Check that motors rest for a while, whatever their drives do."""
        before = {name: self.net.motor(name) for name in names}
        self.net.run(duration)
        for name in names:
            assert self.net.motor(name) == pytest.approx(before[name], abs=CREEP), self.net.story()


@dataclass(frozen=True)
class Fault:
    """A row of the matrix."""

    what: Deviation | str  # happens
    # what the master reports as an error of every drive that is met, or of the bus
    reports: EventKind
    state: DriveState | None  # in which the drive ends; None when it is gone
    cause: RefusalCause  # why targets are refused meanwhile
    verb: str  # command that brings the drive back
    emcy: int | None = None  # error code that the master must have received

    @property
    def met(self) -> tuple[str, ...]:
        """Names of the drives that it stops."""
        return (FAULTY, WITNESS) if isinstance(self.what, str) else (FAULTY,)

    def __str__(self) -> str:
        return str(getattr(self.what, 'label', self.what))


MASTER_UNHEARD, BUS_DOWN = 'master unheard', 'bus down'
SWITCHED_OFF, FAULT = DriveState.SWITCH_ON_DISABLED, DriveState.FAULT
LOST, DRIVE, BUS = EventKind.HEARTBEAT_LOST, EventKind.DRIVE, EventKind.BUS
OFFLINE, FAULTED, OFF = RefusalCause.OFFLINE, RefusalCause.FAULT, RefusalCause.NOT_ENABLED
FAULTS = (
    Fault(Deviation.POWER_OFF, LOST, None, OFFLINE, 'init'),
    Fault(Deviation.REBOOT, LOST, SWITCHED_OFF, OFF, 'init'),  # no heartbeat is missed
    Fault(MASTER_UNHEARD, LOST, FAULT, OFFLINE, 'recover', 0x8130),
    Fault(BUS_DOWN, BUS, FAULT, OFFLINE, 'recover'),
    Fault(Deviation.OVER_CURRENT, DRIVE, FAULT, FAULTED, 'recover', 0x2310),
    Fault(Deviation.UNDER_VOLTAGE, DRIVE, FAULT, FAULTED, 'recover', 0x3220),
    Fault(Deviation.STO, DRIVE, SWITCHED_OFF, OFF, 'enable'),
    Fault(Deviation.FOLLOWING_ERROR, DRIVE, FAULT, FAULTED, 'recover', 0x8611),
    Fault(Deviation.HEARTBEAT_STOP, LOST, SWITCHED_OFF, OFFLINE, 'enable'),
)


@pytest.mark.parametrize(('fault', 'mode'), with_modes(FAULTS))
def test_fault_in_motion(fault: Fault, mode: OperationMode) -> None:
    """It is reported, the drive stops, refuses targets, and only a command brings it back."""
    arm = Arm()
    arm.move(mode)
    before, refusals = len(arm.net.events), list[Refusal]()
    arm.net.drives[FAULTY].released = refusals.append
    arm.strike(fault.what)
    arm.net.run(SETTLING)
    if WITNESS not in fault.met:
        arm.stop(WITNESS, mode)
    for name in fault.met:
        errors = [event for event in arm.net.events[before:] if event.severity is Severity.ERROR]
        assert any(event.kind is fault.reports and event.node in (name, '') for event in errors), (
            arm.net.story()
        )
        codes = [emcy.code for _, emcy in arm.net.network.nodes[name].emergencies.history]
        assert fault.emcy is None or fault.emcy in codes
        refusal = arm.net.drives[name].refusal
        assert refusal is not None
        assert refusal.cause is fault.cause
        with pytest.raises(DriveError):
            arm.net.target(0.1, name)
    if fault.cause is FAULTED and mode in POSITION_MODES:
        # the EMCY that came with it: 0x603F is read when the motion has ended already
        assert refusals[0].cause is FAULTED
        assert refusals[0].detail.startswith(f'0x{fault.emcy:04X}')
    if fault.state is not None:
        assert arm.state() is fault.state, arm.net.story()
        arm.stands(FAULTY)
    if fault.what is Deviation.HEARTBEAT_STOP:  # nothing else takes its power
        assert arm.coasted < STANDING
    stopped = arm.state(WITNESS) is not DriveState.OPERATION_ENABLED
    assert stopped is (WITNESS in fault.met)
    arm.end_faults()
    arm.net.run_until(arm.net.all_ready)
    arm.stands(FAULTY, WITNESS)
    for name in fault.met:
        assert arm.state(name) is not DriveState.OPERATION_ENABLED, 'enabled by itself'
    for name in fault.met:
        arm.net.do(name, fault.verb)
        arm.net.select(name, mode)
    arm.stands(FAULTY, WITNESS)
    assert_accepts_targets(arm, mode)


@pytest.mark.parametrize('fault', [f for f in FAULTS if isinstance(f.what, Deviation)], ids=str)
def test_fault_while_homing(fault: Fault) -> None:
    """The command ends with the reason, the axis stops, and homing does not go on by itself."""
    arm = Arm()
    running = arm.net.home(17)
    arm.net.run(1.0)
    assert not running.done
    arm.strike(fault.what)
    arm.net.run(2.0 * SETTLING)
    assert isinstance(running.error, (DriveError, SdoError))
    arm.end_faults()
    arm.net.run_until(arm.net.all_ready)
    arm.stands(FAULTY)
    assert arm.state() is not DriveState.OPERATION_ENABLED
    arm.net.do(FAULTY, fault.verb)
    arm.stands(FAULTY)


def assert_accepts_targets(arm: Arm, mode: OperationMode) -> None:
    """Check that the drive goes where it is sent now."""
    if mode not in POSITION_MODES:
        arm.net.target(-target_of(mode))
        arm.net.run_until(lambda: arm.net.drives[FAULTY].view.velocity < -0.1, 1.0)
        return
    arm.net.target(-0.2)
    arm.net.run(2.0)
    assert arm.net.motor(FAULTY) == pytest.approx(-0.2, abs=0.01)


Unit = tuple[FaultInjection, dict[str, Any], int]
"""How a drive deviates, how its bus.yml says it, and where its 0 is in [inc]."""


def rates(
    velocity: float, acceleration: float, objects: Mapping[tuple[int, int], int] | None = None
) -> Unit:
    """Return a drive that counts in units of so many [inc/s] and [inc/s^2].

    Its ``objects`` say its unit of accelerations; without any, bus.yml does.
    """
    injection = FaultInjection(Deviation.RATE_UNITS, velocity=velocity, acceleration=acceleration)
    scales = {'scale_vel_to_dev': SCALE / velocity, 'scale_vel_from_dev': velocity / SCALE}
    if not objects:
        scales |= {'scale_acc_to_dev': SCALE / acceleration}
        scales |= {'scale_acc_from_dev': acceleration / SCALE}
    writes = (
        sdo_write(0x60C2, 1, round(1000 * CYCLE)),
        *(sdo_write(i, 0, round(v / velocity)) for i, v in ((0x6081, 10_000), (0x607F, 30_000))),
        *(sdo_write(ramp, 0, round(50_000 / acceleration)) for ramp in (0x6083, 0x6084)),
        sdo_write(0x6085, 0, round(100_000 / acceleration)),
    )
    known = drive_dictionary().for_node(NODE_ID)
    units = (
        ObjectEntry(*address, 'Unit', DataType.UNSIGNED32, default=value)
        for address, value in (objects or {}).items()
    )
    others = (entry for entry in known if entry.address not in (objects or {}))
    dictionary = ObjectDictionary([*others, *units])
    return injection, {'scales': scales, 'sdo_writes': writes, 'dictionary': dictionary}, 0


RPM = 6283.0 / 60.0  # [inc/s]
SERVO_CYCLE = 125e-6  # [s]
FIXED_POINT = 2.0**-16
# 0.1 inc/s and 10 inc/s^2, in two ways
SI_UNITS = {(0x60A9, 0): 0xFFB5_0300, (0x60AA, 0): 0x01B5_5700}
FACTOR_GROUP = {(0x6096, 1): 10, (0x6096, 2): 1, (0x6097, 1): 1, (0x6097, 2): 100}
KEPT_OFFSET = FaultInjection(Deviation.OBJECT_KEPT, object=(0x60B0, 0), value=1_000)
SHIFTED = FaultInjection(Deviation.ENCODER_SHIFTED, position=7_000)
OFFSET = {'scales': {'offset_pos_to_dev': 7_000.0, 'offset_pos_from_dev': -7_000.0 / SCALE}}
UNITS: dict[str, Unit] = {
    'rpm and 0.1 rpm/s': rates(RPM, RPM / 10.0),
    'inc/s and inc/s in a ms': rates(1.0, 1000.0),
    '16.16': rates(FIXED_POINT / SERVO_CYCLE, FIXED_POINT / SERVO_CYCLE**2),
    'SI units': rates(0.1, 10.0, SI_UNITS),
    'factor group': rates(0.1, 10.0, FACTOR_GROUP),
    'position offset': (KEPT_OFFSET, {}, 0),
    'offset in bus.yml': (SHIFTED, OFFSET, 7_000),
}
DECELERATION, QUICK_STOP_DECELERATION = 5.0, 10.0  # [rad/s^2]
SLOWEST_DECELERATION = 2.0  # [rad/s^2] that of mode 2
LATE = 4.0 * CYCLE  # [s] between the command and the beginning of the ramp


@pytest.mark.parametrize(
    'modes', [POSITION_MODES, VELOCITY_MODES[1:]], ids=['position', 'velocity']
)
@pytest.mark.parametrize('unit', UNITS)
def test_a_stop_is_as_short_as_the_drive_can_whatever_it_counts_in(
    unit: str, modes: tuple[OperationMode, ...]
) -> None:
    """Enabling moves nothing, targets are where they were said, and no stop is cut or long."""
    deviation, faulty, zero = UNITS[unit]
    mode = modes[list(UNITS).index(unit) % len(modes)]
    arm = Arm(0.3, deviation, **faulty)

    def place() -> float:
        return (arm.net.simulated().position - zero) / SCALE

    for stop in ('halt', 'quick_stop', 'disable'):
        begin = place()
        arm.net.enable(mode, FAULTY)
        arm.net.run(0.3)
        assert place() == pytest.approx(begin, abs=2e-4)
        target = SPEED if mode in VELOCITY_MODES else begin + FAR
        arm.net.target(target)
        arm.net.run(0.5)
        speed, at = arm.net.speed(), place()
        assert speed == pytest.approx(SPEED if mode in VELOCITY_MODES else 1.0, rel=0.1)
        arm.net.do(FAULTY, stop, preempt=True)
        steep = DECELERATION if stop == 'halt' else QUICK_STOP_DECELERATION
        flat = QUICK_STOP_DECELERATION if stop == 'quick_stop' else DECELERATION
        shortest, longest = (speed**2 / 2.0 / ramp for ramp in (steep, flat))
        assert 0.9 * shortest < place() - at < longest + LATE * speed, (stop, shortest, longest)
        arm.stands(FAULTY)
    arm.net.enable(OperationMode.CYCLIC_POSITION, FAULTY)
    arm.net.target(0.3)
    arm.net.run(3.0)
    assert place() == pytest.approx(0.3, abs=1e-3)


@pytest.mark.parametrize('stop', ['halt', 'quick_stop', 'disable'])
@pytest.mark.parametrize('side', [1, -1])
def test_a_drive_outside_its_limits_is_led_back_and_stopped(side: int, stop: str) -> None:
    """Beyond 0x607D enabling moves nothing, further out is refused, a stream leads back in."""
    limits = (sdo_write(0x607D, 1, -10_000), sdo_write(0x607D, 2, 10_000))
    timing = sdo_write(0x60C2, 1, round(1000 * CYCLE))
    outside = FaultInjection(Deviation.ENCODER_SHIFTED, position=side * 13_000)
    arm = Arm(0.3, outside, sdo_writes=(*MOTION_WRITES, timing, *limits))
    drive = arm.net.drives[FAULTY]

    def stream(cycles: int, speed: float) -> None:
        for _ in range(cycles):
            drive.stream(Setpoint(drive.setpoint + side * speed * CYCLE))
            arm.net.run(CYCLE)

    def enable() -> None:
        begin = arm.net.motor(FAULTY)
        arm.net.enable(OperationMode.CYCLIC_POSITION, FAULTY)
        arm.net.run(0.5)
        assert arm.net.motor(FAULTY) == pytest.approx(begin, abs=2e-4)

    enable()
    with pytest.raises(DriveError, match='software limits'):
        stream(1, 0.1)
    stream(20, -0.5)
    at, speed = arm.net.motor(FAULTY), abs(arm.net.speed())
    assert speed == pytest.approx(0.5, rel=0.1)
    arm.net.do(FAULTY, stop, preempt=True)
    assert abs(arm.net.motor(FAULTY) - at) < speed**2 / 2.0 / DECELERATION + LATE * speed
    arm.stands(FAULTY)
    assert abs(arm.net.motor(FAULTY)) > 1.0
    enable()
    stream(40, -0.5)
    assert abs(arm.net.motor(FAULTY)) < 0.85
    with pytest.raises(DriveError, match='software limits'):
        stream(100, 0.5)
    assert abs(arm.net.motor(FAULTY)) < 1.0 + 2e-3


TPDOS, RPDOS = (0x180, 0x280, 0x380), (0x200, 0x300, 0x400)
ALL, ONE, BOTH = (*TPDOS, *RPDOS), (FAULTY,), (FAULTY, WITNESS)
STREAMED = (OperationMode.INTERPOLATED_POSITION, OperationMode.CYCLIC_POSITION)


@pytest.mark.parametrize(
    ('loss', 'mode'),
    with_modes(
        [(lost, names) for lost in (TPDOS, RPDOS, ALL) for names in (ONE, BOTH)], 0, 1, 3, 6
    ),
)
def test_lost_pdos_in_motion(
    loss: tuple[tuple[int, ...], tuple[str, ...]], mode: OperationMode
) -> None:
    """A drive that cannot be seen is halted and refuses targets; one without RPDOs is reported.

    A halt that does not reach it becomes a quick stop by SDO; else it stays enabled. When the PDOs
    come again nothing moves before a new target.
    """
    lost, names = loss
    arm = Arm()
    arm.move(mode)
    silent, deaf = set(TPDOS) <= set(lost), set(RPDOS) <= set(lost)
    arm.net.lose(
        *(base + arm.net.network.nodes[name].config.node_id for name in names for base in lost)
    )
    for name in {FAULTY, WITNESS} - set(names):
        arm.stop(name, mode)
    arm.net.run(1.0)
    for name in names:
        drive = arm.net.drives[name]
        causes = {text for text in arm.net.reported(Severity.ERROR) if f'{name}: stopping' in text}
        assert drive.accepts_targets is not silent
        assert bool(causes) is (silent or mode in STREAMED), arm.net.story()
        assert drive.halt.held is bool(causes) or not drive.acts
        if silent:
            with pytest.raises(DriveError, match='TPDOs'):
                arm.net.target(0.1, name)
    stopped_by_sdo = deaf and mode not in POSITION_MODES  # which end by themselves
    if stopped_by_sdo:
        halts = [arm.net.begin(name, 'halt', preempt=True) for name in names]
        arm.net.run(0.4)
        assert silent or not any(halt.done for halt in halts), 'commanded to stand, and moves'
        arm.net.run(1.5)
        assert all(SWITCHED_OFF.title in halt.result() for halt in halts)
    arm.stands(*names)
    arm.end_faults()
    arm.net.run(0.7)
    arm.stands(FAULTY, WITNESS)
    for name in (FAULTY, WITNESS):
        if stopped_by_sdo and name in names:
            assert arm.state(name) is SWITCHED_OFF
            arm.net.do(name, 'enable')
        assert arm.state(name) is DriveState.OPERATION_ENABLED
        assert arm.net.drives[name].accepts_targets
    assert_accepts_targets(arm, mode)


PRE_OPERATIONAL, STOP = NmtCommand.ENTER_PRE_OPERATIONAL, NmtCommand.STOP


def slow_heartbeat(period: float, **faulty: Any) -> Arm:
    """Return an arm of a device that goes on when NMT takes it from the master (0x6007).

    It sends its heartbeat with a ``period`` in [s].
    """
    writes = (*MOTION_WRITES, sdo_write(0x60C2, 1, round(1000 * CYCLE)), sdo_write(0x6007, 0, 0))
    return Arm(3.0 * period, heartbeat_producer=period, sdo_writes=writes, **faulty)


@pytest.mark.parametrize(
    ('wait', 'stop', 'mode'),
    [(wait, stop, mode) for stop in ('halt', 'disable') for wait, mode in with_modes([0.05, 0.3])],
)
def test_a_stop_while_no_pdos_pass_and_nothing_says_why(
    wait: float, stop: str, mode: OperationMode
) -> None:
    """A device that left Operational unseen: TPDOs are gone, its heartbeat comes each second.

    What its positions were for the last time is no standstill, also where no PDO has 0x606C.
    """
    no_velocity = (
        pdo(1, 0x180 + NODE_ID, (0x6041, 0), (0x6061, 0)),
        pdo(2, 0x280 + NODE_ID, (0x6064, 0)),
    )
    arm = slow_heartbeat(1.0, tpdos=no_velocity)
    move_far(arm, mode)
    arm.net.run_until(lambda: arm.net.now - arm.net.network.nodes[FAULTY].life.last < 2 * CYCLE)
    leave = Frame(0, bytes((PRE_OPERATIONAL, NODE_ID)))
    arm.net.devices[FAULTY].receive(leave, arm.net.now)
    arm.net.run(wait)
    arm.net.do(FAULTY, stop, preempt=True)
    assert abs(arm.net.simulated(FAULTY).velocity) / SCALE < STANDING
    arm.stands(FAULTY)


@pytest.mark.parametrize('mode', MODES, ids=lambda mode: mode.name)
@pytest.mark.parametrize(('command', 'period'), [(PRE_OPERATIONAL, 1.0), (STOP, 0.1)])
def test_an_axis_is_led_to_rest_when_its_device_leaves_operational(
    command: NmtCommand, period: float, mode: OperationMode
) -> None:
    """By SDO and at once, as the master sees the command of a tool; diagnostics are true."""
    arm = slow_heartbeat(period)
    move_far(arm, mode)
    speed, place = abs(arm.net.simulated(FAULTY).velocity) / SCALE, arm.net.motor(FAULTY)
    arm.net.send_as('tool', Frame(0, bytes((command, NODE_ID))))
    arm.net.run(2.0 * CYCLE)
    level, summary = arm.diagnostic()
    assert level == DiagnosticStatus.ERROR
    assert 'not seen to stand' in summary
    arm.net.run(SETTLING)
    assert arm.net.motor(FAULTY) - place < speed**2 / 2.0 / SLOWEST_DECELERATION + LATE * speed
    assert arm.state() is SWITCHED_OFF
    assert arm.coasted < STANDING
    level, summary = arm.diagnostic()
    assert level == DiagnosticStatus.WARN
    assert 'start it by NMT' in summary
    arm.net.send_as('tool', Frame(0, bytes((NmtCommand.START, NODE_ID))))
    arm.net.run(0.05)
    arm.net.do(FAULTY, 'recover')
    arm.net.select(FAULTY, mode)
    assert_accepts_targets(arm, mode)


@pytest.mark.parametrize(
    ('command', 'mode'), with_modes([PRE_OPERATIONAL, STOP, NmtCommand.RESET_NODE])
)
def test_an_nmt_command_of_a_client_leaves_when_the_axis_stands(
    command: NmtCommand, mode: OperationMode
) -> None:
    """Stopped, a device would take no SDO, and one that is reset would coast."""
    arm = slow_heartbeat(0.1)
    move_far(arm, mode)
    begin = arm.net.now
    arm.net.master.device(FAULTY).send_nmt(command)
    (sent,) = [each.time for each in arm.net.wire.log if each.frame.can_id == 0][-1:]
    assert begin < sent < begin + 1.0
    assert arm.coasted < STANDING
    arm.net.run(SETTLING)
    assert arm.state() is SWITCHED_OFF
    assert arm.net.reported(Severity.ERROR) == []
    node = arm.net.network.nodes[FAULTY]
    if command is NmtCommand.RESET_NODE:
        arm.net.run_until(arm.net.all_ready)
    else:
        assert node.nmt_state is COMMANDED_STATES[command]
        assert arm.diagnostic()[0] == DiagnosticStatus.WARN
        arm.net.master.device(FAULTY).send_nmt(NmtCommand.START)
    arm.net.do(FAULTY, 'enable')


def test_an_nmt_command_says_which_axis_was_not_seen_to_stand() -> None:
    """It leaves all the same: a reset is what helps a drive that takes no other command."""
    arm = slow_heartbeat(0.1)
    move_far(arm, OperationMode.PROFILE_VELOCITY)
    arm.net.lose(0x200 + NODE_ID, 0x600 + NODE_ID)
    said = commanded(arm.net, NmtCommand.RESET_NODE, NODE_ID)
    assert said == f'NMT RESET_NODE sent to node {NODE_ID}; not seen to stand before: {FAULTY}'
    assert arm.net.reported(Severity.WARNING).count(said) == 1


@pytest.mark.parametrize(('node_id', 'by_sdo'), [(NODE_ID, False), (NODE_ID, True), (0, False)])
def test_an_axis_that_coasts_without_power_is_not_seen_to_stand(
    node_id: int, *, by_sdo: bool
) -> None:
    """The answer names it, and a warning does for those who get none; once it rests, neither.

    That is seen by SDO where its TPDOs do not come.
    """
    net = VirtualNetwork(
        bus_config(every_mode(drive_config(FAULTY, NODE_ID))), servo=ServoModel(coasting=0.5)
    )
    net.boot()
    net.enable(OperationMode.PROFILE_VELOCITY, FAULTY)
    net.target(SPEED, FAULTY)
    net.run(SETTLING)
    net.send_as('tool', Frame(0x200 + NODE_ID, b'\0\0\3'))  # disable voltage
    net.run(0.1)
    assert net.simulated(FAULTY).state is SWITCHED_OFF
    assert net.speed(FAULTY) > STANDING
    everyone = {0: 'all nodes', NODE_ID: f'node {NODE_ID}'}
    answer = f'NMT ENTER_PRE_OPERATIONAL sent to {everyone[node_id]}'
    unseen = f'{answer}; not seen to stand before: {FAULTY}'
    assert commanded(net, PRE_OPERATIONAL, node_id) == unseen
    assert net.reported(Severity.WARNING).count(unseen) == 1
    net.run(5.0)
    net.master.device(FAULTY).send_nmt(NmtCommand.START)
    net.lose(*((0x180 + NODE_ID, 0x280 + NODE_ID) if by_sdo else ()))
    net.run(SETTLING)
    assert net.drives[FAULTY].view.fresh is not by_sdo
    assert commanded(net, PRE_OPERATIONAL, node_id) == answer
    assert sum('not seen to stand' in text for text in net.reported(Severity.WARNING)) == 1


def commanded(net: VirtualNetwork, command: NmtCommand, node_id: int) -> str:
    """Return the answer to an NMT command of a client."""
    sent = net.network.command_nmt(command, node_id)
    return str(net.result(net.network.scheduler.spawn(sent), 30.0))


def move_far(arm: Arm, mode: OperationMode) -> None:
    """Set both drives in a motion that does not end by itself."""
    arm.move(mode)
    if mode in POSITION_MODES:
        arm.net.commands[FAULTY].set_target(50.0)
        arm.net.run(0.1)


@pytest.mark.parametrize('mode', [MODES[0], MODES[5], MODES[7]], ids=lambda mode: mode.name)
def test_sdo_time_outs_do_not_disturb_motion(mode: OperationMode) -> None:
    """The cycle needs no SDO: only the caller of one gets the error, with object and device."""
    arm = Arm()
    arm.move(mode)
    arm.net.lose(0x580 + NODE_ID)
    with pytest.raises(SdoError, match=r'joint1.*0x1008|0x1008.*joint1'):
        arm.net.result(arm.net.network.nodes[FAULTY].sdo.read(0x1008, 0, 0.2))
    arm.stop(FAULTY, mode)
    assert arm.state() is DriveState.OPERATION_ENABLED
    arm.end_faults()
    arm.net.run(1.0)
    assert_accepts_targets(arm, mode)


BLOB = 0x2FFF
SDO_DEVIATIONS: tuple[tuple[FaultInjection, str], ...] = (
    (
        FaultInjection(Deviation.SDO_FOUR_BYTES),
        r'0x1001:00, UNSIGNED8 by its EDS, with 4 bytes \(00 a5 a5 a5\)',
    ),
    (FaultInjection(Deviation.SDO_NO_SIZE), ''),  # which CiA 301 allows
    (FaultInjection(Deviation.SDO_SHORT), r'SDO answers of \d bytes where CiA 301 has 8'),
    (FaultInjection(Deviation.BLOCK_ABORT), r'SDO block transfer.*general error'),
    (FaultInjection(Deviation.BLOCK_SILENCE), r'SDO block transfer.*did not answer'),
    (FaultInjection(Deviation.BLOCK_CRC), r'SDO block transfer.*CRC'),
)
"""What devices do otherwise than CiA 301 has it, and how the master reports it."""


@pytest.mark.parametrize(
    ('deviation', 'said'), SDO_DEVIATIONS, ids=[each.fault.label for each, _ in SDO_DEVIATIONS]
)
def test_a_device_that_deviates_is_driven(deviation: FaultInjection, said: str) -> None:
    """It boots, moves, and shows true values; what is odd is said once, with a remedy."""
    blob = ObjectEntry(BLOB, 0, 'Blob', DataType.DOMAIN)
    drive = drive_config(FAULTY, NODE_ID)
    drive = replace(drive, dictionary=ObjectDictionary([*drive.dictionary, blob]))
    net = VirtualNetwork(bus_config(drive))
    net.devices[FAULTY].faults.inject(deviation, net.now)
    net.boot()
    objects = net.network.nodes[FAULTY].objects
    net.enable(OperationMode.PROFILE_POSITION, FAULTY)
    net.target(0.1)
    net.run(1.0)
    assert net.drives[FAULTY].view.position == pytest.approx(0.1, abs=0.01)
    net.result(objects.write_object(0x6098, 0, -3))
    for content in (bytes(range(256)) * 2, bytes(300)):
        net.result(objects.sdo.write(BLOB, 0, content, 0.2))
        blob_read = net.network.scheduler.spawn(objects.upload(f'0x{BLOB:X}'))
        assert net.result(blob_read)[1] == content
    for index, value in ((0x6061, 1), (0x6098, -3), (0x1000, 0x20192)):
        read = net.network.scheduler.spawn(objects.read_object(index))
        assert net.result(read) == value
    warnings = net.reported(Severity.WARNING)
    assert len(warnings) == bool(said), warnings
    assert re.search(said, ''.join(warnings))


SAVE = int.from_bytes(b'save', 'little')
VENDOR = 0x2100  # which may start something with each write


@pytest.mark.parametrize(
    ('index', 'subindex', 'timeout', 'delay', 'boots', 'sent'),
    [
        (0x1010, 1, None, 3.0, True, 1),
        (VENDOR, 0, None, 1.0, True, 1),
        (VENDOR, 0, None, 3.0, False, 1),
        (VENDOR, 0, 5.0, 3.0, True, 1),
        (0x6099, 1, 5.0, 3.0, True, 1),
        (0x6099, 1, None, 0.5, True, 2),  # a setting may be written twice
    ],
)
def test_an_object_that_takes_long_is_written_once(
    index: int, subindex: int, *, timeout: float | None, delay: float, boots: bool, sent: int
) -> None:
    """In the time that bus.yml or the standard gives it; else the message names the key."""
    drive = drive_config(FAULTY, NODE_ID)
    vendor = ObjectEntry(VENDOR, 0, 'Start', DataType.UNSIGNED32)
    write = SdoWrite(index, subindex, SAVE.to_bytes(4, 'little'), timeout)
    drive = replace(
        drive,
        dictionary=ObjectDictionary([*drive.dictionary, vendor]),
        sdo_writes=(*drive.sdo_writes, write),
    )
    net = VirtualNetwork(bus_config(drive))
    slow = FaultInjection(Deviation.SDO_DELAY, object=(index, subindex), delay=delay)
    net.devices[FAULTY].faults.inject(slow, net.now)
    net.start()
    net.run(4.0)
    assert net.network.nodes[FAULTY].online is boots
    request = bytes((0x23, index & 0xFF, index >> 8, subindex)) + write.data
    attempts = sum('boot failed' in text for text in net.reported(Severity.WARNING))
    assert net.frames(0x600 + NODE_ID).count(request) == sent + attempts, net.story()
    assert boots or 'timeout_ms: 10000' in net.story()
    if index == 0x1010:  # flash memory takes its time after the boot, too
        net.result(net.network.nodes[FAULTY].objects.write_object(index, subindex, SAVE))


@pytest.mark.parametrize('later', [False, True], ids=['at start', 'while it runs'])
def test_two_devices_with_one_node_id_are_named_and_not_enabled(*, later: bool) -> None:
    """Both would move; the others run, and after one is switched off the other boots."""
    net = VirtualNetwork(bus_config(drive_config(FAULTY, NODE_ID), drive_config(WITNESS, 3)))
    if later:
        net.boot()
    other = Device(
        NODE_ID, drive_dictionary(), lambda frame: net.wire.put(net.now, 'other', frame)
    )
    net.connect('other', other)
    other.advance(net.now)
    if not later:
        net.start()
    net.run(3.0)
    assert any('two devices have node id 2' in text for text in net.reported(Severity.WARNING)), (
        net.story()
    )
    with pytest.raises(DriveError, match='two devices have node id 2'):
        net.do(FAULTY, 'init')
    for device in (other, net.devices[FAULTY]):
        assert device.drive is not None
        assert device.drive.state is DriveState.SWITCH_ON_DISABLED
    net.do(WITNESS, 'init')
    net.stations.pop('other')
    net._due.pop('other')
    net.run_until(net.all_ready)
    net.do(FAULTY, 'init')
