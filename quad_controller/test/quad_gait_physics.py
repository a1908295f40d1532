# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A controller and a robot in physics, in virtual time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from quad_controller import (
    Controller,
    GaitParameters,
    ServoModel,
    State,
    StateParameters,
    Velocity,
)
from quad_controller.gait.velocity import REST
from quad_controller.policy.runner import PolicyRunner
from quad_description import quadruped, robot_urdf, RobotState, Targets
from quad_sim import ServoModel as Servos
from quad_sim import Terrain
from quad_sim.physics import Meter, PhysicsBackend, Robot
from quad_sim.state import FLAT

PERIOD = 0.02  # [s]
URDF = robot_urdf()
MODEL = quadruped(URDF)
FIRM = GaitParameters(servo=ServoModel(kp=Servos.FIRM.parameters.stiffness))
"""A gait for servos that hardly give way."""


def firm(terrain: Terrain = FLAT) -> Robot:
    """Return a robot with such servos."""
    return Robot(URDF, Servos.FIRM, terrain)


@dataclass(frozen=True)
class Travel:
    """How the robot went; means over some time, in its own frame.

    Attributes:
        x: Forward in [m/s].
        y: To the left in [m/s].
        yaw: Turning in [rad/s].
        tilt: Largest angle between the body's z axis and up in [rad].
    """

    x: float
    y: float
    yaw: float
    tilt: float


class PhysicsRig:
    """Lets a controller walk a robot."""

    def __init__(
        self,
        robot: Robot | None = None,
        gait: GaitParameters | None = None,
        policy: PolicyRunner | None = None,
        urdf: str = URDF,
        sense: Callable[[RobotState], RobotState] = lambda state: state,
        *,
        states: StateParameters | None = None,
    ) -> None:
        """Stand up, by what the robot's sensors say."""
        self._sense = sense
        self.robot, self.model, self._urdf = robot or Robot(urdf), quadruped(urdf), urdf
        self._backend = PhysicsBackend(self.robot, PERIOD)
        self.controller = Controller(
            self.model, gait or GaitParameters(), states or StateParameters(), policy=policy
        )
        self.tilt = 0.0
        self.step(REST)
        self.mode('stand')
        self.run(2.0)

    def mode(self, mode: str) -> None:
        """Ask for a mode that has to be accepted."""
        answer = self.controller.set_mode(mode)
        assert answer.accepted, answer.message

    def step(self, velocity: Velocity) -> Targets:
        """Pass one period; return the targets that were sent."""
        self.controller.set_velocity(velocity)
        state = self._sense(self._backend.observe())
        targets = self.controller.step(state, PERIOD).targets
        self.hold(PERIOD, targets)
        return targets or ()

    def hold(self, duration: float, targets: Targets | None) -> None:
        """Pass some seconds with targets, without the controller."""
        for _ in range(round(duration / PERIOD)):
            self._backend.step(targets)
            self.tilt = max(self.tilt, self.robot.base_pose.tilt)

    def run(self, duration: float, velocity: Velocity = REST) -> None:
        """Pass some seconds with a velocity."""
        for _ in range(round(duration / PERIOD)):
            self.step(velocity)

    def travel(self, duration: float, velocity: Velocity) -> Travel:
        """Walk with a velocity and return how the robot went."""
        self.tilt = 0.0
        meter = Meter(self.robot, self._urdf)
        for _ in range(round(duration / PERIOD)):
            self.step(velocity)
            meter.sample()
        way = meter.read()
        return Travel(way.x / duration, way.y / duration, way.yaw / duration, way.tilt)

    @property
    def state(self) -> str:
        """The controller's state."""
        return self.controller.status.title

    @property
    def faulted(self) -> bool:
        """Whether the controller has given up."""
        return self.controller.status.state is State.FAULT
