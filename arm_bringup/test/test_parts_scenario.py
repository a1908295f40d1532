# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What the demos of motions share: parts that are repeated, and a table with a line."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
import io

from demo_doubles import FakeDisplay, FakeSupervisor
import pytest
from rich.console import Console
from urdf_reader import JointRange

from arm_bringup.demos.figures import Figures
from arm_bringup.demos.plan.figures import PlanFigures
from arm_bringup.demos.results import Results
from arm_bringup.demos.scenario import PartsScenario
from arm_bringup.demos.table import ArmView, LINES_AROUND
from demo_runner import DemoStatus
from process_supervisor import CallError, Outcome


class Client:
    """A client whose services are all there."""

    figures = Figures()

    def prepare(self, services: Iterable[str]) -> None:
        """Nothing is looked for."""

    def call(self, services: list[str], timeout: float) -> Mapping[str, str]:
        """Accept everything."""
        return dict.fromkeys(services, '')

    def wait_until(self, condition: Callable[[], bool], timeout: float, what: str) -> None:
        """Everything is there at once."""
        assert condition()

    def listen(self, duration: float) -> None:
        """Nothing comes in."""

    def close(self) -> None:
        """Nothing is open."""


@dataclass
class FakeParts:
    """Parts that note what is called, and do something in the second run."""

    second: Callable[[], None]
    look: Callable[[], None]
    results: Results = field(default_factory=Results)
    called: list[str] = field(default_factory=list)

    def set_up(self) -> None:
        """Note it."""
        self.called.append('set up')

    def run(self) -> None:
        """Note it."""
        self.called.append('run')
        self.results.add('part', f'{self.called.count("run")}')
        if self.called.count('run') == 2:
            self.second()
        self.look()

    def come_to_rest(self) -> None:
        """Note it."""
        self.called.append('rest')

    def conclude(self) -> None:
        """Note it."""
        self.called.append('conclude')
        self.results.warnings.append('noted')


def repeated(
    second: Callable[[PartsScenario[Client], FakeParts], None],
) -> tuple[PartsScenario[Client], FakeParts, FakeSupervisor]:
    """Run a scenario without end; in the second run something happens."""
    made: list[FakeParts] = []

    def make(client: Client, enter: Callable[[str], None], look: Callable[[], None]) -> FakeParts:
        made.append(FakeParts(lambda: second(scenario, made[0]), look))
        return made[0]

    scenario = PartsScenario[Client](FakeDisplay(), ['joint1'], 'cyclic_position_mode', None, make)
    supervisor = FakeSupervisor()
    scenario.run(supervisor, lambda _: Client())
    return scenario, made[0], supervisor


def fail(scenario: PartsScenario[Client], parts: FakeParts) -> None:
    """Find a problem."""
    parts.results.problem('part', 'it is wrong')


def give_up(scenario: PartsScenario[Client], parts: FakeParts) -> None:
    """Wait for something in vain."""
    raise CallError('nobody answers')


@pytest.mark.parametrize(
    ('second', 'problem'), [(fail, 'part: it is wrong'), (give_up, 'nobody answers')]
)
def test_parts_are_repeated_until_something_goes_wrong(
    second: Callable[[PartsScenario[Client], FakeParts], None], problem: str
) -> None:
    """One more run would hide it; the summary is that of the last one."""
    scenario, parts, supervisor = repeated(second)
    assert parts.called == ['set up', 'run', 'run', 'conclude']
    assert scenario.result.problems == [problem]
    assert scenario.result.summary == ['part  2']
    assert scenario.result.warnings == ['noted']
    assert supervisor.outcome == Outcome(0, 'the demo has ended')


def test_ctrl_c_brings_what_moves_to_rest_before_the_processes_stop() -> None:
    """The robot moves, so the supervisor leaves it to the scenario."""
    answers: list[bool] = []
    scenario, parts, supervisor = repeated(lambda each, _: answers.append(each.leave()))
    assert answers == [True]
    assert parts.called == ['set up', 'run', 'run', 'rest', 'conclude']
    assert scenario.left
    assert scenario.result.problems == []
    assert supervisor.outcome is not None


def test_a_table_with_a_line_of_the_demo_needs_one_more() -> None:
    """It stands below the bus, and in the line of progress before it."""
    plain = ArmView('arm', {'joint1': JointRange('joint1', -1.0, 1.0, 1.0)})
    view = ArmView(plain.title, plain.limits, 'plan')
    height = 1 + LINES_AROUND
    assert plain.fits(100, height)
    assert not view.fits(100, height)
    assert view.fits(100, height + 1)
    figures = PlanFigures(words='LIN', planning_time=0.02, clearance=0.04, nearest=('a', 'b'))
    file = io.StringIO()
    status = DemoStatus(1.0, 'placing', (), ['first', 'second'])
    Console(file=file, width=100, height=height + 1).print(
        view.render(figures, status, 100, height + 1)
    )
    lines = file.getvalue().splitlines()
    assert len(lines) <= height
    assert lines[-1].rstrip() == 'plan   planned in 20 ms   40 mm between a and b   LIN'
    assert view.progress(figures).startswith('planned in 20 ms   40 mm between a and b   LIN; ')
