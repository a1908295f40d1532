# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The program around a demo, with a small real process and a course of the test's own."""

from __future__ import annotations

import argparse
from collections.abc import Callable
import math

import pytest
from rich.console import RenderableType
from rich.text import Text
from small_processes import PATIENCE, program

from process_supervisor import CallError, GivenUpError
from process_supervisor.arguments import seconds_from
from process_supervisor.demo import perform
from process_supervisor.picture import Moment
from process_supervisor.play import Play, Result


class View:
    """A view of a word."""

    title = 'a word'

    def fits(self, width: int, height: int) -> bool:
        """Lines are enough."""
        return False

    def render(self, figures: str, moment: Moment, width: int, height: int) -> RenderableType:
        """Draw it."""
        return Text(figures)

    def progress(self, figures: str) -> str:
        """Say it."""
        return f'progress: {figures}'


class Client:
    """A client that waits for a condition, and hears nothing."""

    figures = 'heard'
    closed = False

    def __init__(self, given_up: Callable[[], bool]) -> None:
        self.given_up = given_up

    def wait_until(self, condition: Callable[[], bool], timeout: float, what: str) -> None:
        """Wait until nobody wants it any more."""
        while not condition():
            if self.given_up():
                raise GivenUpError(what)

    def listen(self, duration: float) -> None:
        """Nothing comes in."""

    def close(self) -> None:
        """Leave."""
        Client.closed = True


class Course(Play[Client]):
    """Waits for the processes, and ends as it is told to."""

    error = ''
    problems: tuple[str, ...] = ()

    def _course(self, client: Client, ready: Callable[[], bool]) -> None:
        client.wait_until(ready, PATIENCE, 'the processes')
        self._enter('dancing')
        self.result = Result(['danced 3 s'], list(self.problems), ['the floor is wet'])
        if self.error:
            raise CallError(self.error)


def dance(course: type[Course]) -> int:
    """Run a demo with one process."""
    Client.closed = False
    return perform(
        [program('good', ready='^ready')],
        view=View(),
        figures='nothing yet',
        commands=['ros2 topic list'],
        make_play=course,
        make_client=Client,
        endless=True,
    )


def test_a_demo_ends_with_its_summary_and_0(capsys: pytest.CaptureFixture[str]) -> None:
    """Phases, the end of the process, summary and warnings are told; readiness only once."""
    assert dance(Course) == 0
    out = capsys.readouterr().out
    assert Client.closed
    places = [out.index(words) for words in ('starting', 'dancing', 'stopping', 'danced 3 s')]
    assert places == sorted(places)
    assert out.endswith('danced 3 s\nwarning: the floor is wet\n')
    assert '| ready ' not in out


@pytest.mark.parametrize(
    ('faults', 'words'),
    [
        ({'problems': ('fell over',)}, 'error: fell over\n'),
        ({'error': 'no music'}, 'error: no music\n'),
    ],
)
def test_what_went_wrong_is_told_and_ends_with_1(
    faults: dict[str, object], words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """Both what the course found, and what it could not go on without."""
    assert dance(type('Bad', (Course,), faults)) == 1
    assert capsys.readouterr().out.endswith(words)


def test_times_of_the_command_line() -> None:
    """Short, negative, endless and senseless times are refused with what they must be."""
    assert seconds_from(5.0)('5') == 5.0
    assert seconds_from(0.0, finite=False)('inf') == math.inf
    for text, least, words in [('4.9', 5.0, 'at least 5'), ('0', 0.0, 'above 0')]:
        with pytest.raises(argparse.ArgumentTypeError, match=words):
            seconds_from(least)(text)
    for text in ('nan', 'inf', '-1', 'soon'):
        with pytest.raises(argparse.ArgumentTypeError, match=f'{text} is no number of seconds'):
            seconds_from(0.0)(text)
