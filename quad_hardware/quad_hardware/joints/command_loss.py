# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What becomes of a robot whose joint commands break off while a leg is in the air.

A controller that dies in the middle of a trot leaves two legs in the air, and the servos hold
them there; so does one that held there for a fault, and then ended. A robot on all its feet stays
as it is, whether it moved or somebody chose its posture.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
import math

from quad_description import Pose, pose_positions, STREAM_TIMEOUT

from .command import MAX_PERIOD
from .mapping import JointMap

MIN_STREAM = 0.5  # [s] a person who tries out a servo sends no stream
SPEED = 1.0  # [rad/s] of the fastest joint on the way down
MIN_DURATION = 1.0  # [s]
MAX_TILT = 0.9  # [rad] beyond which legs find no ground


class LossReaction(Enum):
    """What the robot does; the value is that of the parameter."""

    LIE = 'lie'  # folds its legs
    HOLD = 'hold'  # stays as it is


@dataclass(slots=True)
class _Descent:
    start: Mapping[str, float]
    end: Mapping[str, float]
    stepped_at: float  # [s]
    duration: float  # [s]
    elapsed: float = 0.0  # [s]

    @property
    def is_over(self) -> bool:
        """Whether the end was reached."""
        return self.elapsed >= self.duration

    def step(self, names: Sequence[str], now: float) -> list[float]:
        """Return the next positions on a path with a soft start and end [rad].

        It waits while nobody steps: what is sent keeps up with it, to its end.
        """
        self.elapsed += min(max(now - self.stepped_at, 0.0), MAX_PERIOD)
        self.stepped_at = now
        share = 0.5 * (1.0 - math.cos(math.pi * min(self.elapsed / self.duration, 1.0)))
        pairs = ((self.start[name], self.end[name]) for name in names)
        return [start + share * (end - start) for start, end in pairs]


class CommandLoss:
    """Watches a stream of commands, and brings the robot down when they leave a leg in the air."""

    def __init__(
        self,
        joints: JointMap,
        raised: Callable[[Sequence[float]], Sequence[str]],
        reaction: LossReaction = LossReaction.LIE,
        timeout: float = STREAM_TIMEOUT,
    ) -> None:
        """Begin without a stream.

        Args:
            raised: Names the feet that are in the air at targets of the legs [rad].
        """
        self.timeout = timeout  # a pause after which a stream has ended [s]
        self._legs = joints.names[: joints.leg_count]
        servos = joints.servos[: joints.leg_count]
        pose = pose_positions(Pose.LIE)
        self._lying = {s.joint: min(max(pose[s.joint], s.lower), s.upper) for s in servos
                       if s.joint in pose}  # fmt: skip
        self._raised, self._reaction = raised, reaction
        self._began_at = self._last_at = -math.inf
        self._last: Sequence[float] = ()
        self._descent: _Descent | None = None

    @property
    def goes_down(self) -> bool:
        """Whether the robot is on its way down."""
        return self._descent is not None

    def is_commanded(self, now: float) -> bool:
        """Whether the last command is no longer ago than a pause."""
        return now - self._last_at < self.timeout

    def commanded(self, targets: Sequence[float], now: float) -> None:
        """Take note of targets that were sent [rad]; whoever commands ends the way down."""
        if not self.is_commanded(now) and not (self.goes_down or self.hazard):
            self._began_at = now  # a pause with a foot in the air is part of a stream
        self._descent = None
        self._last_at, self._last = now, targets[: len(self._legs)]

    def forget(self) -> None:
        """Forget the stream: the robot was lost or let go, and is not moved unasked."""
        self._descent = None
        self._began_at = self._last_at = -math.inf
        self._last = ()

    @property
    def hazard(self) -> str:
        """How the last stream ended, if that is nothing to be left so; else nothing."""
        if not self._last or self._last_at - self._began_at < MIN_STREAM:
            return ''
        raised = self._raised(self._last)
        return f'with {" or ".join(raised)} in the air' if raised else ''

    def begin(self, place: Mapping[str, float], tilt: float | None, now: float) -> str:
        """Go down from now on, or return why not. The stream is forgotten.

        Args:
            place: Where the joints are [rad]; empty when nobody knows.
            tilt: Of the body [rad]; None when nobody knows.

        Returns:
            Why the robot holds; empty when it goes down.
        """
        began_at = self._began_at
        self.forget()
        if reason := self._obstacle(place, tilt):
            return reason
        travel = max(abs(self._lying[name] - place[name]) for name in self._legs)
        # a cosine is pi / 2 times as fast in its middle as on average
        duration = max(MIN_DURATION, travel * math.pi / 2 / SPEED)
        self._descent, self._began_at = _Descent(dict(place), self._lying, now, duration), began_at
        return ''

    def step(self, now: float) -> list[float] | None:
        """Return positions of the legs [rad]; None when there is nothing to do any more."""
        descent = self._descent
        if descent is None:
            return None
        positions = descent.step(self._legs, now)
        if descent.is_over:
            self.forget()
        return positions

    def _obstacle(self, place: Mapping[str, float], tilt: float | None) -> str:
        if self._reaction is LossReaction.HOLD:
            return 'the parameter command_loss is hold'
        if unknown := [name for name in self._legs if name not in self._lying]:
            return f'no lying pose is known of {", ".join(unknown)}'
        if missing := [name for name in self._legs if name not in place]:
            return f'no report of {", ".join(missing)}'
        if tilt is not None and tilt > MAX_TILT:
            return f'the body is tilted by {math.degrees(tilt):.0f} degrees'
        return ''
