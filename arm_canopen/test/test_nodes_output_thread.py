# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What the cycle posts for ROS: nothing waits, nothing grows without bound, no answer is lost."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
import threading

import pytest

from arm_canopen.nodes.output_thread import OutputThread, WAITING_MAX

DEADLINE = 10.0  # [s] for what takes milliseconds
STREAMS = 5


class Log:
    """A logger that keeps what it gets."""

    def __init__(self) -> None:
        self.warnings: list[str] = []
        self.errors: list[str] = []

    def warning(self, message: str) -> None:
        """Keep a warning."""
        self.warnings.append(message)

    def error(self, message: str) -> None:
        """Keep an error."""
        self.errors.append(message)


class Slow:
    """An output thread that is held up by its first piece of work, as by a slow DDS.

    Attributes:
        done: What was run, in order.
    """

    def __init__(self) -> None:
        self.log = Log()
        self.done: list[object] = []
        self.thread = OutputThread(self.log)  # type: ignore[arg-type]
        self._gate = threading.Event()
        held_up = threading.Event()

        def hold_up() -> None:
            held_up.set()
            self._gate.wait(DEADLINE)

        self.thread.post(hold_up)
        self.thread.start()
        assert held_up.wait(DEADLINE)

    def release(self) -> None:
        """Let it work again."""
        self._gate.set()

    def go_on(self) -> None:
        """Let it work off everything, and end it."""
        self.release()
        self.thread.stop()


@pytest.fixture
def slow() -> Iterator[Slow]:
    """A thread that is held up."""
    made = Slow()
    yield made
    made.go_on()


def test_streams_do_not_grow_while_ros_is_slow(slow: Slow) -> None:
    """Of each the newest arrives in the end, and what was left out is counted in the log."""
    for number in range(20 * WAITING_MAX):
        for stream in range(STREAMS):
            slow.thread.post_stream(stream, partial(slow.done.append, (stream, number)))
    assert slow.thread.waiting <= WAITING_MAX + STREAMS
    slow.go_on()
    newest: dict[object, object] = dict(pair for pair in slow.done if isinstance(pair, tuple))
    assert newest == dict.fromkeys(range(STREAMS), 20 * WAITING_MAX - 1)
    left_out = 20 * WAITING_MAX * STREAMS - len(slow.done)
    assert len(slow.log.warnings) == 1
    assert slow.log.warnings[0].startswith(f'{left_out} messages were left out')


def test_a_stream_never_goes_back(slow: Slow) -> None:
    """Where the queue empties and fills again while the newest waits, nothing overtakes it."""
    reached, gate = threading.Event(), threading.Event()

    def hold_up_again() -> None:
        reached.set()
        gate.wait(DEADLINE)

    slow.thread.post(lambda: None)
    slow.thread.post(hold_up_again)
    for _ in range(WAITING_MAX - 2):
        slow.thread.post(lambda: None)
    slow.thread.post_stream('stream', partial(slow.done.append, 1))
    slow.release()
    assert reached.wait(DEADLINE)
    slow.thread.post_stream('stream', partial(slow.done.append, 2))
    slow.thread.post_stream('stream', partial(slow.done.append, 3))
    gate.set()
    slow.go_on()
    assert slow.done in ([3], [1, 2, 3])


def test_answers_are_never_left_out(slow: Slow) -> None:
    """However much of streams waits before them."""
    for number in range(2 * WAITING_MAX):
        slow.thread.post_stream('stream', lambda: None)
        slow.thread.post(partial(slow.done.append, number))
    slow.go_on()
    assert slow.done == list(range(2 * WAITING_MAX))


def test_nothing_is_left_out_while_ros_keeps_up(slow: Slow) -> None:
    """Every element of a stream arrives, in order."""
    for number in range(WAITING_MAX - 1):
        slow.thread.post_stream('stream', partial(slow.done.append, number))
    slow.go_on()
    assert slow.done == list(range(WAITING_MAX - 1))
    assert not slow.log.warnings


def test_a_defect_of_one_message_does_not_end_the_others(slow: Slow) -> None:
    """It is logged."""
    slow.thread.post(lambda: slow.done.append(1 // 0))
    slow.thread.post(partial(slow.done.append, 1))
    slow.go_on()
    assert slow.done == [1]
    assert 'ZeroDivisionError' in slow.log.errors[0]
