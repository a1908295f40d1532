# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""One axis of a CiA 402 drive in the SYNC cycle: its commands, supervision and stop."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from enum import auto, Enum
import math

from canopen_core import CanopenError, SdoError
from canopen_core.standard import (
    DriveState,
    Index,
    mode_title,
    OperationMode,
    Statusword,
    TARGET_OBJECTS,
    TORQUE_MODES,
)

from ..config.model.drive import DriveConfig
from ..master.events import EventKind, Severity
from ..master.process_image import SentRpdo
from ..master.remote_node import RemoteNode
from ..master.scheduler import Promise, Scheduler, Task
from .modes import (
    build_modes,
    CyclicPosition,
    FeedForward,
    InterpolatedPosition,
    Mode,
    NEW_SET_POINT,
    NO_BITS,
)
from .modes.cyclic_position import Following, FollowingWatch, MARGIN_TIME
from .modes.mode import check_setpoint, check_target
from .motion import AxisFeedback, Refusal, RefusalCause, Setpoint
from .parameters import quirks_of
from .state import AxisState, DriveStatus, FAULTY, LOOK_PERIOD, POWERED
from .state_machine import Command, ControlwordOutput, fault_reset, next_command
from .stop import ANSWER_CYCLES, BrakingWatch, Halt, StopSequence

FOLLOWS_COMMAND = int(Statusword.FOLLOWS_COMMAND)
FOLLOWING_ERROR = int(Statusword.FOLLOWING_ERROR)
ENABLE_OPERATION = int(Command.ENABLE_OPERATION)
POSITION_AGE_MAX = 0.25  # [s] oldest position at which an axis may be held
TAKE_OVER_TIME = 0.5  # [s] in which a drive that is taken over shows whether it moves
UNSEEN_STOP_TIME = 1.0  # [s] for a motion source to stop a silent drive on its path
NOT_TAKEN = (
    'it has not taken its new target (bit 12); disable and enable it to make it forget the moves '
    'that it holds'
)


class Phase(Enum):
    """Start-up phase of an axis after its device boots; a loss of the device restarts it."""

    OFFLINE = auto()  # its device is not operational
    UNSEEN = auto()  # no controlword is sent until its TPDOs show its state
    FOUND = auto()  # its state is known, and the master commands it
    READY = auto()  # its parameters are also known


class Axis:
    """An axis of a drive, and the sole writer of its controlword, mode and target.

    ``read`` and ``write`` run in each cycle. Commands (``commands.py``) set :attr:`goal`, mode and
    targets from coroutines in the same thread; the controlword follows from the table in
    ``state_machine.py``. Reactions to what the drive does by itself:

    ======================  ====================  =================================================
    it shows                commanded was         then
    ======================  ====================  =================================================
    its first state         nothing               enabled: taken over, or led to rest
    a fault                 anything              goal Switch On Disabled, report, halt ended
    Quick Stop Active       Operation Enabled     goal Quick Stop Active, report
    another state           Operation Enabled     goal Switch On Disabled, report
    no TPDOs                Operation Enabled     halt; the stop looks by SDO
    no state for 0.2 s      Operation Enabled     goal Switch On Disabled, :class:`.StopSequence`
    no motion               set-points            halt, or no power where it is pulled away
    no rest                 halt, or no power     :class:`.StopSequence`: quick stop, then no power
    no life sign            anything              goal none, mode none, :class:`.StopSequence`
    ======================  ====================  =================================================
    """

    def __init__(
        self, node: RemoteNode, scheduler: Scheduler, config: DriveConfig | None = None
    ) -> None:
        """Bind the axis to its device: the first axis, unless ``config`` is that of another."""
        self.node = node  # the device
        self.config = config or node.config.drive  # settings of the axis
        self.view = AxisState(node, scheduler, self.config, self.warn)  # its state
        # name of the device, or of the channel if the device has several axes
        self.name, at = self.view.name, self.view.at
        # called with the cause when a motion source loses the drive
        self.released: Callable[[Refusal], None] = lambda refusal: None
        # called when state and parameters are known after each boot
        self.on_ready: Callable[[], None] = lambda: None
        self.phase = Phase.OFFLINE  # start-up phase
        self.goal: DriveState | None = None  # commanded state; None before a command
        self.modes = build_modes(self.view, self.warn)  # modes that the objects and RPDOs allow
        self.mode = self.modes[OperationMode.NO_MODE]  # commanded mode
        self.halt = Halt()  # state of its halt
        self.controlword = ControlwordOutput(node, at(Index.CONTROLWORD))
        # takes it out of operation; while it runs, it alone commands the drive
        self.stop = StopSequence(
            self.view, self.controlword, scheduler, self.report, lambda: self.halt_bits
        )
        self.failure = ''  # why the master stopped it; cleared when it is enabled
        self.resetting = False  # send fault resets while the drive is faulted
        self.motions = 0  # number of motions begun by targets, moves and motion sources
        self.period = 0.0  # length of the last cycle in [s]
        # set-point that was sent before the last position was measured, minus that position, in
        # user units
        self.following_error = 0.0
        # mode in which it was enabled when its device was lost, None otherwise
        self.interrupted: OperationMode | None = None
        image = node.image
        self.feed_forward = FeedForward(  # the offsets of a motion source
            image.writer(at(Index.VELOCITY_OFFSET)),
            image.writer(at(Index.TORQUE_OFFSET)),
            self.view.units,
        )
        self._scheduler = scheduler
        self.mode_writer = node.objects.writer(at(Index.MODE_OF_OPERATION))
        self._no_mode_zero = quirks_of(self.config.quirks).no_mode_zero
        # the mode is sent to the drive a cycle after the target that holds the drive in it
        self._mode_led = self._mode_shown = self.mode
        self._controlword = 0
        # inputs and RPDO values of the last preload of all modes; empty after other steps
        self._preloaded: tuple[object, ...] = ()
        self._mode_sent: int | None = None  # 0x6060 in the RPDO
        self._state = DriveState.UNKNOWN  # state in the last cycle
        self._reset_began: float | None = None
        self._braking = BrakingWatch()
        self._following = FollowingWatch()
        self._followed = False  # statusword bit 12 in a cyclic mode, in the last cycle
        self._halted_at = -math.inf  # steady time at which bit 8 was set for the last time in [s]
        self._led = self._streamed = False  # commanded by a motion source: last cycle, this cycle
        self._unseen_since: float | None = None
        self._polling: Task[None] | None = None
        node.on_lost.append(self._on_lost)
        node.on_failed.append(self.fail)
        node.lead_to_rest.append(self.lead_to_rest)

    # State, and which targets it accepts.

    def describe(self) -> str:
        """Describe the drive in a sentence."""
        return self.view.describe(halted=self.halt.held, failure=self.failure)

    def status(self) -> DriveStatus:
        """Return a snapshot for other threads."""
        return self.view.status(
            self.setpoint, self.following_error, failure=self.failure, summary=self.describe()
        )

    def report(self, severity: Severity, text: str) -> None:
        """Report something about this drive to the owner of the network."""
        about = text if self.name == self.node.name else f'{self.name}: {text}'
        self.node.report(EventKind.DRIVE, severity, about)

    def warn(self, text: str) -> None:
        """Report a warning about this drive."""
        self.report(Severity.WARNING, text)

    def feedback(self) -> AxisFeedback:
        """Return the state for motion sources."""
        view, refusal = self.view, self.stream_refusal
        return AxisFeedback(  # positional arguments take a third of the time
            self.name,
            self.node.online,
            view.state,
            view.mode,
            view.position,
            view.velocity,
            self.setpoint,
            refusal is None or self._is_led_to_rest(),
            refusal,
            view.age,
            view.parameters.speed_limit or math.inf,
        )

    @property
    def setpoint(self) -> float:
        """Position last commanded, or the actual position if none is commanded."""
        commanded = self.mode.setpoint
        if commanded is None or self.view.state is not DriveState.OPERATION_ENABLED:
            return self.view.position
        return commanded

    @property
    def is_up_to_date(self) -> bool:
        """Whether the cycle has processed the current state; it judges changes by the goal."""
        return self._state is self.view.state

    @property
    def stays_enabled(self) -> bool:
        """Whether it is enabled and no pending command disables it."""
        return self.view.state is DriveState.OPERATION_ENABLED and self._enables

    @property
    def _enables(self) -> bool:
        """Whether the last controlword commands Operation Enabled."""
        return self._controlword & ENABLE_OPERATION == ENABLE_OPERATION

    @property
    def acts(self) -> bool:
        """Whether the target of the selected mode acts on the drive, judged by its last state.

        That state may be too old to accept targets (:attr:`refusal`), but a drive without feedback
        is also braked in its mode.
        """
        return (
            self.goal is DriveState.OPERATION_ENABLED
            and self.view.state is DriveState.OPERATION_ENABLED
            and self.view.mode == self.mode.number
        )

    @property
    def shows_mode(self) -> bool:
        """Whether the drive displays the selected mode, and its holding target was sent."""
        return self._mode_shown is self.mode and self.view.mode == self.mode.number

    @property
    def halt_bits(self) -> int:
        """Controlword bit 8 while the active mode is halted, also in commands that disable."""
        held = self.holding_mode
        return NO_BITS if held is None else self.halt.bits(held)

    @property
    def accepts_targets(self) -> bool:
        """Whether the drive executes a target of the selected mode; else see :attr:`refusal`."""
        return (
            self.acts
            and self.view.fresh
            and self.node.operational
            and self._mode_shown is self.mode
        )

    @property
    def refusal(self) -> Refusal | None:
        """Why it accepts no targets of the selected mode now; None if it accepts them."""
        if self.accepts_targets:
            return None
        view, node = self.view, self.node
        if not node.online:
            return Refusal(RefusalCause.OFFLINE, node.loss or node.phase_text)
        if node.left_operational:
            return Refusal(RefusalCause.NOT_OPERATIONAL)
        if view.shown_state is DriveState.UNKNOWN:
            shown = '' if view.undecoded is None else view.word_text
            return Refusal(RefusalCause.STATE_UNKNOWN, shown)
        if not view.fresh:
            return Refusal(RefusalCause.SILENT, f'the last is {view.age:.1f} s old')
        if view.state in FAULTY:
            return Refusal(RefusalCause.FAULT, view.error)
        if not self.goal is view.state is DriveState.OPERATION_ENABLED:
            return Refusal(RefusalCause.NOT_ENABLED, view.state.title)
        return Refusal(RefusalCause.MODE_CHANGE, mode_title(view.mode))

    @property
    def stream_refusal(self) -> Refusal | None:
        """Why it accepts no stream of positions now; None if it accepts one."""
        refusal, mode = self.refusal, self.mode
        if refusal is not None:
            return refusal
        if not isinstance(mode, CyclicPosition):
            return Refusal(RefusalCause.OTHER_MODE, mode_title(mode.number))
        if mode.goes_to_single_target:
            return Refusal(RefusalCause.SINGLE_TARGET)
        if self.halt.held and not mode.braked:
            return Refusal(RefusalCause.HALTED)
        return None

    @property
    def holding_mode(self) -> Mode | None:
        """Mode whose target acts on the drive: it is powered and displays that mode."""
        return self.shown_mode if self.view.state is DriveState.OPERATION_ENABLED else None

    @property
    def shown_mode(self) -> Mode | None:
        """Mode that the drive displays; None if :attr:`modes` lacks it."""
        return self.modes.get(self.view.mode)

    # The cycle.

    def read(self) -> None:
        """Read the state from the process image, and stop the drive if the state requires it."""
        if self.phase is Phase.OFFLINE and self.node.operational:
            self._begin()
        view, before = self.view, self._state
        view.observe()
        if view.state is DriveState.UNKNOWN:
            return  # the next state decides what to do
        self._state = view.state
        self.following_error = self.setpoint - view.position
        if before is DriveState.UNKNOWN and self.node.taken_over and self.goal is None:
            self._take_over()
        elif self.phase in (Phase.OFFLINE, Phase.UNSEEN) and view.fresh:
            self._found()
        if view.state is not before:
            self._state_changed(before)
        if view.fresh or not self.acts:
            self._unseen_since = None
        elif view.undecoded is None:
            self._watch_sight()
        self._watch_statusword()
        if self.halt.held or self.goal is not DriveState.OPERATION_ENABLED:
            self._watch_braking()
        else:
            self._braking.clear()
        self._watch_following()
        if self.phase is Phase.FOUND and view.ready:
            self.phase = Phase.READY
            self.on_ready()

    def write(self, now: float, period: float) -> None:
        """Write controlword, mode and target for this cycle."""
        self.period = period
        if not self._streamed:
            self.feed_forward.end()
        self._led, self._streamed = self._streamed, False
        command, bits = Command.DISABLE_VOLTAGE, NO_BITS
        view, unseen = self.view, self.phase in (Phase.OFFLINE, Phase.UNSEEN)
        known = view.state is not DriveState.UNKNOWN
        if known and (view.fresh or (self.node.operational and not unseen)):
            command, bits = self._step(self._command(), now, period)
        elif self.node.taken_over:
            return  # its RPDOs keep the commands of the previous master
        elif unseen:
            self.controlword.keep_back()  # Disable voltage would let a moving axis coast
        leads = self._enables and not (unseen or self.stop.running)
        if leads and self.controlword.kept_back:
            raise CanopenError('the RPDO with its controlword is kept back, with another axis')
        self._send(command, bits)

    def _step(self, command: Command, now: float, period: float) -> tuple[Command, int]:
        """Advance the mode by a cycle, and send targets before the command that activates them.

        Returns:
            The command of this cycle, and the controlword bits of mode and halt.
        """
        command, edge = self._lead_targets(command)
        if command is Command.ENABLE_OPERATION and self.acts:
            return command, self._step_mode(now, period)
        return command, self._hold_without_target(edge=edge)

    def _step_mode(self, now: float, period: float) -> int:
        """Advance mode and halt by a cycle; return their controlword bits."""
        mode, halt = self.mode, self.halt
        self._preloaded = ()
        bits = mode.step(now, period, self.view.statusword)
        if not halt.held:
            return bits
        before = halt.bits(mode)  # bit 8 is cleared a cycle after the new target
        if not halt.advance(now, period, mode):
            mode.brake()
            self.warn(f'stays halted: {NOT_TAKEN}')
            return halt.bits(mode)
        held = halt.bits(mode)
        if held and mode.cyclic and (self.view.shows_torque or mode.number not in TORQUE_MODES):
            mode.preload(self.view.actual())  # the motion continues from here
        # without an earlier acknowledge, the halt ends with the edge of bit 4
        return bits | (held if bits & NEW_SET_POINT else before)

    def _lead_targets(self, command: Command) -> tuple[Command, bool]:
        """Send targets a cycle before the mode and the command that activate them.

        If an RPDO other than that of the target carries the command, a drive may process it first.
        The flag is True if this cycle enables the drive or switches its mode.
        """
        enabling = command is Command.ENABLE_OPERATION and not self._enables
        if self._mode_led is not self.mode:
            self._mode_led = self.mode
            return (Command.SWITCH_ON if enabling else command), False
        switching = self._mode_shown is not self.mode
        self._mode_shown = self.mode
        return command, switching or enabling

    def _hold_without_target(self, *, edge: bool) -> int:
        """Preload targets that may act on the drive later; keep a halt while modes change.

        With ``edge`` this cycle enables the drive or switches its mode: targets stay as sent
        before. Returns the halt bits of the controlword.
        """
        view, held = self.view, self.holding_mode
        if edge or (held is not None and (held is self.mode or held.cyclic)):
            self._preloaded = ()
            return self.halt_bits
        # every target in an RPDO, also of modes that are not selected: a drive may stay in the
        # mode that it had; of two modes with one target object the selected one writes last
        actual, rpdos = view.actual(), self.node.image.rpdos
        by = actual, self.mode, view.mode, view.parameters
        if self._preloaded != (*by, [output.values for output in rpdos]):
            for mode in (*self.modes.values(), self.mode):
                if not mode.by_sdo:
                    mode.preload(actual)
            self._preloaded = *by, [output.values.copy() for output in rpdos]
        return self.halt_bits

    def _command(self) -> Command:
        state = self.view.state
        if self.resetting and state is DriveState.FAULT:
            if self._reset_began is None:
                self._reset_began = self._scheduler.now
            elapsed = self._scheduler.now - self._reset_began
            return Command(fault_reset(state, elapsed, self.period))
        self._reset_began = None
        goal = self.goal if self.stop.goal is None else self.stop.goal
        return Command.DISABLE_VOLTAGE if goal is None else next_command(state, goal)

    def _send(self, command: Command, bits: int = NO_BITS) -> None:
        """Write controlword and mode."""
        self._controlword = int(command) | bits
        self.controlword.writer.write(self._controlword)
        number = int(self._mode_shown.number)
        if not number and self._no_mode_zero:
            if not self.view.mode or self.mode_writer.by_sdo:
                return
            number = self.view.mode  # keep its mode
        if number != self._mode_sent or self.mode_writer.by_sdo:
            self.mode_writer.write(number)
            self._mode_sent = number

    # Commands in a mode.

    def select(self, mode: Mode) -> None:
        """Command another mode, preloaded with the actual or held position of the drive.

        A target that goes by SDO is written beforehand (``commands.py``). A halt stays active:
        until the drive shows the new mode, it may still have a target of the old one.
        """
        known = self.view.state is not DriveState.UNKNOWN  # else the first position preloads it
        if known and self.holding_mode is not mode and not mode.by_sdo:
            self.preload(mode)
        self.mode = mode

    def preload(self, mode: Mode) -> Promise[None]:
        """Set the target of a mode to the actual position, or to the held set-point.

        Returns:
            Done when the drive has it.
        """
        held, actual = self.holding_mode, self.view.actual()
        self._preloaded = ()
        if isinstance(held, CyclicPosition):
            # under load the actual position is off the set-point; holding there would let it sag
            position_inc = self.view.units.position.to_device(held.setpoint)
            actual = actual._replace(position_inc=position_inc, velocity=held.velocity)
        return mode.preload(actual)

    def select_back(self, mode: Mode) -> None:
        """Command the previous mode after a failed switch; the drive is halted in it."""
        if not self.node.online or self.mode is mode:
            return
        if self.view.state is DriveState.OPERATION_ENABLED:
            self.hold()
        self.select(mode)

    def hold(self) -> None:
        """Brake, and stay halted until the drive has taken a new target."""
        self._preloaded = ()
        self.mode.brake()
        self.halt.hold()

    def hold_here(self) -> None:
        """Halt it at its actual position, so that it does not jump when freed or reconnected."""
        self.hold()
        self.mode.preload(self.view.actual())

    def check_target(self, target: float) -> None:
        """Refuse a target beyond the limits of the drive in the selected mode."""
        view = self.view
        check_target(
            self.name, self.mode, view.parameters, view.units, target, position=view.position
        )

    def stream(self, setpoint: Setpoint) -> None:
        """Command the set-point of a motion source for this cycle.

        Raises:
            DriveError: A value is not finite, does not fit its object or is beyond a limit.
        """
        mode = self.mode
        if not isinstance(mode, CyclicPosition):
            return
        check_setpoint(self.name, mode, self.view.parameters, setpoint)
        if mode.number is OperationMode.CYCLIC_POSITION:
            self.feed_forward.follow(setpoint)
        mode.stream(setpoint.position)
        self.halt.release()
        self.motions += not self._led
        self._streamed = True

    # Taking it out of operation.

    def fail(self, error: Exception, output: SentRpdo | None = None) -> None:
        """Stop and disable the drive, because its cycle failed; never raises.

        Other drives continue. An error that the drive cannot have caused is a defect;
        ``output`` is an RPDO of its device that cannot be sent.
        """
        text = str(error)
        if not isinstance(error, CanopenError):
            text = f'a defect in the CANopen master: {type(error).__name__}: {error}'
        self._take_out(Refusal(RefusalCause.CYCLE_FAILED, text), text)
        try:
            self._send(self._command())
            self.feed_forward.end()
        except Exception:  # noqa: BLE001  # the cause of the failure may also affect this
            self.stop.use_sdo()
        if output in self.controlword.outputs:
            self.stop.use_sdo()

    def leave_operation(self) -> None:
        """Command Switch On Disabled; run the stop sequence if the axis may still move."""
        self.goal = DriveState.SWITCH_ON_DISABLED
        if self.view.state in POWERED and not self.view.stands:
            self.stop.begin()

    async def lead_to_rest(self, reason: str, severity: Severity = Severity.ERROR) -> bool:
        """Bring it to rest and remove its power; return whether feedback confirmed that.

        State missing in TPDOs is read by SDO; a device that does not answer is left as it is.
        """
        await self.stop.ended()  # the stop begun at the loss of its device
        state = self.view.state if self.view.fresh else await self.view.look()
        if state in (*POWERED, DriveState.FAULT_REACTION_ACTIVE):
            self._note_interruption()
            self._take_out(Refusal(RefusalCause.OFFLINE, reason), reason, severity)
            await self.stop.ended()
            seen = self.stop.disabled and self.stop.rests
        elif self.node.operational:
            seen = await self.stop.seen_at_rest()  # it may coast without power
        else:
            seen = self.view.stands
        if not self.node.operational:
            self.view.lose_sight()
        return seen

    def _take_out(self, refusal: Refusal, text: str, severity: Severity = Severity.ERROR) -> None:
        """Stop and disable it; report only the first cause until it is enabled again."""
        if self.goal is not None:
            self.goal = DriveState.SWITCH_ON_DISABLED
        first, self.failure = not self.failure, self.failure or text
        if first or self.view.state in POWERED:
            self.stop.begin(quiet=not first)
        if not first:
            return
        self.released(refusal)
        self.report(severity, f'stopping: {text}')

    # Events: device operational, first state, state change, device lost.

    def _begin(self) -> None:
        """Read the parameters of the drive when its device becomes operational."""
        self.phase = Phase.UNSEEN
        self._preloaded = ()
        self._mode_sent = None  # the boot has set the RPDO to the device's value
        self.view.cache.begin()
        if self.config is self.node.config.drive:  # one axis polls for all
            poll = self.node.objects.poll(self.node.config.poll_period)
            self._polling = self._scheduler.background(poll)

    def _found(self) -> None:
        """Command it from now on; stop it if it is enabled without a command of this master."""
        self.phase = Phase.FOUND
        if self.stop.running:
            return
        self.controlword.send_again()
        if self.view.state in POWERED and self.goal is None:
            self.warn(f'was found enabled, and is led to rest: {self.describe()}')
            self.leave_operation()

    def _take_over(self) -> None:
        """Take over the drive as the previous master left it; hold it if it is enabled."""
        held, view = self.holding_mode, self.view
        if held is not None:
            actual, is_torque = view.actual(), held.number in TORQUE_MODES
            if isinstance(held, CyclicPosition):
                target = view.held_target(held.number)
                if target is not None:
                    actual = actual._replace(position_inc=target)
            elif is_torque:  # as the other master commanded it: no TPDO may carry 0x6077
                actual = actual._replace(torque=view.held_target(held.number) or 0)
            if not (is_torque and held.by_sdo):  # else the drive already has its holding torque
                held.preload(actual)
            self.mode = self._mode_shown = self._mode_led = held
            self.goal = DriveState.OPERATION_ENABLED
            self._scheduler.background(self._hold_taken_over(held))
            return
        self._mode_shown = self._mode_led = self.mode
        self.warn(f'is not enabled by the new master: {self.describe()}')
        if view.state in POWERED:
            self.leave_operation()

    async def _hold_taken_over(self, mode: Mode) -> None:
        """Halt a drive that still moves by a target of the other master: a move, or a torque."""
        motions, taken = self.motions, f'taken over enabled, in mode {mode_title(mode.number)}'
        holds = isinstance(mode, CyclicPosition)
        with suppress(TimeoutError):
            await self._scheduler.until(lambda: holds or self.view.speed_known, TAKE_OVER_TIME)
        if self.mode is not mode or not self.acts or self.motions != motions:
            return  # a new command has arrived meanwhile
        if holds or self.view.stands:
            self.report(Severity.INFO, f'{taken}; it {"holds" if holds else "stands"}')
            return
        self.hold()
        self.warn(f'{taken}; it is not seen to stand, and is halted until the next target')

    def _state_changed(self, before: DriveState) -> None:
        view, left = self.view, before is DriveState.OPERATION_ENABLED
        if left:
            self.halt.release()
        if before in FAULTY and view.state not in FAULTY:
            view.error = ''  # even if another tool has reset the fault
        if view.state in FAULTY and before not in FAULTY:
            self.goal = DriveState.SWITCH_ON_DISABLED
            view.error = view.error_of_emcy()
            self.released(Refusal(RefusalCause.FAULT, view.error))
            self._scheduler.background(self._report_fault())
        elif left and self.goal is DriveState.OPERATION_ENABLED:
            self._left_by_itself()
        elif left:
            self.released(Refusal(RefusalCause.NOT_ENABLED, view.state.title))

    def _left_by_itself(self) -> None:
        """Keep it from restarting when the cause disappears; keep power while it brakes."""
        goal, cause = DriveState.SWITCH_ON_DISABLED, 'is the voltage or the safe torque off gone?'
        if self.view.state is DriveState.QUICK_STOP_ACTIVE:
            goal = DriveState.QUICK_STOP_ACTIVE
            cause = 'is it at a limit switch, is its quick stop input on, or was a heartbeat late?'
        self.goal = goal
        self.released(Refusal(RefusalCause.NOT_ENABLED, 'it left Operation enabled by itself'))
        self.report(
            Severity.ERROR,
            f'left Operation enabled by itself: {self.describe()}; {cause} Enable it again when '
            'it is safe',
        )

    async def _report_fault(self) -> None:
        await self.view.read_error_code()
        self.report(Severity.ERROR, f'FAULT: {self.describe()}; recover it')

    def _note_interruption(self) -> None:
        """Store the mode in which it is enabled, to restore it after a loss of its device."""
        if self.goal is self.view.state is DriveState.OPERATION_ENABLED:
            self.interrupted = self.mode.number

    def _on_lost(self, reason: str) -> None:
        """Handle the loss of its device: no goal, no mode, and a stop if it may still move."""
        view, node = self.view, self.node
        view.cache.forget(reason)
        if self._polling is not None:
            self._polling.cancel(SdoError(reason))
        by_itself = node.left_by_itself
        powered = view.state in POWERED
        if not node.left_operational:
            self._note_interruption()
        elif not by_itself:
            self.interrupted = None
        self.feed_forward.end()
        self.phase = Phase.OFFLINE
        self.resetting = self._followed = False
        self._unseen_since = None
        self._following.clear()
        self.goal = None
        self.halt.release()
        self.mode = self._mode_shown = self._mode_led = self.modes[OperationMode.NO_MODE]
        view.error = self.failure = ''
        view.lose_sight()
        self._state = DriveState.UNKNOWN
        left = node.left_operational
        cause = RefusalCause.NOT_OPERATIONAL if left else RefusalCause.OFFLINE
        self.released(Refusal(cause, reason))
        if powered and by_itself:  # it may still receive frames
            self.stop.begin(quiet=True)
        elif powered and node.online:
            self._scheduler.background(self._brake_without_pdos(reason))

    async def _brake_without_pdos(self, reason: str) -> None:
        """Stop by SDO an axis that keeps moving after an NMT command ended its PDO operation."""
        self.failure = failure = f'{reason}, and it is not seen to stand'
        self.warn(f'stopping by SDO: {reason}')
        await self.stop.run()
        if self.stop.disabled and self.stop.rests and self.failure == failure:
            self.failure = ''

    # Supervision in each cycle: fresh feedback, braking, following.

    def _watch_sight(self) -> None:
        """Stop an active drive that no longer sends its state."""
        view = self.view
        if self._unseen_since is None:
            self._unseen_since = self._scheduler.now
        if self._is_led_to_rest() or self.halt.rests:
            return
        self.hold()
        self._scheduler.background(self._look_for_motion())
        self.released(Refusal(RefusalCause.SILENT, f'the last is {view.age:.1f} s old'))
        self.report(
            Severity.ERROR,
            f'stopping: no TPDOs for {view.age:.1f} s; it stays halted until the first target '
            'after they have come again',
        )

    def _watch_statusword(self) -> None:
        """Stop a drive whose statusword shows no valid state for too long: it may be faulted."""
        view = self.view
        if view.undecoded is None or view.fresh or self.goal is not DriveState.OPERATION_ENABLED:
            return
        text = f'its statusword shows no state: {view.word_text}'
        self._take_out(Refusal(RefusalCause.STATE_UNKNOWN, view.word_text), text)

    async def _look_for_motion(self) -> None:
        """Poll the state by SDO while TPDOs are missing, to see whether the drive slows down."""
        while not self.view.fresh and self.acts:
            await self.view.look()
            await self._scheduler.timer(LOOK_PERIOD)

    def _is_led_to_rest(self) -> bool:
        """Return whether a motion source may still command a silent drive, to stop on its path."""
        since = self._unseen_since
        return self._led and since is not None and self._scheduler.now - since < UNSEEN_STOP_TIME

    def _watch_braking(self) -> None:
        """Escalate the stop of an axis that a halt or disabling does not slow down."""
        view, halted = self.view, self.halt.rests
        goal, enabled = self.goal, DriveState.OPERATION_ENABLED
        commanded = halted or not (goal is enabled or goal is None)
        if not commanded or view.state is not enabled or self.stop.running:
            self._braking.clear()
            return
        if not self._braking.fails(
            self._scheduler.now, view, view.parameters.profile.deceleration
        ):
            return
        text = (
            f'moves on at {view.rate:.3g} per second, although it was '
            f'{"halted" if halted else "disabled"}: quick stop, and no power if that does not '
            'slow it down either'
        )
        if halted:
            self.goal = DriveState.QUICK_STOP_ACTIVE
        self.stop.begin(disables=not halted)
        self.released(Refusal(RefusalCause.NOT_ENABLED, 'its halt did not slow it down'))
        self.report(Severity.ERROR, text)

    def _watch_following(self) -> None:
        """Stop a drive that does not follow the set-points of a cyclic mode."""
        mode = self.mode
        if not (mode.cyclic and self.accepts_targets):
            self._followed = False
            if mode.cyclic and self.acts:
                self._following.lose_sight()
            else:
                self._following.clear()
            return
        follows = bool(self.view.statusword & FOLLOWS_COMMAND)
        now = self._scheduler.now
        if self.halt_bits:  # which clear bit 12 in mode 10, also in the cycles after them
            self._halted_at = now
        shown = now - self._halted_at > ANSWER_CYCLES * self.period
        lost, self._followed = self._followed and not follows, follows and shown
        if lost:
            rests = isinstance(mode, InterpolatedPosition) and not mode.velocity
            if not (rests or self.halt_bits):  # in mode 7 it may be cleared at standstill
                self.released(Refusal(RefusalCause.NOT_FOLLOWING, 'bit 12'))
                self.warn(f'does not follow its set-points any more (bit 12): {self.describe()}')
        if isinstance(mode, CyclicPosition):
            self._watch_position(mode)

    def _watch_position(self, mode: CyclicPosition) -> None:
        view, setpoint = self.view, mode.setpoint
        position = view.units.position.commanded(view.position_inc)
        shown = mode.number is OperationMode.CYCLIC_POSITION and bool(
            view.statusword & FOLLOWING_ERROR
        )
        parameters = view.parameters
        margin = MARGIN_TIME * parameters.profile.velocity
        window = parameters.following_window or margin
        following = self._following.judge(
            self._scheduler.now,
            setpoint,
            position,
            margin=min(margin, window),
            window=window,
            error=shown,
            received=view.positions_received,
        )
        if following is Following.FOLLOWS:
            return
        if following is Following.UNDECIDED:
            index, subindex = TARGET_OBJECTS[mode.number]
            self.node.image.skip_cycle(view.at(index), subindex)
            return
        self._following.clear()
        where = f'commanded to {setpoint:g}, it is at {position:g}'
        refusal = Refusal(RefusalCause.NOT_FOLLOWING, where)
        text = f'it does not follow its set-points ({where})'
        if following is Following.LASTING_ERROR or view.position_age > POSITION_AGE_MAX:
            self._take_out(refusal, f'{text}. Can it hold its load, and is the axis free?')
            return
        self.hold_here()
        self.released(refusal)
        self.report(
            Severity.ERROR, f'stopping: {text}. Do its RPDOs arrive, and is the axis free?'
        )
