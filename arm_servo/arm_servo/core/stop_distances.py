# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""How far links and other arms keep apart, by what moves the arm and whether its path is checked.

The safety filter lets a step pass that leaves a stop at these distances.
"""

from __future__ import annotations

from ..report import Limiter
from .arbiter import CommandArbiter
from .execution import Execution
from .set_point import Source
from .settings import CoreSettings

ARM_DISTANCE = 0.005  # least distance to another arm that moves, for what is no jog, in [m]

UNCHECKED_CLEARANCE = 0.001
"""Least distance between links on a path that is not checked in a new scene yet in [m]: the arm
that is stopped there is not in contact and can be led away. Planned paths keep as much."""


class StopDistances:
    """The distances of one arm, in [m]; None is any.

    Attributes:
        unchecked: The trajectory whose path is not checked in the present scene; None without one.
    """

    def __init__(self, settings: CoreSettings, arbiter: CommandArbiter) -> None:
        self._settings = settings
        self._arbiter = arbiter
        self._jogged = False
        self.unchecked: Execution | None = None

    def update(self, *, moving: bool) -> None:
        """See what moves the arm in this cycle; a jog counts until the arm rests after it."""
        jogged = self._arbiter.active in {Source.JOG, Source.NONE}
        self._jogged = jogged or (self._jogged and moving and self._arbiter.brakes)

    @property
    def between_links(self) -> float | None:
        """What links keep; any on a path that was checked: a stop stays on it."""
        if self._jogged:
            return self._settings.clearance
        is_unchecked = self.unchecked is not None and self.unchecked is self._arbiter.execution
        is_clear = self._arbiter.on_path and not is_unchecked
        if is_clear or not self._settings.check_self_collision:
            return None
        return UNCHECKED_CLEARANCE if is_unchecked else 0.0

    @property
    def between_arms(self) -> float | None:
        """What other arms keep on a stop of all."""
        if self._jogged:
            return self._settings.clearance
        return ARM_DISTANCE if self._settings.check_self_collision else None

    def refusal(self, limiter: Limiter, *, near_arm: bool) -> str:
        """Explain why a motion cannot go on, and what to do."""
        if near_arm:
            return (
                f'{limiter.name} would come nearer than {ARM_DISTANCE * 1e3:g} mm to another arm; '
                'begin when that is out of the way, or keep more distance'
            )
        if self._arbiter.active is Source.TARGET:
            where = 'on the way to the target from where the arm is; go around that'
        elif self.unchecked is self._arbiter.execution:
            where = 'on the trajectory: the scene changed; lead it around that'
        else:
            where = (
                'while the arm catches up with the path; begin at rest, or give the first point '
                'more time'
            )
        return f'{limiter.name} would collide {where}'
