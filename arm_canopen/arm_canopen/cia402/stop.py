# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The stop of an axis: halt, then quick stop, then no power, until feedback confirms rest.

The drive is commanded by RPDO, else by SDO. If one step does not slow it down, the next one
follows. "Unknown" is never "stopped". First :class:`Halt` (bit 8, and when it may be cleared),
then :class:`BrakingWatch` (whether a stop slows the axis down), then :class:`StopSequence`.
"""

from __future__ import annotations

from collections.abc import Callable
from enum import Enum
import math

from canopen_core import CodecError, SdoError
from canopen_core.standard import (
    Controlword,
    DriveState,
    Index,
    NmtCommand,
    NmtState,
    OperationMode,
)

from ..master.events import Severity
from ..master.scheduler import completed, Promise, Scheduler, Task
from .modes import Mode, NO_BITS, ProfilePosition
from .state import AxisState, WINDOW
from .state_machine import Command, ControlwordOutput

HALT_BIT = int(Controlword.HALT)
RESUME_TIMEOUT = 2.5  # [s] for a halted drive to acknowledge a set-point
UNDER_HALT_TIME = 0.5  # [s] for the acknowledge of a set-point while bit 8 is set
RELEASED_TIME = 0.05  # [s] for it where bit 8 went with bit 4: an old move might go on meanwhile
ANSWER_CYCLES = 5  # in which a drive answers what it sees, if that takes longer


class HaltState(Enum):
    """Whether an axis is halted, and which event ends the halt."""

    ENDED = 'it is not halted'
    HELD = 'bit 8 is set, or the set-points were braked; no target is on its way'
    UNANSWERED = 'as held: the drive has not taken the target that was to end the halt'
    LEAVING = 'a target is on its way that will end it'
    LIFTED = 'so it is, and bit 8 went with its bit 4: the acknowledge is awaited'


class Halt:
    """Halts a drive until it has taken a later target.

    A set-point of mode 1 is offered while bit 8 is set, so that an earlier move cannot resume. A
    drive that does not acknowledge it gets it again in the controlword that clears bit 8, and from
    then on always so; at the end of its halt it has no other target to go to. If it does not
    acknowledge that one either, it is halted again.
    """

    def __init__(self) -> None:
        self.state = HaltState.ENDED
        self._leaving_since = 0.0
        self._delivery = completed()
        self._offered_since: float | None = None
        self._ends_in: OperationMode | None = None
        self._ends_with_offer = False  # the drive sees no set-point under halt

    @property
    def held(self) -> bool:
        """Whether the drive is halted; the next target ends the halt."""
        return self.state is not HaltState.ENDED

    @property
    def leaving(self) -> bool:
        """Whether a pending target will end the halt."""
        return self.state in (HaltState.LEAVING, HaltState.LIFTED)

    @property
    def rests(self) -> bool:
        """Whether the drive is halted and no pending target will end the halt."""
        return self.state in (HaltState.HELD, HaltState.UNANSWERED)

    def hold(self) -> None:
        """Halt; a target that would have ended an earlier halt does not end this one."""
        self._enter(HaltState.HELD)

    def release(self) -> None:
        """End the halt at once, as no earlier motion can resume."""
        self._enter(HaltState.ENDED)

    def leave(self, now: float, delivery: Promise[None]) -> None:
        """End the halt when the drive has taken the target commanded at ``now`` in [s].

        Where the drive refuses its delivery, the halt goes on.
        """
        if self.rests:
            self.state = HaltState.LEAVING
        if self.held:
            self._leaving_since, self._delivery = now, delivery

    def end_in(self, mode: OperationMode) -> None:
        """End the halt when the drive shows another mode, in which it has no target yet."""
        if self.held:
            self._ends_in = mode

    def bits(self, mode: Mode) -> int:
        """Return bit 8 while halted, for the mode that moves or last moved the drive."""
        sets = self.held and self.state is not HaltState.LIFTED and mode.halts_by_bit
        return HALT_BIT if sets else NO_BITS

    def advance(self, now: float, period: float, mode: Mode) -> bool:
        """End the halt if due, for a drive that is active in a mode.

        Returns:
            False when the drive has not taken its new target in time, and stays halted.
        """
        if self._ends_in is mode.number:
            self.release()
        if not self.leaving:
            return True
        if self._delivery.error is not None:
            self.hold()
        elif mode.taken:
            self.release()
        elif isinstance(mode, ProfilePosition) and not self._advance_offer(now, period, mode):
            if not mode.goes_on_unanswered():  # else it is not known to acknowledge anything
                return self._hold_unanswered()
            self._ends_with_offer = False
            self.release()
        elif now - self._leaving_since > RESUME_TIMEOUT:
            return self._hold_unanswered()
        return True

    def _advance_offer(self, now: float, period: float, mode: ProfilePosition) -> bool:
        """Offer a set-point under halt, then without; return False if neither is acknowledged."""
        if self._offered_since is None:
            if mode.offered:
                self._offered_since = now
                self.state = HaltState.LIFTED if self._ends_with_offer else HaltState.LEAVING
            return True
        waited, answers = now - self._offered_since, ANSWER_CYCLES * period
        if self.state is HaltState.LIFTED:
            return waited <= max(RELEASED_TIME, answers)
        if waited > max(UNDER_HALT_TIME, answers):
            self._offered_since = None
            self._ends_with_offer = True
            mode.offer_again()
        return True

    def _hold_unanswered(self) -> bool:
        self._enter(HaltState.UNANSWERED)
        self._ends_with_offer = False
        return False

    def _enter(self, state: HaltState) -> None:
        self.state = state
        self._offered_since = self._ends_in = None


REACTION_TIME = 0.5  # [s] in which a drive shows that it has got a command
UNSEEN_TIMEOUT = 1.0  # [s] for it to show anything, beside the time of the ramp
STOP_TIMEOUT = 2.0  # [s] to come to rest, beside the time of the ramp
RAMP_MAX = 10.0  # [s] that a ramp may take on the way out; then the power goes all the same
SHUTDOWN_MAX = STOP_TIMEOUT + RAMP_MAX + 2 * STOP_TIMEOUT
"""Longest time of a shutdown in [s]: to brake, to lose the power, and to run out without it."""
DISABLED = (DriveState.SWITCH_ON_DISABLED, DriveState.NOT_READY_TO_SWITCH_ON, DriveState.FAULT)
"""States without power; after UNKNOWN and in the reaction to a fault it may still move."""
MAY_MOVE = (DriveState.OPERATION_ENABLED, DriveState.UNKNOWN)
"""States in which a target may move it."""
FALLEN_RATIO = 0.98  # of the least speed so far, below which a speed is falling
SLOWING_RATIO = 0.04  # of the time of a ramp, in which more than that has to be seen


class BrakingWatch:
    """Judges from the positions of an axis whether a commanded stop slows it down."""

    def __init__(self) -> None:
        self._least = math.inf
        self._since = 0.0

    def clear(self) -> None:
        """Restart with the next speed."""
        self._least = math.inf

    def fails(self, now: float, view: AxisState, deceleration: float) -> bool:
        """Return whether the axis has failed to slow down for too long.

        The ``deceleration`` of the stop is in user units per second squared.
        """
        if not view.speed_known:
            self.clear()
            return False
        speed = max(abs(view.rate), view.rest_speed)
        if speed == view.rest_speed or speed < FALLEN_RATIO * self._least:
            self._least, self._since = speed, now
        return now - self._since > max(REACTION_TIME, SLOWING_RATIO * speed / deceleration)


class StopSequence:
    """Stops a drive and removes its power; every step has a deadline.

    A drive that does not react to its RPDO, or gets none because its device is not operational,
    is commanded by SDO; then no RPDO carries its controlword any more, which might enable it
    again. Where the SDO fails, the RPDO leaves again if it can. What its TPDOs do not show is read
    by SDO. A drive that a quick stop does not slow down loses its power.
    """

    def __init__(
        self,
        view: AxisState,
        controlword: ControlwordOutput,
        scheduler: Scheduler,
        report: Callable[[Severity, str], None],
        halt_bits: Callable[[], int],
    ) -> None:
        """Nothing runs before :meth:`begin`; ``halt_bits`` keep a drive halted meanwhile."""
        # state that the drive is led to, whatever else is commanded; None while it does not run
        self.goal: DriveState | None = None
        self._view = view
        self._controlword = controlword
        self._scheduler = scheduler
        self._send_report, self._halt_bits = report, halt_bits
        self._task: Task[None] | None = None
        self._sdo_error = ''
        self._quiet = False
        self._disables = True
        self._braking = BrakingWatch()
        self._began = self._unseen_after = 0.0

    @property
    def running(self) -> bool:
        """Whether the sequence is running."""
        return self.goal is not None

    @property
    def disabled(self) -> bool:
        """Whether feedback confirms that the drive has no power."""
        return self._view.seen and self._view.shown_state in DISABLED

    @property
    def rests(self) -> bool:
        """Whether feedback confirms that the drive stands, and no target moves it any more."""
        return self._view.stands and self._view.shown_state not in MAY_MOVE

    def ramp_time(self) -> float:
        """Return the braking time in [s] by the slower ramp."""
        return min(RAMP_MAX, self._view.speed / self._deceleration)

    @property
    def _elapsed(self) -> float:
        """Time since the current step began in [s]."""
        return self._scheduler.now - self._began

    @property
    def _deceleration(self) -> float:
        parameters = self._view.parameters
        return min(parameters.quick_stop_deceleration, parameters.profile.deceleration)

    def begin(self, *, quiet: bool = False, disables: bool = True) -> None:
        """Begin unless already running; try the RPDO first again, as it may work now.

        Args:
            quiet: Do not report failures, as the sequence is retried repeatedly.
            disables: Disable a drive that a quick stop holds at rest; one that runs does so, too.
        """
        if self.running:
            self._disables |= disables
            return
        self._quiet, self._disables = quiet, disables
        self._controlword.send_again()
        self.goal = DriveState.QUICK_STOP_ACTIVE
        self._task = self._scheduler.background(self._run())

    async def run(self, *, disables: bool = True) -> None:
        """Begin the sequence if necessary, and wait for its end."""
        if self._quiet:
            self.abandon('begun anew')  # what has failed in it may work now
        self.begin(disables=disables)
        await self.ended()

    async def confirmed(self) -> bool:
        """Return whether feedback confirms now that the drive stands without power."""
        with self._view.looking():
            return await self._within(UNSEEN_TIMEOUT, lambda: self.disabled and self.rests)

    async def seen_at_rest(self) -> bool:
        """Return whether the drive stands now, by TPDOs or else by reading its state by SDO."""
        view = self._view
        with view.looking():
            await self._within(UNSEEN_TIMEOUT, lambda: view.speed_known)
        return view.stands

    async def ended(self) -> None:
        """Wait until the sequence has ended."""
        await self._within(SHUTDOWN_MAX + REACTION_TIME, lambda: not self.running)

    def abandon(self, reason: str) -> None:
        """Cancel the sequence."""
        if self._task is not None:
            self._task.cancel(SdoError(reason))
        self.goal = None

    def use_sdo(self) -> None:
        """Command the drive by SDO from now on, as its RPDO has no effect."""
        if self._controlword.keeps_back:
            return
        self._controlword.keep_back()
        if self.running:
            self._write()

    async def _run(self) -> None:
        """Run the steps; skip those whose goal is already reached."""
        view = self._view
        self._sdo_error = ''
        self._note_sight()
        try:
            with view.looking():
                await self._lead(
                    DriveState.QUICK_STOP_ACTIVE,
                    # a motor that has only begun to follow its target still seems to stand
                    lambda: self.disabled or (self.rests and self._elapsed > WINDOW),
                    STOP_TIMEOUT + RAMP_MAX,
                )
                braked = not self._gives_up()
                if not (self.disabled or self.rests):
                    self._report_motion()
                if not self._disables and (self.rests or (braked and not self.disabled)):
                    return
                await self._lead(
                    DriveState.SWITCH_ON_DISABLED, lambda: self.disabled, STOP_TIMEOUT
                )
                if not self.disabled:
                    error = f' ({self._sdo_error})' if self._sdo_error else ''
                    self._report(f'does not show that it is disabled{error}', '. Cut its power')
                elif not await self._within(STOP_TIMEOUT, lambda: self.rests):
                    self._report('has no power, but moves on', '. Does its brake hold?')
        finally:
            self.goal = None

    async def _lead(self, goal: DriveState, done: Callable[[], bool], timeout: float) -> None:
        """Command a state; repeat by SDO if the drive does not react to its RPDO."""
        self.goal = goal
        view, self._began = self._view, self._scheduler.now
        end = self._began + timeout
        self._braking.clear()

        def left() -> float:
            return max(0.0, end - self._scheduler.now)

        def reacts() -> bool:
            return done() or self._gives_up() or (view.seen and view.shown_state not in MAY_MOVE)

        by_sdo = self._controlword.kept_back or not view.node.operational
        while True:
            if by_sdo:
                if view.node.nmt_state is NmtState.STOPPED:  # in which it takes no SDO
                    view.node.send_nmt(NmtCommand.ENTER_PRE_OPERATIONAL)
                self._controlword.keep_back()
                self._write()
            if await self._within(min(REACTION_TIME, left()), reacts) or not left():
                break
            if not by_sdo:
                self._braking.clear()  # the drive may not have got its command before
            by_sdo = True
        await self._within(left(), lambda: done() or self._gives_up())

    def _note_sight(self) -> None:
        """The drive is seen: should it fall silent, its ramp may take as long as from now on."""
        self._unseen_after = self._scheduler.now + UNSEEN_TIMEOUT + self.ramp_time()

    def _gives_up(self) -> bool:
        """Return whether the step has failed: no deceleration, or no feedback."""
        view, now = self._view, self._scheduler.now
        if not view.seen:
            return now > self._unseen_after
        self._note_sight()
        idle = view.stands and view.shown_state in MAY_MOVE
        if idle and self._elapsed > STOP_TIMEOUT:
            return True
        return self._braking.fails(now, view, self._deceleration)

    def _report_motion(self) -> None:
        """Report that rest is not confirmed: the drive moves, or sends no feedback."""
        view = self._view
        if view.seen:
            self._report('did not come to rest in time')
            return
        self._report(
            f'has sent no TPDO for {view.silence:.1f} s, and is not seen to come to rest; last',
            '. Check its power and cable',
        )

    def _report(self, what: str, remedy: str = '') -> None:
        if not self._quiet:
            view = self._view
            shown = 'nothing'
            if view.undecoded is not None or view.state is not DriveState.UNKNOWN:
                shown = view.word_text
            if view.speed_known:
                shown += f'; {view.speed:.3g} per second'
            self._send_report(Severity.ERROR, f'{what}: {shown}{remedy}')

    def _write(self) -> None:
        """Write the controlword of this step without waiting for the answer."""
        quick_stop = self.goal is DriveState.QUICK_STOP_ACTIVE
        command = Command.QUICK_STOP if quick_stop else Command.DISABLE_VOLTAGE
        # a drive without quick stop stays halted
        self._scheduler.background(self._written(command | self._halt_bits()))

    async def _written(self, command: int) -> None:
        place = self._view.at(Index.CONTROLWORD)
        try:
            await self._view.node.objects.write_object(place, 0, command, urgent=True)
        except (SdoError, CodecError) as error:
            self._sdo_error = str(error)
            if self._controlword.keeps_back and self._controlword.can_send(command):
                self._controlword.send_again()

    async def _within(self, timeout: float, condition: Callable[[], bool]) -> bool:
        """Return whether a condition holds in time, even if the cycle of the drive fails."""
        view = self._view

        def holds() -> bool:
            try:
                view.observe()
            except Exception:  # noqa: BLE001  # what made the cycle fail may last
                view.lose_sight()
            return condition()

        try:
            await self._scheduler.until(holds, timeout)
        except TimeoutError:
            return False
        return True
