# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""One axis of a CiA 402 drive in the SYNC cycle: its view, its control, and what stops it."""

from __future__ import annotations

from collections.abc import Callable
import math

from canopen_core import CanopenError, SdoError
from canopen_core.standard import DriveState, mode_title, OperationMode, Statusword

from ..config.model.drive import DriveConfig
from ..master.events import EventKind, Severity
from ..master.process_image import SentRpdo
from ..master.remote_node import RemoteNode
from ..master.scheduler import Scheduler, Task
from .cyclic_position import CyclicPosition, InterpolatedPosition
from .drive_control import DriveControl
from .drive_view import DriveView, FAULTY, LOOK_PERIOD, POWERED
from .feed_forward import FeedForward
from .following_watch import Following, FollowingWatch, MARGIN_TIME
from .modes import NO_BITS
from .motion import AxisFeedback, Setpoint
from .refusal import Refusal, RefusalCause
from .state_machine import Command, fault_reset, next_command
from .stop_sequence import BrakingWatch, StopSequence
from .target_limits import check_setpoint

FOLLOWS_COMMAND = int(Statusword.FOLLOWS_COMMAND)
FOLLOWING_ERROR = int(Statusword.FOLLOWING_ERROR)
POSITION_AGE_MAX = 0.25  # [s] of a position at which an axis may be held
UNSEEN_STOP_TIME = 1.0  # [s] in which a motion source may lead a silent drive to rest on its path


class Drive:
    """An axis of a drive of the bus; most drives have one.

    ``read`` and ``write`` run in each cycle. Commands set goal, mode and targets of its control
    from coroutines in the same thread (``drive_commands.py``).

    Attributes:
        node: The device.
        config: Settings of the axis.
        name: Its name: that of the device, of its channel for one with several axes.
        view: Its state.
        objects: Its objects in the process image.
        control: What is commanded to it.
        failure: Why the master stopped it, until it is enabled again; else empty.
        resetting: Send fault resets while the drive is faulted.
        following_error: Set-point that was sent before the last position was measured, minus that
            position, in user units.
        period: Length of the last cycle in [s].
        motions: How many motions were begun: by targets, moves and motion sources.
        interrupted: Mode in which it was enabled when its device was lost, None otherwise.
        feed_forward: The offsets of a motion source.
        stop: Takes it out of operation; while that runs, nothing else leads it.
        released: Called with the cause when a motion source loses the drive.
        on_ready: Called when state and parameters are known after each boot.
    """

    def __init__(
        self, node: RemoteNode, scheduler: Scheduler, config: DriveConfig | None = None
    ) -> None:
        """Bind the axis to its device; the first one unless ``config`` is another."""
        self.node = node
        self.config = config or node.config.drive
        self.view = DriveView(node, scheduler, self.config, self.warn)
        self.name, self.objects = self.view.name, self.view.objects
        self.control = DriveControl(self.view, self.warn)
        self.failure = ''
        self._scheduler = scheduler
        self.released: Callable[[Refusal], None] = lambda refusal: None
        self.on_ready: Callable[[], None] = lambda: None
        self.resetting = False
        self.motions = 0
        self.following_error = self.period = 0.0
        self.interrupted: OperationMode | None = None
        self.feed_forward = FeedForward(self.objects, self.view.units)
        self._streamed = False
        self.stop = StopSequence(self.view, scheduler, self.report)
        self._braking = BrakingWatch()
        self._state = DriveState.UNKNOWN  # that the last cycle has seen
        self._reset_began: float | None = None
        self._begun = False
        self._announced = False
        self._follows = False
        self._following = FollowingWatch()
        self._led = False  # by a motion source, in the last cycle
        self._unknown = True  # its state, since it was lost; no controlword leaves before it shows
        self._unseen_since: float | None = None
        self._polling: Task[None] | None = None
        node.on_lost.append(self._on_lost)
        node.on_failed.append(self.fail)
        node.lead_to_rest.append(self.lead_to_rest)

    def describe(self) -> str:
        """Describe the drive in a sentence."""
        return self.view.describe(halted=self.control.halted, failure=self.failure)

    def report(self, severity: Severity, text: str) -> None:
        """Report something about this drive to the owner of the network."""
        about = text if self.name == self.node.name else f'{self.name}: {text}'
        self.node.report(EventKind.DRIVE, severity, about)

    def warn(self, text: str) -> None:
        """Report what goes wrong with this drive."""
        self.report(Severity.WARNING, text)

    def feedback(self) -> AxisFeedback:
        """Return the state for motion sources."""
        refusal = self.control.stream_refusal
        return AxisFeedback(
            name=self.name,
            online=self.node.online,
            state=self.view.state,
            mode=self.objects.mode_display,
            position=self.view.position,
            velocity=self.view.velocity,
            setpoint=self.control.setpoint,
            followable=refusal is None or self._is_led_to_rest(),
            refusal=refusal,
            age=self.view.age,
            speed_limit=self.view.parameters.speed_limit or math.inf,
        )

    def read(self) -> None:
        """Read the state from the process image."""
        if not self._begun and self.node.operational:
            self._begun = True
            self.view.cache.begin()
            if self.config is self.node.config.drive:  # one axis polls for all
                poll = self.node.objects.poll(self.node.config.poll_period)
                self._polling = self._scheduler.background(poll)
        view = self.view
        before = self._state
        view.observe()
        self._state = view.state
        if view.state is DriveState.UNKNOWN:
            return
        self.following_error = self.control.setpoint - view.observed
        if before is DriveState.UNKNOWN and self.node.taken_over and self.control.goal is None:
            self._take_over()
        elif self._unknown and view.fresh:
            self._found()
        if view.state is not before:
            self._state_changed(before)
        self._watch_sight()
        self._watch_braking()
        self._watch_following()
        if not self._announced and view.ready:
            self._announced = True
            self.on_ready()

    def write(self, now: float, period: float) -> None:
        """Write controlword, mode and target for this cycle."""
        self.period = period
        if not self._streamed:
            self.feed_forward.end()
        self._led, self._streamed = self._streamed, False
        command, bits = Command.DISABLE_VOLTAGE, NO_BITS
        view = self.view
        known = view.state is not DriveState.UNKNOWN
        if known and (view.fresh or (self.node.operational and not self._unknown)):
            command, bits = self.control.step(self._command(), now, period)
        elif self.node.taken_over:
            return  # its RPDOs go on to carry what another master had commanded
        elif self._unknown:
            self.objects.mute_controlword()  # it may move, and would coast
        leads = self.control.enables and not (self._unknown or self.stop.running)
        if leads and self.objects.controlword_muted:
            raise CanopenError('the RPDO with its controlword is kept back, with another axis')
        self.control.send(command, bits)

    def fail(self, error: Exception, output: SentRpdo | None = None) -> None:
        """Stop and disable the drive, because its cycle failed; never raises.

        The other drives go on. An error that the drive itself could not have caused is a defect;
        ``output`` is an RPDO of its device that cannot be sent.
        """
        text = str(error)
        if not isinstance(error, CanopenError):
            text = f'a defect in the CANopen master: {type(error).__name__}: {error}'
        self._take_out(Refusal(RefusalCause.CYCLE_FAILED, text), text)
        try:
            self.control.send(self._command())
            self.feed_forward.end()
        except Exception:  # noqa: BLE001  # its cause may hinder this, too
            self.stop.use_sdo()
        if output is not None and self.objects.is_controlled_by(output):
            self.stop.use_sdo()

    def leave_operation(self) -> None:
        """Lead it to Switch On Disabled, by the stop sequence where it may still move."""
        self.control.goal = DriveState.SWITCH_ON_DISABLED
        if self.view.state in POWERED and not self.view.stands:
            self.stop.begin()

    async def lead_to_rest(self, reason: str, severity: Severity = Severity.ERROR) -> bool:
        """Bring it to rest and take its power away; return whether that was seen.

        What TPDOs do not show is read by SDO; one that does not answer is left as it is.
        """
        await self.stop.ended()  # that the loss of its device has begun
        state = self.view.state if self.view.fresh else await self.view.look()
        if state in (*POWERED, DriveState.FAULT_REACTION_ACTIVE):
            self._note_interruption()
            self._take_out(Refusal(RefusalCause.OFFLINE, reason), reason, severity)
            await self.stop.ended()
            seen = self.stop.disabled and self.stop.rests
        else:
            seen = state is not DriveState.UNKNOWN
        if not self.node.operational:
            self.view.lose_sight()
        return seen

    def _take_out(self, refusal: Refusal, text: str, severity: Severity = Severity.ERROR) -> None:
        """Stop and disable it; only the first cause is reported until it is enabled again."""
        if self.control.goal is not None:
            self.control.goal = DriveState.SWITCH_ON_DISABLED
        first, self.failure = not self.failure, self.failure or text
        if first or self.view.state in POWERED:
            self.stop.begin(quiet=not first)
        if not first:
            return
        self.released(refusal)
        self.report(severity, f'stopping: {text}')

    def stream(self, setpoint: Setpoint) -> None:
        """Follow a motion source in this cycle.

        Raises:
            DriveError: A value is not finite, does not fit its object or is beyond a limit.
        """
        mode = self.control.mode
        if not isinstance(mode, CyclicPosition):
            return
        check_setpoint(self.name, mode, self.view.parameters, setpoint)
        if mode.number is OperationMode.CYCLIC_POSITION:
            self.feed_forward.follow(setpoint)
        mode.stream(setpoint.position)
        self.control.halt.release()
        self.motions += not self._led
        self._streamed = True

    def _found(self) -> None:
        """Command it from now on; one that is enabled without a command of ours is stopped."""
        self._unknown = False
        if self.stop.running:
            return
        self.objects.unmute_controlword()
        if self.view.state in POWERED and self.control.goal is None:
            self.warn(f'was found enabled, and is led to rest: {self.describe()}')
            self.leave_operation()

    def _take_over(self) -> None:
        """Go on where another master has left the drive."""
        if self.control.adopt():
            title = mode_title(self.control.mode.number)
            self.report(Severity.INFO, f'taken over enabled, in mode {title}; it holds')
            return
        self.warn(f'is not enabled by the new master: {self.describe()}')
        if self.view.state in POWERED:
            self.leave_operation()

    def _watch_sight(self) -> None:
        """Bring a drive to rest that acts on targets and has stopped to send its state."""
        view, control = self.view, self.control
        if view.fresh or not control.acts:
            self._unseen_since = None
            return
        if self._unseen_since is None:
            self._unseen_since = self._scheduler.now
        if self._is_led_to_rest() or (control.halted and not control.halt.leaving):
            return
        control.hold()
        self._scheduler.background(self._look_for_motion())
        self.released(Refusal(RefusalCause.SILENT, f'the last is {view.age:.1f} s old'))
        self.report(
            Severity.ERROR,
            f'stopping: no TPDOs for {view.age:.1f} s; it stays halted until the first target '
            'after they have come again',
        )

    async def _look_for_motion(self) -> None:
        """See by SDO whether a drive slows down whose TPDOs do not come."""
        while not self.view.fresh and self.control.acts:
            await self.view.look()
            await self._scheduler.timer(LOOK_PERIOD)

    def _watch_braking(self) -> None:
        """Stop an axis by stronger means that a halt, or being disabled, does not slow down."""
        view, control = self.view, self.control
        halted = control.halt.held and not control.halt.leaving
        goal, enabled = control.goal, DriveState.OPERATION_ENABLED
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
            control.goal = DriveState.QUICK_STOP_ACTIVE
        self.stop.begin(disables=not halted)
        self.released(Refusal(RefusalCause.NOT_ENABLED, 'its halt did not slow it down'))
        self.report(Severity.ERROR, text)

    def _is_led_to_rest(self) -> bool:
        """Whether a motion source may still lead a silent drive, to stop it on its path."""
        since = self._unseen_since
        return self._led and since is not None and self._scheduler.now - since < UNSEEN_STOP_TIME

    def _watch_following(self) -> None:
        """Stop a drive that is left behind by the set-points of a cyclic mode."""
        mode = self.control.mode
        if not (mode.cyclic and self.control.accepts_targets):
            self._follows = False
            if mode.cyclic and self.control.acts:
                self._following.lose_sight()
            else:
                self._following.clear()
            return
        bit = bool(self.view.statusword & FOLLOWS_COMMAND)
        before, self._follows = self._follows, bit
        if before and not bit:
            rests = isinstance(mode, InterpolatedPosition) and not mode.velocity
            if not rests:  # in mode 7 bit 12 may go where nothing moves
                self.released(Refusal(RefusalCause.NOT_FOLLOWING, 'bit 12'))
                self.warn(f'does not follow its set-points any more (bit 12): {self.describe()}')
        if isinstance(mode, CyclicPosition):
            self._watch_position(mode)

    def _watch_position(self, mode: CyclicPosition) -> None:
        view, setpoint = self.view, mode.setpoint
        position = view.units.position.commanded(view.observed_inc)
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
        )
        if following is Following.FOLLOWS:
            return
        self._following.clear()
        where = f'commanded to {setpoint:g}, it is at {position:g}'
        refusal = Refusal(RefusalCause.NOT_FOLLOWING, where)
        text = f'it does not follow its set-points ({where})'
        if following is Following.LASTING_ERROR or view.position_age > POSITION_AGE_MAX:
            self._take_out(refusal, f'{text}. Can it hold its load, and is the axis free?')
            return
        self.control.hold()
        mode.preload(view.actual())  # so that it does not jump when set-points reach it again
        self.released(refusal)
        self.report(
            Severity.ERROR, f'stopping: {text}. Do its RPDOs arrive, and is the axis free?'
        )

    def _command(self) -> Command:
        state = self.view.state
        if self.resetting and state is DriveState.FAULT:
            if self._reset_began is None:
                self._reset_began = self._scheduler.now
            return Command(fault_reset(state, self._scheduler.now - self._reset_began))
        self._reset_began = None
        goal = self.control.goal if self.stop.goal is None else self.stop.goal
        return Command.DISABLE_VOLTAGE if goal is None else next_command(state, goal)

    def _state_changed(self, before: DriveState) -> None:
        view, control = self.view, self.control
        left = before is DriveState.OPERATION_ENABLED
        if left:
            control.halt.release()
        if view.state in FAULTY and before not in FAULTY:
            control.goal = DriveState.SWITCH_ON_DISABLED
            view.error = view.error_of_emcy()
            self.released(Refusal(RefusalCause.FAULT, view.error))
            self._scheduler.background(self._report_fault())
        elif left and control.goal is DriveState.OPERATION_ENABLED:
            self._left_by_itself()
        elif left:
            self.released(Refusal(RefusalCause.NOT_ENABLED, view.state.title))

    def _left_by_itself(self) -> None:
        """Keep it from starting again when the cause goes away, with power while it brakes."""
        goal, cause = DriveState.SWITCH_ON_DISABLED, 'is the voltage or the safe torque off gone?'
        if self.view.state is DriveState.QUICK_STOP_ACTIVE:
            goal = DriveState.QUICK_STOP_ACTIVE
            cause = 'is it at a limit switch, is its quick stop input on, or was a heartbeat late?'
        self.control.goal = goal
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
        """Keep the mode that it is enabled in, for the time after its device is lost."""
        control = self.control
        if control.goal is self.view.state is DriveState.OPERATION_ENABLED:
            self.interrupted = control.mode.number

    def _on_lost(self, reason: str) -> None:
        view, control = self.view, self.control
        view.cache.forget(reason)
        if self._polling is not None:
            self._polling.cancel(SdoError(reason))
        by_itself = self.node.left_by_itself
        powered = view.state in POWERED
        if not self.node.left_operational:
            self._note_interruption()
        elif not by_itself:
            self.interrupted = None
        self.feed_forward.end()
        self.resetting = self._follows = self._begun = self._announced = False
        self._unknown = True
        self._unseen_since = None
        self._following.clear()
        control.forget()
        view.error = self.failure = ''
        view.lose_sight()
        self._state = DriveState.UNKNOWN
        cause = RefusalCause.OFFLINE
        if self.node.left_operational:
            cause = RefusalCause.NOT_OPERATIONAL
        self.released(Refusal(cause, reason))
        if powered and by_itself:  # it may receive what it does not answer
            self.stop.begin(quiet=True)
        elif powered and self.node.online:
            self._scheduler.background(self._brake_without_pdos(reason))

    async def _brake_without_pdos(self, reason: str) -> None:
        """Stop an axis that goes on without its master, as a command took its device from PDOs."""
        self.failure = failure = f'{reason}, and it is not seen to stand'
        self.warn(f'stopping by SDO: {reason}')
        await self.stop.run()
        if self.stop.disabled and self.stop.rests and self.failure == failure:
            self.failure = ''
