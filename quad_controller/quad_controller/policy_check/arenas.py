# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Where a robot walks: in physics at once, or behind its serial line with clocks that do not wait.

The only part of this package that knows the simulator.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
import time

from quad_description import Backend, robot_urdf, RobotState
from quad_hardware import CommandError, HardwareError, NoAnswerError
from quad_hardware.backend import robot_at
from quad_hardware.protocol import V2
from quad_sim import (
    CommandTiming,
    ServedRobot,
    ServoModel,
    SimulationError,
    Terrain,
)
from quad_sim.physics import ImuBias, Meter, Metered, PhysicsBackend, Robot, Variation

from ..exceptions import CheckError
from ..policy.gains import ServoResponse
from .conditions import AS_MADE, Conditions

MAX_PAUSE = 0.15  # [s] between two steps, which the controller is not to blame for
SILENCE_TIMEOUT = 20.0  # [s] with a robot that does not report
FRESH = 3  # reports after which what was observed before the robot was put down is gone


@dataclass(frozen=True, slots=True)
class RobotChoice:
    """Which simulated robot walks."""

    preset: str = 'lite'  # of its description
    arm: bool = False  # it has its arm
    servo: str = 'firm'  # model of its servos

    @property
    def urdf(self) -> str:
        """What it is made of."""
        return robot_urdf(self.preset, arm=self.arm)


def servo_response(servo: str) -> ServoResponse:
    """Return how the servos of a model follow their targets."""
    parameters = ServoModel(servo).parameters
    return ServoResponse(
        parameters.stiffness,
        parameters.velocity_gain + parameters.damping,
        parameters.armature,
        0.5 * parameters.interpolation,  # the mean of a ramp
    )


class PhysicsArena:
    """A robot in physics, in virtual time."""

    def __init__(self, choice: RobotChoice, conditions: Conditions = AS_MADE) -> None:
        """Make robot and ground.

        Args:
            conditions: What is otherwise than as it is made.
        """
        urdf = choice.urdf
        ground = Terrain(roughness=conditions.roughness, seed=1)
        self._robot = Robot(urdf, ServoModel(choice.servo), ground)
        self._variation = Variation(conditions.friction, conditions.trunk_mass)
        gyro, level = conditions.gyro_bias, conditions.level_bias
        self.backend: Backend = PhysicsBackend(
            self._robot,
            delay=conditions.delay,
            bias=ImuBias((gyro, gyro, gyro), level, level) if gyro or level else None,
        )
        self._meter = Meter(self._robot, urdf)

    def stand(self) -> RobotState:
        """Put the robot on its feet."""
        self.backend.reset()
        self._robot.reset(variation=self._variation)
        self._meter.begin()
        return self.backend.observe()

    def kick(self, x: float, y: float) -> None:
        """Change its velocity at once [m/s]."""
        self._robot.kick((x, y, 0.0))

    def watch(self) -> None:
        """Look at it."""
        self._meter.sample()

    def begin(self) -> None:
        """Measure from now on."""
        self._meter.begin()

    def read(self) -> tuple[Metered, CommandTiming | None]:
        """Return what was measured."""
        return self._meter.read(), None

    @property
    def interruption(self) -> str:
        """Nothing: virtual time waits."""
        return ''


class PatientBackend(Backend):
    """A robot in real time whose machine may be busy: it is waited for, and that is noted."""

    def __init__(self, backend: Backend) -> None:
        """Wait for a robot."""
        self._backend = backend
        self.names, self.period = backend.names, backend.period
        self.interruption = ''  # what came between two steps last; empty for nothing
        self._stepped_at: float | None = None

    def reset(self) -> RobotState:
        """Wait for a report."""
        return self._backend.reset()

    def step(self, targets: Sequence[float] | None) -> RobotState:
        """Send targets, and wait for the next report.

        Raises:
            NoAnswerError: There is none for a long time.
        """
        now, before = time.monotonic(), self._stepped_at
        if before is not None and now - before > MAX_PAUSE:
            self.interruption = f'a pause of {now - before:.2f} s'
        try:
            state = self._backend.step(targets)
        except (NoAnswerError, CommandError) as error:
            self.interruption = str(error)
            state = self._wait(now + SILENCE_TIMEOUT)
        self._stepped_at = time.monotonic()
        return state

    def observe(self) -> RobotState:
        """Return what the newest report says."""
        return self._backend.observe()

    def close(self) -> None:
        """Leave the robot to whoever opened it."""

    def _wait(self, deadline: float) -> RobotState:
        """Return the next report; a time-out of the driver is no end before the deadline."""
        while time.monotonic() < deadline:
            with suppress(NoAnswerError):
                return self._backend.step(None)
        return self._backend.step(None)


class SerialArena:
    """A robot in physics behind its serial line, in another process and in real time."""

    def __init__(self, served: ServedRobot, backend: Backend) -> None:
        """Watch a robot."""
        self._served, self._patient = served, PatientBackend(backend)
        self.backend: Backend = self._patient  # the driver of its serial port

    def stand(self) -> RobotState:
        """Put the robot on its feet."""
        self._served.stand()
        for _ in range(FRESH):
            state = self.backend.step(None)
        self._patient.interruption = ''
        return state

    def kick(self, x: float, y: float) -> None:
        """Change its velocity at once [m/s]."""
        self._served.kick(x, y)

    def watch(self) -> None:
        """Do nothing: the process of the robot looks at it."""

    def begin(self) -> None:
        """Measure from now on."""
        self._served.begin()
        self._patient.interruption = ''

    def read(self) -> tuple[Metered, CommandTiming | None]:
        """Return what was measured."""
        watched = self._served.read()
        return watched.metered, watched.timing

    @property
    def interruption(self) -> str:
        """What the machine did since it stood or was measured; empty for nothing."""
        return self._patient.interruption


@contextmanager
def serial_arena(choice: RobotChoice, *, noise: bool = True) -> Iterator[SerialArena]:
    """Let a robot live behind a serial port, and open it.

    Args:
        noise: Its sensors are as noisy as those of a board.

    Raises:
        CheckError: The simulation or the line failed.
    """
    arguments = ['--protocol', V2.name, '--preset', choice.preset, '--servo', choice.servo]
    arguments += ['--noise', 'board' if noise else 'none', *(['--arm'] if choice.arm else [])]
    try:
        with (
            ServedRobot(*arguments) as served,
            robot_at(served.port, choice.urdf, (V2,), imu_checked=True) as backend,
        ):
            backend.reset()
            yield SerialArena(served, backend)
    except (SimulationError, HardwareError) as error:
        raise CheckError(f'the chain broke: {error}') from error
