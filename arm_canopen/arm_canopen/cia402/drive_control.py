# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What is commanded to one axis: goal, mode and target, halt, and from them the controlword."""

from __future__ import annotations

from collections.abc import Callable

from canopen_core.standard import DriveState, mode_title, OperationMode

from ..master.scheduler import Promise
from .cyclic_position import CyclicPosition
from .drive_view import DriveView, FAULTY
from .halt import Halt
from .mode_table import build_modes
from .modes import Mode, NO_BITS
from .position_modes import NEW_SET_POINT
from .quirks import quirks_of
from .refusal import Refusal, RefusalCause
from .state_machine import Command
from .target_limits import check_target

NOT_TAKEN = (
    'it has not taken its new target (bit 12); disable and enable it to make it forget the moves '
    'that it holds'
)


class DriveControl:
    """The goal, the modes and the controlword of an axis."""

    def __init__(self, view: DriveView, warn: Callable[[str], None]) -> None:
        self._view = view
        self._objects = view.objects
        self._warn = warn
        # state that the cycle leads to, None before the first command
        self.goal: DriveState | None = None
        self.halt = Halt()  # what keeps it halted
        # the modes that this bus.yml makes possible
        self.modes = build_modes(view.objects, view.units, lambda: view.parameters, warn)
        self.mode: Mode = self.modes[OperationMode.NO_MODE]  # the mode that is commanded
        self._mode_shown = self._mode_led = self.mode
        self._controlword = 0
        self._quirks = quirks_of(view.config.quirks)

    @property
    def setpoint(self) -> float:
        """Position last commanded, the actual one where none is."""
        commanded = self.mode.setpoint
        if commanded is None or self._view.state is not DriveState.OPERATION_ENABLED:
            return self._view.position
        return commanded

    @property
    def halted(self) -> bool:
        """Whether it is stopped by a halt; the next target ends it."""
        return self.halt.held

    @property
    def enables(self) -> bool:
        """Whether the last controlword commands Operation Enabled."""
        enable = int(Command.ENABLE_OPERATION)
        return self._controlword & enable == enable

    @property
    def stays_enabled(self) -> bool:
        """Whether it is enabled, and no command is on its way that changes that."""
        return self._view.state is DriveState.OPERATION_ENABLED and self.enables

    @property
    def acts(self) -> bool:
        """Whether the target of the selected mode acts on the drive, by its last state.

        It may be too old to accept targets (:attr:`refusal`), but a drive that cannot be seen is
        braked in its mode, too.
        """
        return (
            self.goal is DriveState.OPERATION_ENABLED
            and self._view.state is DriveState.OPERATION_ENABLED
            and self._objects.mode_display == self.mode.number
        )

    @property
    def shows_mode(self) -> bool:
        """Whether the drive displays the selected mode, and has been sent what holds it there."""
        return self._mode_shown is self.mode and (self._objects.mode_display == self.mode.number)

    @property
    def accepts_targets(self) -> bool:
        """Whether a target of the selected mode would be executed."""
        return self.refusal is None

    @property
    def refusal(self) -> Refusal | None:
        """Why it accepts no targets of the selected mode now; None when it does."""
        view, node = self._view, self._view.node
        if not node.online:
            return Refusal(RefusalCause.OFFLINE, node.loss or node.phase_text)
        if node.left_operational:
            return Refusal(RefusalCause.NOT_OPERATIONAL)
        if view.state is DriveState.UNKNOWN:
            return Refusal(RefusalCause.STATE_UNKNOWN)
        if not view.fresh:
            return Refusal(RefusalCause.SILENT, f'the last is {view.age:.1f} s old')
        if view.state in FAULTY:
            return Refusal(RefusalCause.FAULT, view.error)
        if not self.goal is view.state is DriveState.OPERATION_ENABLED:
            return Refusal(RefusalCause.NOT_ENABLED, view.state.title)
        if not self.shows_mode:
            return Refusal(RefusalCause.MODE_CHANGE, mode_title(self._objects.mode_display))
        return None

    @property
    def stream_refusal(self) -> Refusal | None:
        """Why it accepts no stream of positions now; None when it does."""
        refusal, mode = self.refusal, self.mode
        if refusal is not None:
            return refusal
        if not isinstance(mode, CyclicPosition):
            return Refusal(RefusalCause.OTHER_MODE, mode_title(mode.number))
        if mode.goes_to_single_target:
            return Refusal(RefusalCause.SINGLE_TARGET)
        if self.halted and not mode.braked:
            return Refusal(RefusalCause.HALTED)
        return None

    @property
    def holding_mode(self) -> Mode | None:
        """Mode whose target acts on the drive: it is powered and displays that mode."""
        return self.shown_mode if self._view.state is DriveState.OPERATION_ENABLED else None

    @property
    def shown_mode(self) -> Mode | None:
        """Mode that the drive displays; None where it is none of :attr:`modes`."""
        shown = self._objects.mode_display
        return next((mode for mode in self.modes.values() if mode.number == shown), None)

    @property
    def _keeps_target(self) -> bool:
        """Whether the drive is powered by a target that must stay as it is."""
        held = self.holding_mode
        return held is not None and (held is self.mode or held.cyclic)

    def adopt(self) -> bool:
        """Lead on a drive that another master has left enabled: it holds where it is held.

        Returns:
            False when it is not enabled, or in a mode that this bus.yml has no means for.
        """
        held = self.holding_mode
        if held is None:
            self._mode_shown = self._mode_led = self.mode
            return False
        actual = self._view.actual()
        target = self._objects.held_position(held.number, self._view.parameters.offsets)
        if isinstance(held, CyclicPosition) and target is not None:
            actual = actual._replace(position_inc=target)
        held.preload(actual)
        self.mode = self._mode_shown = self._mode_led = held
        self.goal = DriveState.OPERATION_ENABLED
        return True

    def forget(self) -> None:
        """The device is lost: nothing is commanded any more, and no mode selected."""
        self.goal = None
        self.halt.release()
        self.mode = self._mode_shown = self._mode_led = self.modes[OperationMode.NO_MODE]

    def select(self, mode: Mode) -> None:
        """Command another mode, preloaded with where the drive is, or where it is held.

        A target that goes by SDO is in the drive before (``sequences.py``).
        A halt goes on: until the drive shows the new mode, it may still have a target of the old.
        """
        known = self._view.state is not DriveState.UNKNOWN  # else its first position preloads it
        if known and self.holding_mode is not mode and not mode.by_sdo:
            self.preload(mode)
        self.mode = mode

    def preload(self, mode: Mode) -> Promise[None]:
        """Set the target of a mode to where the drive is, or where it is held.

        Returns:
            Done when the drive has it.
        """
        held, actual = self.holding_mode, self._view.actual()
        if isinstance(held, CyclicPosition):
            # under load the drive is not quite where it is held, and would sag to where it is
            position_inc = self._view.units.position.to_device(held.setpoint)
            actual = actual._replace(position_inc=position_inc, velocity=held.velocity)
        return mode.preload(actual)

    def select_back(self, mode: Mode) -> None:
        """Command the mode of before after a switch that failed; the drive is halted in it."""
        if not self._view.node.online or self.mode is mode:
            return
        if self._view.state is DriveState.OPERATION_ENABLED:
            self.hold()
        self.select(mode)

    def hold(self) -> None:
        """Brake, and stay halted until a new target is taken."""
        self.mode.brake()
        self.halt.hold()

    def check_target(self, target: float) -> None:
        """Refuse a target beyond the limits that the drive has in the selected mode."""
        view = self._view
        check_target(
            view.name, self.mode, view.parameters, view.units, target, position=view.position
        )

    def step(self, command: Command, now: float, period: float) -> tuple[Command, int]:
        """Advance the mode by a cycle, and let targets leave before what makes them act.

        Returns:
            The command of this cycle, and the bits of mode and halt in its controlword.
        """
        command, edge = self._lead_targets(command)
        if command is Command.ENABLE_OPERATION and self.acts:
            return command, self._step_mode(now, period)
        return command, self._hold_without_target(edge=edge)

    def send(self, command: Command, bits: int = NO_BITS) -> None:
        """Write controlword and mode."""
        self._controlword = int(command) | bits
        self._objects.controlword.write(self._controlword)
        number = int(self._mode_shown.number)
        if number or not self._quirks.no_mode_zero:
            self._objects.mode.write(number)
        elif self._objects.mode_display and not self._objects.mode.by_sdo:
            self._objects.mode.write(self._objects.mode_display)  # keeps the mode that it has

    def _step_mode(self, now: float, period: float) -> int:
        """Advance the mode by a cycle, and the halt; return their bits of the controlword."""
        bits = self.mode.step(now, period, self._view.statusword)
        halt = self.halt.bits(self.mode)  # at its end bit 8 goes a cycle after the new target
        if not self.halt.advance(now, period, self.mode):
            self.mode.brake()
            self._warn(f'stays halted: {NOT_TAKEN}')
            return self.halt.bits(self.mode)
        if bits & NEW_SET_POINT:
            # ends with the edge where no acknowledge comes before
            halt = self.halt.bits(self.mode)
        if self.halt.bits(self.mode) and self.mode.cyclic:
            self.mode.preload(self._view.actual())  # from there it goes on
        return bits | halt

    def _lead_targets(self, command: Command) -> tuple[Command, bool]:
        """Send targets a cycle before the mode and the command that make them act.

        RPDOs carry objects in any distribution, so that of one cycle a drive may see the edge
        before the target. The flag: this command, or the mode, makes targets act that have left.
        """
        if self._mode_led is not self.mode:
            self._mode_led = self.mode
            if command is Command.ENABLE_OPERATION and not self.enables:
                return Command.SWITCH_ON, False
            return command, False
        switching = self._mode_shown is not self.mode
        self._mode_shown = self.mode
        enabling = command is Command.ENABLE_OPERATION and not self.enables
        return command, switching or enabling

    def _hold_without_target(self, *, edge: bool) -> int:
        """Preload what may act on the drive later, and keep up a halt while modes change.

        With ``edge`` the drive is enabled, or its mode switched, by what leaves in this cycle:
        targets stay as they left in the one before.
        """
        held = self.holding_mode
        if not edge and not self._keeps_target:
            self._preload_all()
        if held is None or self.goal is not DriveState.OPERATION_ENABLED:
            return NO_BITS
        return self.halt.bits(held)

    def _preload_all(self) -> None:
        """Set every target in an RPDO to where the drive is, also of modes that are not selected.

        A drive may stay in the mode that it had, whatever was selected; of two modes with one
        target object the selected one writes last.
        """
        actual = self._view.actual()
        for mode in (*self.modes.values(), self.mode):
            if not mode.by_sdo:
                mode.preload(actual)
