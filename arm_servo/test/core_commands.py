# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Commands to a core in a loop without other threads."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
import math

import numpy as np

from arm_model import Array, Pose
from arm_servo import (
    DisplacementRequest,
    Execution,
    JogRequest,
    JointCommand,
    MotionCore,
    PauseRequest,
    PoseCommand,
    SpeedRequest,
    StopRequest,
    TargetRequest,
    TwistCommand,
)
from arm_servo.core.requests import by_joint, ImmediateRequest, MotionRequest
from arm_trajectory import TrajectoryGoal

TIMEOUT = 0.1  # time for which a jog counts in [s]


def command(
    core: MotionCore, request: MotionRequest | ImmediateRequest, now: float = 0.0
) -> Execution | None:
    """Put a request into effect; return the execution of a trajectory."""
    motion = core.command(request, now)
    return motion if isinstance(motion, Execution) else None


def twist(
    core: MotionCore,
    numbers: Sequence[float] | Array,
    now: float,
    *,
    link: str | None = None,
    axes: Array | None = None,
    duration: float = TIMEOUT,
) -> None:
    """Move the tool at a speed."""
    jog = TwistCommand(np.array(numbers, dtype=np.float64), link, axes)
    command(core, JogRequest(jog, now + duration), now)


def jog(
    core: MotionCore, speeds: Mapping[str, float], now: float, duration: float = TIMEOUT
) -> None:
    """Move joints at speeds."""
    jog = JointCommand(*by_joint(core.model, speeds, 'velocities'))
    command(core, JogRequest(jog, now + duration), now)


def track(core: MotionCore, pose: Pose, now: float, duration: float = TIMEOUT) -> None:
    """Go to a pose."""
    command(core, JogRequest(PoseCommand(pose), now + duration), now)


def follow(core: MotionCore, goal: TrajectoryGoal) -> Execution:
    """Follow a trajectory."""
    execution = command(core, goal)
    assert execution is not None
    return execution


def move_to(core: MotionCore, positions: Mapping[str, float], max_speed: float = math.inf) -> None:
    """Move joints to positions."""
    command(core, TargetRequest(positions, max_speed))


def move_by(
    core: MotionCore, displacements: Mapping[str, float], max_speed: float = math.inf
) -> None:
    """Move joints on by amounts."""
    command(core, DisplacementRequest(displacements, max_speed))


def override(core: MotionCore, speed: float) -> None:
    """Set the speed of trajectories and targets."""
    command(core, SpeedRequest(speed))


def pause(core: MotionCore) -> None:
    """Come to rest until resumed."""
    command(core, PauseRequest())


def resume(core: MotionCore) -> None:
    """Go on."""
    command(core, PauseRequest(is_paused=False))


def stop(core: MotionCore, reason: str = 'stopped') -> None:
    """Come to rest."""
    command(core, StopRequest(reason))
