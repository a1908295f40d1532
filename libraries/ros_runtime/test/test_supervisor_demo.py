# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A demo beside a small real process: its table or lines, its summary and its exit code."""

from __future__ import annotations

from collections.abc import Callable, Sequence
import io

import pytest
from rich.console import Console, RenderableType
from rich.text import Text
from small_processes import program

from process_supervisor import (
    CallError,
    GivenUpError,
    LineWriter,
    Notice,
    Outcome,
    Painter,
    Phase,
    Severity,
)
from process_supervisor import demo as demo_module
from process_supervisor.demo import Demo, run_demo, second_terminal


class Client:
    """Waits for a condition, and receives nothing."""

    closed = False

    def __init__(self, given_up: Callable[[], bool]) -> None:
        self.given_up = given_up

    def wait_until(self, condition: Callable[[], bool], timeout: float, what: str) -> None:
        """Wait until it is no longer wanted."""
        while not condition():
            if self.given_up():
                raise GivenUpError(what)

    def listen(self, duration: float) -> None:
        """Nothing comes in."""

    def close(self) -> None:
        """Close."""
        Client.closed = True


class Dance(Demo):  # type: ignore[type-arg]  # its client is no node
    """Dances on three widgets, and ends as it is to."""

    lines = 14
    error = ''
    found: Sequence[str] = ()

    def __init__(self) -> None:
        super().__init__('widgets on vcan0', ['ros2 topic hz /joint_states'])

    def join(self, given_up: Callable[[], bool]) -> Client:
        """Make the client."""
        return Client(given_up)

    def perform(self) -> None:
        """Dance."""
        self.enter('dancing')
        self.summary, self.problems, self.warnings = ['danced 3 s'], self.found, ['wet floor']
        if self.error:
            raise CallError(self.error)

    def table(self, width: int) -> Sequence[RenderableType]:
        """Draw one line."""
        return [Text('3 widgets')]

    def progress(self) -> str:
        """Count them."""
        return '3 widgets run'


class Utf8(io.StringIO):
    """A file of a terminal."""

    encoding = 'utf-8'


class Latin1(io.StringIO):
    """A file that has no dots and lines."""

    encoding = 'iso8859-1'


def screen(
    file: io.StringIO, size: tuple[int, int] = (80, 40), *, terminal: bool = True
) -> tuple[demo_module._Screen, io.StringIO]:
    """Return the screen of a demo, and where its lines go."""
    width, height = size
    console = Console(
        file=file, force_terminal=terminal, width=width, height=height, color_system=None
    )
    lines = io.StringIO()
    painter = Painter('demo', ['master'], colour=False)
    return demo_module._Screen(Dance(), console, LineWriter(lines), painter), lines


@pytest.mark.parametrize(
    'case',
    [
        (Utf8(), True, 'xterm', (80, 24), True),
        (Utf8(), False, 'xterm', (80, 24), False),
        (Utf8(), True, 'dumb', (80, 24), False),
        (Latin1(), True, 'xterm', (80, 24), False),
        (Utf8(), True, 'xterm', (60, 24), False),
        (Utf8(), True, 'xterm', (80, 10), False),
    ],
    ids=['terminal', 'pipe', 'dumb', 'no unicode', 'narrow', 'low'],
)
def test_the_table_is_for_terminals_that_have_room_for_it(
    monkeypatch: pytest.MonkeyPatch, case: tuple[io.StringIO, bool, str, tuple[int, int], bool]
) -> None:
    """Everything else gets lines; a line says so where the terminal is too small."""
    file, terminal, term, size, is_table = case
    monkeypatch.setenv('TERM', term)
    shown, lines = screen(file, size, terminal=terminal)
    shown.close()
    assert (shown.live is not None) == is_table
    assert ('too few' in lines.getvalue()) == (size != (80, 24))


def test_lines_show_phases_warnings_and_notices() -> None:
    """Information of the processes is left out: it would bury the rest."""
    shown, lines = screen(Utf8(), terminal=False)
    shown.enter('booting')
    shown.line('master', '[INFO] [master]: joint1 operational')
    shown.line('master', '[WARN] [master]: joint2 silent')
    shown.line('master', 'Traceback (most recent call last):')
    shown.notice(Notice(Severity.INFO, 'all is ready'))
    shown.show()  # too soon after a phase
    text = lines.getvalue()
    for words in ('widgets on vcan0', 'booting', 'joint2 silent', 'Traceback', 'all is ready'):
        assert words in text
    for words in ('joint1 operational', 'widgets run'):
        assert words not in text


def test_the_table_shows_what_was_said_last_and_stays_when_it_is_closed() -> None:
    """After the end it has no commands to be tried any more."""
    file = Utf8()
    shown, _ = screen(file)
    shown.enter('waving')
    shown.line('master', '[INFO] [master]: joint1 operational')
    shown.line('master', '[ERROR] [master]: heartbeat lost')
    shown.notice(Notice(Severity.INFO, 'stopping'))
    shown.show()
    shown.close()
    pictures = file.getvalue().split('widgets on vcan0')
    waving = [picture for picture in pictures if 'waving' in picture][-1]
    for words in ('waving', 'heartbeat lost', 'stopping', 'ros2 topic hz', '3 widgets'):
        assert words in waving
    assert 'joint1 operational' not in file.getvalue()
    assert 'ended' in pictures[-1]
    assert 'ros2 topic hz' not in pictures[-1]
    length = len(file.getvalue())
    shown.show()
    assert len(file.getvalue()) == length


def test_what_lasts_stays_in_the_table_until_its_process_says_something_else() -> None:
    """The URL of a page, until the page is gone; other notices come and go."""
    file = Utf8()
    shown, _ = screen(file)
    shown.notice(Notice(Severity.INFO, 'seen at http://localhost:8080', 'viewer', lasting=True))
    for number in range(20):
        shown.notice(Notice(Severity.INFO, f'notice {number}'))
    shown.enter('waving')
    assert 'http://localhost:8080' in file.getvalue().split('widgets on vcan0')[-1]
    shown.notice(Notice(Severity.WARNING, 'viewer ended', 'viewer'))
    last = file.getvalue().split('widgets on vcan0')[-1]
    assert 'viewer ended' in last
    assert 'http://localhost:8080' not in last
    shown.close()


def test_a_full_terminal_is_not_exceeded_and_commands_can_be_copied(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """What stands below the table gets the room that is left; the domain comes first."""
    monkeypatch.setenv('ROS_DOMAIN_ID', '7')
    assert second_terminal(['x']) == ['source env.sh; export ROS_DOMAIN_ID=7', 'x']
    for height in (14, 16, 20):
        file = Utf8()
        shown, _ = screen(file, (80, height))
        for number in range(4):
            shown.notice(Notice(Severity.WARNING, f'notice {number}'))
        picture = shown._picture(80, height)
        console = Console(file=io.StringIO(), width=80, height=height)
        drawn = console.render_lines(picture)
        assert len(drawn) <= 2 + height - Dance.lines  # title, one line of table, and the rest
        shown.close()


def dance(scenario: type[Dance]) -> int:
    """Run a demo with one process."""
    Client.closed = False
    return run_demo(scenario(), [program('good', notifies_ready=True)], endless=True)


def test_a_demo_ends_with_its_summary_and_0(capsys: pytest.CaptureFixture[str]) -> None:
    """Phases, the end of the process, summary and warnings are reported."""
    assert dance(Dance) == 0
    out = capsys.readouterr().out
    assert Client.closed
    places = [out.index(words) for words in ('starting', 'dancing', 'stopping', 'danced 3 s')]
    assert places == sorted(places)
    assert out.endswith('danced 3 s\nwarning: wet floor\n')


@pytest.mark.parametrize(
    ('faults', 'words'),
    [
        ({'found': ('fell over',)}, 'error: fell over\n'),
        ({'error': 'no music'}, 'error: no music\n'),
    ],
)
def test_what_went_wrong_is_reported_and_ends_with_1(
    faults: dict[str, object], words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """Both what the demo found, and what it could not go on without."""
    assert dance(type('Bad', (Dance,), faults)) == 1
    assert capsys.readouterr().out.endswith(words)


class FakeRunner:
    """A supervisor that runs until a stop is requested."""

    def __init__(self) -> None:
        self.phase = Phase.RUNNING
        self.outcome: Outcome | None = None

    def stop(self, outcome: Outcome) -> None:
        """Stop at once."""
        self.outcome, self.phase = outcome, Phase.STOPPED


@pytest.mark.parametrize('defect', [ZeroDivisionError, SystemExit])
def test_a_defect_in_the_demo_stops_the_processes(defect: type[BaseException]) -> None:
    """Whatever it is: drives must not stay enabled because a picture could not be drawn."""

    class Broken(Dance):
        def perform(self) -> None:
            raise defect('in the picture')

    Client.closed = False
    runner = FakeRunner()
    with pytest.raises(defect):
        Broken().play(runner, screen(Utf8())[0])  # type: ignore[arg-type]
    assert runner.outcome == Outcome(1, f'{defect.__name__}: in the picture')
    assert Client.closed


def test_a_supervisor_that_stops_ends_the_demo() -> None:
    """A process has died: nothing is waited for any more, and the outcome is the supervisor's."""

    class Patient(Dance):
        def perform(self) -> None:
            assert not self.leave()  # before the robot moves Ctrl-C is the supervisor's
            self.moving = True
            assert self.leave()
            runner.phase = Phase.STOPPED
            self.wait(lambda: False, 60.0, 'the end')

    Client.closed = False
    runner = FakeRunner()
    Patient().play(runner, screen(Utf8())[0])  # type: ignore[arg-type]
    assert runner.outcome is None
    assert Client.closed
