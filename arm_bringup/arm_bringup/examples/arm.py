# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What the demos of an arm share: command line, bring-up, enabling, table of drives, goals."""

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
"""States of the arm that wait: a demo which a busy computer holds up misses some, and sees where
the arm is now."""
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
    """The user asked for the end."""


def number(values: Mapping[str, str], key: str) -> float:
    """Read a number of /diagnostics; what is missing or is none becomes NaN."""
    try:
        return float(values[key].split()[0])
    except (KeyError, ValueError, IndexError):
        return math.nan


def known(value: float, digits: int = 0) -> str:
    """Write a number; what is unknown as a dash."""
    return f'{value:.{digits}f}' if math.isfinite(value) else '-'


class ArmDemo(Demo[ServiceClient]):
    """A demo on simulated drives: enables them, and shows what /diagnostics has of them."""

    opening = 'booting'
    widest = WIDE
    beside = ''  # what runs beside the drives, for the title
    label = ''  # what the demo's own line in the table begins with

    def __init__(
        self,
        arm: Session,
        limits: Mapping[str, JointRange],
        duration: float | None,
        commands: Sequence[str],
        enabled: Sequence[str] = (),
    ) -> None:
        """Prepare; nothing happens yet.

        It runs for a duration in [s], or until Ctrl-C, on the joints that have a drive, with their
        limits; all of these drives are enabled, or those that are named.
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
        """Move the enabled arm, bring it to rest, and leave the result."""

    def services(self) -> Sequence[str]:
        """Return services of drives that are called beside those that enable them."""
        return ()

    def line(self) -> str:
        """Return the demo's own line, below the bus."""
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
        """Enable the drives, and move."""
        self.enter('enabling')
        for services in self._enabling:
            self.client.call(services, ENABLE_TIMEOUT)
        self.moving = True
        self.move()

    def take(self, message: DiagnosticArray) -> None:
        """Keep what a message says of drives and bus; statuses of others are passed over."""
        for status in message.status:
            source, _, part = status.name.partition(': ')
            values = {each.key: each.value for each in status.values}
            if (source, part) == ('master', 'bus'):
                self.bus = values
            elif part == 'drive':
                self.drives = {**self.drives, source: {**values, 'message': status.message}}
                self.observe(source)

    def observe(self, drive: str) -> None:  # a demo may need the latest only
        """Handle new figures of a drive."""

    def is_online(self, name: str) -> bool:
        """Return whether a drive is online."""
        return self.drives.get(name, {}).get('online') == 'True'

    def is_enabled(self, name: str) -> bool:
        """Return whether a drive can move."""
        return self.is_online(name) and self.drives[name].get('state') == ENABLED

    @property
    def missed(self) -> int:
        """Synchronous PDOs that did not come in their cycle."""
        return self.count('missed_pdos')

    def count(self, key: str) -> int:
        """Return a count of the bus; 0 before there is one."""
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
        """Add a part to the summary, and what went wrong in it."""
        self.rows.append((name, figures))
        if problem:
            self.problem(name, problem)

    def problem(self, name: str, text: str) -> None:
        """Add what went wrong in a part."""
        self.found.append(f'{name}: {text}')

    def repeat(self, begin: Callable[[], None], run: Callable[[], None]) -> None:
        """Run parts until the time is over, once at least; after a problem or Ctrl-C no more."""
        try:
            end = time.monotonic() + self.duration
            begin()
            while True:
                lap = time.monotonic()
                run()
                now = time.monotonic()
                if now + (now - lap) > end or self.found:
                    return  # another one would take longer, or hide what went wrong
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
        """Return what is worth a look although the demo went well."""
        found = []
        if lost := self.count('frames_lost'):
            found.append(f'{lost} frames were lost: this host was too busy to read them in time')
        if self.missed:
            old = 'what was measured then is older than what was commanded'
            found.append(f'{self.missed} PDOs of drives missed their cycle: {old}')
        return found

    def look(self) -> None:
        """Draw a picture; end what goes on where the user asked for it.

        Raises:
            EndRequested: The user did.
        """
        self.show()
        if self.left:
            raise EndRequested

    def wait_moving(self, condition: Callable[[], bool], timeout: float, what: str) -> None:
        """Wait for something that is given up at Ctrl-C.

        Raises:
            EndRequested: The user asked for the end.
            CallError: It did not come within the timeout in [s].
        """

        def reached() -> bool:
            self.look()
            return condition()

        self.client.wait_until(reached, timeout, what)

    def pause(self, duration: float) -> None:
        """Wait for a time in [s]."""
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
        table.columns[0].max_width = max(12, width - 66 - 45 * wide)  # names are cut, no numbers
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
    """Show where a joint is between its limits; outside of them the mark is red, at the end."""
    span = limits.upper - limits.lower
    if not math.isfinite(span) or not math.isfinite(position):
        return Text('')
    share = (position - limits.lower) / span
    place = round(min(max(share, 0.0), 1.0) * (GAUGE_WIDTH - 1))
    style = 'bold cyan' if 0.0 <= share <= 1.0 else 'bold red'
    before, after = '─' * place, '─' * (GAUGE_WIDTH - 1 - place)
    return Text.assemble(' ', (before, 'dim'), ('●', style), (after, 'dim'))


class ActionRun:
    """A goal on its way; ``feedback`` is what the server has sent so far."""

    def __init__(
        self,
        client: ServiceClient,
        action: ActionClient,
        goal: Any,  # noqa: ANN401  # goals have no type
        name: str,
    ) -> None:
        """Send it, and wait until it is accepted.

        Raises:
            CallError: It was not accepted, or no server answers.
            GivenUpError: It is no longer wanted.
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
        """Whether it has ended."""
        return bool(self._result.done())

    @property
    def status(self) -> int:
        """The action_msgs/GoalStatus it ended with, once it is done."""
        return int(self._result.result().status)

    @property
    def result(self) -> Any:  # noqa: ANN401
        """Its result, once it is done."""
        return self._result.result().result

    def cancel(self) -> None:
        """Cancel it, and wait for its end."""
        answer = self._handle.cancel_goal_async()
        self._client.wait_until(answer.done, ANSWER_TIMEOUT, f'the cancel of {self._name}')
        self._client.wait_until(lambda: self.done, ANSWER_TIMEOUT, 'the end of the canceled')


MakeFiles = Callable[..., Sequence[Path]]
"""Makes the parameter files of motion nodes: of a robot, in a folder, for nodes and groups."""
MakeDemo = Callable[[Session, Mapping[str, JointRange], float | None, MovedGroups], ArmDemo]
"""Makes a demo for a prepared arm, its joints with a drive, its duration and its moved groups."""


def parse(
    argv: Sequence[str], name: str, description: str, duration: str
) -> tuple[argparse.Namespace, RosOptions]:
    """Parse the command line of a demo; ``description`` and ``duration`` are texts of the help."""
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
    """Bring a simulated arm up, and run a demo until its end or Ctrl-C.

    Args:
        files: Makes the parameter files of motion nodes; None for a demo of drives.
        endless: The table runs until Ctrl-C, without a summary.
        errors: What is raised besides, where a robot does not suit the demo.

    Returns:
        0 when all went well, 1 when something did not, 2 when nothing was started.
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
