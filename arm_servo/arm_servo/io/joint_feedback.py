# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The arm's state from joint states that others publish."""

from __future__ import annotations

from collections.abc import Sequence
import math

import numpy as np

from arm_model import frozen, RobotState
from robot_primitives import JointSample, JointStateStore


class JointFeedback(JointStateStore):
    """The measured state of an arm, of joint states that name some of its joints.

    :meth:`receive` is for one thread, :meth:`state` for any.
    """

    def __init__(self, joints: Sequence[str], timeout: float) -> None:
        """Begin empty; a position counts no more at the age of the time-out in [s]."""
        super().__init__(joints)
        self._order, self._timeout = list(joints), timeout

    @property
    def time(self) -> float:
        """Steady time since which every joint was received in [s]."""
        return min(-math.inf if each is None else each.time for each in self._latest())

    def state(self, now: float) -> tuple[RobotState | None, str]:
        """Return the measured state, None before it is whole; and why it is no good."""
        latest, blocked = self._latest(), ''
        silent = [
            joint
            for joint, each in zip(self._order, latest, strict=True)
            if each is None or now - each.time > self._timeout
        ]
        if silent:
            blocked = (
                f'no joint states of {", ".join(silent)} for {self._timeout:g} s;'
                ' does their driver run, and publish finite numbers?'
            )
        whole = [each for each in latest if each is not None]
        if len(whole) < len(latest):
            return None, blocked
        speeds = [each.velocity if math.isfinite(each.velocity) else 0.0 for each in whole]
        measured = RobotState(
            frozen([each.position for each in whole]), frozen(speeds), np.zeros(len(whole))
        )
        return measured, blocked

    def _latest(self) -> list[JointSample | None]:
        return [self.sample(joint) for joint in self._order]
