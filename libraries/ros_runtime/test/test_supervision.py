# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The supervisor's decisions and stopping in order, in virtual time."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from signal import Signals

from hypothesis import given
from hypothesis import strategies as st
import pytest

from process_supervisor import (
    Notice,
    Outcome,
    Phase,
    ProcessSpec,
    Severity,
    StartError,
    Supervision,
)
from process_supervisor.guardian import StopSequence


class Bench:
    """A supervision whose processes are names in a list."""

    def __init__(
        self,
        *specs: ProcessSpec,
        missing: str = '',
        on_interrupt: Callable[[], bool] | None = None,
    ) -> None:
        self.missing = missing
        self.started: list[str] = []
        self.sent: list[tuple[str, Signals]] = []
        self.notices: list[Notice] = []
        self.supervision = Supervision(
            specs, self._start, self._send, self.notices.append, on_interrupt=on_interrupt
        )
        self.supervision.begin(0.0)

    def _start(self, spec: ProcessSpec) -> None:
        if spec.name == self.missing:
            raise StartError('no such file')
        self.started.append(spec.name)

    def _send(self, name: str, signal: Signals) -> None:
        self.sent.append((name, signal))

    @property
    def outcome(self) -> Outcome:
        """How it ends."""
        assert self.supervision.outcome is not None
        return self.supervision.outcome


def spec(name: str, **options: object) -> ProcessSpec:
    """Describe a process that reports when it is ready."""
    values: dict[str, object] = {'notifies_ready': True, 'ready_timeout': 10.0, **options}
    return ProcessSpec(name, ('true',), **values)  # type: ignore[arg-type]


MASTER = spec('master')
SLAVES = spec('slaves', stop_order=2)
STOP = ('master', Signals.SIGTERM)


def test_all_start_at_once_and_running_means_all_are_ready() -> None:
    """No process waits for another to be ready."""
    bench = Bench(MASTER, SLAVES)
    assert bench.started == ['master', 'slaves']
    bench.supervision.ready('slaves', 1.0)
    assert bench.supervision.waiting == ('master',)
    bench.supervision.ready('master', 2.0)
    assert bench.supervision.phase is Phase.RUNNING
    assert bench.supervision.next_deadline() is None


def test_not_ready_in_time_stops_all_and_names_the_process_and_its_last_lines() -> None:
    """The outcome says who was late, by when, and what it wrote last."""
    bench = Bench(MASTER, SLAVES)
    bench.supervision.ready('slaves', 1.0)
    bench.supervision.line('master', 'waiting for panda_joint3')
    assert bench.supervision.next_deadline() == 10.0
    bench.supervision.advance(10.0)
    assert bench.supervision.phase is Phase.STOPPING
    assert bench.outcome.exit_code == 1
    assert bench.outcome.process == 'master'
    assert bench.outcome.reason.startswith('master did not get ready within 10 s')
    assert bench.outcome.last_lines == ('waiting for panda_joint3',)


@pytest.mark.parametrize('awaited', [True, False])
def test_what_is_not_required_and_late_is_reported_once_and_may_still_come(
    *, awaited: bool
) -> None:
    """A warning when its time is over, all is ready without it; then what it says of itself."""
    bench = Bench(MASTER, spec('viewer', required=False, awaited=awaited))
    bench.supervision.ready('master', 1.0)
    assert bench.supervision.waiting == (('viewer',) if awaited else ())
    assert bench.supervision.next_deadline() == 10.0
    bench.supervision.advance(10.0)
    assert bench.supervision.phase is Phase.RUNNING
    late = 'viewer did not get ready within 10 s; going on without it'
    assert Notice(Severity.WARNING, late, 'viewer') in bench.notices
    assert bench.supervision.next_deadline() is None
    bench.supervision.ready('viewer', 12.0, 'seen')
    assert bench.notices[-1].text == 'seen'


def test_an_infinite_timeout_waits_for_ever() -> None:
    """ready_timeout=inf has no deadline."""
    bench = Bench(spec('master', ready_timeout=float('inf')))
    assert bench.supervision.next_deadline() is None
    bench.supervision.advance(1e9)
    assert bench.supervision.phase is Phase.STARTING


@pytest.mark.parametrize(
    ('returncode', 'words'), [(3, 'exit code 3'), (0, 'ended'), (-11, 'SIGSEGV'), (-50, '50')]
)
def test_the_end_of_a_required_process_ends_all(returncode: int, words: str) -> None:
    """Whatever way it ends, also with exit code 0, the rest is stopped and the exit code is 1."""
    bench = Bench(MASTER, SLAVES)
    bench.supervision.exited('slaves', returncode, 1.0)
    assert bench.sent == [('master', Signals.SIGTERM)]
    assert bench.outcome.exit_code == 1
    assert words in bench.outcome.reason
    bench.supervision.exited('master', 0, 2.0)
    assert bench.supervision.phase is Phase.STOPPED


def test_the_end_of_an_optional_process_is_a_warning() -> None:
    """The bring-up goes on, and no longer waits for it."""
    bench = Bench(spec('viewer', required=False))
    bench.supervision.exited('viewer', 1, 1.0)
    assert bench.supervision.phase is Phase.RUNNING
    assert bench.notices[0].severity is Severity.WARNING


def test_a_second_interrupt_kills_everybody_and_is_no_success() -> None:
    """Forced: drives may still be enabled, so the exit code is not 0."""
    bench = Bench(SLAVES, MASTER)
    bench.supervision.interrupt(5.0)
    bench.supervision.interrupt(5.5)
    assert {('master', Signals.SIGKILL), ('slaves', Signals.SIGKILL)} < set(bench.sent)
    bench.supervision.exited('master', -9, 5.6)
    bench.supervision.exited('slaves', -9, 5.6)
    assert bench.outcome.exit_code == 1
    assert 'master had to be killed' in bench.outcome.reason


@pytest.mark.parametrize('is_taken', [False, True])
def test_an_echo_of_an_interrupt_does_nothing(*, is_taken: bool) -> None:
    """Two signals a few milliseconds apart are one: drives come to rest and are disabled.

    The first interrupt can be taken over; the next one stops, and the one after it kills.
    """
    calls: list[int] = []

    def take() -> bool:
        calls.append(1)
        return is_taken

    bench = Bench(SLAVES, MASTER, on_interrupt=take)
    for begin, sent in ((5.0, [] if is_taken else [STOP]), (6.0, [STOP] if is_taken else None)):
        if sent is not None:
            for echo in (0.0, 0.003, 0.49):
                bench.supervision.interrupt(begin + echo)
            assert (calls, bench.sent) == ([1], sent)
    bench.supervision.interrupt(7.0)
    assert {('master', Signals.SIGKILL), ('slaves', Signals.SIGKILL)} < set(bench.sent)


def test_a_process_that_does_not_stop_is_killed_in_the_end() -> None:
    """The ladder's last step is SIGKILL; a process that survives it is named."""
    bench = Bench(MASTER)
    bench.supervision.interrupt(0.0)
    while bench.supervision.phase is not Phase.STOPPED:
        deadline = bench.supervision.next_deadline()
        assert deadline is not None
        bench.supervision.advance(deadline)
    assert [signal for _, signal in bench.sent] == [
        Signals.SIGTERM,
        Signals.SIGABRT,
        Signals.SIGKILL,
    ]
    assert 'not even SIGKILL ended master' in bench.notices[-1].text


@pytest.mark.parametrize(
    ('seconds', 'reason'),
    [(1.0, 'master was killed by SIGABRT'), (30.0, 'master had to be killed')],
    ids=['crashed', 'hung'],
)
def test_a_crash_in_the_end_is_no_success(seconds: float, reason: str) -> None:
    """Its reason is another one than that of a process that was asked twice."""
    bench = Bench(MASTER)
    bench.supervision.interrupt(0.0)
    bench.supervision.advance(seconds)
    bench.supervision.exited('master', -Signals.SIGABRT, seconds)
    assert (bench.outcome.exit_code, bench.outcome.reason) == (1, reason)


def test_the_first_reason_stays() -> None:
    """What ends while everything is being stopped does not hide why."""
    bench = Bench(MASTER, SLAVES)
    bench.supervision.exited('slaves', 7, 1.0)
    bench.supervision.stop(Outcome(0, 'done'), 1.1)
    bench.supervision.exited('master', -9, 2.0)
    assert bench.outcome.reason == 'slaves ended with exit code 7 before it was ready'


def test_two_processes_of_one_name_are_refused() -> None:
    """Names are the keys of everything."""
    with pytest.raises(ValueError, match='slaves'):
        Bench(SLAVES, SLAVES)


@pytest.mark.parametrize('options', [{'argv': ()}, {'stop_steps': ()}], ids=['argv', 'steps'])
def test_a_spec_refuses_what_would_only_fail_later(options: dict[str, object]) -> None:
    """The message names the process."""
    values = {'argv': ('true',), **options}
    with pytest.raises(ValueError, match='process master'):
        ProcessSpec('master', **values)  # type: ignore[arg-type]


def test_what_is_not_awaited_keeps_nobody_waiting() -> None:
    """All is ready before it is; what it says of itself then lasts until it ends."""
    bench = Bench(MASTER, spec('viewer', required=False, awaited=False))
    assert bench.supervision.waiting == ('master',)
    bench.supervision.ready('master', 1.0)
    assert bench.supervision.phase is Phase.RUNNING
    bench.supervision.ready('viewer', 2.0, 'seen at http://localhost')
    assert bench.notices[-1] == Notice(
        Severity.INFO, 'seen at http://localhost', 'viewer', lasting=True
    )
    bench.supervision.exited('viewer', 1, 3.0)
    gone = 'viewer ended with exit code 1; it is started again in 1 s'
    assert bench.notices[-1] == Notice(Severity.WARNING, gone, 'viewer')
    assert bench.supervision.phase is Phase.RUNNING


def test_an_optional_process_that_ends_is_started_again() -> None:
    """Ever later while it ends soon; what it says of itself is said again; not while all stops."""
    bench = Bench(MASTER, spec('viewer', required=False, awaited=False))
    bench.supervision.ready('master', 0.0)
    now = 0.0
    for count, delay in enumerate([1.0, 5.0, 30.0, 30.0], 2):
        bench.supervision.ready('viewer', now, 'seen')
        assert bench.notices[-1].text == 'seen'
        bench.supervision.exited('viewer', -9, now)
        again = f'viewer was killed by SIGKILL; it is started again in {delay:g} s'
        assert bench.notices[-1] == Notice(Severity.WARNING, again, 'viewer')
        now += delay
        assert bench.supervision.next_deadline() == now
        bench.supervision.advance(now - 0.1)
        assert bench.started.count('viewer') == count - 1
        bench.supervision.advance(now)
        assert bench.started.count('viewer') == count
        assert bench.supervision.running == ('master', 'viewer')
    bench.supervision.ready('viewer', now)
    bench.supervision.exited('viewer', -9, now + 31.0)
    assert bench.notices[-1].text.endswith('again in 1 s'), 'it ran for long'
    bench.missing = 'viewer'
    bench.supervision.advance(now + 32.0)
    cannot = 'viewer cannot be started: no such file; it is started again in 5 s'
    assert bench.notices[-1].text == cannot
    bench.missing = ''
    bench.supervision.advance(now + 37.0)
    bench.supervision.exited('viewer', 1, now + 37.1)
    assert bench.notices[-1].text.endswith('again in 30 s'), 'before it was ready'
    bench.supervision.interrupt(now + 38.0)
    bench.supervision.advance(now + 100.0)
    assert bench.supervision.running == ('master',)


@pytest.mark.parametrize('required', [True, False])
def test_only_what_is_required_makes_a_failure_of_being_killed(*, required: bool) -> None:
    """A page that hangs is killed, and the robot has ended well all the same."""
    bench = Bench(MASTER, spec('viewer', required=required))
    for name in ('master', 'viewer'):
        bench.supervision.ready(name, 1.0)
    bench.supervision.interrupt(2.0)
    bench.supervision.exited('master', 0, 3.0)
    bench.supervision.exited('viewer', -Signals.SIGKILL, 4.0)
    assert bench.outcome.exit_code == (1 if required else 0)


STEPS = ((Signals.SIGINT, 5.0), (Signals.SIGTERM, 2.0), (Signals.SIGKILL, 1.0))


@dataclass
class Play:
    """Plays processes that die of one of the signals, some time after it."""

    deaths: dict[str, tuple[Signals | None, float]]
    now: float = 0.0
    sent: list[tuple[float, str, Signals]] = field(default_factory=list)
    gone: dict[str, float] = field(default_factory=dict)
    dying: dict[str, float] = field(default_factory=dict)

    def send(self, name: str, signal: Signals) -> None:
        """Note a signal; the process may die of it."""
        self.sent.append((self.now, name, signal))
        deadly, delay = self.deaths[name]
        if signal is deadly:
            self.dying[name] = self.now + delay

    def run(self, orders: dict[str, int], steps: Sequence[tuple[Signals, float]]) -> StopSequence:
        """Play until all processes have ended."""
        sequence = StopSequence(self.send)
        for name, order in orders.items():
            sequence.add(name, order, steps)
        while not sequence.finished:
            for name in [name for name, when in self.dying.items() if when <= self.now]:
                del self.dying[name]
                self.gone[name] = self.now
                sequence.exited(name)
            sequence.advance(self.now)
            deadline = sequence.next_deadline()
            times = [*self.dying.values(), *([] if deadline is None else [deadline])]
            self.now = max(self.now, min(times, default=self.now))
        return sequence


names = st.sampled_from(['master', 'joint_states', 'slaves', 'viewer'])
deaths = st.tuples(
    st.sampled_from([Signals.SIGINT, Signals.SIGTERM, Signals.SIGKILL, None]), st.floats(0, 0.9)
)


@given(st.dictionaries(names, st.tuples(st.integers(0, 2), deaths), min_size=1))
def test_lower_orders_are_gone_before_higher_ones_are_signalled(
    plan: dict[str, tuple[int, tuple[Signals | None, float]]],
) -> None:
    """No process gets a signal while one of a lower order is there, and all are dealt with."""
    orders = {name: order for name, (order, _) in plan.items()}
    play = Play({name: death for name, (_, death) in plan.items()})
    sequence = play.run(orders, STEPS)
    stubborn = {name for name, (signal, _) in play.deaths.items() if signal is None}
    assert set(sequence.abandoned) == stubborn
    assert set(play.gone) == set(plan) - stubborn
    for when, name, _ in play.sent:
        earlier = [other for other, order in orders.items() if order < orders[name]]
        assert all(play.gone.get(other, 0.0) <= when for other in earlier)


@given(deaths)
def test_each_signal_is_sent_once_and_only_as_long_as_needed(
    death: tuple[Signals | None, float],
) -> None:
    """The ladder is climbed up to the signal that the process dies of, after the time-outs."""
    play = Play({'master': death})
    play.run({'master': 0}, STEPS)
    signals = [signal for _, _, signal in play.sent]
    last = [step[0] for step in STEPS].index(death[0]) if death[0] else len(STEPS) - 1
    assert signals == [signal for signal, _ in STEPS[: last + 1]]
    times = [when for when, _, _ in play.sent]
    assert times == [sum(timeout for _, timeout in STEPS[:i]) for i in range(last + 1)]
