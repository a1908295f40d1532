# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""One axis of a CiA 402 drive in the SYNC cycle: state in, controlword, mode and target out."""

from __future__ import annotations

from collections.abc import Callable

from ..config.drive_model import DriveConfig
from ..exceptions import CanopenError, SdoError
from ..master.events import Severity
from ..master.process_image import SentRpdo
from ..master.remote_node import RemoteNode
from ..master.scheduler import Promise, Scheduler, Task
from ..standard.drive import DriveState, mode_title, OperationMode, Statusword
from .cyclic_position import CyclicPosition, InterpolatedPosition
from .feed_forward import FeedForward
from .following_watch import Following, FollowingWatch, MARGIN_TIME
from .moded_drive import ModedDrive
from .modes import NO_BITS
from .motion import AxisFeedback, Setpoint
from .observed_drive import FAULTY
from .quirks import quirks_of
from .refusal import Refusal, RefusalCause
from .state_machine import Command, fault_reset, next_command
from .stop_sequence import StopSequence
from .target_limits import check_setpoint

FOLLOWS_COMMAND = int(Statusword.FOLLOWS_COMMAND)
FOLLOWING_ERROR = int(Statusword.FOLLOWING_ERROR)
POSITION_AGE_MAX = 0.25  # [s] of a position at which an axis may be held
UNSEEN_STOP_TIME = 1.0  # [s] in which a motion source may lead a silent drive to rest on its path


class Drive(ModedDrive):
    """An axis of a drive of the bus; most drives have one.

    ``read`` and ``write`` run in each cycle. What leads it somewhere sets its goal, mode and
    targets from coroutines in the same thread (``drive_commands.py``).

    Attributes:
        resetting: Send fault resets while the drive is faulted.
        period: Length of the last cycle in [s].
        interrupted: Mode in which it was enabled when its device was lost, None otherwise.
        feed_forward: What a motion source tells ahead.
        stop: Takes it out of operation; while that runs, nothing else leads it.
        released: Called with the cause when a motion source loses the drive.
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
        self.released: Callable[[Refusal], None] = lambda refusal: None
        self.on_ready: Callable[[], None] = lambda: None
        self.resetting = False
        self.period = 0.0
        self.interrupted: OperationMode | None = None
        self.feed_forward = FeedForward(self.objects, self.units)
        self._streamed = False
        self.stop = StopSequence(self, scheduler)
        self._controlword = 0
        self._reset_began: float | None = None
        self._quirks = quirks_of(self.config.quirks)
        self._mode_shown = self._mode_led = self.mode
        self._begun = False
        self._announced = False
        self._follows = False
        self._following = FollowingWatch()
        self._led = False  # by a motion source, in the last cycle
        self._unseen_since: float | None = None
        self._polling: Task[None] | None = None
        node.on_lost.append(self._on_lost)
        node.on_failed.append(self.fail)

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
        return self.state is DriveState.OPERATION_ENABLED and self._commands_enabled

    @property
    def _commands_enabled(self) -> bool:
        """Whether the last controlword commands Operation Enabled."""
        enable = int(Command.ENABLE_OPERATION)
        return self._controlword & enable == enable

    def feedback(self) -> AxisFeedback:
        """Return the state for motion sources."""
        refusal = self.stream_refusal
        return AxisFeedback(
            name=self.name,
            online=self.node.online,
            state=self.state,
            mode=self.objects.mode_display,
            position=self.position,
            velocity=self.velocity,
            setpoint=self.setpoint,
            followable=refusal is None or self._is_led_to_rest(),
            refusal=refusal,
            age=self.age,
        )

    def read(self) -> None:
        """Take the state from the process image."""
        if self.node.operational and not self._begun:
            self._begun = True
            self._cache.begin()
            if self.config is self.node.config.drive:  # one axis polls for all
                poll = self.node.objects.poll(self.node.config.poll_period)
                self._polling = self._scheduler.background(poll)
        before = self.state
        self._observe()
        if self.state is DriveState.UNKNOWN:
            return
        if before is DriveState.UNKNOWN and self.node.taken_over and self.goal is None:
            self._take_over()
        if self.state is not before:
            self._state_changed(before)
        self._watch_sight()
        self._watch_following()
        if not self._announced and self.ready:
            self._announced = True
            self.on_ready()

    def write(self, now: float, period: float) -> None:
        """Write controlword, mode and target for this cycle."""
        self.period = period
        if not self._streamed:
            self.feed_forward.end()
        self._led, self._streamed = self._streamed, False
        bits = NO_BITS
        if self.state is DriveState.UNKNOWN and self.node.taken_over:
            return  # its RPDOs go on to carry what another master had commanded
        if self.state is DriveState.UNKNOWN:
            command = Command.DISABLE_VOLTAGE
        else:
            command, edge = self._lead_targets(self._command())
            if command is Command.ENABLE_OPERATION and self.acts:
                bits = self._step_mode(now, period)
            else:
                bits = self._hold_without_target(edge=edge)
        if self._commands_enabled and self.objects.controlword_muted and not self.stop.running:
            raise CanopenError('the RPDO with its controlword is kept back, with another axis')
        self._send(command, bits)

    def fail(self, error: Exception, output: SentRpdo | None = None) -> None:
        """Stop and disable the drive, because its cycle failed; never raises.

        The other drives of the bus go on.

        Args:
            error: Why; one that the drive itself could not have caused is a defect.
            output: An RPDO of its device that cannot be sent.
        """
        text = str(error)
        if not isinstance(error, CanopenError):
            text = f'a defect in the CANopen master: {type(error).__name__}: {error}'
        self._take_out(Refusal(RefusalCause.CYCLE_FAILED, text), text)
        try:
            self._send(self._command())
            self.feed_forward.end()
        except Exception:  # noqa: BLE001  # what keeps it from being led may keep this from it, too
            self.stop.use_sdo()
        if output is not None and self.objects.is_controlled_by(output):
            self.stop.use_sdo()

    def _take_out(self, refusal: Refusal, text: str) -> None:
        """Stop and disable it; only the first cause is told until it is enabled again."""
        if self.goal is not None:
            self.goal = DriveState.SWITCH_ON_DISABLED
        first, self.failure = not self.failure, self.failure or text
        if first or not self.stop.disabled:
            self.stop.begin(quiet=not first)
        if not first:
            return
        self.released(refusal)
        self.report(Severity.ERROR, f'stopped: {text}')

    def resume(self, delivery: Promise[None]) -> None:
        """End a halt as soon as the drive has the new target, so that no old one revives.

        Args:
            delivery: Of the new target.
        """
        self.halt.leave(self._scheduler.now, delivery)

    def stream(self, setpoint: Setpoint) -> None:
        """Follow a motion source in this cycle.

        Raises:
            DriveError: A value is not finite, does not fit its object or is beyond a limit.
        """
        if not isinstance(self.mode, CyclicPosition):
            return
        check_setpoint(self.name, self.mode, self.parameters, setpoint)
        if self.mode.number is OperationMode.CYCLIC_POSITION:
            self.feed_forward.follow(setpoint)
        self.mode.stream(setpoint.position)
        self.halt.release()
        self._streamed = True

    def _lead_targets(self, command: Command) -> tuple[Command, bool]:
        """Let targets leave a cycle before the mode and the command that make them act.

        RPDOs carry objects in any distribution, so that of one cycle a drive may see the edge
        before the target.

        Returns:
            The command of this cycle, and whether it, or the mode, makes targets act that have
            left before.
        """
        if self._mode_led is not self.mode:
            self._mode_led = self.mode
            if command is Command.ENABLE_OPERATION and not self._commands_enabled:
                return Command.SWITCH_ON, False
            return command, False
        switching = self._mode_shown is not self.mode
        self._mode_shown = self.mode
        enabling = command is Command.ENABLE_OPERATION and not self._commands_enabled
        return command, switching or enabling

    def _send(self, command: Command, bits: int = NO_BITS) -> None:
        self._controlword = int(command) | bits
        self.objects.controlword.write(self._controlword)
        number = int(self._mode_shown.number)
        if number or not self._quirks.no_mode_zero:
            self.objects.mode.write(number)
        elif self.objects.mode_display and not self.objects.mode.by_sdo:
            self.objects.mode.write(self.objects.mode_display)  # keeps the mode that it has

    def _take_over(self) -> None:
        """Go on where another master has left the drive."""
        adopted = self.adopt()
        self._mode_shown = self._mode_led = self.mode
        if adopted:
            title = mode_title(self.mode.number)
            self.report(Severity.INFO, f'taken over enabled, in mode {title}; it holds')
        else:
            self.warn(f'is not enabled by the new master: {self.describe()}')

    def _watch_sight(self) -> None:
        """Bring a drive to rest that acts on targets and has stopped to send its state."""
        if self.fresh or not self.acts:
            self._unseen_since = None
            return
        if self._unseen_since is None:
            self._unseen_since = self._scheduler.now
        if self._is_led_to_rest() or (self.halted and not self.halt.leaving):
            return
        self.hold()
        self.released(Refusal(RefusalCause.SILENT, f'the last is {self.age:.1f} s old'))
        self.report(
            Severity.ERROR,
            f'stopped: no TPDOs for {self.age:.1f} s; it stays halted until the first target '
            'after they have come again',
        )

    def _is_led_to_rest(self) -> bool:
        """Whether a motion source may still lead a silent drive, to stop it on its path."""
        since = self._unseen_since
        return self._led and since is not None and self._scheduler.now - since < UNSEEN_STOP_TIME

    def _watch_following(self) -> None:
        """Stop a drive that is left behind by the set-points of a cyclic mode."""
        mode = self.mode
        if not (mode.cyclic and self.accepts_targets):
            self._follows = False
            if mode.cyclic and self.acts:
                self._following.lose_sight()
            else:
                self._following.clear()
            return
        bit = bool(self.statusword & FOLLOWS_COMMAND)
        before, self._follows = self._follows, bit
        rests = isinstance(mode, InterpolatedPosition) and not mode.velocity
        if before and not bit and not rests:  # in mode 7 bit 12 may go where nothing moves
            self.released(Refusal(RefusalCause.NOT_FOLLOWING, 'bit 12'))
            self.warn(f'does not follow its set-points any more (bit 12): {self.describe()}')
        if isinstance(mode, CyclicPosition):
            self._watch_position(mode)

    def _watch_position(self, mode: CyclicPosition) -> None:
        setpoint = mode.setpoint
        position = self.units.position_commanded(self._position_inc())
        shown = mode.number is OperationMode.CYCLIC_POSITION and bool(
            self.statusword & FOLLOWING_ERROR
        )
        now = self._scheduler.now
        margin = MARGIN_TIME * self.parameters.profile.velocity
        window = self.parameters.following_window or margin
        following = self._following.judge(
            now, setpoint, position, margin=min(margin, window), window=window, error=shown
        )
        if following is Following.FOLLOWS:
            return
        self._following.clear()
        where = f'commanded to {setpoint:g}, it is at {position:g}'
        refusal = Refusal(RefusalCause.NOT_FOLLOWING, where)
        age = now - self.objects.position_timestamp
        text = f'it does not follow its set-points ({where})'
        if following is Following.LASTING_ERROR or age > POSITION_AGE_MAX:
            self._take_out(refusal, f'{text}. Can it hold its load, and is the axis free?')
            return
        self.hold()
        mode.preload(self._actual())  # so that it does not jump when set-points reach it again
        self.released(refusal)
        self.report(Severity.ERROR, f'stopped: {text}. Do its RPDOs arrive, and is the axis free?')

    def _command(self) -> Command:
        if self.resetting and self.state is DriveState.FAULT:
            if self._reset_began is None:
                self._reset_began = self._scheduler.now
            return Command(fault_reset(self.state, self._scheduler.now - self._reset_began))
        self._reset_began = None
        goal = self.goal if self.stop.goal is None else self.stop.goal
        return Command.DISABLE_VOLTAGE if goal is None else next_command(self.state, goal)

    def _state_changed(self, before: DriveState) -> None:
        left = before is DriveState.OPERATION_ENABLED
        if left:
            self.halt.release()
        if self.state in FAULTY and before not in FAULTY:
            self.goal = DriveState.SWITCH_ON_DISABLED
            self.released(Refusal(RefusalCause.FAULT, self.error))
            self._scheduler.background(self._report_fault())
        elif left and self.goal is DriveState.OPERATION_ENABLED:
            # a drive that lost its enable must not start again when the cause goes away
            self.goal = DriveState.SWITCH_ON_DISABLED
            self.released(Refusal(RefusalCause.NOT_ENABLED, 'it left Operation enabled by itself'))
            self.report(
                Severity.ERROR,
                f'left Operation enabled by itself: {self.describe()}; is the voltage or the '
                'safe torque off gone? Call ~/enable when it is safe',
            )
        elif left:
            self.released(Refusal(RefusalCause.NOT_ENABLED, self.state.title))

    async def _report_fault(self) -> None:
        await self.read_error_code()
        self.report(Severity.ERROR, f'FAULT: {self.describe()}; call ~/recover')

    def _on_lost(self, reason: str) -> None:
        self._cache.forget(reason)
        if self._polling is not None:
            self._polling.cancel(SdoError(reason))
        enabled = self.state is DriveState.OPERATION_ENABLED and self.goal is self.state
        if enabled and not self.node.left_operational:
            self.interrupted = self.mode.number
        self.feed_forward.end()
        self.goal = None
        self.resetting = self._follows = self._begun = self._announced = False
        self._unseen_since = None
        self._following.clear()
        self.halt.release()
        self.stop.abandon(reason)
        self.error = self.failure = ''
        self._lose_sight()
        self.mode = self._mode_shown = self._mode_led = self.modes[OperationMode.NO_MODE]
        cause = RefusalCause.OFFLINE
        if self.node.left_operational:
            cause = RefusalCause.NOT_OPERATIONAL
        self.released(Refusal(cause, reason))
