# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Compares policies with the gait: in parallel on all cores, or in real time on a serial line."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
import multiprocessing
import os
from pathlib import Path

from quad_description import quadruped
from quad_sim import SimulationError

from ..exceptions import CheckError
from ..gait.generator import GaitGenerator
from ..gait.parameters import AS_TUNED, GaitParameters
from ..gait.velocity import Velocity
from ..policy.load import load_policy, shipped_policies
from ..policy.options import PolicyOptions
from ..states.modes import StateParameters
from .arenas import AS_MADE, Conditions, PhysicsArena, RobotChoice, serial_arena, SerialArena
from .course import CourseFigures, CourseWalker, REST_TIME, SETTLE_TIME, STAND_TIME


@dataclass(frozen=True, slots=True)
class Candidate:
    """A policy or the gait, as a test candidate."""

    path: Path | None = None  # an ONNX file; None for the gait
    options: PolicyOptions = field(default_factory=PolicyOptions)  # how the policy is run
    robot: RobotChoice = field(default_factory=RobotChoice)  # which robot walks
    gait: GaitParameters = AS_TUNED  # tuning of the gait

    def placed_in(self, arena: PhysicsArena | SerialArena) -> CourseWalker:
        """Put the robot on its feet in an arena, with a gait adapted to its servos.

        Raises:
            PolicyError: The policy does not match the robot.
        """
        robot, gait, policy = quadruped(self.robot.urdf), self.robot.tuned(self.gait), None
        if self.path is not None:
            stand, period = GaitGenerator(robot, gait).stand_targets, StateParameters().period
            policy = load_policy(self.path, robot, stand, self.options, period).runner
        return CourseWalker(arena, robot, policy, gait)


def shipped_walkers() -> dict[str, Candidate]:
    """Return the shipped policies by name, as candidates."""
    return {name: Candidate(path) for name, path in shipped_policies().items()}


@dataclass(frozen=True, slots=True)
class Trial:
    """One candidate on one course."""

    who: Candidate
    commands: tuple[Velocity, ...]  # one after the other
    duration: float  # of each in [s]
    conditions: Conditions = AS_MADE  # what differs
    seed: int = 1  # of the pushes

    def run(self) -> CourseFigures:
        """Walk the course in physics, in virtual time.

        Raises:
            CheckError: The physics failed.
            PolicyError: The policy does not fit the robot.
        """
        try:
            walker = self.who.placed_in(PhysicsArena(self.who.robot, self.conditions))
            push = self.conditions.push
            return walker.walk(self.commands, self.duration, push=push, seed=self.seed)
        except SimulationError as error:
            raise CheckError(f'the physics failed: {error}') from error


def run_trials(trials: Sequence[Trial]) -> list[CourseFigures]:
    """Run trials on all cores; return their results in order.

    Raises:
        CheckError: The physics failed.
        PolicyError: A policy does not fit the robot.
    """
    # a process that is forked would have locks of threads that it does not have
    context = multiprocessing.get_context('spawn')
    workers = min(len(os.sched_getaffinity(0)), len(trials))
    with ProcessPoolExecutor(workers, mp_context=context) as pool:
        return list(pool.map(Trial.run, trials))


def run_chain(
    walkers: Sequence[Candidate], commands: Sequence[Velocity], duration: float
) -> list[CourseFigures]:
    """Walk a course with each candidate in real time, one after another, each on its own line.

    Raises:
        CheckError: The simulation or the line failed.
        PolicyError: A policy does not fit the robot.
    """
    figures = []
    for who in walkers:
        with serial_arena(who.robot) as arena:
            figures.append(who.placed_in(arena).walk(commands, duration))
    return figures


def chain_duration(minutes: float, walkers: int, commands: int) -> float:
    """Return the time per command [s] so that a whole run takes some minutes."""
    each = 60.0 * minutes / walkers - STAND_TIME - REST_TIME
    return each / commands - SETTLE_TIME
