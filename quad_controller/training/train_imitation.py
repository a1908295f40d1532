# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Trains the policy that ships with the package: an imitation of the geometric gait, by DAgger.

The network walks a robot in physics, with noise on its sensors, pushes and changing commands; the
teacher says at every step what it would have done, and the network is trained on all of that
(Ross, Gordon and Bagnell, 2011). Needs MuJoCo and onnx, a few minutes and one core::

    python train_imitation.py ../quad_controller/policies/trot_imitation.onnx
"""

from __future__ import annotations

import argparse
from pathlib import Path
import sys
import time

from gait_teacher import GaitTeacher
import numpy as np
from policy_export import export, joined
from policy_mlp import fit, Floats, Mlp

from quad_controller.gait.parameters import GaitParameters
from quad_controller.gait.velocity import Velocity
from quad_controller.policy.contract.build import build_contract
from quad_controller.policy.contract.mjlab import read_metadata, VENDOR_TERMS
from quad_controller.policy.observation import ObservationBuilder, Observed
from quad_controller.policy.options import GravitySource
from quad_description import ImuSample, quadruped, robot_urdf, RobotState
from quad_description.rotations import multiply, normalized
from quad_sim import ServoModel, Terrain
from quad_sim.physics import PhysicsBackend, Robot

PERIOD = 0.02  # [s]
SCALE = 0.25  # [rad] for an action of one, as in the vendor's training
HIDDEN = (128, 64)
PHASE_THRESHOLD = 0.02
EPISODE = 6.0  # [s]
COMMAND_TIME = 1.5  # [s] between two commands
MAX_VELOCITY = (0.35, 0.15, 1.5)  # [m/s], [m/s], [rad/s]
MAX_TILT = 0.7  # [rad] an episode ends there
# the vendor's training noise (luwu_mjlab): uniform, in [rad/s], of a unit vector, [rad], [rad/s]
NOISE = {'rate': 0.2, 'gravity': 0.05, 'position': 0.01, 'velocity': 1.5}


class Trainer:
    """Collects examples and fits the network to them.

    Attributes:
        network: What is trained.
    """

    def __init__(self, seed: int) -> None:
        """Make robot, teacher and an untrained network."""
        self._random = np.random.default_rng(seed)
        self._urdf = robot_urdf()
        self._model = quadruped(self._urdf)
        self._teacher = GaitTeacher(self._model, GaitParameters())
        self._defaults: Floats = (np.round(self._teacher.stand, 3) + 0.0).astype(np.float32)
        self._metadata = self._describe()
        self._contract = build_contract(read_metadata(self._metadata))
        count = len(self._model.names)
        self.network = Mlp((self._contract.width, *HIDDEN, count), self._random)
        self._inputs: list[Floats] = []
        self._wanted: list[Floats] = []

    @property
    def examples(self) -> int:
        """How many there are."""
        return len(self._inputs)

    def collect(self, episodes: int, share: float) -> float:
        """Walk, and note what the teacher says; return the mean length of an episode in [s].

        Args:
            episodes: How many.
            share: Of episodes that the teacher walks itself.
        """
        return float(
            np.mean([self._episode(self._random.random() < share) for _ in range(episodes)])
        )

    def fit(self, epochs: int) -> float:
        """Train on everything so far; return the error in [rad], root mean square."""
        inputs, wanted = np.array(self._inputs), np.array(self._wanted)
        if not self.network.mean.any():
            self.network.mean = inputs.mean(axis=0)
            self.network.deviation = np.maximum(inputs.std(axis=0), 0.05).astype(np.float32)
        error = fit(self.network, inputs, wanted, epochs=epochs, random=self._random)
        return float(np.sqrt(error)) * SCALE

    def export(self, path: Path) -> None:
        """Write the network with what a controller has to know of it."""
        export(self.network, path, self._metadata)

    def _describe(self) -> dict[str, str]:
        servo = ServoModel.FIRM.parameters
        count = len(self._model.names)
        return {
            'run_path': 'quad_controller/training/train_imitation.py',
            'kind': 'imitation of the geometric trot (DAgger in MuJoCo, firm servos)',
            'joint_names': joined(self._model.names),
            'joint_stiffness': joined([servo.stiffness] * count),
            'joint_damping': joined([servo.velocity_gain] * count),
            'default_joint_pos': joined(self._defaults.tolist()),
            'command_names': 'twist',
            'observation_names': joined(VENDOR_TERMS),
            'action_scale': joined([SCALE] * count),
            'step_dt': joined(PERIOD),
            'phase_period': f'{self._teacher.schedule.period:.3f}',
            'phase_command_threshold': joined(PHASE_THRESHOLD),
            'imu_frame': 'base',
        }

    def _episode(self, taught: bool) -> float:
        random = self._random
        robot = Robot(
            self._urdf,
            terrain=Terrain(friction=float(random.uniform(0.4, 1.3))),
            pose=dict(zip(self._model.names, self._teacher.stand, strict=True)),
        )
        backend = PhysicsBackend(robot, PERIOD)
        state = backend.observe()
        period = round(self._teacher.schedule.period, 3)
        builder = ObservationBuilder(self._contract, GravitySource.EULER)
        phase = float(random.uniform())
        builder.advance(phase * period)
        previous: Floats = np.zeros_like(self._defaults)
        velocity = Velocity()
        steps = round(EPISODE / PERIOD)
        for step in range(steps):
            if step % round(COMMAND_TIME / PERIOD) == 0:
                velocity = self._command()
            if random.random() < 0.01:
                robot.kick((*random.uniform(-0.4, 0.4, 2), 0.0))
                state = backend.observe()
            builder.advance(PERIOD)
            phase = (phase + PERIOD / period) % 1.0
            joints, imu = self._sense(state)
            row = builder.build(Observed(*joints, imu, velocity, previous))
            moves = np.linalg.norm(row[0, 6:9]) >= PHASE_THRESHOLD
            right = self._teacher.targets(velocity if moves else Velocity(), phase, _tilt(state))
            wanted: Floats = ((np.array(right) - self._defaults) / SCALE).astype(np.float32)
            self._inputs.append(row[0].copy())
            self._wanted.append(wanted)
            previous = wanted if taught else self.network(row)[0]
            state = backend.step((self._defaults + SCALE * previous).tolist())
            if robot.base_pose.tilt > MAX_TILT:
                return step * PERIOD
        return EPISODE

    def _command(self) -> Velocity:
        """Return a velocity; every sixth is zero, and every third along one axis."""
        kind = self._random.integers(6)
        if kind == 0:
            return Velocity()
        parts = self._random.uniform(-1.0, 1.0, 3) * MAX_VELOCITY
        if kind <= 2:
            parts *= np.eye(3)[self._random.integers(3)]
        x, y, yaw = parts.tolist()
        return Velocity(x, y, yaw)

    def _sense(self, state: RobotState) -> tuple[tuple[Floats, Floats], ImuSample]:
        if state.joints is None or state.imu is None:
            raise ValueError('a policy needs joints and attitude')
        noise = {name: self._random.uniform(-size, size, 12) for name, size in NOISE.items()}
        rate = np.array(state.imu.angular_velocity) + noise['rate'][:3]
        # a small turn of the attitude is a small error of the direction of gravity
        a, b = (0.5 * noise['gravity'][:2]).tolist()
        orientation = normalized(multiply(state.imu.orientation, (a, b, 0.0, 1.0)))
        positions = (np.array(state.joints.positions) + noise['position']).astype(np.float32)
        velocities = (np.array(state.joints.velocities) + noise['velocity']).astype(np.float32)
        x, y, z = rate.tolist()
        return (positions, velocities), ImuSample(orientation, (x, y, z), (0.0, 0.0, 9.81))


def _tilt(state: RobotState) -> tuple[float, float]:
    roll, pitch, _ = state.imu.roll_pitch_yaw if state.imu is not None else (0.0, 0.0, 0.0)
    return roll, pitch


def main() -> None:
    """Entry point."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else '')
    parser.add_argument('path', type=Path, help='ONNX file to write')
    parser.add_argument('--rounds', type=int, default=8, help='of collecting and fitting')
    parser.add_argument('--episodes', type=int, default=40, help='of each round')
    parser.add_argument(
        '--epochs', type=int, default=30, help='of each round; the last has 3 times'
    )
    parser.add_argument('--seed', type=int, default=1)
    options = parser.parse_args()
    trainer, start = Trainer(options.seed), time.monotonic()
    for turn in range(options.rounds):
        length = trainer.collect(options.episodes, share=1.0 if turn == 0 else 0.1)
        last = turn == options.rounds - 1
        error = trainer.fit(options.epochs * (3 if last else 1))
        sys.stdout.write(
            f'round {turn + 1}: episodes {length:.1f} s, {trainer.examples} examples, '
            f'error {error:.4f} rad, {time.monotonic() - start:.0f} s\n'
        )
        sys.stdout.flush()
    trainer.export(options.path)


if __name__ == '__main__':
    main()
