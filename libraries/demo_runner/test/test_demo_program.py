# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The program around a demo, with a small real process and a scenario of the test's own."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from rich.console import RenderableType
from rich.text import Text
from small_processes import program

from demo_runner import DemoResult, DemoScenario, DemoStatus, run_demo
from process_supervisor import CallError, GivenUpError


class View:
    """A view of a word."""

    title = 'a word'

    def fits(self, width: int, height: int) -> bool:
        """Lines are enough."""
        return False

    def render(self, figures: str, status: DemoStatus, width: int, height: int) -> RenderableType:
        """Draw it."""
        return Text(figures)

    def progress(self, figures: str) -> str:
        """Say it."""
        return f'progress: {figures}'


class Client:
    """A client that waits for a condition, and receives nothing."""

    figures = 'received'
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


class Dance(DemoScenario[Client]):
    """Waits for the processes, and ends as it is to."""

    error = ''
    problems: tuple[str, ...] = ()

    def _perform(self, client: Client) -> None:
        self._enter('dancing')
        self.result = DemoResult(['danced 3 s'], list(self.problems), ['the floor is wet'])
        if self.error:
            raise CallError(self.error)


def dance(scenario: type[Dance]) -> int:
    """Run a demo with one process."""
    Client.closed = False
    return run_demo(
        [program('good', notifies_ready=True)],
        view=View(),
        figures='nothing yet',
        commands=['ros2 topic list'],
        make_scenario=scenario,
        make_client=Client,
        endless=True,
    )


def test_a_demo_ends_with_its_summary_and_0(capsys: pytest.CaptureFixture[str]) -> None:
    """Phases, the end of the process, summary and warnings are reported."""
    assert dance(Dance) == 0
    out = capsys.readouterr().out
    assert Client.closed
    places = [out.index(words) for words in ('starting', 'dancing', 'stopping', 'danced 3 s')]
    assert places == sorted(places)
    assert out.endswith('danced 3 s\nwarning: the floor is wet\n')


@pytest.mark.parametrize(
    ('faults', 'words'),
    [
        ({'problems': ('fell over',)}, 'error: fell over\n'),
        ({'error': 'no music'}, 'error: no music\n'),
    ],
)
def test_what_went_wrong_is_reported_and_ends_with_1(
    faults: dict[str, object], words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """Both what the scenario found, and what it could not go on without."""
    assert dance(type('Bad', (Dance,), faults)) == 1
    assert capsys.readouterr().out.endswith(words)
