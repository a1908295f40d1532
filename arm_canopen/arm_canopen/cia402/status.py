# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Immutable snapshots of drives, for other threads."""

from __future__ import annotations

from dataclasses import dataclass

from canopen_core.standard import DriveState, mode_title, Statusword, statusword_text

from ..master.status import node_status, NodeStatus
from .drive import Drive
from .drive_view import DriveView, FAULTY


@dataclass(frozen=True, slots=True)
class DriveStatus:
    """How a drive was at one moment."""

    name: str  # name of the axis
    node: NodeStatus  # the device below it
    state: DriveState  # state of the power drive system
    mode: str  # mode of operation in words
    statusword: str  # 0x6041 in words
    warning: bool  # the statusword shows a warning or an internal limit
    error: str  # 0x603F in words, empty when none is known
    failure: str  # why the master stopped it, until it is enabled again; else empty
    fresh: bool  # state, position and velocity are young enough to act on
    age: float  # age of the oldest of them in [s]; infinite while they are unknown
    position: float  # actual position in user units
    velocity: float  # actual velocity in user units per second
    setpoint: float  # position last commanded in user units
    following_error: float  # set-point that was sent before the position was measured, minus that
    summary: str  # all of it in a sentence

    @property
    def faulted(self) -> bool:
        """Whether the drive is in a fault or on the way to it."""
        return self.state in FAULTY


def drive_status(drive: Drive, now: float) -> DriveStatus:
    """Take a snapshot of a drive."""
    return axis_status(
        drive.view,
        now,
        setpoint=drive.control.setpoint,
        following_error=drive.following_error,
        failure=drive.failure,
        summary=drive.describe(),
    )


def axis_status(
    view: DriveView,
    now: float,
    *,
    setpoint: float,
    following_error: float,
    failure: str = '',
    summary: str = '',
) -> DriveStatus:
    """Take a snapshot of an axis."""
    word = view.statusword
    return DriveStatus(
        name=view.name,
        node=node_status(view.node, now),
        state=view.state,
        mode=mode_title(view.objects.mode_display),
        statusword=statusword_text(word),
        warning=bool(word & (Statusword.WARNING | Statusword.INTERNAL_LIMIT)),
        error=view.error,
        failure=failure,
        fresh=view.fresh,
        age=view.age,
        position=view.position,
        velocity=view.velocity,
        setpoint=setpoint,
        following_error=following_error,
        summary=summary or view.describe(),
    )
