# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Coroutines in virtual time: promises, timers, conditions, ends and mishaps."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

from hypothesis import given
from hypothesis import strategies as st
import pytest

from arm_canopen import SdoError
from arm_canopen.master.scheduler import Promise, Scheduler, Task

Act: TypeAlias = Callable[[Scheduler, Promise[int]], None]


def test_a_promise_keeps_its_first_result() -> None:
    """Later results and errors are ignored."""
    promise: Promise[int] = Promise()
    promise.resolve(1)
    promise.resolve(2)
    promise.reject(SdoError('late'))
    assert promise.result() == 1
    assert promise.error is None


def test_a_rejected_promise_raises_each_time() -> None:
    """The error is raised as often as the result is read."""
    promise: Promise[int] = Promise()
    promise.reject(SdoError('no'))
    for _ in range(2):
        with pytest.raises(SdoError, match='no'):
            promise.result()


def test_a_promise_without_a_result_has_none_to_give() -> None:
    """Asking too early is a mistake of the program, and no None."""
    promise: Promise[int] = Promise()
    with pytest.raises(RuntimeError, match='not done'):
        promise.result()


def test_callbacks_are_called_once_before_or_after() -> None:
    """A callback gets the end exactly once, in order, also when it comes too late."""
    promise: Promise[int] = Promise()
    received: list[str] = []
    promise.when_done(lambda _: received.append('first'))
    promise.when_done(lambda _: received.append('second'))
    promise.resolve(1)
    promise.when_done(lambda _: received.append('late'))
    promise.resolve(2)
    assert received == ['first', 'second', 'late']


def test_a_callback_may_resolve_the_promise_again() -> None:
    """Re-entrance changes nothing."""
    promise: Promise[int] = Promise()
    promise.when_done(lambda done: done.resolve(9))
    promise.resolve(1)
    assert promise.result() == 1


def test_a_coroutine_runs_to_its_first_wait_at_once() -> None:
    """Spawning starts; the result is that of the coroutine."""
    steps: list[int] = []

    async def sequence(gate: Promise[int]) -> int:
        steps.append(1)
        value = await gate
        steps.append(2)
        return value + 1

    gate: Promise[int] = Promise()
    task = Scheduler().spawn(sequence(gate))
    assert steps == [1]
    assert not task.done
    gate.resolve(4)
    assert steps == [1, 2]
    assert task.result() == 5


def test_an_error_in_a_coroutine_belongs_to_whoever_awaits() -> None:
    """It passes through awaiting coroutines and can be caught there."""

    async def inner() -> None:
        raise SdoError('inside')

    async def outer() -> str:
        try:
            await inner()
        except SdoError as error:
            return f'caught {error}'
        return 'nothing'

    assert Scheduler().spawn(outer()).result() == 'caught inside'
    assert isinstance(Scheduler().spawn(inner()).error, SdoError)


def test_an_error_in_the_background_is_reported() -> None:
    """What nobody awaits does not die in silence, at its start or later."""
    reported: list[type[BaseException]] = []
    scheduler = Scheduler()
    scheduler.on_defect = lambda error: reported.append(type(error))
    gate: Promise[None] = Promise()

    async def broken_at_once() -> None:
        raise ZeroDivisionError

    async def broken_later() -> None:
        await gate
        raise KeyError

    scheduler.background(broken_at_once())
    scheduler.background(broken_later())
    gate.resolve(None)
    assert reported == [ZeroDivisionError, KeyError]


def test_what_ends_well_or_on_purpose_in_the_background_is_no_defect() -> None:
    """Neither a result nor a cancellation is reported."""
    reported: list[BaseException] = []
    scheduler = Scheduler()
    scheduler.on_defect = reported.append

    async def sleeper() -> None:
        await scheduler.timer(1.0)

    scheduler.background(sleeper()).cancel(SdoError('enough'))
    scheduler.background(sleeper())
    scheduler.advance(1.0)
    assert reported == []


def test_timers_resume_in_the_order_of_their_times() -> None:
    """Equal times resume in the order in which they were requested, none too early."""
    scheduler = Scheduler(10.0)
    order: list[str] = []

    async def sleeper(name: str, delay: float) -> None:
        await scheduler.timer(delay)
        order.append(name)

    for name, delay in (('c', 3.0), ('a', 1.0), ('b1', 2.0), ('b2', 2.0)):
        scheduler.spawn(sleeper(name, delay))
    scheduler.advance(10.99)
    assert order == []
    scheduler.advance(12.0)
    assert order == ['a', 'b1', 'b2']
    scheduler.advance(13.0)
    assert order == ['a', 'b1', 'b2', 'c']


@given(st.lists(st.floats(0.0, 100.0), max_size=20), st.lists(st.floats(0.0, 30.0), max_size=20))
def test_the_next_deadline_is_the_earliest_timer(delays: list[float], jumps: list[float]) -> None:
    """However time passes, the deadline is the minimum of the timers that wait."""
    scheduler = Scheduler()
    timers = [(delay, scheduler.timer(delay)) for delay in delays]
    for jump in jumps:
        scheduler.advance(scheduler.now + jump)
        waiting = [time for time, timer in timers if not timer.done]
        assert all(time > scheduler.now for time in waiting)
        assert scheduler.next_deadline() == (min(waiting) if waiting else None)


def test_time_does_not_go_back() -> None:
    """An earlier time changes nothing."""
    scheduler = Scheduler(5.0)
    scheduler.advance(3.0)
    assert scheduler.now == 5.0


@pytest.mark.parametrize(
    ('act', 'expected'),
    [
        (lambda s, p: p.resolve(7), 7),
        (lambda s, p: p.reject(SdoError('x')), SdoError),
        (lambda s, p: s.advance(1.0), TimeoutError),
        (lambda s, p: (s.advance(0.999), p.resolve(7)), 7),
        (lambda s, p: (s.advance(1.0), p.resolve(7)), TimeoutError),
    ],
    ids=['result', 'error', 'time-out', 'just in time', 'too late'],
)
def test_waiting_ends_once(act: Act, expected: object) -> None:
    """With the result, with its error or with the time-out, whichever is first."""
    scheduler = Scheduler()
    promise: Promise[int] = Promise()
    outcome: list[object] = []

    async def sequence() -> None:
        try:
            value = await scheduler.wait(promise, 1.0)
            outcome.append(value)
        except (TimeoutError, SdoError) as error:
            outcome.append(type(error))

    scheduler.spawn(sequence())
    act(scheduler, promise)
    scheduler.advance(5.0)
    assert outcome == [expected]


def test_a_wait_that_ended_leaves_no_deadline() -> None:
    """Nobody is woken for the time-out of an answer that came."""
    scheduler = Scheduler()
    promise: Promise[int] = Promise()
    task = scheduler.spawn(scheduler.wait(promise, 1.0))
    assert scheduler.next_deadline() == 1.0
    promise.resolve(1)
    assert task.done
    assert scheduler.next_deadline() is None


def test_a_wait_that_was_cancelled_leaves_no_deadline() -> None:
    """Nor for the time-out of what nobody waits for any more."""
    scheduler = Scheduler()
    task = scheduler.spawn(scheduler.wait(Promise[int](), 1.0))
    task.cancel(SdoError('enough'))
    assert scheduler.next_deadline() is None


def test_until_looks_whenever_time_advances() -> None:
    """A condition that holds already does not wait; another one ends it at the next look."""
    scheduler = Scheduler()
    flag: list[bool] = []
    assert scheduler.spawn(scheduler.until(lambda: True, 1.0)).done
    task = scheduler.spawn(scheduler.until(lambda: bool(flag), 1.0))
    scheduler.advance(0.5)
    assert not task.done
    flag.append(True)
    scheduler.advance(0.5)
    assert task.done
    assert scheduler.next_deadline() is None


def test_until_times_out_and_is_forgotten() -> None:
    """After the time-out the condition is not checked again."""
    scheduler = Scheduler()
    checked: list[float] = []

    def condition() -> bool:
        checked.append(scheduler.now)
        return False

    task = scheduler.spawn(scheduler.until(condition, 1.0))
    scheduler.advance(1.0)
    assert isinstance(task.error, TimeoutError)
    count = len(checked)
    scheduler.advance(2.0)
    assert len(checked) == count


def test_a_condition_that_raises_ends_its_own_task_only() -> None:
    """The others, and the time, go on."""
    scheduler = Scheduler()

    def defect() -> bool:
        if scheduler.now > 0.0:
            raise ZeroDivisionError
        return False

    first = scheduler.spawn(scheduler.until(defect, 9.0))
    second = scheduler.spawn(scheduler.until(lambda: scheduler.now >= 1.0, 9.0))
    scheduler.advance(1.0)
    scheduler.advance(2.0)
    assert isinstance(first.error, ZeroDivisionError)
    assert second.done
    assert second.error is None


def test_conditions_resumed_together_may_wait_again() -> None:
    """A task resumed by a condition adds the next one without disturbing the others."""
    scheduler = Scheduler()
    order: list[str] = []

    async def two_steps(name: str) -> None:
        await scheduler.until(lambda: scheduler.now >= 1.0, 9.0)
        order.append(f'{name}1')
        await scheduler.until(lambda: scheduler.now >= 2.0, 9.0)
        order.append(f'{name}2')

    for name in 'ab':
        scheduler.spawn(two_steps(name))
    scheduler.advance(1.0)
    scheduler.advance(2.0)
    assert order == ['a1', 'b1', 'a2', 'b2']


def test_gather_waits_for_all_and_raises_the_first_error() -> None:
    """Also those after a failed one are waited for."""
    scheduler = Scheduler()
    promises: list[Promise[int]] = [Promise() for _ in range(3)]
    task = scheduler.spawn(scheduler.gather(promises))
    promises[1].reject(SdoError('second'))
    promises[2].reject(SdoError('third'))
    assert not task.done
    promises[0].resolve(1)
    assert isinstance(task.error, SdoError)
    assert str(task.error) == 'second'


@given(st.permutations(range(5)))
def test_gather_keeps_the_order_of_the_tasks(order: list[int]) -> None:
    """Results come in the order of the arguments, whatever ended first."""
    scheduler = Scheduler()
    promises: list[Promise[int]] = [Promise() for _ in range(5)]
    task = scheduler.spawn(scheduler.gather(promises))
    for position in order:
        promises[position].resolve(position)
    assert task.result() == [0, 1, 2, 3, 4]


def test_cancelling_runs_what_must_be_run() -> None:
    """Clean-up code runs at once, and whoever awaits gets the reason."""
    scheduler = Scheduler()
    cleaned: list[str] = []

    async def inner() -> None:
        try:
            await scheduler.timer(1.0)
        finally:
            cleaned.append('inner')

    async def outer() -> None:
        try:
            await inner()
        finally:
            cleaned.append('outer')

    task = scheduler.spawn(outer())
    task.cancel(SdoError('enough'))
    assert cleaned == ['inner', 'outer']
    assert isinstance(task.error, SdoError)
    scheduler.advance(2.0)
    assert cleaned == ['inner', 'outer']


def test_cancelling_the_task_that_waits_for_another_leaves_that_one() -> None:
    """Only what was cancelled ends."""
    scheduler = Scheduler()

    async def long() -> int:
        await scheduler.timer(1.0)
        return 3

    other = scheduler.spawn(long())

    async def waits() -> int:
        return await other

    task = scheduler.spawn(waits())
    task.cancel(SdoError('enough'))
    scheduler.advance(1.0)
    assert other.result() == 3
    assert isinstance(task.error, SdoError)


def test_cancelling_twice_or_after_the_end_changes_nothing() -> None:
    """A result stays; the first reason stays."""
    scheduler = Scheduler()

    async def at_once() -> int:
        return 1

    done = scheduler.spawn(at_once())
    done.cancel(SdoError('late'))
    assert done.result() == 1
    task = scheduler.spawn(scheduler.gather([Promise[int]()]))
    task.cancel(SdoError('first'))
    task.cancel(SdoError('second'))
    assert str(task.error) == 'first'


def test_a_task_may_be_cancelled_while_it_runs() -> None:
    """A sequence that ends itself over some corner stops at its next wait."""
    scheduler = Scheduler()
    gate: Promise[None] = Promise()
    seen: list[str] = []

    async def sequence() -> None:
        await gate
        tasks[0].cancel(SdoError('ended from inside'))
        seen.append('to the next wait')
        try:
            await scheduler.timer(1.0)
        finally:
            seen.append('clean-up')
        seen.append('beyond')

    tasks: list[Task[None]] = []
    tasks.append(scheduler.spawn(sequence()))
    gate.resolve(None)
    scheduler.advance(5.0)
    assert seen == ['to the next wait', 'clean-up']
    assert str(tasks[0].error) == 'ended from inside'


def test_a_reason_reaches_whoever_awaits_a_cancelled_task() -> None:
    """Awaiting a cancelled task raises the reason, as in a preempted command."""
    scheduler = Scheduler()

    async def long() -> None:
        await scheduler.timer(9.0)

    task = scheduler.spawn(long())

    async def waits() -> str:
        try:
            await task
        except SdoError as error:
            return str(error)
        return 'nothing'

    waiting = scheduler.spawn(waits())
    task.cancel(SdoError('why'))
    assert waiting.result() == 'why'
