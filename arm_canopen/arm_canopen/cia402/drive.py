# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""One CiA 402 drive in the SYNC cycle: state in, controlword, mode and target out."""

from __future__ import annotations

from collections.abc import Callable

from ..exceptions import CodecError, DriveError, SdoError
from ..master.events import EventKind, Severity
from ..master.remote_node import RemoteNode
from ..master.scheduler import Scheduler, Task
from ..standard.drive import (
    DriveState,
    mode_title,
    OperationMode,
    statusword_text,
)
from ..standard.emcy import error_code_text
from ..standard.objects import Index
from .drive_objects import DriveObjects
from .modes import (
    CyclicPosition,
    Homing,
    InterpolatedPosition,
    Mode,
    NO_BITS,
    NoMode,
    ProfilePosition,
    ProfileVelocity,
)
from .motion import AxisFeedback
from .parameters import DriveParameters, read_parameters
from .state_machine import Command, fault_reset, next_command
from .units import Units

ASK_AGAIN = 1.0  # [s] after which a drive is asked again for what it did not answer
FAULTY = (DriveState.FAULT, DriveState.FAULT_REACTION_ACTIVE)


class Drive:
    """A drive of the bus.

    ``read`` and ``write`` run in each cycle. What leads it somewhere sets its goal, mode and
    targets from coroutines in the same thread (``drive_commands.py``).

    Attributes:
        node: The device.
        units: Its units.
        objects: Its objects in the process image.
        state: State shown in the last cycle.
        mode: The mode that is commanded.
        modes: The modes that this bus.yml makes possible.
        parameters: What it told about itself.
        goal: State that the cycle leads to, None while nobody asked for one.
        resetting: Send fault resets while the drive is faulted.
        error: 0x603F in words when it was faulted last, else empty.
        released: Called with a reason when a motion source loses the drive.
    """

    def __init__(self, node: RemoteNode, scheduler: Scheduler) -> None:
        """Bind the drive to its device.

        Args:
            node: The device.
            scheduler: Time.
        """
        self.node = node
        self.units = Units(node.config.drive)
        self.objects = DriveObjects(node)
        self.state = DriveState.UNKNOWN
        self.parameters = DriveParameters()
        self.goal: DriveState | None = None
        self.error = ''
        self.released: Callable[[str], None] = lambda reason: None
        self.resetting = False
        self.modes = self._build_modes()
        self.mode: Mode = self.modes[OperationMode.NO_MODE]
        self._cyclic_modes = [m for m in self.modes.values() if isinstance(m, CyclicPosition)]
        self._scheduler = scheduler
        self._controlword = 0
        self._asked = False
        self._answered = False
        self._background: list[Task[None]] = []
        node.on_lost = self._on_lost

    @property
    def name(self) -> str:
        """Name in bus.yml."""
        return self.node.name

    @property
    def position(self) -> float:
        """Actual position in user units."""
        return self.units.position_from_device(self.objects.position)

    @property
    def velocity(self) -> float:
        """Actual velocity in user units per second."""
        return self.units.velocity_from_device(self.objects.velocity)

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
    def ready(self) -> bool:
        """Whether its state and its parameters are known."""
        return self.state is not DriveState.UNKNOWN and self._answered

    @property
    def obeys(self) -> bool:
        """Whether the drive follows targets of its mode in this cycle."""
        return (
            self.goal is DriveState.OPERATION_ENABLED
            and self.state is DriveState.OPERATION_ENABLED
            and self.objects.mode_display == self.mode.number
        )

    @property
    def _holding_mode(self) -> CyclicPosition | None:
        """The mode whose set-point holds the drive: it is powered and displays that mode."""
        if self.state is not DriveState.OPERATION_ENABLED:
            return None
        shown = self.objects.mode_display
        return next((mode for mode in self._cyclic_modes if mode.number == shown), None)

    @property
    def _keeps_target(self) -> bool:
        """Whether the drive is powered in a mode in which its target must stay as it is."""
        if self._holding_mode is not None:
            return True
        displayed = self.objects.mode_display == self.mode.number
        return displayed and self.state is DriveState.OPERATION_ENABLED

    @property
    def followable(self) -> bool:
        """Whether a stream of positions would be obeyed in this cycle."""
        mode = self.mode
        return self.obeys and isinstance(mode, CyclicPosition) and not mode.goes_to_single_target

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
            return f'offline: {phase}{detail}'
        parts = ['no statusword yet']
        if self.objects.known:
            parts = [
                statusword_text(self.objects.statusword),
                f'mode {mode_title(self.objects.mode_display)}',
            ]
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
            poll = self.node.poll(self.node.config.poll_period)
            self._background = [self._scheduler.background(work) for work in (self._ask(), poll)]
        if not self.node.operational or not self.objects.known:
            self.state = DriveState.UNKNOWN
            return
        before, self.state = self.state, self.objects.state
        if self.state is not before:
            self._state_changed(before)

    def write(self, now: float, period: float) -> None:
        """Write controlword, mode and target for this cycle."""
        if self.state is DriveState.UNKNOWN:
            command, bits = Command.DISABLE_VOLTAGE, NO_BITS
        else:
            command, bits = self._command(), NO_BITS
            if command is Command.ENABLE_OPERATION and self.obeys:
                bits = self.mode.step(now, period, self.objects.statusword)
            elif not self._keeps_target:
                self._preload_all()
        self._controlword = int(command) | int(bits)
        self.objects.controlword.write(self._controlword)
        self.objects.mode.write(int(self.mode.number))

    def stream(self, setpoint: float) -> None:
        """Follow a motion source in this cycle.

        Raises:
            DriveError: The set-point is not finite, does not fit the object or is beyond a limit.
        """
        self.check_limits(setpoint)
        if isinstance(self.mode, CyclicPosition):
            self.mode.stream(setpoint)

    def select(self, mode: Mode) -> None:
        """Command another mode, preloaded with where the drive is, or where it is held."""
        held = self._holding_mode
        if held is None:
            mode.preload(int(self.objects.position), self.velocity)
        elif held is not mode:
            # under load the drive is not quite where it is held, and would sag to where it is
            mode.preload(self.units.position_to_device(held.setpoint), held.velocity)
        self.mode = mode

    def _preload_all(self) -> None:
        """Let every target be where the drive is, also those of modes that are not selected.

        A drive may stay in the mode that it had, whatever was selected.
        """
        for mode in self.modes.values():
            mode.preload(int(self.objects.position), self.velocity)

    def check_limits(self, target: float) -> None:
        """Refuse a position beyond the drive's software limits.

        Raises:
            DriveError: It is beyond; the message names the limits.
        """
        limits = self.parameters.position_limits
        if limits is not None and not limits[0] <= target <= limits[1]:
            raise DriveError(
                f'{self.name}: target {target:g} is beyond the software limits '
                f'{limits[0]:g} to {limits[1]:g} (0x607D)'
            )

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
            self.parameters = await read_parameters(self.node, self.units)
        except SdoError as error:
            return str(error)
        self._answered = True
        return ''

    async def know_error(self) -> None:
        """Read 0x603F, so that the answer can say what is wrong."""
        if self.state not in FAULTY or (Index.ERROR_CODE, 0) not in self.node.config.dictionary:
            return
        try:
            code = await self.node.read_object(Index.ERROR_CODE)
        except (SdoError, CodecError):
            return  # the statusword says that there is a fault, only its code stays unknown
        self.error = error_code_text(int(code)) if isinstance(code, int) else ''

    def _command(self) -> Command:
        if self.resetting and self.state is DriveState.FAULT:
            return Command(fault_reset(self.state, self._controlword))
        return (
            Command.DISABLE_VOLTAGE if self.goal is None else next_command(self.state, self.goal)
        )

    def _state_changed(self, before: DriveState) -> None:
        left = before is DriveState.OPERATION_ENABLED
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
        self.goal = None
        self.resetting = False
        self._asked = self._answered = False
        self.error = ''
        self.state = DriveState.UNKNOWN
        self.mode = self.modes[OperationMode.NO_MODE]
        self.released(reason)

    def report(self, severity: Severity, text: str) -> None:
        """Tell the owner of the network something about this drive."""
        self.node.report(EventKind.DRIVE, severity, text)

    def _build_modes(self) -> dict[OperationMode, Mode]:
        modes: list[Mode] = [NoMode(), Homing()]
        position = self.objects.target_writer(Index.TARGET_POSITION)
        velocity = self.objects.target_writer(Index.TARGET_VELOCITY)
        interpolation = self.objects.target_writer(Index.INTERPOLATION_DATA, 1)
        if position is not None:
            apart = self.objects.waits_for_sync_apart(Index.TARGET_POSITION)
            modes.append(
                ProfilePosition(self.units, position, self._warn, target_waits_for_sync=apart)
            )
            modes.append(CyclicPosition(self.units, position, lambda: self.parameters.profile))
        if velocity is not None:
            modes.append(ProfileVelocity(self.units, velocity))
        if interpolation is not None:
            modes.append(
                InterpolatedPosition(self.units, interpolation, lambda: self.parameters.profile)
            )
        return {mode.number: mode for mode in modes}

    def _warn(self, text: str) -> None:
        self.report(Severity.WARNING, text)
