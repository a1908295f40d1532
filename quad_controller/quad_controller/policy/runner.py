# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Runs a policy that fits: observation in, protected joint targets out."""

from __future__ import annotations

from dataclasses import dataclass
import math

import numpy as np

from quad_description import ImuSample, JointSample, Quadruped, Targets

from ..gait.velocity import Velocity
from .interface import missing_inputs, PolicyStep
from .metadata import PolicyMetadata
from .network import Floats, Network
from .observation import ObservationBuilder
from .options import ImuFrame, PolicyOptions, VENDOR_PHASE_PERIOD, VENDOR_PHASE_THRESHOLD


@dataclass(frozen=True, slots=True)
class JointMapping:
    """Which joint of the policy is which of the robot.

    Attributes:
        policy: Places in the policy's order.
        robot: Places of the same joints in the robot's order.
        count: Joints of the policy; those that the robot lacks are in neither list.
    """

    policy: tuple[int, ...]
    robot: tuple[int, ...]
    count: int


def joint_mapping(names: tuple[str, ...], robot: Quadruped) -> JointMapping:
    """Return the mapping of a policy's joints by their names."""
    pairs = [
        (index, robot.names.index(name)) for index, name in enumerate(names) if name in robot.names
    ]
    return JointMapping(
        tuple(policy for policy, _ in pairs), tuple(place for _, place in pairs), len(names)
    )


class PolicyRunner:
    """A policy for a robot; see :class:`.interface.Policy`."""

    def __init__(
        self,
        name: str,
        network: Network,
        metadata: PolicyMetadata,
        robot: Quadruped,
        options: PolicyOptions,
    ) -> None:
        """Prepare it.

        Args:
            name: How it is called in messages.
            network: What answers.
            metadata: What its file has; checked before. It has the frame of the IMU where the
                options leave it open.
            robot: The robot.
            options: How to run it.
        """
        self._name, self._network, self._options = name, network, options
        self._map = joint_mapping(metadata.joint_names, robot)
        self._policy_places = np.array(self._map.policy)
        self._robot_places = np.array(self._map.robot)
        self._defaults: Floats = np.array(metadata.default_joint_pos, np.float32)
        self._scale: Floats = np.array(metadata.action_scale, np.float32)
        self._lower, self._upper = self._soft_limits(robot, options.soft_limits)
        threshold = metadata.phase_threshold
        frame = options.imu_frame
        if frame is ImuFrame.AUTO:
            frame = ImuFrame(metadata.imu_frame)
        self._builder = ObservationBuilder(
            self._defaults,
            options.phase_period or metadata.phase_period or VENDOR_PHASE_PERIOD,
            VENDOR_PHASE_THRESHOLD if threshold is None else threshold,
            yawed=frame is ImuFrame.YAWED,
            source=options.gravity_source,
        )
        self._previous: Floats = np.zeros(self._map.count, np.float32)
        self._positions = self._defaults.copy()
        self._velocities = np.zeros_like(self._defaults)
        self._others: Targets = ()
        self._filtered: Floats | None = None

    @property
    def name(self) -> str:
        """How it is called in messages."""
        return self._name

    def reset(self, others: Targets) -> None:
        """Begin anew: no previous action, phase zero.

        Args:
            others: Positions of all joints, for those that the policy does not move [rad].
        """
        self._others = others
        self._previous[:] = 0.0
        self._filtered = None
        self._builder.reset()

    def observe(self, joints: JointSample, imu: ImuSample, velocity: Velocity) -> Floats:
        """Return the observation; it is valid until the next one.

        Args:
            joints: Measured joints.
            imu: Measured attitude and turning.
            velocity: Velocity that is requested.
        """
        self._positions[self._policy_places] = np.array(joints.positions)[self._robot_places]
        if joints.velocities is not None:
            self._velocities[self._policy_places] = np.array(joints.velocities)[self._robot_places]
        return self._builder.build(
            self._positions, self._velocities, imu, velocity, self._previous
        )

    def step(
        self, joints: JointSample, imu: ImuSample, velocity: Velocity, dt: float
    ) -> PolicyStep:
        """Advance.

        Args:
            joints: Measured joints.
            imu: Measured attitude and turning.
            velocity: Velocity that is requested.
            dt: Duration of the step in [s].
        """
        self._builder.advance(dt)
        if missing := missing_inputs(joints, imu):
            return PolicyStep(None, missing)
        observation = self.observe(joints, imu, velocity)
        if not np.isfinite(observation).all():
            return PolicyStep(None, 'the observation is not finite')
        try:
            action = self._network.run(observation)[0]
        except Exception as error:  # noqa: BLE001  # whatever a network fails with, the robot stands
            return PolicyStep(None, f'the network failed: {error}')
        if not np.isfinite(action).all():
            return PolicyStep(None, 'the action is not finite')
        self._previous[:] = action
        return PolicyStep(self._targets(action, dt))

    def _targets(self, action: Floats, dt: float) -> Targets:
        wanted = np.clip(self._defaults + self._scale * action, self._lower, self._upper)
        if self._options.low_pass > 0.0:
            share = 1.0 - math.exp(-math.tau * self._options.low_pass * dt)
            before = wanted if self._filtered is None else self._filtered
            wanted = self._filtered = before + np.float32(share) * (wanted - before)
        targets = list(self._others)
        values = wanted.tolist()
        for policy, place in zip(self._map.policy, self._map.robot, strict=True):
            targets[place] = values[policy]
        return tuple(targets)

    def _soft_limits(self, robot: Quadruped, share: float) -> tuple[Floats, Floats]:
        """Return the range of each joint in the policy's order; the default pose is in it."""
        lower, upper = self._defaults.copy(), self._defaults.copy()
        for policy, place in zip(self._map.policy, self._map.robot, strict=True):
            limits = robot.limits[place]
            if math.isinf(limits.lower) or math.isinf(limits.upper):
                lower[policy], upper[policy] = limits.lower, limits.upper
                continue
            middle, half = (limits.lower + limits.upper) / 2, (limits.upper - limits.lower) / 2
            lower[policy] = min(middle - share * half, self._defaults[policy])
            upper[policy] = max(middle + share * half, self._defaults[policy])
        return lower, upper
