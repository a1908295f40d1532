# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Test arenas: physics in virtual time, or a simulated robot on a serial line in real time.

Only this module of the package depends on the simulator.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
import time

from quad_description import Backend, robot_urdf, RobotState
from quad_hardware import CommandError, HardwareError, NoAnswerError
from quad_hardware.backend import JointBytes, robot_at
from quad_hardware.protocol import Model, V2
from quad_sim import parse_servo, ServedRobot, SimulationError, Terrain, WatchedRobot
from quad_sim.physics import Meter, PhysicsBackend, Robot, Variation

from ..exceptions import CheckError
from ..gait.parameters import GaitParameters, ServoModel
from ..policy.options import ServoResponse

MAX_PAUSE = 0.15  # [s] between two steps, which the controller is not to blame for
SILENCE_TIMEOUT = 20.0  # [s] with a robot that does not report
FRESH = 3  # reports after which what was observed before the robot was put down is gone


@dataclass(frozen=True, slots=True)
class Conditions:
    """Variations of robot and ground."""

    trunk_mass: float = 1.0  # factor of the mass of the trunk
    push: float = 0.0  # change of the velocity at once, to any side, every two seconds, in [m/s]
    roughness: float = 0.0  # height of the highest bumps of the ground in [m]
    v1: bool = False  # targets and positions pass through the bytes of protocol v1


AS_MADE = Conditions()
"""The robot as it is, on level ground."""

TIPPING_PUSH = 1.3
"""A push that tips the gait in about half of the cases, in [m/s]."""


@dataclass(frozen=True, slots=True)
class RobotChoice:
    """Selects the simulated robot."""

    preset: str = 'lite'  # of its description
    arm: bool = False  # it has its arm
    servo: str = 'nominal'  # its servos, as fake_xgo takes them

    @property
    def urdf(self) -> str:
        """URDF of the robot."""
        return robot_urdf(self.preset, arm=self.arm)

    def tuned(self, gait: GaitParameters) -> GaitParameters:
        """Return gait parameters adapted to the stiffness of the servos."""
        model = gait.servo or ServoModel()
        return replace(gait, servo=replace(model, kp=parse_servo(self.servo).stiffness))


def servo_response(servo: str) -> ServoResponse:
    """Return the response of a model's servos to their targets."""
    parameters = parse_servo(servo)
    return ServoResponse(
        parameters.stiffness,
        parameters.velocity_gain + parameters.damping,
        parameters.armature,
        parameters.delay + 0.5 * parameters.interpolation,  # the mean of a ramp
    )


class BytesBackend(PhysicsBackend):
    """A robot in physics behind protocol v1 encoding, in virtual time."""

    def __init__(self, robot: Robot, choice: RobotChoice, watch: Callable[[], None]) -> None:
        super().__init__(robot, watch=watch)
        self._bytes = JointBytes(choice.urdf, Model(choice.preset))

    def reset(self) -> RobotState:
        """Reset the robot to standing."""
        self._bytes.reset()
        return super().reset()

    def step(self, targets: Sequence[float] | None) -> RobotState:
        """Send targets and advance by one period."""
        return super().step(targets and self._bytes.rounded(targets))

    def observe(self) -> RobotState:
        """Return the state that the protocol can carry."""
        state = super().observe()
        positions = () if state.joints is None else state.joints.positions
        return replace(state, joints=self._bytes.read(positions, state.time))


class PhysicsArena:
    """A robot in physics, in virtual time."""

    interruption = ''  # virtual time waits

    def __init__(self, choice: RobotChoice, conditions: Conditions = AS_MADE) -> None:
        """Create robot and ground."""
        urdf = choice.urdf
        ground = Terrain(roughness=conditions.roughness, seed=1)
        robot = Robot(urdf, parse_servo(choice.servo), ground)
        meter = Meter(robot, urdf)
        self.robot = WatchedRobot(robot, meter)
        self.robot.start = {'variation': Variation(trunk_mass=conditions.trunk_mass)}
        self.backend: Backend = PhysicsBackend(robot, watch=meter.sample)
        if conditions.v1:
            self.backend = BytesBackend(robot, choice, meter.sample)

    def stand(self) -> RobotState:
        """Put the robot on its feet."""
        self.backend.reset()
        self.robot.stand()
        return self.backend.observe()


class SerialArena(Backend):
    """A robot in physics behind a serial line, in another process and in real time.

    On a busy machine, it waits for the robot and records the interruption.
    """

    def __init__(self, served: ServedRobot, driver: Backend) -> None:
        """Observe a robot through the driver of its serial port."""
        self.robot, self._driver = served, driver
        self.names, self.period = driver.names, driver.period
        self.backend: Backend = self
        # what the machine did since the robot stood or was measured; empty for nothing
        self.interruption = ''
        self._stepped_at: float | None = None

    def reset(self) -> RobotState:
        """Wait for a report."""
        return self._driver.reset()

    def step(self, targets: Sequence[float] | None) -> RobotState:
        """Send targets and wait for the next report.

        Raises:
            NoAnswerError: No report arrives for a long time.
        """
        now, before = time.monotonic(), self._stepped_at
        if before is not None and now - before > MAX_PAUSE:
            self.interruption = f'a pause of {now - before:.2f} s'
        try:
            state = self._driver.step(targets)
        except (NoAnswerError, CommandError) as error:
            self.interruption = str(error)
            state = self._wait(now + SILENCE_TIMEOUT)
        self._stepped_at = time.monotonic()
        return state

    def observe(self) -> RobotState:
        """Return the state of the newest report."""
        return self._driver.observe()

    def close(self) -> None:
        """Do nothing: :func:`serial_arena` owns the robot."""

    def _wait(self, deadline: float) -> RobotState:
        """Return the next report; retry after driver time-outs until the deadline."""
        while time.monotonic() < deadline:
            with suppress(NoAnswerError):
                return self._driver.step(None)
        return self._driver.step(None)

    def stand(self) -> RobotState:
        """Put the robot on its feet."""
        self.robot.stand()
        for _ in range(FRESH):
            state = self.step(None)
        self.interruption = ''
        return state


@contextmanager
def serial_arena(choice: RobotChoice, *, noise: bool = True) -> Iterator[SerialArena]:
    """Simulate a robot behind a serial port, by default with a board's noise; open the port.

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
