# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Sequences as coroutines in the steady time of the network, without threads or an event loop.

A boot-up or a mode switch takes many frames and waits in between. Written as a coroutine it reads
from top to bottom; the scheduler resumes it when its SDO is answered, its condition holds or its
time is up. Time is what ``advance`` got last, so tests run hours in milliseconds.
"""

from __future__ import annotations

from collections.abc import Callable, Coroutine, Generator, Sequence
import heapq
from itertools import count
from typing import Any, Generic, TypeVar

T = TypeVar('T')


class Promise(Generic[T]):
    """A result that is set later, once; coroutines of a scheduler can await it."""

    def __init__(self) -> None:
        self.done = False
        self._value: T | None = None
        self._error: BaseException | None = None
        self._callbacks: list[Callable[[Promise[T]], None]] = []

    def resolve(self, value: T) -> None:
        """Set the result; ignored if there is one already."""
        self._finish(value, None)

    def reject(self, error: BaseException) -> None:
        """Set an error as the result; ignored if there is one already."""
        self._finish(None, error)

    def follow(self, other: Promise[T]) -> None:
        """Adopt the result of another promise."""

        def finish(done: Promise[T]) -> None:
            if done.error is None:
                self.resolve(done.result())
            else:
                self.reject(done.error)

        other.when_done(finish)

    def abandon(self) -> None:
        """End without a result or callbacks, as the result is not needed any more."""
        self.done = True
        self._callbacks.clear()

    def result(self) -> T:
        """Return the result or raise the error.

        Raises:
            RuntimeError: There is no result yet.
        """
        if not self.done:
            raise RuntimeError('the promise is not done, it has no result yet')
        if self._error is not None:
            raise self._error
        return self._value  # type: ignore[return-value]  # None only where T allows it

    @property
    def error(self) -> BaseException | None:
        """Error with which it was rejected, if any."""
        return self._error

    def when_done(self, callback: Callable[[Promise[T]], None]) -> None:
        """Call ``callback`` when there is a result, at once if there is one already."""
        if self.done:
            callback(self)
        else:
            self._callbacks.append(callback)

    def __await__(self) -> Generator[Promise[T], None, T]:
        """Wait for the result inside a coroutine of a scheduler."""
        if not self.done:
            yield self
        return self.result()

    def _finish(self, value: T | None, error: BaseException | None) -> None:
        if self.done:
            return
        self.done, self._value, self._error = True, value, error
        callbacks, self._callbacks = self._callbacks, []
        for callback in callbacks:
            callback(self)


def completed() -> Promise[None]:
    """Return a promise that is already resolved."""
    promise: Promise[None] = Promise()
    promise.resolve(None)
    return promise


class Task(Promise[T]):
    """A running coroutine; its result is what the coroutine returns."""

    def __init__(self, coroutine: Coroutine[Promise[Any], None, T]) -> None:
        """Run the coroutine up to its first wait."""
        super().__init__()
        self.cancelled = False  # it was ended from outside
        self._coroutine = coroutine
        self._stepping = False
        self._step(None)

    def cancel(self, reason: BaseException) -> None:
        """End the coroutine where it waits; awaiting the task raises the reason.

        A coroutine that cancels itself while it runs ends at its next wait.
        """
        if self.done:
            return
        self.cancelled = True
        self.reject(reason)
        if not self._stepping:
            self._coroutine.close()

    def _step(self, _: Promise[Any] | None) -> None:
        if self.done:
            return
        self._stepping = True
        try:
            awaited = self._coroutine.send(None)
        except StopIteration as stop:
            self.resolve(stop.value)
        except Exception as error:  # noqa: BLE001  # handed to what awaits the task
            self.reject(error)
        else:
            if self.cancelled:
                self._coroutine.close()
            else:
                awaited.when_done(self._step)
        finally:
            self._stepping = False


class Scheduler:
    """Timers and conditions for coroutines."""

    def __init__(self, now: float = 0.0) -> None:
        self.now = now  # steady time of the last ``advance`` in [s]
        # called with the error of a coroutine that is not awaited
        self.on_defect: Callable[[BaseException], None] = lambda error: None
        self._timers: list[tuple[float, int, Promise[None]]] = []
        self._order = count()
        self._conditions: list[tuple[Callable[[], bool], Promise[None]]] = []

    def advance(self, now: float) -> None:
        """Set the time; resume coroutines whose timer has expired or whose condition holds."""
        self.set_time(now)
        while self._timers and self._timers[0][0] <= self.now:
            heapq.heappop(self._timers)[2].resolve(None)
        if self._conditions:
            self._check_conditions()

    def set_time(self, now: float) -> None:
        """Set the time without resuming tasks, so that new timers start from it."""
        self.now = max(self.now, now)

    def next_deadline(self) -> float | None:
        """Return the time of the next timer in [s], None if there is none."""
        while self._timers and self._timers[0][2].done:
            heapq.heappop(self._timers)
        return self._timers[0][0] if self._timers else None

    def spawn(self, coroutine: Coroutine[Promise[Any], None, T]) -> Task[T]:
        """Start a coroutine now; return its task, which the caller awaits or checks."""
        return Task(coroutine)

    def background(self, coroutine: Coroutine[Promise[Any], None, None]) -> Task[None]:
        """Start a coroutine that is not awaited; an error in it is reported as a defect."""
        task = Task(coroutine)
        task.when_done(self._check_background)
        return task

    def timer(self, delay: float) -> Promise[None]:
        """Return a promise that is resolved after a delay in [s]."""
        promise: Promise[None] = Promise()
        heapq.heappush(self._timers, (self.now + delay, next(self._order), promise))
        return promise

    async def wait(self, promise: Promise[T], timeout: float) -> T:
        """Wait for a promise for at most a time in [s].

        Raises:
            TimeoutError: No result within ``timeout``.
        """
        first: Promise[None] = Promise()
        timer = self.timer(timeout)
        promise.when_done(lambda _: first.resolve(None))
        timer.when_done(lambda _: first.resolve(None))
        try:
            await first
        finally:
            timer.abandon()  # no deadline is left, also when the task is cancelled
        if not promise.done:
            raise TimeoutError(f'nothing within {timeout:g} s')
        return promise.result()

    async def until(self, condition: Callable[[], bool], timeout: float) -> None:
        """Wait until a condition holds; it is checked whenever time advances.

        Raises:
            TimeoutError: It did not hold within the time-out in [s].
        """
        if condition():
            return
        promise: Promise[None] = Promise()
        entry = (condition, promise)
        self._conditions.append(entry)
        try:
            await self.wait(promise, timeout)
        finally:
            if entry in self._conditions:
                self._conditions.remove(entry)

    async def gather(self, tasks: Sequence[Promise[T]]) -> list[T]:
        """Wait for all tasks; return their results, or raise the first error in their order."""
        for task in tasks:
            await self._end_of(task)
        return [task.result() for task in tasks]

    @staticmethod
    def _end_of(task: Promise[Any]) -> Promise[None]:
        """Return a promise that is resolved when the task ends, with or without an error."""
        end: Promise[None] = Promise()
        task.when_done(lambda _: end.resolve(None))
        return end

    def _check_background(self, task: Promise[None]) -> None:
        cancelled = isinstance(task, Task) and task.cancelled
        if task.error is not None and not cancelled:
            self.on_defect(task.error)

    def _check_conditions(self) -> None:
        for entry in list(self._conditions):
            condition, promise = entry
            try:
                ready = condition()
            except Exception as error:  # noqa: BLE001  # belongs to what waits for it
                promise.reject(error)
                continue
            if ready:
                promise.resolve(None)
