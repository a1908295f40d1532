# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A robot without physics: servos only, for the serial side."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np

from quad_description import movable_joints
from quad_description.rotations import Vector

from ..exceptions import SetupError, TargetError
from .state import Array, BasePose, BaseVelocity, disturb, Imu, Measurement, Noise, NONE
from .targets import TargetRamp, Targets

TIMESTEP = 0.002  # [s]
SET_POINT_TIME = 0.02  # [s] of a servo from one target to the next
GRAVITY = 9.81  # [m/s2]
_FEET = 4


class KinematicRobot:
    """A robot held up in the air: servos follow at once, and nothing else moves.

    Costs next to nothing and needs no MuJoCo; good for the serial side, not for gaits.
    """

    def __init__(
        self,
        urdf: str,
        *,
        pose: Mapping[str, float] | None = None,
        noise: Noise = NONE,
        seed: int = 0,
    ) -> None:
        """Hold the robot.

        Args:
            pose: Joint positions at the start [rad]; zero for those left out.
            noise: What :meth:`measure` adds.

        Raises:
            SetupError: The pose names joints that the robot lacks.
        """
        joints = movable_joints(urdf)
        self.joint_names = tuple(joint.name for joint in joints)
        self._noise = noise
        self._ramp = TargetRamp(joints, TIMESTEP, np.zeros(len(joints)))
        self.reset(pose=pose, seed=seed)

    def reset(self, *, pose: Mapping[str, float] | None = None, seed: int = 0) -> None:
        """Begin anew.

        Raises:
            SetupError: The pose names joints that the robot lacks.
        """
        self._random = np.random.default_rng(seed)
        self._on = dict.fromkeys(self.joint_names, True)
        self._missed: dict[str, float] = {}  # targets that came without torque
        self._steps, self._remaining_steps = 0, 0.0
        self._ramp.jump(np.zeros(len(self.joint_names)))
        try:
            self._ramp.approach(pose or {}, 0.0)
        except TargetError as error:
            raise SetupError(f'start pose: {error}') from error
        self._ramp.advance()
        self._before: Array = self._ramp.values.copy()

    @property
    def time(self) -> float:
        """Time since the start [s]."""
        return self._steps * TIMESTEP

    @property
    def base_pose(self) -> BasePose:
        """Level, and where it was."""
        return BasePose((0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))

    @property
    def base_velocity(self) -> BaseVelocity:
        """None."""
        return BaseVelocity((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))

    @property
    def foot_contacts(self) -> tuple[bool, ...]:
        """None: it is held up in the air."""
        return (False,) * _FEET

    @property
    def joint_targets(self) -> Array:
        """Set-points now [rad]."""
        return np.array(self._ramp.values)

    def set_targets(self, targets: Targets, duration: float | None = None) -> None:
        """Set new targets [rad]; servos without torque stay where they are.

        Raises:
            TargetError: As :meth:`quad_sim.physics.Robot.set_targets`.
        """
        self._ramp.check(targets)
        if not isinstance(targets, Mapping):
            targets = dict(zip(self.joint_names, targets, strict=True))
        held = {name: value for name, value in targets.items() if self._on[name]}
        self._missed |= {name: value for name, value in targets.items() if not self._on[name]}
        self._ramp.approach(held, SET_POINT_TIME if duration is None else duration)

    def set_torque(
        self, on: bool, joints: Iterable[str] | None = None, *, hold: bool = True
    ) -> None:
        """Switch servos on or off, as the robot in physics does; they do not fall."""
        names = self.joint_names if joints is None else tuple(joints)
        self._on |= dict.fromkeys(names, on)
        missed = {name: self._missed.pop(name) for name in names if on and name in self._missed}
        if not hold:
            self._ramp.approach(missed, 0.0)

    def torque_on(self, joint: str) -> bool:
        """Return whether a servo holds."""
        return self._on[joint]

    def push(self, force: Vector, duration: float = 0.1) -> None:
        """Refuse: what is held does not move.

        Raises:
            SetupError: Always.
        """
        raise SetupError('a robot without physics cannot be pushed; leave out --physics none')

    def kick(self, velocity: Vector) -> None:
        """Refuse, as :meth:`push` does.

        Raises:
            SetupError: Always.
        """
        raise SetupError('a robot without physics cannot be kicked; leave out --physics none')

    def step(self, duration: float) -> None:
        """Advance the time [s]."""
        self._remaining_steps += duration / TIMESTEP
        count = int(self._remaining_steps + 1e-6)
        self._remaining_steps -= count
        self._steps += count
        for _ in range(count):
            self._before[:] = self._ramp.values
            self._ramp.advance()

    def measure(self) -> Measurement:
        """Return what the sensors measure."""
        values = self.joint_targets
        level = (0.0, 0.0, 0.0)
        truth = Measurement(
            time=self.time,
            imu=Imu((0.0, 0.0, GRAVITY), level, level),
            positions=values,
            velocities=(values - self._before) / TIMESTEP,
            torques=np.zeros(len(values)),
            foot_forces=np.zeros(_FEET),
        )
        return disturb(truth, self._noise, self._random)
