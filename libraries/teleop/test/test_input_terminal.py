# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
import signal
import subprocess
import sys
import time

from hypothesis import given
from hypothesis import strategies as st
from input_devices import InjectedDevice, InjectedDevices
from input_terminal import ScriptedTerminal
import pytest

from operator_input import (
    HeldKeys,
    KeyAction,
    Keyboard,
    KeyEvent,
    ReleaseSource,
    status_text,
    StatusLine,
    Style,
    TerminalError,
    TerminalKeyboard,
)
from operator_input.key_decoder import Kitty, Report, ReportKind
from operator_input.terminal import fitted, POP, PUSH, Stage, TerminalDialogue

ATTRIBUTES = Report(ReportKind.DEVICE_ATTRIBUTES)
ALL = Kitty(31)


def flags(value: Kitty | int) -> Report:
    """Answer the question for the flags."""
    return Report(ReportKind.KITTY_FLAGS, Kitty(value))


@pytest.mark.parametrize('got', [Kitty.DISAMBIGUATE, Kitty.EVENT_TYPES, Kitty.ALL_KEYS])
def test_half_a_protocol_is_none(got: Kitty) -> None:
    """A terminal that does not report the releases of letters gets the protocol switched off."""
    dialogue = TerminalDialogue()
    dialogue.start()
    dialogue.take(flags(0))
    dialogue.take(ATTRIBUTES)
    assert dialogue.take(flags(got)) == POP
    assert dialogue.stage is Stage.ABSENT


REPORTS = st.one_of(
    st.integers(0, 31).map(flags), st.just(ATTRIBUTES), st.just(Report(ReportKind.STATUS))
)


@given(st.lists(REPORTS, max_size=12))
def test_every_push_is_popped(reports: list[Report]) -> None:
    """Whatever a terminal answers, in the end nothing is left switched on, nor taken twice."""
    dialogue = TerminalDialogue()
    written = dialogue.start()
    for report in reports:
        written += dialogue.take(report)
    written += dialogue.stop()
    assert written.count(PUSH) == written.count(POP)
    assert written.count(PUSH) <= 1


class Paper(TerminalKeyboard):
    """Remembers what was written."""

    def __init__(self, columns: int) -> None:
        self.text = ''
        self.columns = columns

    def write(self, text: str) -> None:
        """Write."""
        self.text += text

    def width(self) -> int:
        """Return the width."""
        return self.columns


def test_the_status_line_costs_nothing_when_unchanged_and_stays_below_messages() -> None:
    """Over SSH that matters; a message erases the line, ends with a new line, and it returns."""
    paper = Paper(40)
    line = StatusLine(paper)
    for text, is_written in (('0.15 m/s', True), ('0.15 m/s', False), ('0.20 m/s', True)):
        before = paper.text
        line.show(text)
        assert (paper.text != before) is is_written
    line.message('message')
    assert paper.text.endswith('\r\x1b[Kmessage\n0.20 m/s')


def test_line_never_wraps_and_colours_change_no_words() -> None:
    """In a narrow tmux pane the line is cut, colours are switched off again."""
    paper = Paper(8)
    StatusLine(paper).show('\x1b[1mspeed 0.15 m/s\x1b[0m')
    assert paper.text == '\r\x1b[K\x1b[1mspeed 0\x1b[0m'
    parts = [('idle', Style.DIM), ('0.15 m/s', Style.PLAIN)]
    assert status_text(parts, colour=False) == 'idle | 0.15 m/s'
    assert status_text(parts, colour=True) == '\x1b[2midle\x1b[0m | 0.15 m/s'


@given(st.text(st.characters(codec='ascii', categories=['L', 'N', 'P', 'Zs'])), st.integers(0, 80))
def test_cut_text_is_a_beginning(text: str, width: int) -> None:
    """What fits is kept whole; else as many columns as there are: a wide character has two."""
    assert fitted(text, width) == text[:width]
    assert fitted('狗ab', 3) == '狗a'
    assert fitted('狗狗', 3) == '狗'


TIMEOUT = 10.0  # [s] of a test on a busy machine
KEY_Q, KEY_I, KEY_SPACE = 16, 23, 57


def read_until(
    keyboard: TerminalKeyboard | Keyboard, enough: Callable[[list[KeyEvent]], bool]
) -> list[KeyEvent]:
    """Read keys until a condition holds."""
    events: list[KeyEvent] = []
    deadline = time.monotonic() + TIMEOUT
    while not enough(events):
        assert time.monotonic() < deadline, f'only {events}'
        events += (
            keyboard.read(0.1) if isinstance(keyboard, TerminalKeyboard) else keyboard.wait(0.1)
        )
    return events


def negotiate(keyboard: TerminalKeyboard) -> Stage:
    """Read until the terminal has answered."""
    read_until(keyboard, lambda _: keyboard.stage in {Stage.ACTIVE, Stage.ABSENT})
    return keyboard.stage


def actions(events: list[KeyEvent]) -> list[tuple[str, KeyAction]]:
    """Return the actions without their times."""
    return [(event.key, event.action) for event in events]


@pytest.mark.parametrize('kitty', [True, False])
def test_terminal_is_given_back_as_it_was(kitty: bool) -> None:
    """Settings, modes and the protocol's stack are restored; nothing is left for the shell."""
    with ScriptedTerminal(kitty=kitty) as terminal:
        before = terminal.settings()
        with TerminalKeyboard(terminal.path) as keyboard:
            negotiate(keyboard)
            during = terminal.settings()
            terminal.wait_written(rb'2004h')
        terminal.wait_written(rb'2004l')
        assert during != before
        assert terminal.settings() == before
        assert (terminal.flags, terminal.modes) == ([], set())
        assert terminal.unread() == b''


def test_quick_exit_leaves_no_answer_behind() -> None:
    """Left before a slow terminal answered: its answers do not appear at the shell's prompt."""
    with ScriptedTerminal(kitty=True, delay=0.05) as terminal:
        with TerminalKeyboard(terminal.path):
            pass
        terminal.wait_answered(2)
        terminal.wait_written(rb'2004l')
        assert terminal.unread() == b''
        assert terminal.flags == []


@pytest.mark.parametrize('answers', [True, False])
def test_old_terminal(answers: bool) -> None:
    """Without the protocol, or without any answer at all, characters are typed keys."""
    with (
        ScriptedTerminal(kitty=False, answers=answers) as terminal,
        TerminalKeyboard(terminal.path) as keyboard,
    ):
        if answers:
            assert negotiate(keyboard) is Stage.ABSENT
        terminal.send('i\x03\x1b[A')
        events = read_until(keyboard, lambda found: len(found) == 3)
    assert actions(events) == [(key, KeyAction.TYPED) for key in ('i', 'ctrl+c', 'up')]


def test_cut_line_releases_the_held_key() -> None:
    """When the network is cut with a key held, the key does not stay held.

    A terminal that answers keeps a silent key held well beyond that time-out.
    """
    with ScriptedTerminal(kitty=True) as terminal, TerminalKeyboard(terminal.path) as keyboard:
        negotiate(keyboard)
        terminal.key('i', 1)
        events = read_until(keyboard, bool)
        deadline = time.monotonic() + 1.5
        while time.monotonic() < deadline:
            events += keyboard.read(0.1)
        assert actions(events) == [('i', KeyAction.PRESSED)]
        terminal.stall()
        assert actions(read_until(keyboard, bool)) == [('', KeyAction.ALL_RELEASED)]


def test_pause_gives_the_terminal_back() -> None:
    """During a pause the shell has its terminal; afterwards keys are read again."""
    with ScriptedTerminal(kitty=True) as terminal, TerminalKeyboard(terminal.path) as keyboard:
        negotiate(keyboard)
        raw = terminal.settings()
        with keyboard.paused():
            assert terminal.settings() != raw
            terminal.wait_written(rb'2004l')
            terminal.wait_written(rb'\x1b\[<u')
            assert terminal.flags == []
        assert terminal.settings() == raw
        assert negotiate(keyboard) is Stage.ACTIVE
        terminal.key('k', 1)
        assert actions(read_until(keyboard, bool)) == [('k', KeyAction.PRESSED)]


@pytest.mark.parametrize('path', ['/dev/null', '/nonexistent/tty'])
def test_no_terminal(path: str) -> None:
    """What is no terminal is refused, with what it is."""
    with pytest.raises(TerminalError, match=path), TerminalKeyboard(path):
        pass


def test_process_without_a_terminal_names_the_remedy() -> None:
    """Started as a service, without a controlling terminal, the message says what to do."""
    result = subprocess.run(
        [sys.executable, '-c', 'from operator_input.show_input import show_keys; show_keys()'],
        start_new_session=True,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=TIMEOUT * 3,
        env={'PYTHONPATH': ':'.join(sys.path)},
        check=False,
    )
    assert result.returncode == 1
    assert 'start this in a terminal' in result.stderr
    assert 'Traceback' not in result.stderr


def test_stuck_terminal_does_not_hold_the_writer_up() -> None:
    """Writing more than a terminal takes returns; the robot's loop goes on."""
    with ScriptedTerminal(kitty=False) as terminal, TerminalKeyboard(terminal.path) as keyboard:
        negotiate(keyboard)
        signal.alarm(int(TIMEOUT))
        try:
            for _ in range(100):
                keyboard.write('x' * 4096)
        finally:
            signal.alarm(0)


@contextmanager
def beside(
    devices: InjectedDevices, environment: dict[str, str] | None = None
) -> Iterator[Keyboard]:
    """Press i on an old terminal, and on the keyboard of this machine."""
    with (
        ScriptedTerminal(kitty=False) as terminal,
        Keyboard(terminal.path, devices=devices, environment=environment or {}) as keyboard,
    ):
        devices.plugged[0].press(KEY_I)
        terminal.send('i')
        yield keyboard


@pytest.mark.parametrize('unplugged', [False, True])
def test_keyboard_reports_the_release_that_the_terminal_cannot(unplugged: bool) -> None:
    """On an old terminal, the local keyboard's own word ends the hold.

    So does pulling it out with a key down: from then on time-outs take over.
    """
    device, held = InjectedDevice('AT keyboard', {KEY_Q, KEY_I, KEY_SPACE}), HeldKeys()
    devices = InjectedDevices(device)
    with beside(devices) as keyboard:
        events = read_until(
            keyboard, lambda found: any(e.action is KeyAction.PRESSED for e in found)
        )
        sources = [keyboard.release_source]
        if unplugged:
            devices.plugged.clear()
            device.unplug()
        else:
            device.release(KEY_I)
        events += read_until(keyboard, bool)
        assert unplugged or actions(events)[-1] == ('i', KeyAction.RELEASED)
        for event in events:
            held.feed(event)
        assert held.held(time.monotonic()) == ()
        sources.append(keyboard.release_source)
        after = ReleaseSource.TIME_OUT if unplugged else ReleaseSource.KEYBOARD
        assert sources == [ReleaseSource.KEYBOARD, after]
        assert device.is_closed is unplugged


def test_keyboards_are_not_read_over_ssh() -> None:
    """A person elsewhere is not at this machine's keyboard, which stays unopened."""
    devices = InjectedDevices(InjectedDevice('AT keyboard', {KEY_Q, KEY_I, KEY_SPACE}))
    with beside(devices, {'SSH_CONNECTION': '10.0.0.1 1 10.0.0.2 22'}) as keyboard:
        events = read_until(keyboard, bool)
        assert keyboard.release_source is ReleaseSource.TIME_OUT
    assert actions(events) == [('i', KeyAction.TYPED)]
