# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Runs a validated policy: observation in, limited joint targets out."""

from __future__ import annotations

from dataclasses import dataclass, replace
import math

import numpy as np

from quad_description import JointSample, Quadruped, Targets

from ..exceptions import PolicyError
from ..gait.velocity import Velocity
from .contract.model import PolicyContract, Source
from .network import Floats, OnnxNetwork
from .observation import ObservationBuilder, Situation
from .options import PolicyOptions

TOLERANCE = 1.1  # share of its noise that velocities may have: the period of reports jitters


@dataclass(frozen=True, slots=True)
class PolicyStep:
    """Result of one policy step."""

    # positions of all joints in [rad]; None when the answer cannot be used
    targets: Targets | None
    reason: str = ''  # why it cannot be used
    observation: Floats | None = None  # what the network was given; None when it was not asked
    action: Floats | None = None  # what it answered


class PolicyRunner:
    """A trained policy that matches the robot."""

    def __init__(
        self,
        network: OnnxNetwork,
        contract: PolicyContract,
        robot: Quadruped,
        *,
        options: PolicyOptions,
        period: float,
    ) -> None:
        """Set up the policy.

        Args:
            contract: Contract of the policy, already checked.
            period: Period of the control loop in [s]; the policy's period is a multiple of it.

        Raises:
            PolicyError: The clip range of a target lies outside of the joint limits.
        """
        self.name, self.digest, self.contract = network.name, network.digest, contract
        self._network = network
        self._low_pass = options.low_pass or contract.action.low_pass
        places = {name: place for place, name in enumerate(robot.names)}
        self._places = [
            (index, places[name])
            for index, name in enumerate(contract.joint_names)
            if name in places
        ]
        """Places of each common joint in the policy's and in the robot's order."""
        self._policy_places, self._robot_places = np.array(self._places, int).reshape(-1, 2).T
        self._defaults: Floats = np.array(contract.default_positions, np.float32)
        self._scale: Floats = np.array(contract.action.scale, np.float32)
        self._offset: Floats = np.array(contract.action.offset, np.float32)
        self._clip = contract.action.clip and np.array(contract.action.clip, np.float32).T
        self._lower, self._upper = self._limits(robot, options.soft_limits)
        self._builder = ObservationBuilder(contract, options.gravity_source)
        self._decimation = max(round(contract.period / period), 1)
        self._waits = 0
        self._others: Targets = ()
        self._wanted: Floats | None = None
        self._filtered: Floats | None = None

    def missing(self, inputs: Situation) -> str:
        """Return which measurement the policy lacks; empty if none."""
        needs, joints, imu = self.contract.needs, inputs.joints, inputs.imu
        if joints is None or imu is None:
            return 'a policy needs joint states and an attitude; there are none yet'
        if joints.velocities is None and needs(Source.JOINT_VELOCITIES):
            return 'a policy needs the velocities of the joints, which /joint_states does not have'
        if imu.angular_velocity is None and needs(Source.ANGULAR_VELOCITY):
            return 'a policy needs the angular velocity, which /imu does not have'
        if inputs.linear_velocity is None and needs(Source.LINEAR_VELOCITY):
            return 'the policy needs the linear velocity of the body, which is not estimated'
        if inputs.foot_contacts is None and needs(Source.FOOT_CONTACTS):
            return 'the policy needs the contacts of the feet, and /foot_contacts is not published'
        return ''

    def inexact(self, joints: JointSample | None, *, stated: bool = False) -> str:
        """Return why joint velocities may be too noisy for the policy; empty if they are not.

        ``stated``: check only if the contract states the noise in training.
        """
        noise = self.contract.velocity_noise
        error = 0.0 if joints is None else joints.velocity_error
        exceeds = error > TOLERANCE * (noise or 0.0)
        needed = self.contract.needs(Source.JOINT_VELOCITIES) and exceeds
        if not needed or (stated and noise is None):
            return ''
        trained = 'nothing says with what noise' if noise is None else f'with {noise:.3g} rad/s'
        return (
            f'joint velocities have an error of {error:.2f} rad/s rms, and {trained} the policy '
            'was trained; use protocol v2 or more reports a second (rate of the hardware node), '
            'or set noise [rad/s rms] of joint_velocities in policy_contract to what it tolerates'
        )

    def reset(self, others: Targets) -> None:
        """Reset the previous action, the history and the phase.

        Args:
            others: Positions of all joints [rad], used for those that the policy does not move.
        """
        self._others = others
        self._builder.previous[:] = 0.0
        self._filtered = self._wanted = None
        self._waits = 0
        self._builder.reset()
        self._network.reset()

    def in_its_order(self, positions: Targets) -> Floats:
        """Return positions in the policy's order; joints that the robot lacks have defaults."""
        ordered: Floats = self._defaults.copy()
        ordered[self._policy_places] = np.array(positions)[self._robot_places]
        return ordered

    def observe(self, inputs: Situation) -> Floats:
        """Return the observation and advance its history by one step."""
        joints, imu = inputs.joints, inputs.imu
        if joints is None or imu is None:
            raise ValueError('a policy observes joints and attitude')
        # joints that only the policy has keep their defaults
        builder, own, there = self._builder, self._policy_places, self._robot_places
        builder.positions[own] = np.array(joints.positions)[there]
        if joints.velocities is not None:
            builder.velocities[own] = np.array(joints.velocities)[there]
        velocity = self._command(inputs.velocity)
        if velocity != inputs.velocity:
            inputs = replace(inputs, velocity=velocity)
        return builder.build(inputs, imu)

    def step(self, inputs: Situation, dt: float) -> PolicyStep:
        """Advance by a time [s]; a slower policy runs only once in several steps."""
        self.advance(dt)
        if missing := self.missing(inputs):
            return PolicyStep(None, missing)
        if self._waits > 0 and self._wanted is not None:
            self._waits -= 1
            return PolicyStep(self._targets(self._wanted, dt))
        observation = self.observe(inputs)
        if not np.isfinite(observation).all():
            return PolicyStep(None, 'the observation is not finite')
        try:
            action = self._network.run(observation)[0]
        except Exception as error:  # noqa: BLE001  # whatever a network fails with, the robot stands
            return PolicyStep(None, f'the network failed: {error}')
        if not np.isfinite(action).all():
            return PolicyStep(None, 'the action is not finite')
        return PolicyStep(self.act(action, dt), observation=observation, action=action)

    def advance(self, dt: float) -> None:
        """Advance the phase clock by a duration in [s]."""
        self._builder.advance(dt)

    def act(self, action: Floats, dt: float) -> Targets:
        """Convert an action to limited targets, and store it as the previous action."""
        if self._clip is not None:
            action = np.clip(action, *self._clip)
        self._builder.previous[:] = action
        self._waits = self._decimation - 1
        target = self._offset + self._scale * action
        self._wanted = np.minimum(np.maximum(target, self._lower), self._upper)
        return self._targets(self._wanted, dt)

    def _command(self, velocity: Velocity) -> Velocity:
        """Clamp a velocity to the command ranges of the training."""
        if self.contract.commands is None:
            return velocity
        axes = zip(velocity, self.contract.commands, strict=True)
        return Velocity(*(min(max(value, low), high) for value, (low, high) in axes))

    def _targets(self, wanted: Floats, dt: float) -> Targets:
        if self._low_pass > 0.0:
            share = 1.0 - math.exp(-math.tau * self._low_pass * dt)
            before = wanted if self._filtered is None else self._filtered
            wanted = self._filtered = before + np.float32(share) * (wanted - before)
        targets = list(self._others)
        values = wanted.tolist()
        for policy, place in self._places:
            targets[place] = values[policy]
        return tuple(targets)

    def _limits(self, robot: Quadruped, share: float) -> tuple[Floats, Floats]:
        """Return the target ranges in the policy's order, including the default pose."""
        lower, upper = self._defaults.copy(), self._defaults.copy()
        for policy, place in self._places:
            limits = robot.limits[place]
            if math.isinf(limits.lower) or math.isinf(limits.upper):
                lower[policy], upper[policy] = limits.lower, limits.upper
                continue
            middle, half = (limits.lower + limits.upper) / 2, (limits.upper - limits.lower) / 2
            lower[policy] = min(middle - share * half, self._defaults[policy])
            upper[policy] = max(middle + share * half, self._defaults[policy])
        if self.contract.action.target_clip is not None:
            lowest, highest = np.array(self.contract.action.target_clip, np.float32).T
            np.maximum(lower, lowest, out=lower)
            np.minimum(upper, highest, out=upper)
            for name, low, high in zip(self.contract.joint_names, lower, upper, strict=True):
                if low > high:
                    raise PolicyError(
                        f'action.target_clip of {name} lies outside of its soft limits'
                    )
        return lower, upper
