# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""State machine of the power drive system, device side (CiA 402-2, clause 6)."""

from __future__ import annotations

from collections.abc import Callable, Container
from enum import auto, Enum
from functools import partial
from typing import NamedTuple, TypeVar

from canopen_core.standard import AbortCode, OperationMode, Value
from canopen_core.standard import DriveState as State

from ..deviations import Fault
from ..object_store import Integer, refusal
from .axis import Axis
from .objects import DriveObjects

Option = TypeVar('Option', bound=Enum)

FAULT_RESET_BIT = 0x80


class DriveCommand(Enum):
    """Command of a controlword to the state machine (CiA 402-2, table 26)."""

    NONE = auto()
    SHUTDOWN = auto()
    SWITCH_ON = auto()  # also "disable operation", the same bits in another state
    ENABLE_OPERATION = auto()
    DISABLE_VOLTAGE = auto()
    QUICK_STOP = auto()


COMMAND_MASKS: tuple[tuple[int, int, DriveCommand], ...] = (
    (0x82, 0x00, DriveCommand.DISABLE_VOLTAGE),
    (0x86, 0x02, DriveCommand.QUICK_STOP),
    (0x87, 0x06, DriveCommand.SHUTDOWN),
    (0x8F, 0x07, DriveCommand.SWITCH_ON),
    (0x8F, 0x0F, DriveCommand.ENABLE_OPERATION),
)
"""Mask, value and command (CiA 402-2, table 26)."""


def decode_command(controlword: int) -> DriveCommand:
    """Return the command in a controlword; bit 7 permits only the fault reset."""
    for mask, value, command in COMMAND_MASKS:
        if controlword & mask == value:
            return command
    return DriveCommand.NONE


class Transition(NamedTuple):
    """An edge of the state machine."""

    number: int  # its number in CiA 402-2, figure 4
    target: State  # where it leads


COMMANDED_TRANSITIONS: dict[tuple[State, DriveCommand], Transition] = {
    (state, command): Transition(number, target)
    for number, state, command, target in (
        (2, State.SWITCH_ON_DISABLED, DriveCommand.SHUTDOWN, State.READY_TO_SWITCH_ON),
        (3, State.READY_TO_SWITCH_ON, DriveCommand.SWITCH_ON, State.SWITCHED_ON),
        # "enable operation" passes Switched On by itself (table 26, note)
        (3, State.READY_TO_SWITCH_ON, DriveCommand.ENABLE_OPERATION, State.SWITCHED_ON),
        (7, State.READY_TO_SWITCH_ON, DriveCommand.DISABLE_VOLTAGE, State.SWITCH_ON_DISABLED),
        (7, State.READY_TO_SWITCH_ON, DriveCommand.QUICK_STOP, State.SWITCH_ON_DISABLED),
        (4, State.SWITCHED_ON, DriveCommand.ENABLE_OPERATION, State.OPERATION_ENABLED),
        (6, State.SWITCHED_ON, DriveCommand.SHUTDOWN, State.READY_TO_SWITCH_ON),
        (10, State.SWITCHED_ON, DriveCommand.DISABLE_VOLTAGE, State.SWITCH_ON_DISABLED),
        (10, State.SWITCHED_ON, DriveCommand.QUICK_STOP, State.SWITCH_ON_DISABLED),
        (5, State.OPERATION_ENABLED, DriveCommand.SWITCH_ON, State.SWITCHED_ON),
        (8, State.OPERATION_ENABLED, DriveCommand.SHUTDOWN, State.READY_TO_SWITCH_ON),
        (9, State.OPERATION_ENABLED, DriveCommand.DISABLE_VOLTAGE, State.SWITCH_ON_DISABLED),
        (11, State.OPERATION_ENABLED, DriveCommand.QUICK_STOP, State.QUICK_STOP_ACTIVE),
        (12, State.QUICK_STOP_ACTIVE, DriveCommand.DISABLE_VOLTAGE, State.SWITCH_ON_DISABLED),
        (16, State.QUICK_STOP_ACTIVE, DriveCommand.ENABLE_OPERATION, State.OPERATION_ENABLED),
    )
}
"""Transitions that a controlword causes (CiA 402-2, figure 4 and table 26).

Automatic transitions are 0 and 1 (start), 12 (quick stop done), 13 (fault) and 14 (reaction done);
15 is the rising edge of the fault reset bit.
"""


class StopOption(Enum):
    """Supported values of 0x605A to 0x605E; not every object has each of them (CiA 402-2).

    "Current limit" and "voltage limit" brake as hard as possible: ramps of twice the quick
    stop deceleration. The vendor's value -1 of the fault reaction brakes half as hard as "slow
    down". Of 0x605A those above 4 brake in the same ways, and stay in Quick stop active.
    """

    VENDOR_SLOW = -1
    DISABLE = 0
    SLOW_DOWN = 1
    QUICK_STOP = 2
    CURRENT_LIMIT = 3
    VOLTAGE_LIMIT = 4
    SLOW_DOWN_AND_STAY = 5
    QUICK_STOP_AND_STAY = 6
    CURRENT_LIMIT_AND_STAY = 7
    VOLTAGE_LIMIT_AND_STAY = 8

    @property
    def stays(self) -> bool:
        """Whether the drive stays in Quick stop active at standstill."""
        return self.value > StopOption.VOLTAGE_LIMIT.value

    @property
    def ramp(self) -> StopOption:
        """Braking ramp of this option."""
        return StopOption(self.value - 4 if self.stays else self.value)


class AbortConnectionOption(Enum):
    """Values of 0x6007: reaction to a lost connection to the master (CiA 402-2, 0x6007)."""

    NO_ACTION = 0
    FAULT = 1
    DISABLE_VOLTAGE = 2
    QUICK_STOP = 3


POWERED_STATES = frozenset({State.OPERATION_ENABLED, State.QUICK_STOP_ACTIVE})
LIMIT_FACTOR = 2.0  # of the quick stop ramp, where the motor brakes at its limit
VOLTAGE_STATES = POWERED_STATES | {State.SWITCHED_ON}
"""States that need the voltage of the power stage."""


class StateMachine:
    """State of a drive, and the ramps between two states.

    During a ramp out of Operation enabled (option codes 0x605B and 0x605C), the drive stays in
    that state; it changes when the motor is at standstill.
    """

    def __init__(
        self,
        objects: DriveObjects,
        axis: Axis,
        enabled: Callable[[float], None],
        causes: Container[Fault] = (),
    ) -> None:
        """Begin in Not ready to switch on.

        ``enabled`` is called with the time whenever operation is enabled; ``causes`` contains the
        active faults of the drive, at any time.
        """
        self.state = State.NOT_READY_TO_SWITCH_ON  # present state
        self.voltage = True  # the power stage is supplied
        self._objects = objects
        self._axis = axis
        self._enabled = enabled
        self._causes = causes
        self._word = 0
        self._pending: Transition | None = None
        for variable, options in (
            (objects.quick_stop_option, range(9)),
            (objects.shutdown_option, range(2)),
            (objects.disable_option, range(2)),
            (objects.fault_option, range(-1, 5)),
            (objects.halt_option, range(1, 5)),
        ):
            variable.check = partial(_check, variable, options)

    @property
    def operating(self) -> bool:
        """Whether the mode of operation moves the axis."""
        return self.state is State.OPERATION_ENABLED and self._pending is None

    @property
    def transient(self) -> bool:
        """Whether the drive leaves this state automatically at standstill."""
        if self.state is State.QUICK_STOP_ACTIVE:
            return not self.quick_stop_option.stays
        return self._pending is not None or self.state is State.FAULT_REACTION_ACTIVE

    @property
    def quick_stop_option(self) -> StopOption:
        """Option code of the quick stop (0x605A)."""
        return chosen(self._objects.quick_stop_option, StopOption.QUICK_STOP)

    def start(self) -> None:
        """Pass transitions 0 and 1: the drive has started."""
        if self.state is State.NOT_READY_TO_SWITCH_ON:
            self.state = State.SWITCH_ON_DISABLED

    def reset(self) -> None:
        """Restart, as after power-on."""
        self._word = 0
        self._power_off(State.NOT_READY_TO_SWITCH_ON)

    def command(self, word: int, now: float) -> None:
        """Execute a controlword, through as many states as it permits."""
        self._word = word
        command = decode_command(word)
        if command is DriveCommand.ENABLE_OPERATION and self._pending is not None:
            self._pending = None  # a ramp out of Operation enabled is called off
            self._enabled(now)
        while True:
            transition = COMMANDED_TRANSITIONS.get((self.state, command))
            if transition is None or not self._go(transition, now):
                return

    def set_voltage(self, present: bool, now: float) -> None:
        """Supply the power stage or cut it off; without supply the motor has no torque."""
        self.voltage = present
        if present:
            self.command(self._word, now)
        elif self.state is State.FAULT_REACTION_ACTIVE:
            self._power_off(State.FAULT)

    def fault(self, *, at_once: bool = False) -> None:
        """Pass transition 13, and also 14 if there is nothing to stop.

        A fault ``at_once`` leaves no torque to brake with, whatever 0x605E selects.
        """
        if self.state is State.FAULT_REACTION_ACTIVE and at_once:
            self._power_off(State.FAULT)
        if self.state in (State.FAULT_REACTION_ACTIVE, State.FAULT):
            return
        reaction = chosen(self._objects.fault_option, StopOption.QUICK_STOP)
        can_brake = self._axis.powered and self.voltage and not at_once
        if can_brake and reaction is not StopOption.DISABLE:
            self._pending = None
            self.state = State.FAULT_REACTION_ACTIVE
            self._axis.stop(self.deceleration(reaction))
        else:
            self._power_off(State.FAULT)

    def reset_fault(self) -> None:
        """Pass transition 15."""
        if self.state is State.FAULT:
            self.state = State.SWITCH_ON_DISABLED

    def quick_stop(self) -> None:
        """Pass transition 11."""
        option = self.quick_stop_option
        if option is StopOption.DISABLE:
            self._power_off(State.SWITCH_ON_DISABLED)
            return
        self._pending = None
        self.state = State.QUICK_STOP_ACTIVE
        self._axis.stop(self.deceleration(option.ramp))

    def disable(self) -> None:
        """Remove the torque at once, as "disable voltage" does."""
        self._power_off(State.SWITCH_ON_DISABLED)

    def advance(self, now: float) -> None:
        """Leave a state whose ramp has ended; advance the axis before."""
        if not self.transient or not self._axis.settled:
            return
        if self._pending is not None:
            self._power_off(self._pending.target)
        elif self.state is State.FAULT_REACTION_ACTIVE:
            self._power_off(State.FAULT)
        else:
            self._power_off(State.SWITCH_ON_DISABLED)
        self.command(self._word, now)

    def deceleration(self, option: StopOption) -> float:
        """Return the deceleration of a stop option in [inc/s^2]."""
        objects = self._objects
        match option:
            case StopOption.SLOW_DOWN:
                return objects.slow_down
            case StopOption.VENDOR_SLOW:
                return 0.5 * objects.slow_down
            case StopOption.CURRENT_LIMIT | StopOption.VOLTAGE_LIMIT:
                return LIMIT_FACTOR * objects.quick_stop
        return objects.quick_stop

    def _go(self, transition: Transition, now: float) -> bool:
        """Pass a transition; return whether the state has changed."""
        without_mode = self._objects.mode_display.value == OperationMode.NO_MODE
        match transition.number:
            case 3 | 4 if not self.voltage:
                return False
            case 4 if without_mode and Fault.MODE_REQUIRED in self._causes:
                return False
            case 4:
                self._axis.power_on(self._objects.slow_down)
                return self._enable(now)
            case 16 if self.quick_stop_option.stays and Fault.QUICK_STOP_FINAL not in self._causes:
                return self._enable(now)
            case 16:
                return False
            case 5:
                return self._leave(transition, self._objects.disable_option)
            case 8:
                return self._leave(transition, self._objects.shutdown_option)
            case 9 | 10 | 12:
                self._power_off(transition.target)
            case 11:
                self.quick_stop()
            case _:
                self.state = transition.target
        return True

    def _enable(self, now: float) -> bool:
        self.state = State.OPERATION_ENABLED
        self._enabled(now)
        return True

    def _leave(self, transition: Transition, option: Integer) -> bool:
        if transition == self._pending:
            return False
        slow_down = chosen(option, StopOption.DISABLE) is StopOption.SLOW_DOWN
        if slow_down and not self._axis.settled:
            self._pending = transition
            self._axis.stop(self._objects.slow_down)
            return False
        self._power_off(transition.target)
        return True

    def _power_off(self, state: State) -> None:
        self._pending = None
        self._axis.power_off()
        self.state = state


def chosen(variable: Integer, default: Option) -> Option:
    """Return the option in an object; ``default`` if its value is invalid."""
    try:
        return type(default)(variable.value)
    except ValueError:
        return default


def _check(variable: Integer, allowed: Container[Value], value: Value) -> None:
    if value not in allowed:
        raise refusal(AbortCode.VALUE_RANGE, variable.entry)
