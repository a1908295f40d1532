# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""One axis of a CiA 402 drive in the SYNC cycle: state in, controlword, mode and target out."""

from __future__ import annotations

from collections.abc import Callable

from ..config.model import DriveConfig
from ..exceptions import DriveError, SdoError
from ..master.events import Severity
from ..master.remote_node import RemoteNode
from ..master.scheduler import Scheduler, Task
from ..standard.drive import Controlword, DriveState, OperationMode, Statusword
from .cyclic_position import CyclicPosition
from .mode_table import build_modes
from .modes import Mode, NO_BITS
from .motion import AxisFeedback
from .observed_drive import FAULTY, ObservedDrive
from .state_machine import Command, fault_reset, next_command
from .target_limits import check_target


class Drive(ObservedDrive):
    """An axis of a drive of the bus; most drives have one.

    ``read`` and ``write`` run in each cycle. What leads it somewhere sets its goal, mode and
    targets from coroutines in the same thread (``drive_commands.py``).

    Attributes:
        mode: The mode that is commanded.
        modes: The modes that this bus.yml makes possible.
        goal: State that the cycle leads to, None while nobody asked for one.
        resetting: Send fault resets while the drive is faulted.
        period: Length of the last cycle in [s].
        interrupted: Mode in which it was enabled when its device was lost, None otherwise.
        released: Called with a reason when a motion source loses the drive.
        on_ready: Called when state and parameters are known after each boot.
    """

    def __init__(
        self, node: RemoteNode, scheduler: Scheduler, config: DriveConfig | None = None
    ) -> None:
        """Bind the axis to its device.

        Args:
            node: The device.
            scheduler: Time.
            config: Settings of the axis; None for the first one.
        """
        super().__init__(node, scheduler, config or node.config.drive)
        self.goal: DriveState | None = None
        self.released: Callable[[str], None] = lambda reason: None
        self.on_ready: Callable[[], None] = lambda: None
        self.resetting = False
        self.period = 0.0
        self.interrupted: OperationMode | None = None
        self.modes = build_modes(self.objects, self.units, lambda: self.parameters, self.warn)
        self.mode: Mode = self.modes[OperationMode.NO_MODE]
        self._failure = ''
        self._controlword = 0
        self._begun = False
        self._announced = False
        self._follows = False
        self._polling: Task[None] | None = None
        node.on_lost.append(self._on_lost)

    @property
    def setpoint(self) -> float:
        """Position last commanded, the actual one where none is."""
        commanded = self.mode.setpoint
        if commanded is None or self.state is not DriveState.OPERATION_ENABLED:
            return self.position
        return commanded

    @property
    def stays_enabled(self) -> bool:
        """Whether it is enabled, and no command is on its way that changes that."""
        enable = int(Command.ENABLE_OPERATION)
        told = self._controlword & enable == enable
        return self.state is DriveState.OPERATION_ENABLED and told

    @property
    def obeys(self) -> bool:
        """Whether the drive follows targets of its mode in this cycle."""
        return (
            self.goal is DriveState.OPERATION_ENABLED
            and self.state is DriveState.OPERATION_ENABLED
            and self.objects.mode_display == self.mode.number
        )

    @property
    def followable(self) -> bool:
        """Whether a stream of positions would be obeyed in this cycle."""
        mode = self.mode
        if not self.obeys or not isinstance(mode, CyclicPosition) or mode.goes_to_single_target:
            return False
        return mode.braked or not self.halted

    @property
    def holding_mode(self) -> Mode | None:
        """Mode whose target acts on the drive: it is powered and displays that mode."""
        if self.state is not DriveState.OPERATION_ENABLED:
            return None
        shown = self.objects.mode_display
        return next((mode for mode in self.modes.values() if mode.number == shown), None)

    @property
    def _keeps_target(self) -> bool:
        """Whether the drive is powered by a target that must stay as it is."""
        held = self.holding_mode
        return held is not None and (held is self.mode or held.cyclic)

    def feedback(self) -> AxisFeedback:
        """Return the state for motion sources."""
        return AxisFeedback(
            name=self.name,
            online=self.node.online,
            state=self.state,
            mode=self.objects.mode_display,
            position=self.position,
            velocity=self.velocity,
            setpoint=self.setpoint,
            followable=self.followable,
        )

    def read(self) -> None:
        """Take the state from the process image."""
        if self.node.operational and not self._begun:
            self._begun = True
            self._upkeep.begin()
            if self.config is self.node.config.drive:  # one axis polls for all
                poll = self.node.poll(self.node.config.poll_period)
                self._polling = self._scheduler.background(poll)
        before = self.state
        self._observe()
        if self.state is DriveState.UNKNOWN:
            return
        if self.state is not before:
            self._state_changed(before)
        self._watch_following()
        if not self._announced and self.ready:
            self._announced = True
            self.on_ready()

    def write(self, now: float, period: float) -> None:
        """Write controlword, mode and target for this cycle."""
        self.period = period
        bits = NO_BITS
        if self.state is DriveState.UNKNOWN:
            command = Command.DISABLE_VOLTAGE
        else:
            command = self._command()
            if command is Command.ENABLE_OPERATION and self.obeys:
                bits = self._step(now, period)
            else:
                bits = self._hold_without_target(command)
        self._send(command, bits)

    def fail(self, error: Exception) -> None:
        """Stop the drive, because its cycle failed; the other drives of the bus go on.

        Args:
            error: Why; one that the drive itself could not have caused is a defect.
        """
        if self.state is DriveState.OPERATION_ENABLED:
            self.goal = DriveState.QUICK_STOP_ACTIVE
        elif self.goal is not None:
            self.goal = DriveState.SWITCH_ON_DISABLED
        self._send(self._command())
        text = str(error)
        if not isinstance(error, DriveError):
            text = f'a defect in the CANopen master: {type(error).__name__}: {error}'
        if text != self._failure:
            self._failure = text
            self.released('its cycle failed')
            self.report(Severity.ERROR, f'stopped: {text}')

    def hold(self) -> None:
        """Brake, and stay halted until a new target is taken."""
        self.mode.brake()
        self.halt.hold()

    def resume(self) -> None:
        """End a halt as soon as the drive has the new target, so that no old one revives."""
        self.halt.leave(self._scheduler.now)

    def stream(self, setpoint: float) -> None:
        """Follow a motion source in this cycle.

        Raises:
            DriveError: The set-point is not finite, does not fit the object or is beyond a limit.
        """
        self.check_target(setpoint)
        if isinstance(self.mode, CyclicPosition):
            self.halt.release()
            self.mode.stream(setpoint)

    def select(self, mode: Mode) -> None:
        """Command another mode, preloaded with where the drive is, or where it is held.

        A halt goes on: until the drive shows the new mode, it may still have a target of the old.
        """
        held = self.holding_mode
        if held is not None and held is mode:
            self.mode = mode
            return
        actual = self._actual()
        if isinstance(held, CyclicPosition):
            # under load the drive is not quite where it is held, and would sag to where it is
            position_inc = self.units.position_to_device(held.setpoint)
            actual = actual._replace(position_inc=position_inc, velocity=held.velocity)
        mode.preload(actual)
        self.mode = mode

    def select_back(self, mode: Mode) -> None:
        """Command the mode of before after a switch that failed; the drive is halted in it."""
        if not self.node.online or self.mode is mode:
            return
        if self.state is DriveState.OPERATION_ENABLED:
            self.hold()
        self.select(mode)

    def check_target(self, target: float) -> None:
        """Refuse a target beyond the limits that the drive has in the selected mode.

        Raises:
            DriveError: It is beyond; the message names the limits.
        """
        check_target(self.name, self.mode, self.parameters, target)

    def _step(self, now: float, period: float) -> Controlword:
        """Advance the mode by a cycle, and the halt; return their bits of the controlword."""
        bits = self.mode.step(now, period, self.objects.statusword)
        if not self.halt.advance(now, self.mode):
            self.mode.brake()
            self.warn(
                'stays halted: it has not taken its new target (bit 12); ~/disable and ~/enable '
                'make it forget the moves that it holds'
            )
        halt = self.halt.bits(self.mode)
        if halt and self.mode.cyclic:
            self.mode.preload(self._actual())  # from there it goes on
        return bits | halt

    def _hold_without_target(self, command: Command) -> Controlword:
        """Preload what may act on the drive later, and keep up a halt while modes change."""
        held = self.holding_mode
        if not self._keeps_target:
            self._preload_all()
        if held is None or command is not Command.ENABLE_OPERATION:
            return NO_BITS
        return self.halt.bits(held)

    def _send(self, command: Command, bits: Controlword = NO_BITS) -> None:
        self._controlword = int(command) | int(bits)
        self.objects.controlword.write(self._controlword)
        self.objects.mode.write(int(self.mode.number))

    def _preload_all(self) -> None:
        """Let every target be where the drive is, also those of modes that are not selected.

        A drive may stay in the mode that it had, whatever was selected; of two modes with one
        target object the selected one writes last.
        """
        actual = self._actual()
        for mode in self.modes.values():
            mode.preload(actual)
        self.mode.preload(actual)

    def _watch_following(self) -> None:
        """Bit 12 of the cyclic modes: a drive that has followed and does not any more is said."""
        cyclic = self.mode.cyclic
        bit = bool(self.objects.statusword & Statusword.FOLLOWS_COMMAND)
        before, self._follows = self._follows, self.obeys and cyclic and bit
        if before and not bit and self.obeys and cyclic:
            self.released('the drive does not follow its set-points (bit 12)')
            self.warn(f'does not follow its set-points any more (bit 12): {self.describe()}')

    def _command(self) -> Command:
        if self.resetting and self.state is DriveState.FAULT:
            return Command(fault_reset(self.state, self._controlword))
        return (
            Command.DISABLE_VOLTAGE if self.goal is None else next_command(self.state, self.goal)
        )

    def _state_changed(self, before: DriveState) -> None:
        left = before is DriveState.OPERATION_ENABLED
        if self.state is DriveState.OPERATION_ENABLED:
            self._failure = ''
        if left:
            self.halt.release()
        if self.state in FAULTY and before not in FAULTY:
            self.goal = DriveState.SWITCH_ON_DISABLED
            self.released('fault')
            self._scheduler.background(self._report_fault())
        elif left and self.goal is DriveState.OPERATION_ENABLED:
            # a drive that lost its enable must not start again when the cause goes away
            self.goal = DriveState.SWITCH_ON_DISABLED
            self.released('the drive left Operation enabled')
            self.report(
                Severity.ERROR,
                f'left Operation enabled by itself: {self.describe()}; is the voltage or the '
                'safe torque off gone? Call ~/enable when it is safe',
            )
        elif left:
            self.released(f'the drive is {self.state.title}')

    async def _report_fault(self) -> None:
        await self.know_error()
        self.report(Severity.ERROR, f'FAULT: {self.describe()}; call ~/recover')

    def _on_lost(self, reason: str) -> None:
        self._upkeep.forget(reason)
        if self._polling is not None:
            self._polling.cancel(SdoError(reason))
        enabled = self.state is DriveState.OPERATION_ENABLED and self.goal is self.state
        if enabled and not self.node.left_operational:
            self.interrupted = self.mode.number
        self.goal = None
        self.resetting = self._follows = self._begun = self._announced = False
        self.halt.release()
        self.error = ''
        self._lose_sight()
        self.mode = self.modes[OperationMode.NO_MODE]
        self.released(reason)
