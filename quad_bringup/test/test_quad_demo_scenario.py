# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The scenario of the demo, with a ROS client and a supervisor of the test's own."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from demo_doubles import FakeDisplay, FakeSupervisor
import pytest

from process_supervisor import CallError, GivenUpError, Outcome, Phase
from quad_bringup.demo import scenario as scenario_module
from quad_bringup.demo.figures import Figures
from quad_bringup.demo.period_statistics import PeriodFigures
from quad_bringup.demo.scenario import Milestones, WalkScenario
from quad_bringup.demo.segments import STANDSTILL, Velocity
from quad_bringup.demo.track import Milestone

STEP = 0.05
"""Virtual time in [s] between two looks of a wait."""


class Clock:
    """A clock that goes on when somebody waits."""

    def __init__(self) -> None:
        self.now = 100.0

    def monotonic(self) -> float:
        """Return the virtual time."""
        return self.now


@pytest.fixture(autouse=True)
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    """Let the demo live in virtual time."""
    clock = Clock()
    monkeypatch.setattr(scenario_module, 'time', clock)
    return clock


class Robot:
    """A client of a robot that moves as commanded, times a factor."""

    def __init__(self, clock: Clock, factor: float = 1.0) -> None:
        self.modes: list[str] = []
        self.commands: list[Velocity | None] = []
        self.refuses = ''
        self.after: Callable[[str], None] = lambda what: None
        self.given_up: Callable[[], bool] = lambda: False
        self.figures = Figures(state='lie', tilt_max=0.0, periods=PeriodFigures(50.0, 0.0, 0.0))
        self.milestones = Milestones(Milestone(0.0), None)
        self.missing: list[str] = []
        self._clock, self._factor = clock, factor

    def command(self, velocity: Velocity | None) -> None:
        """Keep it."""
        self.commands.append(velocity)

    def watch_tilt(self) -> None:
        """It never tilts."""

    def set_mode(self, mode: str, timeout: float) -> str:
        """Be in it at once, or refuse it."""
        if mode == self.refuses:
            raise CallError(f'the mode {mode!r} was refused: battery low')
        self.modes.append(mode)
        self.figures = replace(self.figures, state=mode)
        return mode

    def wait_until(self, condition: Callable[[], bool], timeout: float, what: str) -> None:
        """Let time pass."""
        end = self._clock.now + timeout
        while not condition():
            if self.given_up():
                raise GivenUpError(what)
            if self._clock.now > end:
                raise CallError(f'waited in vain for {what}')
            self._move()
            self.after(what)

    def _move(self) -> None:
        self._clock.now += STEP
        last, command = self.milestones.measured, self.commands[-1] if self.commands else None
        command = command or STANDSTILL
        assert last is not None
        way = STEP * self._factor
        moved = Milestone(
            self._clock.now,
            last.forward + way * command.forward,
            last.left + way * command.left,
            last.turn + way * command.turn,
        )
        self.milestones = Milestones(moved, None)

    def listen(self, duration: float) -> None:
        """Let time pass."""
        self._clock.now += duration

    def close(self) -> None:
        """Leave."""


def run(scenario: WalkScenario, supervisor: FakeSupervisor, robot: Robot) -> None:
    """Run the demo in this thread."""

    def make_client(given_up: Callable[[], bool]) -> Robot:
        robot.given_up = given_up
        return robot

    scenario.run(supervisor, make_client)


def test_it_stands_up_walks_turns_strafes_stops_and_lies_down(clock: Clock) -> None:
    """With a summary of each segment; at the end nobody commands anything any more."""
    display, supervisor, robot = FakeDisplay(), FakeSupervisor(), Robot(clock)
    scenario = WalkScenario(display, 'walk', 20.0)
    run(scenario, supervisor, robot)
    assert robot.modes == ['stand', 'walk', 'lie']
    moves = ['walk', 'turn', 'strafe', 'stop']
    assert display.phases == ['starting', 'standing up', *moves, 'lying down', 'stopping']
    assert robot.commands[0] == Velocity(forward=0.2)
    assert robot.commands[-1] is None
    assert supervisor.outcome == Outcome(0, 'the demo has ended')
    assert scenario.result.problems == []
    rows = [line.split()[0] for line in scenario.result.summary[2:6]]
    assert rows == moves


def test_a_topic_that_is_never_found_ends_it_by_name(clock: Clock) -> None:
    """Before anything moves."""
    supervisor, robot = FakeSupervisor(), Robot(clock)
    robot.missing = ['/odom', '/imu']
    run(WalkScenario(FakeDisplay(), 'walk', 20.0), supervisor, robot)
    assert supervisor.outcome is not None
    assert supervisor.outcome.reason == 'not found in 20 s: /odom, /imu'
    assert robot.modes == []


def test_a_robot_that_walks_too_slowly_is_a_problem(clock: Clock) -> None:
    """The demo goes on to its end, and says so then."""
    supervisor = FakeSupervisor()
    scenario = WalkScenario(FakeDisplay(), 'walk', 20.0)
    run(scenario, supervisor, Robot(clock, factor=0.6))
    names = [text.split(':')[0] for text in scenario.result.problems]
    assert names == ['walk', 'turn']


def test_a_mode_that_is_refused_ends_it_with_the_reason(clock: Clock) -> None:
    """Before anything is commanded."""
    supervisor, robot = FakeSupervisor(), Robot(clock)
    robot.refuses = 'stand'
    run(WalkScenario(FakeDisplay(), 'walk', 20.0), supervisor, robot)
    assert supervisor.outcome == Outcome(1, "the mode 'stand' was refused: battery low")
    assert set(robot.commands) == {None}


def test_a_mode_that_is_never_reached_ends_it(clock: Clock) -> None:
    """The time-out says which."""
    supervisor, robot = FakeSupervisor(), Robot(clock)

    def fall_back(what: str) -> None:
        robot.figures = replace(robot.figures, state='lie')

    robot.after = fall_back
    robot.set_mode = lambda mode, timeout: mode  # type: ignore[method-assign]
    run(WalkScenario(FakeDisplay(), 'walk', 20.0), supervisor, robot)
    assert supervisor.outcome == Outcome(1, 'waited in vain for mode stand')


def test_a_fault_ends_it_at_once_with_its_words(clock: Clock) -> None:
    """In the middle of the walk."""
    supervisor, robot = FakeSupervisor(), Robot(clock)

    def fall(what: str) -> None:
        if clock.now > 105.0:
            robot.figures = replace(robot.figures, state='fault', fault='fallen: tilt 80°')

    robot.after = fall
    run(WalkScenario(FakeDisplay(), 'walk', 20.0), supervisor, robot)
    assert supervisor.outcome == Outcome(1, 'the controller is in a fault: fallen: tilt 80°')
    assert robot.modes == ['stand', 'walk']


def test_ctrl_c_lets_it_lie_down_first(clock: Clock) -> None:
    """Without an end it goes on and on until then; what was cut short is not measured."""
    supervisor, robot = FakeSupervisor(), Robot(clock)
    scenario = WalkScenario(FakeDisplay(), 'policy', None)

    def leave(what: str) -> None:
        if clock.now > 100.0 + 33.0:  # in the walk of the second round
            assert scenario.leave()

    robot.after = leave
    run(scenario, supervisor, robot)
    assert robot.modes == ['stand', 'policy', 'lie']
    assert supervisor.outcome is not None
    assert supervisor.outcome.exit_code == 0
    assert [line.split()[0] for line in scenario.result.summary[2:-1]].count('walk') == 2


def test_ctrl_c_before_it_stands_is_left_to_the_supervisor(clock: Clock) -> None:
    """There is nothing to lie down from."""
    scenario = WalkScenario(FakeDisplay(), 'walk', None)
    assert not scenario.leave()


@pytest.mark.parametrize('moment', [100.2, 104.0])
def test_a_supervisor_that_stops_ends_the_demo(clock: Clock, moment: float) -> None:
    """A process has died: nothing is waited for any more, and the outcome is the supervisor's."""
    supervisor, robot = FakeSupervisor(), Robot(clock)

    def die(what: str) -> None:
        if clock.now > moment:
            supervisor.phase = Phase.STOPPED

    robot.after = die
    run(WalkScenario(FakeDisplay(), 'walk', None), supervisor, robot)
    assert supervisor.outcome is None


def test_an_error_of_our_own_stops_everything_and_is_not_hidden(clock: Clock) -> None:
    """The processes are stopped; the traceback is there."""
    supervisor, robot = FakeSupervisor(), Robot(clock)

    def fail(what: str) -> None:
        raise ZeroDivisionError('in the picture')

    robot.after = fail
    with pytest.raises(ZeroDivisionError):
        run(WalkScenario(FakeDisplay(), 'walk', 20.0), supervisor, robot)
    assert supervisor.outcome == Outcome(1, 'ZeroDivisionError: in the picture')
