# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""One axis of a CiA 402 drive in the SYNC cycle: state in, controlword, mode and target out."""

from __future__ import annotations

from collections.abc import Callable

from ..config.model import DriveConfig
from ..exceptions import CodecError, DriveError, SdoError
from ..master.events import EventKind, Severity
from ..master.remote_node import RemoteNode
from ..master.scheduler import Scheduler, Task
from ..standard.drive import (
    Controlword,
    DriveState,
    mode_title,
    OperationMode,
    Statusword,
    statusword_text,
)
from ..standard.emcy import error_code_text
from ..standard.objects import Index
from .cyclic_position import CyclicPosition
from .drive_objects import DriveObjects
from .halt import Halt
from .mode_table import build_modes
from .modes import Actual, Mode, NO_BITS
from .motion import AxisFeedback
from .parameters import DriveParameters, ParameterReader
from .state_machine import Command, fault_reset, next_command
from .target_limits import check_target
from .units import clamp, INT16_MAX, INT32_MAX, Units
from .velocity_estimate import VelocityEstimate

ASK_AGAIN = 1.0  # [s] after which a drive is asked again for what it did not answer
FAULTY = (DriveState.FAULT, DriveState.FAULT_REACTION_ACTIVE)


class Drive:
    """An axis of a drive of the bus; most drives have one.

    ``read`` and ``write`` run in each cycle. What leads it somewhere sets its goal, mode and
    targets from coroutines in the same thread (``drive_commands.py``).

    Attributes:
        node: The device.
        config: Settings of the axis.
        name: Its name: that of the device, of its channel for one with several axes.
        units: Its units.
        objects: Its objects in the process image.
        state: State shown in the last cycle.
        statusword: 0x6041 as it was then.
        mode: The mode that is commanded.
        modes: The modes that this bus.yml makes possible.
        parameters: What it told about itself.
        goal: State that the cycle leads to, None while nobody asked for one.
        resetting: Send fault resets while the drive is faulted.
        period: Length of the last cycle in [s].
        halt: What keeps it halted.
        error: 0x603F in words when it was faulted last, else empty.
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
        self.node = node
        self.config = config or node.config.drive
        self.name = self.config.name or node.name
        self.units = Units(self.config)
        self.objects = DriveObjects(node, self.config.channel)
        self.state = DriveState.UNKNOWN
        self.statusword = 0
        self.parameters = DriveParameters()
        self.goal: DriveState | None = None
        self.error = ''
        self.released: Callable[[str], None] = lambda reason: None
        self.on_ready: Callable[[], None] = lambda: None
        self.resetting = False
        self.period = 0.0
        self.halt = Halt()
        self.interrupted: OperationMode | None = None
        self.modes = build_modes(self.objects, self.units, lambda: self.parameters, self._warn)
        self.mode: Mode = self.modes[OperationMode.NO_MODE]
        self._reader = ParameterReader(node, self.config, self.units)
        self._scheduler = scheduler
        polled = self.objects.position_is_polled
        self._estimate = VelocityEstimate(node.config.poll_period if polled else 0.0)
        self._failure = ''
        self._controlword = 0
        self._asked = False
        self._answered = False
        self._announced = False
        self._follows = False
        self._background: list[Task[None]] = []
        node.on_lost.append(self._on_lost)

    @property
    def position(self) -> float:
        """Actual position in user units."""
        return self.units.position_from_device(self.objects.position)

    @property
    def velocity(self) -> float:
        """Actual velocity in user units per second; from the positions where no PDO tells it."""
        told = self.objects.velocity
        return self.rate if told is None else self.units.velocity_from_device(told)

    @property
    def rate(self) -> float:
        """Rate of the actual position in user units per second, a few cycles late."""
        return self.units.rate_from_device(self._estimate.rate)

    @property
    def effort(self) -> float:
        """Actual torque in user units."""
        return self.units.effort_from_device(self.objects.torque)

    @property
    def setpoint(self) -> float:
        """Position last commanded, the actual one where none is."""
        commanded = self.mode.setpoint
        if commanded is None or self.state is not DriveState.OPERATION_ENABLED:
            return self.position
        return commanded

    @property
    def halted(self) -> bool:
        """Whether it is stopped by a halt; the next target ends it."""
        return self.halt.held

    @property
    def ready(self) -> bool:
        """Whether its state and its parameters are known."""
        return self.state is not DriveState.UNKNOWN and self._answered

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
    def homes_at_init(self) -> bool:
        """Whether bus.yml asks for homing: it writes a method to 0x6098."""
        index = self.objects.at(Index.HOMING_METHOD)
        return any(
            write.index == index and any(write.data) for write in self.node.config.sdo_writes
        )

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

    def describe(self) -> str:
        """Say in a sentence how the drive is."""
        if not self.node.online:
            phase = self.node.phase.value
            detail = f' ({self.node.phase_detail})' if self.node.phase_detail else ''
            loss = f'; lost before: {self.node.loss}' if self.node.loss else ''
            return f'offline: {phase}{detail}{loss}'
        parts = ['no statusword yet']
        if self.state is not DriveState.UNKNOWN:
            parts = [
                statusword_text(self.statusword),
                f'mode {mode_title(self.objects.mode_display)}',
            ]
        if self.halted:
            parts.append('halted')
        if self.error:
            parts.append(f'error {self.error}')
        if self.node.last_emergency is not None:
            parts.append(f'EMCY {self.node.last_emergency}')
        if self.node.left_operational and self.node.nmt_state is not None:
            parts.append(f'NMT state {self.node.nmt_state.name}: call ~/nmt_start_node')
        return '; '.join(parts)

    def read(self) -> None:
        """Take the state from the process image."""
        if self.node.operational and not self._asked:
            self._asked = True
            self._background = [self._scheduler.background(self._ask())]
            if self.config is self.node.config.drive:  # one axis polls for all
                poll = self.node.poll(self.node.config.poll_period)
                self._background.append(self._scheduler.background(poll))
        if not self.node.operational or not self.objects.known:
            self.state, self.statusword = DriveState.UNKNOWN, 0
            self._estimate.clear()
            return
        self._estimate.note(self._scheduler.now, self.objects.position)
        before, self.state = self.state, self.objects.state
        self.statusword = self.objects.statusword
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

    async def know_error(self) -> None:
        """Read 0x603F, so that the answer can say what is wrong."""
        index = self.objects.at(Index.ERROR_CODE)
        if self.state not in FAULTY or (index, 0) not in self.node.config.dictionary:
            return
        try:
            code = await self.node.read_object(index)
        except (SdoError, CodecError):
            return  # the statusword says that there is a fault, only its code stays unknown
        self.error = error_code_text(int(code)) if isinstance(code, int) else ''

    def report(self, severity: Severity, text: str) -> None:
        """Tell the owner of the network something about this drive."""
        about = text if self.name == self.node.name else f'{self.name}: {text}'
        self.node.report(EventKind.DRIVE, severity, about)

    def _step(self, now: float, period: float) -> Controlword:
        """Advance the mode by a cycle, and the halt; return their bits of the controlword."""
        bits = self.mode.step(now, period, self.objects.statusword)
        if not self.halt.advance(now, self.mode):
            self.mode.brake()
            self._warn(
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

    def _actual(self) -> Actual:
        """Return where the drive is, and the velocity from which it has to be braked.

        The velocity is the lesser of what 0x606C tells and what 0x6064 shows: one that is told
        wrong must not set an axis in motion that stands.
        """
        objects = self.objects
        velocity, told = self.rate, objects.velocity
        velocity_dev = self.units.velocity_raw(velocity)
        if told is not None:
            shown = self.units.velocity_from_device(told)
            share = 0.0 if shown * velocity <= 0.0 else min(1.0, velocity / shown)
            velocity, velocity_dev = share * shown, share * told
        return Actual(
            clamp(objects.position, INT32_MAX),
            velocity,
            clamp(velocity_dev, INT32_MAX),
            clamp(objects.torque, INT16_MAX),
        )

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
            self._warn(f'does not follow its set-points any more (bit 12): {self.describe()}')

    async def _ask(self) -> None:
        reason = await self._parameters_unread()
        if reason:
            self._warn(f'its parameters are unknown, so it takes no commands: {reason}')
        while reason:
            await self._scheduler.timer(ASK_AGAIN)
            reason = await self._parameters_unread()

    async def _parameters_unread(self) -> str:
        """Read the parameters; return why that could not be done, or nothing."""
        try:
            self.parameters = await self._reader.read()
        except SdoError as error:
            return str(error)
        self._answered = True
        return ''

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
        for task in self._background:
            task.cancel(SdoError(reason))
        enabled = self.state is DriveState.OPERATION_ENABLED and self.goal is self.state
        if enabled and not self.node.left_operational:
            self.interrupted = self.mode.number
        self.goal = None
        self.resetting = self._follows = False
        self.halt.release()
        self._asked = self._answered = self._announced = False
        self.error = ''
        self.state, self.statusword = DriveState.UNKNOWN, 0
        self.mode = self.modes[OperationMode.NO_MODE]
        self.released(reason)

    def _warn(self, text: str) -> None:
        self.report(Severity.WARNING, text)
