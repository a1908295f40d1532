# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""One axis with its modes: which is commanded, which one acts, and what each would do next."""

from __future__ import annotations

from ..config.drive_model import DriveConfig
from ..master.remote_node import RemoteNode
from ..master.scheduler import Promise, Scheduler
from ..standard.drive import DriveState, mode_title, OperationMode
from .cyclic_position import CyclicPosition
from .mode_table import build_modes
from .modes import Mode, NO_BITS
from .observed_drive import FAULTY, ObservedDrive
from .position_modes import NEW_SET_POINT
from .refusal import Refusal, RefusalCause
from .target_limits import check_target

NOT_TAKEN = (
    'it has not taken its new target (bit 12); ~/disable and ~/enable make it forget the moves '
    'that it holds'
)


class ModedDrive(ObservedDrive):
    """An axis and its modes of operation.

    Attributes:
        modes: The modes that this bus.yml makes possible.
        mode: The mode that is commanded.
        goal: State that the cycle leads to, None while nobody asked for one.
    """

    def __init__(self, node: RemoteNode, scheduler: Scheduler, config: DriveConfig) -> None:
        """Build the modes; arguments as of :class:`ObservedDrive`."""
        super().__init__(node, scheduler, config)
        self.goal: DriveState | None = None
        self.modes = build_modes(self.objects, self.units, lambda: self.parameters, self.warn)
        self.mode: Mode = self.modes[OperationMode.NO_MODE]

    @property
    def acts(self) -> bool:
        """Whether the target of the selected mode acts on the drive, by its last state.

        It may be too old to accept targets (:attr:`refusal`), but a drive that cannot be seen is
        braked in its mode, too.
        """
        return (
            self.goal is DriveState.OPERATION_ENABLED
            and self.state is DriveState.OPERATION_ENABLED
            and self.objects.mode_display == self.mode.number
        )

    @property
    def accepts_targets(self) -> bool:
        """Whether a target of the selected mode would be executed."""
        return self.refusal is None

    @property
    def refusal(self) -> Refusal | None:
        """Why it accepts no targets of the selected mode now; None when it does."""
        node = self.node
        if not node.online:
            return Refusal(RefusalCause.OFFLINE, node.loss or node.phase_text)
        if node.left_operational:
            return Refusal(RefusalCause.NOT_OPERATIONAL)
        if self.state is DriveState.UNKNOWN:
            return Refusal(RefusalCause.STATE_UNKNOWN)
        if not self.fresh:
            return Refusal(RefusalCause.SILENT, f'the last is {self.age:.1f} s old')
        if self.state in FAULTY:
            return Refusal(RefusalCause.FAULT, self.error)
        if not self.goal is self.state is DriveState.OPERATION_ENABLED:
            return Refusal(RefusalCause.NOT_ENABLED, self.state.title)
        if self.objects.mode_display != self.mode.number:
            return Refusal(RefusalCause.MODE_CHANGE, mode_title(self.objects.mode_display))
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
        return self.shown_mode if self.state is DriveState.OPERATION_ENABLED else None

    @property
    def shown_mode(self) -> Mode | None:
        """Mode that the drive displays; None where it is none of :attr:`modes`."""
        shown = self.objects.mode_display
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
            return False
        actual = self._actual()
        target = self.objects.held_position(held.number)
        if isinstance(held, CyclicPosition) and target is not None:
            actual = actual._replace(position_inc=target)
        held.preload(actual)
        self.mode = held
        self.goal = DriveState.OPERATION_ENABLED
        return True

    def select(self, mode: Mode) -> None:
        """Command another mode, preloaded with where the drive is, or where it is held.

        A target that goes by SDO is in the drive before (``sequences.py``).
        A halt goes on: until the drive shows the new mode, it may still have a target of the old.
        """
        known = self.state is not DriveState.UNKNOWN  # else its first position preloads it
        if known and self.holding_mode is not mode and not mode.by_sdo:
            self.preload(mode)
        self.mode = mode

    def preload(self, mode: Mode) -> Promise[None]:
        """Let the target of a mode be where the drive is, or where it is held.

        Returns:
            Done when the drive has it.
        """
        held, actual = self.holding_mode, self._actual()
        if isinstance(held, CyclicPosition):
            # under load the drive is not quite where it is held, and would sag to where it is
            position_inc = self.units.position_to_device(held.setpoint)
            actual = actual._replace(position_inc=position_inc, velocity=held.velocity)
        return mode.preload(actual)

    def select_back(self, mode: Mode) -> None:
        """Command the mode of before after a switch that failed; the drive is halted in it."""
        if not self.node.online or self.mode is mode:
            return
        if self.state is DriveState.OPERATION_ENABLED:
            self.hold()
        self.select(mode)

    def hold(self) -> None:
        """Brake, and stay halted until a new target is taken."""
        self.mode.brake()
        self.halt.hold()

    def check_target(self, target: float) -> None:
        """Refuse a target beyond the limits that the drive has in the selected mode.

        Raises:
            DriveError: It is beyond; the message names the limits.
        """
        check_target(self.name, self.mode, self.parameters, self.units, target)

    def _step_mode(self, now: float, period: float) -> int:
        """Advance the mode by a cycle, and the halt; return their bits of the controlword."""
        bits = self.mode.step(now, period, self.statusword)
        halt = self.halt.bits(self.mode)  # at its end bit 8 goes a cycle after the new target
        if not self.halt.advance(now, period, self.mode):
            self.mode.brake()
            self.warn(f'stays halted: {NOT_TAKEN}')
            return self.halt.bits(self.mode)
        if bits & NEW_SET_POINT:
            halt = self.halt.bits(
                self.mode
            )  # ends with the edge where no acknowledge comes before
        if self.halt.bits(self.mode) and self.mode.cyclic:
            self.mode.preload(self._actual())  # from there it goes on
        return bits | halt

    def _hold_without_target(self, *, edge: bool) -> int:
        """Preload what may act on the drive later, and keep up a halt while modes change.

        Args:
            edge: The drive is enabled, or its mode switched, by what leaves in this cycle; the
                targets stay as they left in the one before.
        """
        held = self.holding_mode
        if not edge and not self._keeps_target:
            self._preload_all()
        if held is None or self.goal is not DriveState.OPERATION_ENABLED:
            return NO_BITS
        return self.halt.bits(held)

    def _preload_all(self) -> None:
        """Let every target in an RPDO be where the drive is, also of modes that are not selected.

        A drive may stay in the mode that it had, whatever was selected; of two modes with one
        target object the selected one writes last.
        """
        actual = self._actual()
        for mode in (*self.modes.values(), self.mode):
            if not mode.by_sdo:
                mode.preload(actual)
