# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Runs and observes a simulated robot behind a serial port, in its own process.

Clients exercise the full chain in real time: servos, board and serial line.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from dataclasses import dataclass, field
from functools import partial
import multiprocessing
from multiprocessing.connection import Connection
from pathlib import Path
import signal
import subprocess
import sys
import tempfile
from typing import Any, cast, TYPE_CHECKING

from quad_description import Pose, pose_positions, robot_urdf

from .exceptions import SetupError, SimulationError
from .options import build, parse_arguments, Simulation
from .robot_line import CommandTiming, RobotLine
from .server import PseudoTerminal, Server

if TYPE_CHECKING:
    from typing_extensions import Self

    from .physics import Meter, Robot
    from .physics.backend import Metered

START_TIME = 120.0  # [s] in which the process has to be there, on a machine that has much to do
ANSWER_TIME = 40.0  # [s]


@dataclass(frozen=True, slots=True)
class Watched:
    """Observations of a robot since :meth:`ServedRobot.begin`."""

    metered: Metered  # where it went, and what that cost
    # when its commands came; nothing without real clocks
    timing: CommandTiming = field(default_factory=CommandTiming)

    def __add__(self, other: Watched) -> Watched:
        """Merge two observations."""
        return Watched(self.metered + other.metered, self.timing + other.timing)


class WatchedRobot:
    """A robot in physics that can be reset, kicked and observed."""

    def __init__(self, robot: Robot, meter: Meter, line: RobotLine | None = None) -> None:
        """Observe a robot and, if it has a line, the timing of its commands."""
        self._robot, self._meter, self._line = robot, meter, line
        # how it stands up: arguments of its reset
        self.start: Mapping[str, Any] = {}

    def stand(self) -> None:
        """Reset the robot to standing at its start."""
        self._robot.reset(**self.start)
        self.begin()

    def kick(self, x: float, y: float) -> None:
        """Change its velocity instantly, forward and left [m/s]."""
        self._robot.kick((x, y, 0.0))

    def begin(self) -> None:
        """Restart the observation."""
        self._meter.begin()
        if self._line is not None:
            self._line.command_times.clear()

    def read(self) -> Watched:
        """Return the observations since :meth:`begin`."""
        line = self._line
        timing = CommandTiming() if line is None else line.command_times.timing()
        return Watched(self._meter.read(), timing)


class ServedRobot:
    """Runs a robot in real time, for a ``with`` block."""

    def __init__(self, *arguments: str) -> None:
        """Set up the robot; it starts with the block.

        Args:
            arguments: Arguments of fake_xgo, except ``--link`` and ``--start``.
        """
        self._arguments = arguments
        self.port = ''  # path of its serial port

    def __enter__(self) -> Self:
        """Start the process.

        Raises:
            SimulationError: The process did not start; the message has the reason.
        """
        self._folder = tempfile.TemporaryDirectory(prefix='quad_sim-')
        self.port = str(Path(self._folder.name) / 'xgo')
        self._pipe, theirs = multiprocessing.Pipe()
        argv = ['--link', self.port, '--start', Pose.STAND.value, *self._arguments]
        number = theirs.fileno()
        # not multiprocessing's: that runs the main module of this process again
        program = [sys.executable, '-c', f'import {__name__} as m; m.serve()', str(number), *argv]
        self._process = subprocess.Popen(program, pass_fds=[number])
        theirs.close()
        try:
            self._answer(START_TIME)
        except BaseException:
            self.__exit__(None, None, None)
            raise
        return self

    def __exit__(self, *_error: object) -> None:
        """End the process."""
        self._pipe.close()  # which it takes as the end
        try:
            self._process.wait(ANSWER_TIME)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._folder.cleanup()

    def stand(self) -> None:
        """See :meth:`WatchedRobot.stand`."""
        self._ask('stand')

    def kick(self, x: float, y: float) -> None:
        """See :meth:`WatchedRobot.kick`."""
        self._ask('kick', x, y)

    def begin(self) -> None:
        """See :meth:`WatchedRobot.begin`."""
        self._ask('begin')

    def read(self) -> Watched:
        """See :meth:`WatchedRobot.read`."""
        return cast('Watched', self._ask('read'))

    def _ask(self, request: str, *arguments: float) -> object:
        try:
            self._pipe.send((request, arguments))
        except OSError as error:
            raise SimulationError(f'the simulated robot is gone: {error}') from error
        return self._answer(ANSWER_TIME)

    def _answer(self, timeout: float) -> object:
        try:
            if not self._pipe.poll(timeout):
                raise SimulationError(f'the simulated robot did not answer within {timeout:g} s')
            answer = self._pipe.recv()
        except EOFError as error:
            raise SimulationError('the process of the simulated robot has ended') from error
        if isinstance(answer, Exception):
            raise answer
        return answer


def serve() -> None:
    """Serve a robot until the pipe closes whose number is the first argument."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent ends by it, and closes the pipe
    number, *argv = sys.argv[1:]
    with Connection(int(number)) as pipe:
        try:
            simulation = build(parse_arguments(argv))
            with PseudoTerminal(Path(argv[1])) as terminal:
                _Watch(simulation, argv, terminal).answer(pipe)
        except SimulationError as error:
            pipe.send(error)


class _Watch:
    """Executes requests on a robot."""

    def __init__(
        self, simulation: Simulation, argv: Sequence[str], terminal: PseudoTerminal
    ) -> None:
        from .physics import Meter, Robot

        robot = simulation.plant
        if not isinstance(robot, Robot):
            raise SetupError('a robot without physics goes nowhere; leave out --physics none')
        options = parse_arguments(argv)
        meter = Meter(robot, robot_urdf(options.preset, options.arm, options.trunk_mass))
        self._robot = WatchedRobot(robot, meter, simulation.line)
        self._robot.start = {'pose': pose_positions(Pose.STAND, options.arm)}
        self._server = Server(robot, simulation.line, terminal, meter.sample)

    def answer(self, pipe: Connection) -> None:
        """Serve requests until the pipe closes."""
        with closing(self._server), ThreadPoolExecutor(1) as pool:
            life = pool.submit(self._server.run)
            try:
                pipe.send(None)
                while True:
                    request, arguments = pipe.recv()
                    pipe.send(self._do(request, arguments))
            except (EOFError, OSError):  # the parent is gone
                pass
            finally:
                self._server.stop()
            life.result()

    def _do(self, request: str, arguments: tuple[Any, ...]) -> object:
        action = partial(getattr(self._robot, request), *arguments)
        try:
            return self._server.submit(action).result(ANSWER_TIME / 2)
        except (SimulationError, TimeoutError) as error:
            return SimulationError(f'{request}: {error}')
