# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The servo's status: moveit_servo's code, and in words what limits the motion."""

from __future__ import annotations

from enum import IntEnum

from ...controllers.controller import Source
from ...core.snapshot import Snapshot
from ...report import Cause, MotionReport

HALTED_SPEED_FACTOR = 0.02  # share of the asked speed below which a motion counts as halted


class StatusCode(IntEnum):
    """Codes of moveit_msgs/msg/ServoStatus in Jazzy."""

    INVALID = -1
    NO_WARNING = 0
    DECELERATE_FOR_APPROACHING_SINGULARITY = 1
    HALT_FOR_SINGULARITY = 2
    DECELERATE_FOR_LEAVING_SINGULARITY = 3
    DECELERATE_FOR_COLLISION = 4
    HALT_FOR_COLLISION = 5
    JOINT_BOUND = 6


def code_of(report: MotionReport) -> StatusCode:
    """Return the code for what limits most; speed and acceleration have none."""
    for limiter in report.limiters:
        halted = limiter.factor < HALTED_SPEED_FACTOR
        if limiter.cause is Cause.COLLISION:
            return StatusCode.HALT_FOR_COLLISION if halted else StatusCode.DECELERATE_FOR_COLLISION
        if limiter.cause is Cause.SINGULARITY:
            return (
                StatusCode.HALT_FOR_SINGULARITY
                if halted
                else StatusCode.DECELERATE_FOR_APPROACHING_SINGULARITY
            )
        if limiter.cause is Cause.JOINT_POSITION:
            return StatusCode.JOINT_BOUND
    return StatusCode.NO_WARNING


def status_of(
    snapshot: Snapshot, refusal: str, paused: str, capped: str, age: float = 0.0
) -> tuple[int, str]:
    """Return code and message.

    Args:
        refusal: Why the last command was refused, with the remedy; empty when it was not.
    """
    if refusal:
        return int(StatusCode.INVALID), refusal
    if stale := snapshot.stale(age):
        return int(StatusCode.INVALID), stale
    if snapshot.set_point is None or snapshot.blocked:
        return int(StatusCode.INVALID), snapshot.blocked
    if paused:
        return int(StatusCode.NO_WARNING), paused
    if snapshot.paused:
        return int(StatusCode.NO_WARNING), 'the arm is held; ~/resume of the trajectory controller'
    report = snapshot.set_point.report
    if snapshot.source is not Source.JOG:
        words = _idle(snapshot.source)
        return int(code_of(report)), f'{words}; {report}' if report.limiters else words
    words = str(report) if not capped else f'{capped}; {report}'
    return int(code_of(report)), words


def _idle(source: Source) -> str:
    if source is Source.TRAJECTORY:
        return 'a trajectory moves the arm; a command takes over'
    return 'moves to a target' if source is Source.TARGET else 'ready'
