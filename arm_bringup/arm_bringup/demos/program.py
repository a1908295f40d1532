# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The program of each demo of an arm: its command line, the processes of the arm, and its run."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
import sys
from typing import Any, Protocol

from urdf_reader import JointRange

from demo_runner import DemoScenario, Display, REFRESH_PERIOD, run_demo
from process_supervisor import (
    Executable,
    parse_with_ros,
    RosOptions,
    SupervisorError,
    USAGE_ERROR,
)
from process_supervisor.arguments import seconds_from

from ..description import joint_limits
from ..exceptions import BringupError, RobotError
from ..groups import moved_groups, MovedGroups
from ..robots import Robot
from ..session import (
    add_arguments,
    locate,
    no_files,
    robots_epilog,
    Session,
    session,
    SIMULATED_BUS,
)
from .figures import Figures
from .table import ArmView


class MakeFiles(Protocol):
    """Makes the parameter files of motion nodes."""

    def __call__(
        self, robot: Robot, folder: Path, ros: RosOptions, groups: MovedGroups
    ) -> Sequence[Path]:
        """Make them for the groups of a robot that are moved, in a folder."""


@dataclass(frozen=True, slots=True)
class DemoArm:
    """A simulated arm, for which a demo is about to be set up.

    Attributes:
        session: Its processes, prepared.
        limits: Its joints that have a drive.
        duration: How long the demo runs in [s]; None until Ctrl-C.
        groups: Its groups that are moved; none for a demo of drives.
    """

    session: Session
    limits: Mapping[str, JointRange]
    duration: float | None
    groups: MovedGroups


@dataclass(frozen=True, slots=True)
class DemoSetup:
    """What a demo runs on its arm.

    Attributes:
        commands: Commands to try in a second terminal.
        make_scenario: Makes its scenario, for a display.
        make_client: Makes its ROS client, in the thread of the scenario.
        figures: The first ones, before there are any.
    """

    commands: Sequence[str]
    make_scenario: Callable[[Display[Any]], DemoScenario[Any]]
    make_client: Callable[[Callable[[], bool]], Any]
    figures: Figures


@dataclass(frozen=True, slots=True)
class DemoProgram:
    """What a demo has of its own.

    Attributes:
        name: Name of its executable.
        description: What it does, for the help.
        duration: What ``--duration`` does, for the help.
        master: What runs the bus.
        set_up: Makes what it runs on an arm.
        beside: What runs beside the drives, for the title.
        label: What its own line in the table begins with; without one it has none.
        find_robot: Finds the robot that is asked for.
        files: Makes the parameter files of motion nodes; None for a demo of drives.
        plan: With move_group.
        endless: Whoever saw its table until Ctrl-C needs no summary.
        errors: What it raises besides, where a robot does not suit it.
    """

    name: str
    description: str
    duration: str
    master: Executable
    set_up: Callable[[DemoArm], DemoSetup]
    beside: str = ''
    label: str = ''
    find_robot: Callable[[argparse.Namespace], Robot] = locate
    files: MakeFiles | None = None
    plan: bool = False
    endless: bool = False
    errors: tuple[type[Exception], ...] = ()

    def parse(self, argv: Sequence[str]) -> tuple[argparse.Namespace, RosOptions]:
        """Parse the command line.

        Args:
            argv: Arguments without the program's name.

        Returns:
            What was asked for, and the options of all nodes.
        """
        parser = argparse.ArgumentParser(
            prog=f'ros2 run arm_bringup {self.name}',
            description=self.description,
            epilog=robots_epilog(),
            allow_abbrev=False,
        )
        default_bus = f'{SIMULATED_BUS}: vcan0 when it is there, else multicast'
        add_arguments(parser, default_bus=default_bus)
        parser.add_argument('--duration', metavar='S', type=seconds_from(0.0), help=self.duration)
        return parse_with_ros(parser, argv)

    def main(self, argv: Sequence[str] | None = None) -> int:
        """Run the demo until its end or Ctrl-C.

        Args:
            argv: Arguments without the program's name; None takes those of the process.

        Returns:
            0 when all went well, 1 when something did not, 2 when nothing was started.
        """
        arguments, ros = self.parse(sys.argv[1:] if argv is None else argv)
        errors: tuple[type[Exception], ...] = (BringupError, SupervisorError, *self.errors)
        try:
            return self._run(arguments, ros)
        except errors as error:
            sys.stderr.write(f'{error}\n')
            return USAGE_ERROR

    def _run(self, arguments: argparse.Namespace, ros: RosOptions) -> int:
        robot, groups = self.find_robot(arguments), MovedGroups(())
        make_files: Callable[[Robot, Path, RosOptions], Sequence[Path]] = no_files
        if self.files is not None:
            if robot.lacking:
                raise RobotError(
                    f'{robot.name} lacks {robot.lacking}: '
                    f'ros2 run arm_bringup check {arguments.robot} reports all of it'
                )
            groups = moved_groups(robot)
            make_files = partial(self.files, groups=groups)
        with session(
            arguments,
            ros,
            simulate=True,
            master=self.master,
            master_parameters={'diagnostics_period': f'{REFRESH_PERIOD}'},
            master_files=make_files,
            plan=self.plan,
        ) as arm:
            return self._run_on(arm, groups, arguments.duration)

    def _run_on(self, arm: Session, groups: MovedGroups, duration: float | None) -> int:
        limits = {
            name: each for name, each in joint_limits(arm.urdf).items() if name in arm.drives
        }
        setup = self.set_up(DemoArm(arm, limits, duration, groups))
        if arm.start:
            sys.stdout.write(f'{arm.start}\n')
        title = f'{arm.robot.name}: {len(arm.drives)} simulated drives on {arm.bus}{self.beside}'
        return run_demo(
            arm.processes,
            view=ArmView(title, limits, self.label),
            figures=setup.figures,
            commands=setup.commands,
            make_scenario=setup.make_scenario,
            make_client=setup.make_client,
            endless=self.endless and duration is None,
        )
