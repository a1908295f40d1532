# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A simulated drive: state machine, modes of operation, faults and a motor (CiA 402-2).

The drive updates its axis at each SYNC, and otherwise every few milliseconds while anything moves
or is pending. The update rate does not influence the motion.
"""

from __future__ import annotations

from collections.abc import Container, Iterator
from contextlib import contextmanager
import math

from canopen_core.standard import AbortCode, Controlword, STATE_WORDS, Statusword, Value
from canopen_core.standard import DriveState as State

from ..deviations import Fault, FaultInjection
from ..messages import EmcyProducer, SyncConsumer
from ..object_store import NEVER, ObjectStore, refusal
from .axis import Axis, INTERLOCK_BIT, ServoModel, Switches
from .homing import Homing
from .modes import Dwell, Mode, NoMode, ProfilePosition, ProfileVelocity, TARGET_REACHED, Velocity
from .objects import DriveObjects, MILLISECOND, NO_WINDOW
from .state_machine import (
    AbortConnectionOption,
    chosen,
    decode_command,
    DriveCommand,
    FAULT_RESET_BIT,
    POWERED_STATES,
    StateMachine,
    StopOption,
    VOLTAGE_STATES,
)
from .streamed_modes import (
    CyclicPosition,
    CyclicTorque,
    CyclicVelocity,
    InterpolatedPosition,
    ProfileTorque,
)

MODES: tuple[type[Mode], ...] = (
    NoMode,
    ProfilePosition,
    Velocity,
    ProfileVelocity,
    ProfileTorque,
    Homing,
    InterpolatedPosition,
    CyclicPosition,
    CyclicVelocity,
    CyclicTorque,
)


class ModeSelection:
    """Selects the mode of a drive.

    A mode is available if it is simulated and 0x6502 of the dictionary lists it; without
    0x6502, if the dictionary has the objects of the mode. Other modes are refused for an SDO;
    from an RPDO they are ignored, and 0x6061 keeps showing the present mode.
    """

    def __init__(
        self, objects: DriveObjects, axis: Axis, clock: SyncConsumer, causes: Container[Fault] = ()
    ) -> None:
        self._objects = objects
        self._causes = causes
        self._modes: dict[int, Mode] = {m.number: m(objects, axis, clock) for m in MODES}
        self.current = self._modes[NoMode.number]  # the selected mode
        objects.mode.check = self._check

    def reset(self) -> None:
        """Select the default mode of the dictionary, as after power-on."""
        for mode in self._modes.values():
            mode.reset()
        supported = self._objects.supported_modes
        # many EDS files give no default here, and a drive without any mode would be of no use;
        # others promise more than is simulated
        promised = supported.value or self._objects.possible_modes
        supported.value = promised & sum(m.number.support_bit for m in MODES)
        self.current = self._modes[NoMode.number]
        self.select()

    def select(self) -> bool:
        """Select and display the mode of 0x6060; return whether the mode has changed."""
        number = self._objects.mode.value
        changed = number != self.current.number and self._supports(number)
        if changed:
            self.current = self._modes[number]
        self._objects.mode_display.put(self.current.number)
        return changed

    def _supports(self, number: int) -> bool:
        mode = self._modes.get(number)
        if mode is None or (not number and Fault.MODE_ZERO_REFUSED in self._causes):
            return False
        bit = mode.number.support_bit
        return not bit or bool(bit & self._objects.supported_modes.value)

    def _check(self, value: Value) -> None:
        if not isinstance(value, int) or not self._supports(value):
            raise refusal(AbortCode.VALUE_RANGE, self._objects.mode.entry)


FOLLOWING_ERROR_CODE = 0x8611
UNDER_VOLTAGE_CODE = 0x3220
CONNECTION_CODE = 0x8130

DC_VOLTAGE = 48_000  # [mV]
CONTROL_PERIOD = 0.005  # [s] how often the drive looks at its axis without SYNC
SYNC_PERIOD_MAX = 0.02  # [s] a slower SYNC is not what the drive waits for
SYNC_TIMEOUT_PERIODS = 1.5  # periods that it waits for a SYNC

HALT = int(Controlword.HALT)
VOLTAGE_ENABLED = int(Statusword.VOLTAGE_ENABLED)
REMOTE = int(Statusword.REMOTE)
INTERNAL_LIMIT = int(Statusword.INTERNAL_LIMIT)
FOLLOWING_ERROR = int(Statusword.FOLLOWING_ERROR)
HOMED = int(Statusword.TARGET_REACHED | Statusword.HOMING_ATTAINED)


class Drive:
    """One axis of a device.

    Times ``now`` are on the steady clock in [s]; the default is the time of the last update of
    the axis.
    """

    def __init__(
        self,
        store: ObjectStore,
        errors: EmcyProducer,
        clock: SyncConsumer,
        model: ServoModel,
        *,
        number: int = 0,
        rate_units: tuple[float, float] = (1.0, 1.0),
    ) -> None:
        """Work on the objects of a device; ``rate_units`` are those of :class:`DriveObjects`."""
        self.deadline = NEVER  # steady time in [s] at which it wants to look at its axis
        self.faults: set[int] = set()  # codes of the faults since the last fault reset
        # faults whose cause is still there; no fault reset helps against them
        self.causes: set[Fault] = set()
        self.number = number  # of the axis in its device, from 0
        self._rate_units = rate_units
        self._objects = objects = DriveObjects(store, number, rate_units)
        self._errors = errors
        self._clock = clock
        self._axis = Axis(model)
        self._machine = StateMachine(objects, self._axis, self._begin_mode, self.causes)
        self._modes = ModeSelection(objects, self._axis, clock, self.causes)
        self._following = Dwell()
        self._word = 0
        self._idle = True
        objects.mode.listener = self._on_mode
        objects.controlword.listener = self._on_controlword
        objects.max_velocity.variable.listener = self._on_max_velocity
        objects.max_motor_speed.variable.listener = self._on_max_velocity
        for target in (
            objects.target_position,
            objects.target_velocity.variable,
            objects.interpolation_target,
            objects.vl_target.variable,
            objects.target_torque,
        ):
            target.listener = self._on_setpoint

    @property
    def state(self) -> State:
        """State of the power drive system."""
        return self._machine.state

    @property
    def _mode(self) -> Mode:
        return self._modes.current

    @property
    def position(self) -> float:
        """Motor position in [inc]."""
        return self._axis.position

    @property
    def origin(self) -> float:
        """Position of the mechanical zero in [inc]; homing shifts it without moving the axis."""
        return self._axis.origin

    @property
    def velocity(self) -> float:
        """Motor velocity in [inc/s]."""
        return self._axis.velocity

    def reset(self, now: float) -> None:
        """Restart with the present objects; the motor stays where it is."""
        self._axis.advance(now)
        self._machine.reset()
        self._word = 0
        self.faults.clear()
        self._following.clear()
        self._modes.reset()
        self._axis.speed = self._objects.speed
        self._publish(now)

    def count_from(self, position: float, now: float | None = None) -> None:
        """Set the present motor position in [inc], as the encoder reports it after power-on."""
        now = self._axis.time if now is None else now
        self._axis.advance(now)
        self._axis.shift(position - self._axis.position)
        self._publish(now)

    def start(self, now: float) -> None:
        """Become ready for commands; the device has started."""
        self._machine.start()
        for fault in sorted(self.causes, key=lambda fault: fault.value.code):
            if fault.value.code:
                self._fail(fault.value.code, now, at_once=fault.value.at_once)
        self._publish(now)

    def advance(self, now: float) -> None:
        """Advance to a time; nothing happens while the axis is at rest."""
        if not self._idle:
            self._move(now)
            self._publish(now)

    def sync(self, now: float) -> None:
        """Apply a set-point with SYNC; :meth:`advance` was called for this time before."""
        if self._machine.operating and self._mode.sync(now):
            self._schedule(now)

    @contextmanager
    def _at(self, now: float | None) -> Iterator[float]:
        """Advance to a time, perform an action there, and update the visible objects."""
        now = self._axis.time if now is None else now
        self._move(now)
        yield now
        self._publish(now)

    def raise_fault(self, code: int, now: float | None = None, *, at_once: bool = False) -> None:
        """Raise a fault; ``at_once`` leaves no torque to brake with, whatever 0x605E selects."""
        with self._at(now) as moment:
            self._fail(code, moment, at_once=at_once)

    def inject(self, injection: FaultInjection, now: float) -> None:
        """Inject a fault; the cause of a lasting fault stays until :meth:`clear`."""
        fault, kind = injection.fault, injection.fault.value
        if injection.lasting:
            self.causes.add(fault)
        if fault is Fault.BLOCKED_MOTOR:
            self.block(now=now)
        if fault is Fault.STO:
            self.set_voltage(False, now, fault=False)
        elif fault is Fault.ENCODER_SHIFTED:
            self.count_from(injection.position, now)
        elif fault is Fault.RATE_UNITS:
            self._count_rates_in(injection.velocity, injection.acceleration, now)
        elif kind.code:  # others change what it does with later commands only
            self.raise_fault(kind.code, now, at_once=kind.at_once)

    def clear(self, fault: Fault, now: float) -> None:
        """Remove the cause of a fault; the drive still needs a fault reset."""
        self.causes.discard(fault)
        if fault is Fault.BLOCKED_MOTOR:
            self.release(now)
        elif fault is Fault.STO:
            self.set_voltage(True, now)
        elif fault is Fault.RATE_UNITS:
            self._count_rates_in(None, None, now)

    def _count_rates_in(
        self, velocity: float | None, acceleration: float | None, now: float
    ) -> None:
        """Use other units; None for its own. The numbers in its objects stay the same."""
        own_velocity, own_acceleration = self._rate_units
        self._objects.rate_units[:] = velocity or own_velocity, acceleration or own_acceleration
        self._on_max_velocity(now)
        self._publish(now)

    def block(self, at: float | None = None, now: float | None = None) -> None:
        """Put a mechanical stop at a position in [inc]; by default the motor is stuck."""
        with self._at(now):
            here = self._axis.position
            if at is None:
                self._axis.set_stops(here, here)
            elif at >= here:
                self._axis.set_stops(-math.inf, at)
            else:
                self._axis.set_stops(at, math.inf)

    def release(self, now: float | None = None) -> None:
        """Remove mechanical stops."""
        with self._at(now):
            self._axis.set_stops(-math.inf, math.inf)

    def set_load(self, torque: float, now: float | None = None) -> None:
        """Load the axis, as gravity does; the load is the torque that holds it.

        A positive load in [0.1 % of the rated torque] pulls towards negative positions.
        """
        with self._at(now) as moment:
            self._axis.load = torque
            if self._machine.operating:
                self._mode.load_changed(moment)

    def set_switches(self, switches: Switches) -> None:
        """Move limit switches, home switch and index pulse."""
        self._axis.switches = switches
        self._publish(self._axis.time)

    def set_voltage(self, present: bool, now: float | None = None, *, fault: bool = True) -> None:
        """Supply the power stage, or cut its supply.

        Without voltage a drive that is switched on faults, or goes to Switch on disabled, as
        with safe torque off (no ``fault``).
        """
        with self._at(now) as moment:
            self._machine.set_voltage(present, moment)
            if not present and self._machine.state in VOLTAGE_STATES:
                if fault:
                    self._fail(UNDER_VOLTAGE_CODE, moment)
                else:
                    self._machine.disable()

    def connection_lost(self, now: float) -> None:
        """React to the loss of the master as 0x6007 selects, if the motor has torque."""
        if self._machine.state not in POWERED_STATES:
            return
        with self._at(now):
            match chosen(self._objects.abort_connection, AbortConnectionOption.FAULT):
                case AbortConnectionOption.FAULT:
                    self._fail(CONNECTION_CODE, now)
                case AbortConnectionOption.DISABLE_VOLTAGE:
                    self._machine.disable()
                case AbortConnectionOption.QUICK_STOP if self._machine.operating:
                    self._machine.quick_stop()

    def _move(self, now: float) -> None:
        """Advance the axis to a time, and what depends on where it is."""
        axis, mode = self._axis, self._mode
        if not self._machine.operating:
            axis.advance(now)
        while axis.time < now:
            axis.step(min(now, mode.due))
            mode.step(axis.time)
        self._watch_following_error(now)
        self._machine.advance(now)

    def _watch_following_error(self, now: float) -> None:
        if self._machine.state not in POWERED_STATES:
            return
        window = self._objects.following_window.value
        beyond = 0 < window < NO_WINDOW and abs(self._axis.following_error) > window
        timeout = self._objects.following_timeout.value * MILLISECOND
        self._following.update(beyond, timeout, now)
        if self._following.reached:
            self._fail(FOLLOWING_ERROR_CODE, now)

    def _fail(self, code: int, now: float, *, at_once: bool = False) -> None:
        self.faults.add(code)
        self._objects.error_code.put(code)
        self._machine.fault(at_once=at_once)
        self._errors.report(code, now, self)

    def _reset_fault(self, now: float) -> None:
        if any(fault.value.code for fault in self.causes):
            return
        for code in sorted(self.faults):
            self._errors.clear(code, now, self)
        self.faults.clear()
        self._following.clear()
        self._objects.error_code.put(0)
        self._machine.reset_fault()

    def _on_controlword(self, now: float) -> None:
        word, previous = self._objects.controlword.value, self._word
        if word == previous:
            return
        self._move(now)
        self._word = word
        if word & ~previous & FAULT_RESET_BIT and self._machine.state is State.FAULT:
            self._reset_fault(now)
        is_quick_stop = decode_command(word) is DriveCommand.QUICK_STOP
        if not (is_quick_stop and Fault.QUICK_STOP_IGNORED in self.causes):
            self._machine.command(word, now)
        if self._machine.operating:
            self._apply_halt(now)
            self._mode.command(word, previous, now)
            self._mode.step(now)
        self._publish(now)

    @property
    def _halted(self) -> bool:
        return bool(self._word & HALT) and Fault.HALT_IGNORED not in self.causes

    def _apply_halt(self, now: float) -> None:
        halted = self._halted
        if halted is self._mode.halted:
            return
        self._mode.halted = halted
        if halted:
            option = chosen(self._objects.halt_option, StopOption.SLOW_DOWN)
            self._axis.stop(self._machine.deceleration(option))
            self._mode.halt(now)
        else:
            self._mode.resume(now)

    def _on_setpoint(self, now: float) -> None:
        if self._machine.operating and self._mode.setpoint(now):
            self._schedule(now)

    def _on_max_velocity(self, now: float) -> None:
        self._move(now)
        self._axis.speed = self._objects.speed

    def _on_mode(self, now: float) -> None:
        self._move(now)
        if Fault.MODE_HELD_UNDER_HALT in self.causes and self._word & HALT:
            return
        if not self._modes.select():
            return
        if self._machine.operating:
            self._begin_mode(now)
        self._publish(now)

    def _begin_mode(self, now: float) -> None:
        self._mode.halted = self._halted
        self._mode.start(self._word, now)
        self._mode.step(now)

    def _publish(self, now: float) -> None:
        """Write the visible objects, and schedule the next update."""
        objects, axis = self._objects, self._axis
        objects.statusword.value = self._statusword()
        objects.position_actual.put(axis.position)
        objects.position_internal.put(axis.position - axis.origin)
        objects.velocity_actual.put(axis.velocity)
        objects.position_demand.put(axis.demand)
        objects.velocity_demand.put(axis.demand_velocity)
        objects.following_error.put(axis.following_error)
        inputs = axis.switches.inputs(axis.position - axis.origin)
        objects.digital_inputs.put(inputs | (0 if self._machine.voltage else INTERLOCK_BIT))
        objects.vl_demand.put(axis.demand_velocity)
        objects.vl_actual.put(axis.velocity)
        self._publish_torque()
        self._schedule(now)

    def _publish_torque(self) -> None:
        objects, axis = self._objects, self._axis
        applied = self._mode.torque if self._machine.operating else None
        torque = axis.torque if applied is None else applied
        if applied is None and axis.blocked:  # the position loop pushes as hard as it may
            torque = objects.held_torque(math.copysign(math.inf, axis.following_error))
        objects.torque_demand.put(torque)
        objects.torque_actual.put(torque)
        objects.current_actual.put(torque)
        objects.dc_voltage.put(DC_VOLTAGE if self._machine.voltage else 0)

    def _statusword(self) -> int:
        state = self._machine.state
        word = STATE_WORDS[state] | REMOTE
        if self._machine.voltage:
            word |= VOLTAGE_ENABLED
        if self._axis.speed_limited or (self._machine.operating and self._mode.limited):
            word |= INTERNAL_LIMIT
        if FOLLOWING_ERROR_CODE in self.faults:
            word |= FOLLOWING_ERROR
        if state is State.OPERATION_ENABLED:
            word |= self._mode.status()
            if self._mode.halted:
                # during halt "target reached" means that the axis stands (CiA 402-2, table 30)
                word = word & ~TARGET_REACHED | (TARGET_REACHED if self._axis.settled else 0)
        elif state is State.QUICK_STOP_ACTIVE and self._axis.settled:
            word |= TARGET_REACHED
        elif Fault.ARRIVED_WHEN_DISABLED in self.causes:
            word |= HOMED
        return word

    def _schedule(self, now: float) -> None:
        machine = self._machine
        waiting = machine.transient or (machine.operating and self._mode.waiting)
        self._idle = self._axis.settled and not waiting
        if self._idle:
            self.deadline = NEVER
            return
        period = CONTROL_PERIOD
        if self._clock.period <= SYNC_PERIOD_MAX and self._clock.alive(now):
            period = SYNC_TIMEOUT_PERIODS * self._clock.period
        phase_end = self._axis.phase_end
        self.deadline = phase_end if now < phase_end < now + period else now + period
