# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Decisions of a supervisor, without processes, clock or signal handlers."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from enum import Enum
import math
from signal import Signals

from .guardian import StopSequence
from .spec import ProcessSpec, StartError

LAST_LINES = 12  # how many lines of a process are kept to explain its end

ECHO_TIME = 0.5
"""An interrupt this soon after another one in [s] is its echo: a key that bounces, or a signal to
a process and to its group."""

RESTART_DELAYS = (1.0, 5.0, 30.0)
"""Delays in [s] before restarts of an optional process, in order; the last one repeats. They begin
anew after the process ran for longer than the last delay."""

GOOD_ENDS = (0, -Signals.SIGINT, -Signals.SIGTERM)
"""Return codes of a process that was stopped normally."""


class Phase(Enum):
    """Phase of a supervision."""

    IDLE = 'idle'
    STARTING = 'starting'
    RUNNING = 'running'
    STOPPING = 'stopping'
    STOPPED = 'stopped'


class Severity(Enum):
    """Severity of a notice."""

    INFO = 'info'
    WARNING = 'warning'
    ERROR = 'error'


@dataclass(frozen=True, slots=True)
class Notice:
    """A message to the user."""

    severity: Severity  # how loud
    text: str  # what happened, and what to do when there is something to do
    process: str = ''  # the process that it is about; empty for none
    # it stays true until there is another notice about its process, so a display keeps it in sight
    lasting: bool = False


@dataclass(frozen=True, slots=True)
class Outcome:
    """How a supervision ended."""

    exit_code: int  # 0 when it ended on request
    reason: str  # why it ended
    process: str = ''  # the process that ended it, empty when none did
    last_lines: tuple[str, ...] = ()  # what that process wrote last


@dataclass(slots=True)
class _Child:
    spec: ProcessSpec
    deadline: float
    ready: bool = False
    reported: bool = False
    running: bool = False
    started: float = -math.inf
    ends: int = 0
    restart: float = math.inf
    lines: deque[str] = field(default_factory=lambda: deque(maxlen=LAST_LINES))


class Supervision:
    """Starts all processes, waits until they are ready, stops all when a required one ends.

    An optional process that ends after it was ready is restarted. ``now`` is steady time in [s].
    """

    def __init__(
        self,
        specs: Iterable[ProcessSpec],
        start: Callable[[ProcessSpec], None],
        send: Callable[[str, Signals], None],
        notify: Callable[[Notice], None],
        *,
        on_interrupt: Callable[[], bool] | None = None,
        on_phase: Callable[[Phase], None] = lambda _: None,
    ) -> None:
        """Plan the run; nothing is started yet.

        Args:
            specs: The processes, started in this order.
            start: Starts a process; raises :class:`.StartError` if it cannot.
            send: Sends a signal to a running process.
            notify: Shows the user a notice.
            on_interrupt: Called at the first interrupt; returns True if it stops the processes
                itself, False or None to stop them at once.
            on_phase: Called when another phase begins.

        Raises:
            ValueError: Two processes have the same name.
        """
        self.phase = Phase.IDLE  # what it is doing
        self.outcome: Outcome | None = None  # how it ends; None while nothing ends it
        self._start = start
        self._notify = notify
        self._on_interrupt = on_interrupt
        self._on_phase = on_phase
        self._interrupted = math.inf
        self._begun = 0.0
        self._stopping = StopSequence(send)
        self._children: dict[str, _Child] = {}
        for spec in specs:
            if spec.name in self._children:
                raise ValueError(f'two processes are called {spec.name!r}')
            self._children[spec.name] = _Child(spec, math.inf)

    def _enter(self, phase: Phase) -> None:
        self.phase = phase
        self._on_phase(phase)

    @property
    def running(self) -> tuple[str, ...]:
        """Names of the running processes."""
        return tuple(name for name, child in self._children.items() if child.running)

    @property
    def waiting(self) -> tuple[str, ...]:
        """Names of the processes that are not ready yet."""
        return tuple(name for name in self._late_ones() if self._children[name].spec.awaited)

    def begin(self, now: float) -> None:
        """Start all processes."""
        self._enter(Phase.STARTING)
        self._begun = now
        for name, child in self._children.items():
            if why := self._run(child, now):
                self._fail(name, f'{name} {why}', now)
                return
        self._check_ready(now)

    def _run(self, child: _Child, now: float) -> str:
        """Start a process; return why it failed, empty if it runs."""
        child.deadline, child.restart = now + child.spec.ready_timeout, math.inf
        try:
            self._start(child.spec)
        except StartError as error:
            return f'cannot be started: {error}'
        child.running, child.reported, child.started = True, False, now
        child.ready = not child.spec.notifies_ready
        return ''

    def line(self, name: str, text: str) -> None:
        """Process a line of output."""
        self._children[name].lines.append(text)

    def ready(self, name: str, now: float, status: str = '') -> None:
        """Handle the readiness of a process."""
        child = self._children[name]
        if child.reported:
            return
        child.ready = child.reported = True
        if self.phase in {Phase.STARTING, Phase.RUNNING}:
            self._say(f'{name} is ready ({now - self._begun:.1f} s)')
            if status:
                self._notify(Notice(Severity.INFO, status, name, lasting=True))
            self._check_ready(now)

    def _check_ready(self, now: float) -> None:
        if self.phase is Phase.STARTING and not self.waiting:
            self._enter(Phase.RUNNING)
            self._say(f'all is ready ({now - self._begun:.1f} s)')

    def exited(self, name: str, returncode: int, now: float) -> None:
        """Handle the end of a process; a negative code is the signal that killed it."""
        child = self._children[name]
        child.running = False
        how = describe_exit(returncode)
        if self.phase is Phase.STOPPING:
            self._stopping.exited(name)
            is_good = returncode in GOOD_ENDS
            self._say(f'{name} {how}', Severity.INFO if is_good else Severity.WARNING)
            crashed = returncode < 0 and not is_good and child.spec.required
            if crashed and self.outcome and not self.outcome.exit_code:
                forced = name in self._stopping.forced
                reason = f'{name} {"had to be killed" if forced else how}'
                self.outcome = Outcome(1, reason, name, tuple(child.lines))
            self._advance_stop(now)
        elif child.spec.required:
            early = '' if child.ready else ' before it was ready'
            self._fail(name, f'{name} {how}{early}', now)
        elif child.ready or child.ends:
            if now - child.started > RESTART_DELAYS[-1]:
                child.ends = 0
            self._plan_restart(child, how, now)
        else:
            child.ready = True
            self._go_on_without(name, f'{name} {how}')
            self._check_ready(now)

    def _plan_restart(self, child: _Child, how: str, now: float) -> None:
        delay = RESTART_DELAYS[min(child.ends, len(RESTART_DELAYS) - 1)]
        child.ends, child.restart = child.ends + 1, now + delay
        text = f'{child.spec.name} {how}; it is started again in {delay:g} s'
        self._notify(Notice(Severity.WARNING, text, child.spec.name))

    def interrupt(self, now: float) -> None:
        """Handle Ctrl-C: stop in order; a second one after :data:`ECHO_TIME` kills at once."""
        if 0.0 <= now - self._interrupted < ECHO_TIME:
            return
        self._interrupted = now
        deferred, self._on_interrupt = self._on_interrupt, None
        if self.phase is Phase.STOPPING:
            self._say('forced: killing ' + ', '.join(self.running), Severity.WARNING)
            self._stopping.force(now)
        elif deferred is None or not deferred():
            self._say('stopping; Ctrl-C again kills everything at once')
            self.stop(Outcome(0, 'stopped by the user'), now)

    def stop(self, outcome: Outcome, now: float) -> None:
        """Stop everything in order; the first outcome stays."""
        if self.phase in {Phase.STOPPING, Phase.STOPPED}:
            return
        self.outcome = outcome
        self._enter(Phase.STOPPING)
        for name in self.running:
            spec = self._children[name].spec
            steps = [(step.signal, step.timeout) for step in spec.stop_steps]
            self._stopping.add(name, spec.stop_order, steps)
        self._advance_stop(now)

    def advance(self, now: float) -> None:
        """Perform the actions that are due."""
        if self.phase in {Phase.STARTING, Phase.RUNNING}:
            for child in self._children.values():
                if now >= child.restart and (why := self._run(child, now)):
                    self._plan_restart(child, why, now)
            self._check_deadlines(now)
        elif self.phase is Phase.STOPPING:
            self._advance_stop(now)

    def next_deadline(self) -> float | None:
        """Steady time in [s] at which :meth:`advance` has something to do, None for never."""
        if self.phase is Phase.STOPPING:
            return self._stopping.next_deadline()
        if self.phase not in {Phase.STARTING, Phase.RUNNING}:
            return None
        deadlines = [self._children[name].deadline for name in self._late_ones()]
        deadlines += [child.restart for child in self._children.values()]
        deadline = min(deadlines, default=math.inf)
        return None if math.isinf(deadline) else deadline

    def _check_deadlines(self, now: float) -> None:
        for name in list(self._late_ones()):
            child = self._children[name]
            if now < child.deadline:
                continue
            late = f'{name} did not get ready within {child.spec.ready_timeout:g} s'
            if child.spec.required:
                remedy = 'on a busy computer allow more with --timeout'
                self._fail(name, f'{late}; {remedy}', now)
                return
            child.ready = True
            self._go_on_without(name, late)
        self._check_ready(now)

    def _go_on_without(self, name: str, why: str) -> None:
        self._notify(Notice(Severity.WARNING, f'{why}; going on without it', name))

    def _late_ones(self) -> Iterator[str]:
        return (name for name, child in self._children.items() if not child.ready)

    def _advance_stop(self, now: float) -> None:
        self._stopping.advance(now)
        if not self._stopping.finished:
            return
        self._enter(Phase.STOPPED)
        if self._stopping.abandoned:
            names = ', '.join(self._stopping.abandoned)
            self._say(f'not even SIGKILL ended {names}', Severity.ERROR)

    def _fail(self, name: str, reason: str, now: float) -> None:
        self._say(reason, Severity.ERROR)
        self.stop(Outcome(1, reason, name, tuple(self._children[name].lines)), now)

    def _say(self, text: str, severity: Severity = Severity.INFO) -> None:
        self._notify(Notice(severity, text))


def describe_exit(returncode: int) -> str:
    """Return in words how a process ended; a negative code is the signal that killed it."""
    if returncode >= 0:
        return f'ended with exit code {returncode}' if returncode else 'ended'
    try:
        return f'was killed by {Signals(-returncode).name}'
    except ValueError:
        return f'was killed by signal {-returncode}'
