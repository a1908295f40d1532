# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The loops of the programs, with a robot that only records its commands."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
import math
import os
import signal
import threading
import time
from typing import Any

from hypothesis import given
from hypothesis import strategies as st
from input_devices import InjectedDevice, InjectedDevices, xbox_pad
from input_terminal import ScriptedTerminal
import pytest

from operator_input import (
    CommandStream,
    DeadmanMapping,
    HeldKeys,
    Keyboard,
    KeyEvent,
    KeyMapping,
    ProgramRequest,
    RESTS,
    StatusPart,
    Style,
    TeleopProgram,
    TerminalError,
)
from operator_input.gamepad import Axis, Button, Deadman, Gamepad, GamepadState, Grip

STREAM_PERIOD = 0.05
COMMANDS = st.sampled_from([None, 0.1, 0.5, -0.2])
STEPS = st.lists(st.tuples(COMMANDS, st.sampled_from([0.0, 0.01, 0.03, 0.05, 0.2])), max_size=60)
Step = tuple[float | None, float]


@given(STEPS)
def test_only_what_is_wanted_is_published_at_once_and_its_end(steps: list[Step]) -> None:
    """No other velocity ever leaves but zero, and a motion only while it is wanted.

    A new velocity, and the first zero, do not wait for the next period. However it went before,
    after the end there are some zeros, and then silence.
    """
    stream, now, last = CommandStream(STREAM_PERIOD, lambda _: 0.0), 0.0, None
    for wanted, gap in steps:
        now += gap
        published = stream.step(wanted, now)
        assert published in {wanted or 0.0, None}
        if wanted != last:
            assert published == (wanted or 0.0)
        last = wanted
    rests = [stream.step(None, now + 0.01 * index) for index in range(100)]
    zeros = [velocity for velocity in rests if velocity is not None]
    assert set(zeros) <= {0.0}
    assert len(zeros) == RESTS if last is not None else len(zeros) <= RESTS
    assert stream.is_idle
    assert stream.due() == math.inf


def test_steady_velocity_is_repeated_at_the_rate() -> None:
    """A held key publishes once a period, however often it is looked at."""
    stream = CommandStream(STREAM_PERIOD, lambda _: 0.0)
    times = [0.001 * index for index in range(1000)]
    published = [stream.step(0.1, now) for now in times]
    assert sum(velocity is not None for velocity in published) == pytest.approx(20, abs=1)


@pytest.mark.parametrize('period', [0.0, -1.0, math.inf, math.nan])
def test_senseless_period_is_refused(period: float) -> None:
    """A period must be a time."""
    with pytest.raises(ValueError, match='period'):
        CommandStream(period, lambda _: 0.0)


TIMEOUT = 10.0  # [s]
PERIOD = 0.01  # [s]
ABS_Y, LEFT_SHOULDER, SOUTH = 1, 0x136, 0x130


class Record:
    """The commands of a robot, with a condition to wait for."""

    def __init__(self) -> None:
        self.commands: list[Any] = []
        self._changed = threading.Condition()

    def add(self, what: object) -> None:
        """Write something down."""
        with self._changed:
            self.commands.append(what)
            self._changed.notify_all()

    def wait_for(self, condition: Callable[[list[Any]], bool]) -> None:
        """Wait until a condition holds."""
        with self._changed:
            assert self._changed.wait_for(lambda: condition(self.commands), TIMEOUT), self.commands


class RecordedRobot:
    """Writes down."""

    def __init__(self, record: Record) -> None:
        self._record = record
        self.say: Callable[[str], None] = record.add
        self.fails = False

    def publish(self, command: object) -> None:
        """Write it down."""
        self._record.add(command)

    def handle(self, request: object, now: float) -> None:
        """Write it down."""
        assert now <= time.monotonic()
        self._record.add(request)

    def serve(self, now: float) -> None:
        """Fail when it is to."""
        assert now <= time.monotonic()
        if self.fails:
            raise RuntimeError('the robot is gone')

    def flush(self) -> None:
        """Write it down."""
        self._record.add('flush')


REQUESTS: dict[str, object] = {
    'q': ProgramRequest.QUIT,
    'z': ProgramRequest.SUSPEND,
    '?': 'nobody helps',
    'a': Button.SOUTH,
}


class Keys(KeyMapping):
    """Each held key is a command; some strokes are requests."""

    introduction = 'press i'

    def feed(self, event: KeyEvent) -> list[object]:
        """Record a key."""
        self._held.feed(event)
        return [REQUESTS[event.key]] if event.is_stroke and event.key in REQUESTS else []

    def wanted(self, now: float) -> str | None:
        """Want the held key."""
        key = self._held.current(now)
        return key if key in {'i', 'k'} else None

    def status(self, now: float) -> list[StatusPart]:
        """Show nothing much."""
        assert now <= time.monotonic()
        return [('status', Style.PLAIN)]


@contextmanager
def at_terminal() -> Any:
    """Run a program on a scripted terminal in a thread; yield terminal, robot and record."""
    record, stop = Record(), threading.Event()
    with (
        ScriptedTerminal(kitty=True) as terminal,
        Keyboard(terminal.path, evdev=False) as keyboard,
    ):
        robot, stream = RecordedRobot(record), CommandStream(PERIOD, lambda _: 'rest')
        program = TeleopProgram(keyboard, Keys(robot, HeldKeys(), stream), stop)
        ended: list[BaseException] = []

        def run() -> None:
            try:
                program.run()
            except (RuntimeError, TerminalError) as error:
                ended.append(error)

        thread = threading.Thread(target=run)
        thread.start()
        terminal.wait_written(b'press i')
        try:
            yield terminal, robot, record, ended, thread
        finally:
            stop.set()
            thread.join(TIMEOUT)


END = ['rest'] * RESTS + ['flush']


def test_a_key_moves_as_long_as_it_is_held() -> None:
    """The command is published again and again, then rests; requests go to the robot."""
    with at_terminal() as (terminal, _, record, _, thread):
        terminal.key('i', 1)
        record.wait_for(lambda commands: commands.count('i') >= 3)
        terminal.key('i', 3)
        record.wait_for(lambda commands: commands[-RESTS:] == ['rest'] * RESTS)
        terminal.send('a?')
        record.wait_for(lambda commands: commands[-1] == Button.SOUTH)
        terminal.wait_written(rb'nobody helps\r?\n')
        terminal.wait_written(rb'status \| .*true releases')
        terminal.send('q')
        thread.join(TIMEOUT)
        assert record.commands[-RESTS - 1 :] == END


@pytest.mark.parametrize('how', ['robot', 'window', 'signal'])
def test_whatever_ends_it_the_robot_rests(how: str) -> None:
    """While a key is held; an error is passed on after the rests."""
    with at_terminal() as (terminal, robot, record, ended, thread):
        terminal.key('i', 1)
        record.wait_for(lambda commands: commands.count('i') >= 2)
        if how == 'robot':
            robot.fails = True
        elif how == 'window':
            terminal.hang_up()
        if how != 'signal':  # it sets the event that is set where this block ends
            thread.join(TIMEOUT)
    error = {'robot': RuntimeError, 'window': TerminalError}.get(how)
    assert [type(each) for each in ended] == ([error] if error else [])
    assert [each for each in record.commands if each != 'i'] == END


def test_ctrl_z_rests_before_the_shell_has_the_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    """The process group is stopped with the terminal given back, and goes on after fg."""
    with at_terminal() as (terminal, _, record, _, _):
        monkeypatch.setattr(os, 'killpg', lambda group, number: record.add((group, number)))
        terminal.key('i', 1)
        record.wait_for(lambda commands: 'i' in commands)
        terminal.send('z')
        terminal.wait_written(b'going on')
        stopped = record.commands.index((0, signal.SIGTSTP))
        assert record.commands[stopped - RESTS - 1 : stopped] == END
        terminal.key('k', 1)
        record.wait_for(lambda commands: 'k' in commands)


class Sticks(DeadmanMapping):
    """The left stick, while the deadman is held; new buttons are requests."""

    def wanted(self, now: float) -> float | None:
        """Return how far the stick is away."""
        assert now <= time.monotonic()
        return None if self.grip is Grip.RELEASED else self.state.axis(Axis.LEFT_Y)

    def feed(self, state: GamepadState) -> list[Button]:
        """Record a state."""
        return list(state.pressed_since(self.take(state)))


@contextmanager
def with_pads(*pads: InjectedDevice, deadman: Deadman | None = None) -> Iterator[Record]:
    """Run a program with the pads that are there; yield the robot's record."""
    record, stop = Record(), threading.Event()
    gamepad = Gamepad(InjectedDevices(*pads), warn=record.add)
    stream = CommandStream(PERIOD, lambda _: 0.0)
    mapping = Sticks(RecordedRobot(record), deadman or Deadman(), stream, record.add)

    def run() -> None:
        with gamepad:
            TeleopProgram(gamepad, mapping, stop).run()

    thread = threading.Thread(target=run)
    thread.start()
    try:
        yield record
    finally:
        stop.set()
        thread.join(TIMEOUT)


@pytest.mark.parametrize(
    ('position', 'parameter'),
    [(-32768, 'deadman_full_deflection_timeout'), (-20000, 'deadman_timeout')],
)
def test_a_gamepad_that_does_not_change_names_the_timeout(position: int, parameter: str) -> None:
    """The motion ends, and the person reads which parameter says after which time."""
    pad = xbox_pad()
    with with_pads(pad, deadman=Deadman(timeout=0.05, full_deflection_timeout=0.05)) as record:
        pad.move(ABS_Y, position)
        pad.press(LEFT_SHOULDER)
        said = f'the gamepad has not changed for 0.05 s ({parameter}), so the motion ended'
        record.wait_for(lambda commands: any(str(one).startswith(said) for one in commands))


@pytest.mark.parametrize('unplugged', [False, True])
def test_a_gamepad_moves_with_its_deadman(unplugged: bool) -> None:
    """The stick counts while the deadman is held; then, or without the gamepad, rests follow."""
    pad = xbox_pad()
    with with_pads(pad) as record:
        pad.move(ABS_Y, -32768)
        pad.press(SOUTH)
        record.wait_for(lambda commands: commands == [Button.SOUTH])
        pad.press(LEFT_SHOULDER)
        record.wait_for(lambda commands: commands.count(1.0) >= 3)
        if unplugged:
            pad.unplug()
        else:
            pad.release(LEFT_SHOULDER)
        record.wait_for(lambda commands: commands[-RESTS:] == [0.0] * RESTS)
    assert record.commands[-1] == 'flush'
    assert pad.is_closed


def test_without_a_gamepad_it_says_so() -> None:
    """A message says what to do; nothing is published, and it ends as usual."""
    with with_pads() as record:
        record.wait_for(lambda commands: len(commands) == 1)
    assert record.commands[0].startswith('no gamepad yet: ')
    assert record.commands[1:] == ['flush']
