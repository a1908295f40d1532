# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Shared code of the arm demos: command line, bring-up, enabling, table of drives, goals."""

from __future__ import annotations

from abc import abstractmethod
import argparse
from collections.abc import Callable, Mapping, Sequence
from functools import partial
import itertools
import math
from pathlib import Path
import sys
import time
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.action.client import ActionClient
from rich.console import RenderableType
from rich.table import Table
from rich.text import Text
from urdf_reader import JointRange

from process_supervisor import (
    CallError,
    Executable,
    parse_with_ros,
    RosOptions,
    SupervisorError,
    USAGE_ERROR,
)
from process_supervisor.demo import Demo, make_table, REFRESH_PERIOD, run_demo, signed
from process_supervisor.ros_options import seconds_from

from ..groups import moved_groups, MovedGroups
from ..robots import BringupError, joint_limits, Robot, RobotError
from ..service_client import ServiceClient
from ..session import (
    add_arguments,
    enabling_services,
    locate,
    MASTER,
    no_files,
    robots_epilog,
    Session,
    session,
    SIMULATED_BUS,
)

ANSWER_TIMEOUT = 30.0  # longest time for an answer in [s]
QUEUE = 5
"""Queue depth for states of the arm: on a busy computer a demo drops old states, and sees the
present one."""
ENABLE_TIMEOUT = 15.0
"""Longest time in [s] for all drives to be enabled, and for them to be in their mode."""
ENABLED = 'Operation enabled'  # title of the state in which a drive can move (CiA 402-2, figure 4)
WIDE = 122  # columns from which there is room for modes and gauges
GAUGE_WIDTH = 21  # characters of a gauge
STATE_STYLES = {
    ENABLED: 'green',
    'Fault': 'bold red',
    'Fault reaction active': 'bold red',
    'Quick stop active': 'yellow',
}
"""Colours of CiA 402 states; others are dim."""


class EndRequested(Exception):  # noqa: N818  # it is no error: the user asked for the end
    """The user requested the end of the demo."""


def number(values: Mapping[str, str], key: str) -> float:
    """Read a number of /diagnostics; return NaN if it is missing or invalid."""
    try:
        return float(values[key].split()[0])
    except (KeyError, ValueError, IndexError):
        return math.nan


def known(value: float, digits: int = 0) -> str:
    """Format a number; an unknown one as a dash."""
    return f'{value:.{digits}f}' if math.isfinite(value) else '-'


class ArmDemo(Demo[ServiceClient]):
    """Base of demos on simulated drives: enables them, and shows their /diagnostics."""

    opening = 'booting'
    widest = WIDE
    beside = ''  # additional nodes, for the title
    label = ''  # label of the demo's own line in the table

    def __init__(
        self,
        arm: Session,
        limits: Mapping[str, JointRange],
        duration: float | None,
        commands: Sequence[str],
        enabled: Sequence[str] = (),
    ) -> None:
        """Store the settings, without starting the demo.

        The demo runs for ``duration`` in [s], or until Ctrl-C if None. ``limits`` are those of
        the joints with a drive. It enables the drives ``enabled``, or all drives if empty.
        """
        title = f'{arm.robot.name}: {len(arm.drives)} simulated drives on {arm.bus}{self.beside}'
        super().__init__(title, commands)
        self.arm, self.limits = arm, limits
        self.duration = math.inf if duration is None else duration
        # title, head, its rule, a blank line, two lines of the bus, and one that is left free: a
        # full terminal would scroll at each refresh
        self.lines = len(limits) + 7 + bool(self.label)
        self.drives: Mapping[str, Mapping[str, str]] = {}  # of /diagnostics, by name
        self.bus: Mapping[str, str] = {}
        self.rows: list[tuple[str, str]] = []  # of the summary
        self.found: list[str] = []
        self.moved: set[str] = set()  # joints that the demo moves
        self.goal: ActionRun | None = None  # the last one, which Ctrl-C cancels
        self._enabling = enabling_services(list(enabled or limits), arm.mode_service)

    @abstractmethod
    def move(self) -> None:
        """Move the enabled arm, bring it to rest, and store the result."""

    def services(self) -> Sequence[str]:
        """Return drive services that the demo calls in addition to those for enabling."""
        return ()

    def line(self) -> str:
        """Return the demo's own line in the table, below the bus."""
        return ''

    def join(self, given_up: Callable[[], bool]) -> ServiceClient:
        """Join the ROS graph."""
        client = ServiceClient('demo', given_up, self.arm.ros.namespace)
        client.node.create_subscription(DiagnosticArray, 'diagnostics', self.take, 50)
        return client

    def prepare(self) -> None:
        """Discover the services while the drives boot."""
        self.client.prepare([*itertools.chain(*self._enabling), *self.services()])

    def perform(self) -> None:
        """Enable the drives, and run :meth:`move`."""
        self.enter('enabling')
        for services in self._enabling:
            self.client.call(services, ENABLE_TIMEOUT)
        self.moving = True
        self.move()

    def take(self, message: DiagnosticArray) -> None:
        """Store the statuses of drives and bus from a message; ignore all others."""
        for status in message.status:
            source, _, part = status.name.partition(': ')
            values = {each.key: each.value for each in status.values}
            if (source, part) == ('master', 'bus'):
                self.bus = values
            elif part == 'drive':
                self.drives = {**self.drives, source: {**values, 'message': status.message}}
                self.observe(source)

    def observe(self, drive: str) -> None:  # a demo may need the latest only
        """Handle new diagnostics of a drive."""

    def is_online(self, name: str) -> bool:
        """Return whether a drive is online."""
        return self.drives.get(name, {}).get('online') == 'True'

    def is_enabled(self, name: str) -> bool:
        """Return whether a drive can move."""
        return self.is_online(name) and self.drives[name].get('state') == ENABLED

    @property
    def missed(self) -> int:
        """Number of synchronous PDOs that did not arrive in their cycle."""
        return self.count('missed_pdos')

    def count(self, key: str) -> int:
        """Return a counter of the bus; 0 before the first diagnostics."""
        value = number(self.bus, key)
        return int(value) if math.isfinite(value) else 0

    def bus_line(self) -> str:
        """Return frame rate, load and losses of the bus, and jitter of its cycle, in one line."""
        return ', '.join(self._bus_figures())

    def _bus_figures(self) -> tuple[str, str]:
        jitter = '/'.join(known(1e3 * number(self.bus, f'jitter_p{p}'), 2) for p in (50, 99))
        rate, load = (known(number(self.bus, key)) for key in ('frames_per_second', 'bus_load'))
        bus = f'{rate} frames/s, load {load} %, lost {self.count("frames_lost")}'
        return bus, f'cycle jitter p50/p99 {jitter} ms, missed PDOs {self.missed}'

    def progress(self) -> str:
        """Return the demo's own line, and the bus."""
        return '; '.join(filter(None, (self.line(), self.bus_line())))

    def add(self, name: str, figures: str, problem: str = '') -> None:
        """Add a part and its problem, if any, to the summary."""
        self.rows.append((name, figures))
        if problem:
            self.problem(name, problem)

    def problem(self, name: str, text: str) -> None:
        """Record a problem in a part."""
        self.found.append(f'{name}: {text}')

    def repeat(self, begin: Callable[[], None], run: Callable[[], None]) -> None:
        """Call ``begin``, then ``run`` at least once, until time is up, a problem or Ctrl-C."""
        try:
            end = time.monotonic() + self.duration
            begin()
            while True:
                lap = time.monotonic()
                run()
                now = time.monotonic()
                if now + (now - lap) > end or self.found:
                    return  # another run would exceed the time, or hide the problem
                self.rows.clear()
        except CallError as error:
            self.found.append(str(error))
        except EndRequested:
            self.enter('leaving')
            if self.goal is not None and not self.goal.done:
                self.goal.cancel()

    def conclude(self) -> None:
        """Set summary, problems and warnings."""
        width = max((len(name) for name, _ in self.rows), default=0)
        self.summary = [f'{name:<{width}}  {figures}' for name, figures in self.rows]
        self.problems = self.found
        self.warnings = [*self.bus_warnings(), *self.warnings]

    def bus_warnings(self) -> list[str]:
        """Return warnings about the bus that do not fail the demo."""
        found = []
        if lost := self.count('frames_lost'):
            found.append(f'{lost} frames were lost: this host was too busy to read them in time')
        if self.missed:
            old = 'what was measured then is older than what was commanded'
            found.append(f'{self.missed} PDOs of drives missed their cycle: {old}')
        return found

    def look(self) -> None:
        """Refresh the table.

        Raises:
            EndRequested: The user requested the end.
        """
        self.show()
        if self.left:
            raise EndRequested

    def wait_moving(self, condition: Callable[[], bool], timeout: float, what: str) -> None:
        """Wait for a condition while the table is refreshed.

        Raises:
            EndRequested: The user requested the end.
            CallError: The condition was not met within the timeout in [s].
        """

        def reached() -> bool:
            self.look()
            return condition()

        self.client.wait_until(reached, timeout, what)

    def pause(self, duration: float) -> None:
        """Wait for a duration in [s] while the table is refreshed."""
        end = time.monotonic() + duration
        self.wait_moving(lambda: time.monotonic() >= end, math.inf, 'a pause')

    def table(self, width: int) -> Sequence[RenderableType]:
        """Draw the drives, the bus, and the demo's own line."""
        bus = Text.assemble(('bus    ', 'bold'), '\n       '.join(self._bus_figures()))
        body: list[RenderableType] = [self._drive_table(width), Text(''), bus]
        if self.label:
            line = Text.assemble((f'{self.label:<7}', 'bold'), self.line())
            line.truncate(width)
            body.append(line)
        return body

    def _drive_table(self, width: int) -> Table:
        wide = width >= WIDE
        more = ('mode', 21, False), (' between its limits', GAUGE_WIDTH + 1, False)
        table = make_table(
            ('joint', 12, False),
            ('NMT', 15, False),
            ('CiA 402 state', 21, False),
            *((name, 8, True) for name in ('position', 'velocity', 'error')),
            *(more if wide else ()),
        )
        table.columns[0].max_width = max(12, width - 66 - 45 * wide)  # truncate names, not numbers
        for name, limits in self.limits.items():
            drive, moves = self.drives.get(name, {}), name in self.moved
            state, figures = drive.get('state', ''), ('position', 'velocity', 'following_error')
            cells = [
                Text(name, style='bold' if moves else ''),
                Text(drive.get('nmt_state', ''), 'green' if self.is_online(name) else 'red'),
                Text(state, style=STATE_STYLES.get(state, 'dim')),
                *(Text(signed(number(drive, key))) for key in figures),
            ]
            if wide:
                cells.append(Text(drive.get('mode', ''), '' if moves else 'yellow'))
                cells.append(_gauge(number(drive, 'position'), limits))
            table.add_row(*cells)
        return table


def _gauge(position: float, limits: JointRange) -> Text:
    """Draw the joint position between its limits; outside, the mark is red, at the end."""
    span = limits.upper - limits.lower
    if not math.isfinite(span) or not math.isfinite(position):
        return Text('')
    share = (position - limits.lower) / span
    place = round(min(max(share, 0.0), 1.0) * (GAUGE_WIDTH - 1))
    style = 'bold cyan' if 0.0 <= share <= 1.0 else 'bold red'
    before, after = '─' * place, '─' * (GAUGE_WIDTH - 1 - place)
    return Text.assemble(' ', (before, 'dim'), ('●', style), (after, 'dim'))


class ActionRun:
    """A sent action goal; ``feedback`` collects the feedback received so far."""

    def __init__(
        self,
        client: ServiceClient,
        action: ActionClient,
        goal: Any,  # noqa: ANN401  # goals have no type
        name: str,
    ) -> None:
        """Send the goal, and wait until it is accepted.

        Raises:
            CallError: The goal was rejected, or no server answers.
            GivenUpError: The user gave up.
        """
        self.feedback: list[Any] = []
        self._client, self._name = client, name
        client.wait_until(action.server_is_ready, ANSWER_TIMEOUT, name)
        client.wait_until_known([f'{name}/_action/send_goal'], ANSWER_TIMEOUT)
        sent = action.send_goal_async(goal, lambda each: self.feedback.append(each.feedback))
        client.wait_until(sent.done, ANSWER_TIMEOUT, f'the answer of {name}')
        if not sent.result().accepted:
            raise CallError(f'{name}: the goal was not accepted')
        self._handle = sent.result()
        self._result = self._handle.get_result_async()

    @property
    def done(self) -> bool:
        """Whether the goal has ended."""
        return bool(self._result.done())

    @property
    def status(self) -> int:
        """The final action_msgs/GoalStatus, once the goal has ended."""
        return int(self._result.result().status)

    @property
    def result(self) -> Any:  # noqa: ANN401
        """The result, once the goal has ended."""
        return self._result.result().result

    def cancel(self) -> None:
        """Cancel the goal, and wait for its end."""
        answer = self._handle.cancel_goal_async()
        self._client.wait_until(answer.done, ANSWER_TIMEOUT, f'the cancel of {self._name}')
        self._client.wait_until(lambda: self.done, ANSWER_TIMEOUT, 'the end of the canceled')


MakeFiles = Callable[..., Sequence[Path]]
"""Writes parameter files of motion nodes, from robot, folder, ROS options and groups."""
MakeDemo = Callable[[Session, Mapping[str, JointRange], float | None, MovedGroups], ArmDemo]
"""Creates a demo from the session, limits of joints with a drive, duration and moved groups."""


def parse(
    argv: Sequence[str], name: str, description: str, duration: str
) -> tuple[argparse.Namespace, RosOptions]:
    """Parse the command line of a demo; ``description`` and ``duration`` are help texts."""
    parser = argparse.ArgumentParser(
        prog=f'ros2 run arm_bringup {name}',
        description=description,
        epilog=robots_epilog(),
        allow_abbrev=False,
    )
    default_bus = f'{SIMULATED_BUS}: vcan0 when it is there, else multicast'
    add_arguments(parser, default_bus=default_bus)
    parser.add_argument('--duration', metavar='S', type=seconds_from(0.0), help=duration)
    return parse_with_ros(parser, argv)


def run(
    parsed: tuple[argparse.Namespace, RosOptions],
    make_demo: MakeDemo,
    *,
    master: Executable = MASTER,
    find_robot: Callable[[argparse.Namespace], Robot] = locate,
    files: MakeFiles | None = None,
    plan: bool = False,
    endless: bool = False,
    errors: tuple[type[Exception], ...] = (),
) -> int:
    """Bring up a simulated arm, and run a demo until its end or Ctrl-C.

    Args:
        files: Writes the parameter files of motion nodes; None for a demo of drives only.
        endless: Whether the table runs until Ctrl-C, without a summary.
        errors: Further exceptions raised if a robot does not suit the demo.

    Returns:
        0 on success, 1 if something failed, 2 if nothing was started.
    """
    arguments, ros = parsed
    unsuited: tuple[type[Exception], ...] = (BringupError, SupervisorError, *errors)
    groups = MovedGroups(())
    make_files: Callable[[Robot, Path, RosOptions], Sequence[Path]] = no_files
    try:
        robot = find_robot(arguments)
        if files is not None:
            if robot.lacking:
                raise RobotError(
                    f'{robot.name} lacks {robot.lacking}: '
                    f'ros2 run arm_bringup check {arguments.robot} reports all of it'
                )
            groups = moved_groups(robot)
            make_files = partial(files, groups=groups)
        with session(
            robot,
            arguments,
            ros,
            simulate=True,
            master=master,
            master_parameters={'diagnostics_period': f'{REFRESH_PERIOD}'},
            master_files=make_files,
            plan=plan,
        ) as arm:
            limits = {
                name: each for name, each in joint_limits(arm.urdf).items() if name in arm.drives
            }
            demo = make_demo(arm, limits, arguments.duration, groups)
            if arm.start:
                sys.stdout.write(f'{arm.start}\n')
            return run_demo(demo, arm.processes, endless=endless and arguments.duration is None)
    except unsuited as error:
        sys.stderr.write(f'{error}\n')
        return USAGE_ERROR
