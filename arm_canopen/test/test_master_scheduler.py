# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Coroutines in a time that the test hands in: promises, timers, waits and cancellation."""

from __future__ import annotations

from collections.abc import Awaitable

from hypothesis import given
from hypothesis import strategies as st
import pytest

from arm_canopen import Promise, Scheduler, SdoError
from arm_canopen.master.scheduler import Task


def test_a_promise_keeps_its_first_end() -> None:
    """Later results and errors are ignored, also from its own callbacks; each is called once."""
    promise: Promise[int] = Promise()
    received: list[str] = []
    promise.when_done(lambda done: done.resolve(9))
    promise.when_done(lambda _: received.append('first'))
    promise.when_done(lambda _: received.append('second'))
    with pytest.raises(RuntimeError, match='not done'):
        promise.result()
    promise.resolve(1)
    promise.when_done(lambda _: received.append('late'))
    promise.resolve(2)
    promise.reject(SdoError('late'))
    assert (promise.result(), promise.error) == (1, None)
    assert received == ['first', 'second', 'late']


def test_a_coroutine_runs_to_its_first_wait_at_once() -> None:
    """Its error can be caught where it is awaited; it is raised whenever the result is read."""
    steps: list[str] = []

    async def inner(gate: Promise[int]) -> int:
        steps.append('started')
        value = await gate
        if value < 0:
            raise SdoError('inside')
        return value + 1

    async def outer(gate: Promise[int]) -> object:
        try:
            return await inner(gate)
        except SdoError as error:
            return f'caught {error}'

    for value, expected in ((4, 5), (-1, 'caught inside')):
        gate: Promise[int] = Promise()
        task, failing = (Scheduler().spawn(run(gate)) for run in (outer, inner))
        assert (steps, task.done) == (['started'] * 2, False)
        steps.clear()
        gate.resolve(value)
        assert task.result() == expected
    for _ in range(2):
        with pytest.raises(SdoError, match='inside'):
            failing.result()


def test_an_error_in_the_background_is_reported() -> None:
    """At its start or later; neither a result nor a cancellation is one."""
    reported: list[type[BaseException]] = []
    scheduler = Scheduler()
    scheduler.on_defect = lambda error: reported.append(type(error))
    gate: Promise[None] = Promise()

    async def broken_at_once() -> None:
        raise ZeroDivisionError

    async def broken_later() -> None:
        await gate
        raise KeyError

    async def sleeper() -> None:
        await scheduler.timer(1.0)

    scheduler.background(broken_at_once())
    scheduler.background(broken_later())
    scheduler.background(sleeper()).cancel(SdoError('enough'))
    scheduler.background(sleeper())
    gate.resolve(None)
    scheduler.advance(1.0)
    assert reported == [ZeroDivisionError, KeyError]


def test_timers_resume_in_the_order_of_their_times() -> None:
    """Equal times resume in the order in which they were requested, none too early."""
    scheduler = Scheduler(10.0)
    order: list[str] = []

    async def sleeper(name: str, delay: float) -> None:
        await scheduler.timer(delay)
        order.append(name)

    for name, delay in (('c', 3.0), ('a', 1.0), ('b1', 2.0), ('b2', 2.0)):
        scheduler.spawn(sleeper(name, delay))
    for now, expected in ((10.99, ''), (12.0, 'a b1 b2'), (13.0, 'a b1 b2 c')):
        scheduler.advance(now)
        assert ' '.join(order) == expected
    scheduler.advance(3.0)  # time does not go back
    assert scheduler.now == 13.0


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


def test_waiting_ends_once() -> None:
    """With the result, with its error or with the time-out, whichever is first."""
    for steps, expected in (
        ([('resolve', 7)], 7),
        ([('reject', SdoError('x'))], SdoError),
        ([('advance', 1.0)], TimeoutError),
        ([('advance', 0.999), ('resolve', 7)], 7),
        ([('advance', 1.0), ('resolve', 7)], TimeoutError),
    ):
        scheduler = Scheduler()
        promise: Promise[int] = Promise()
        task = scheduler.spawn(scheduler.wait(promise, 1.0))
        assert scheduler.next_deadline() == 1.0, steps
        for name, value in steps:
            getattr(scheduler if name == 'advance' else promise, name)(value)
        assert scheduler.next_deadline() is None, steps
        scheduler.advance(5.0)
        assert (type(task.error) if task.error else task.result()) == expected, steps


def test_until_looks_whenever_time_advances() -> None:
    """What holds already does not wait; one that holds, times out or is cancelled is forgotten."""
    scheduler = Scheduler()
    flag: list[bool] = []
    checked: list[float] = []

    def never() -> bool:
        checked.append(scheduler.now)
        return False

    assert scheduler.spawn(scheduler.until(lambda: True, 1.0)).done
    task = scheduler.spawn(scheduler.until(lambda: bool(flag), 1.0))
    late = scheduler.spawn(scheduler.until(never, 1.0))
    scheduler.spawn(scheduler.wait(Promise[int](), 0.1)).cancel(SdoError('enough'))
    scheduler.advance(0.5)
    assert not task.done
    flag.append(True)
    scheduler.advance(0.5)
    assert task.done
    scheduler.advance(1.0)
    assert isinstance(late.error, TimeoutError)
    count = len(checked)
    scheduler.advance(2.0)
    assert len(checked) == count
    assert scheduler.next_deadline() is None


def test_a_condition_that_raises_ends_its_own_task_only() -> None:
    """The others, and the time, go on; a task that is resumed may wait again."""
    scheduler = Scheduler()
    order: list[str] = []

    def defect() -> bool:
        if scheduler.now > 0.0:
            raise ZeroDivisionError
        return False

    async def two_steps(name: str) -> None:
        await scheduler.until(lambda: scheduler.now >= 1.0, 9.0)
        order.append(f'{name}1')
        await scheduler.until(lambda: scheduler.now >= 2.0, 9.0)
        order.append(f'{name}2')

    first = scheduler.spawn(scheduler.until(defect, 9.0))
    for name in 'ab':
        scheduler.spawn(two_steps(name))
    scheduler.advance(1.0)
    scheduler.advance(2.0)
    assert isinstance(first.error, ZeroDivisionError)
    assert order == ['a1', 'b1', 'a2', 'b2']


@given(st.permutations(range(5)), st.sets(st.integers(0, 4)))
def test_gather_waits_for_all(order: list[int], failing: set[int]) -> None:
    """Results come in the order of the tasks, whatever ended first; else the first error does."""
    scheduler = Scheduler()
    promises: list[Promise[int]] = [Promise() for _ in range(5)]
    task = scheduler.spawn(scheduler.gather(promises))
    for position in order:
        assert not task.done
        if position in failing:
            promises[position].reject(SdoError(str(position)))
        else:
            promises[position].resolve(position)
    if failing:
        assert str(task.error) == str(min(failing))
    else:
        assert task.result() == [0, 1, 2, 3, 4]


def test_cancelling_runs_what_must_be_run() -> None:
    """Clean-up code runs at once, and whoever awaits gets the first reason."""
    scheduler = Scheduler()
    seen: list[str] = []

    async def cleaning(name: str, awaited: Awaitable[object]) -> int:
        try:
            await awaited
        finally:
            seen.append(name)
        return 3

    def waiting(seconds: float, *names: str) -> Task[int]:
        awaited: Awaitable[object] = scheduler.timer(seconds)
        for name in names:
            awaited = cleaning(name, awaited)
        return scheduler.spawn(awaited)  # type: ignore[arg-type]

    task = waiting(1.0, 'inner', 'outer')
    behind = scheduler.spawn(cleaning('behind', task))
    task.cancel(SdoError('enough'))
    task.cancel(SdoError('second'))
    assert str(task.error) == str(behind.error) == 'enough'
    assert sorted(seen) == ['behind', 'inner', 'outer']
    # neither the task that one waits for ends, nor one that has ended already
    other = waiting(1.0, 'other')
    task = scheduler.spawn(cleaning('cancelled', other))
    task.cancel(SdoError('enough'))
    scheduler.advance(1.0)
    other.cancel(SdoError('late'))
    assert other.result() == 3
    assert isinstance(task.error, SdoError)
    assert seen[3:] == ['cancelled', 'other']


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
