# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The scenario of the demo, with a ROS client and a supervisor of the test's own."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
import time

from demo_doubles import FakeDisplay, FakeSupervisor
import pytest
from urdf_reader import JointRange

from arm_bringup.demos.figures import AxisFigures, DriveFigures, Figures
from arm_bringup.demos.wave.scenario import WaveScenario
from process_supervisor import CallError, GivenUpError, Outcome, Phase

JOINTS = ['joint1', 'joint2']
RANGES = {name: JointRange(name, -2.0, 2.0, 1.0) for name in JOINTS}
DRIVE = DriveFigures(online=True, state='Operation enabled')
MOVED = AxisFigures(True, -0.4, 0.4, 0.01, 0.005)
GOOD = Figures(dict.fromkeys(JOINTS, DRIVE), axes=dict.fromkeys(JOINTS, MOVED))


class Client:
    """A client whose services answer as they are given, and whose second drive is taken away."""

    def __init__(self, refuses: str = '', when: Callable[[str], None] = lambda what: None) -> None:
        self.figures = GOOD
        self.prepared: list[str] = []
        self.called: list[str] = []
        self.left = ['joint2 left the wave: halted']
        self.closed = False
        self.given_up: Callable[[], bool] = lambda: False
        self._refuses = refuses
        self._when = when

    def prepare(self, services: Iterable[str]) -> None:
        """Keep the names."""
        self.prepared += services

    def call(self, services: list[str], timeout: float) -> dict[str, str]:
        """Answer, or refuse one."""
        self.called += services
        if self._refuses in services:
            raise CallError(f'{self._refuses}: fault')
        return dict.fromkeys(services, '')

    def start_wave(self) -> None:
        """Note it."""
        self.called.append('start')

    def stop_wave(self) -> Sequence[str]:
        """Return the drive that is left."""
        self.called.append('stop')
        return JOINTS[:1]

    def departures(self) -> Sequence[str]:
        """Report each once."""
        left, self.left = self.left, []
        return left

    def wait_until(self, condition: Callable[[], bool], timeout: float, what: str) -> None:
        """Wait as the real one does."""
        self._when(what)
        end = time.monotonic() + timeout
        while not condition():
            if self.given_up():
                raise GivenUpError(what)
            if time.monotonic() > end:
                raise CallError(f'no {what} within {timeout:g} s')

    def listen(self, duration: float) -> None:
        """Nothing comes in."""

    def close(self) -> None:
        """Leave."""
        self.closed = True


def run(scenario: WaveScenario, supervisor: FakeSupervisor, client: Client) -> None:
    """Run the demo in this thread."""

    def make_client(given_up: Callable[[], bool]) -> Client:
        client.given_up = given_up
        return client

    scenario.run(supervisor, make_client)


def test_all_joints_are_enabled_before_the_wave_and_the_wave_stops_before_the_processes() -> None:
    """Services of all joints are called side by side; what is still in the wave is halted."""
    display, supervisor, client = FakeDisplay(), FakeSupervisor(), Client()
    scenario = WaveScenario(display, RANGES, 'cyclic_position_mode', duration=0.01)
    run(scenario, supervisor, client)
    assert client.called == [
        'joint1/init',
        'joint2/init',
        'joint1/cyclic_position_mode',
        'joint2/cyclic_position_mode',
        'start',
        'stop',
        'joint1/halt',
    ]
    assert {*client.called} - {*client.prepared} == {'start', 'stop'}
    assert [each.text for each in display.notices] == ['joint2 left the wave: halted']
    assert display.phases == ['booting', 'enabling', 'waving', 'stopping']
    assert supervisor.outcome is not None
    assert supervisor.outcome.exit_code == 0
    assert scenario.result.problems == []
    assert len(scenario.result.summary) == 5
    assert not scenario.left
    assert client.closed


def test_a_drive_that_refuses_ends_the_demo_with_its_reason() -> None:
    """No wave is started, and there is no summary of one."""
    supervisor, client = FakeSupervisor(), Client(refuses='joint2/init')
    scenario = WaveScenario(FakeDisplay(), RANGES, 'cyclic_position_mode', duration=1.0)
    run(scenario, supervisor, client)
    assert supervisor.outcome == Outcome(1, 'joint2/init: fault')
    assert 'start' not in client.called
    assert scenario.result.summary == []
    assert client.closed


def test_ctrl_c_stops_the_wave_first() -> None:
    """Before the wave it is left to the supervisor, which stops at once."""
    answers: list[bool] = []

    def when(what: str) -> None:
        if what in {'the processes', 'the end'}:
            answers.append(scenario.leave())

    supervisor, client = FakeSupervisor(), Client(when=when)
    scenario = WaveScenario(FakeDisplay(), RANGES, 'cyclic_position_mode', duration=None)
    run(scenario, supervisor, client)
    assert answers == [False, True]
    assert client.called[-2:] == ['stop', 'joint1/halt']
    assert scenario.left


@pytest.mark.parametrize('what', ['the processes', 'the end'])
def test_a_supervisor_that_stops_ends_the_demo(what: str) -> None:
    """A process has died: nothing is waited for any more, and the outcome is the supervisor's."""

    def when(waited_for: str) -> None:
        if waited_for == what:
            supervisor.phase = Phase.STOPPED

    supervisor, client = FakeSupervisor(Phase.RUNNING), Client(when=when)
    run(
        WaveScenario(FakeDisplay(), RANGES, 'cyclic_position_mode', duration=None),
        supervisor,
        client,
    )
    assert supervisor.outcome is None
    assert client.closed


@pytest.mark.parametrize('defect', [ZeroDivisionError, SystemExit])
def test_a_defect_in_the_demo_stops_the_processes(defect: type[BaseException]) -> None:
    """Whatever it is: drives must not stay enabled because a picture could not be drawn."""

    def when(what: str) -> None:
        raise defect('in the picture')

    supervisor, client = FakeSupervisor(), Client(when=when)
    with pytest.raises(defect):
        run(
            WaveScenario(FakeDisplay(), RANGES, 'cyclic_position_mode', duration=1.0),
            supervisor,
            client,
        )
    assert supervisor.outcome == Outcome(1, f'{defect.__name__}: in the picture')
    assert client.closed
