# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The motions of the demo: squares, a singular pose, trajectories with override and cancel."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
import math
import time

from action_msgs.msg import GoalStatus
import numpy as np

from arm_model import Array, RobotModel
from process_supervisor import CallError

from ..client import ActionRun
from .client import MotionClient
from .goals import duration
from .poses import can_go, free_end, free_way, SIDE, SIDES, square_fits, square_speed
from .results import MotionResults, Square, WORST_PATH
from .samples import away_from_line, peak_jerk, tool_speed, tracking_error

PERIOD = 0.02
"""Time between two jog commands in [s]."""
SETTLE = 0.35
"""Least pause after a motion in [s]."""
FRESH = 0.1
"""Age in [s] up to which a state says where the arm is now."""
FAST = 0.2
"""Speed of the way to the singular pose in [m/s]."""
OUT, DOWN = 0.866, 0.5
"""Direction of the way to the singular pose: shares of outwards and down."""
STUCK = 0.05
"""Speed below which the tool has come to its end in [m/s]."""
LONGEST = 6.0
"""Longest time of the way to the singular pose in [s]; the way back may take twice as long."""
SLOW = 0.3
"""Speed override."""
EARLY, HALF, LATE = 0.2, 0.4, 0.6
"""Shares of the way of a trajectory at which something is asked."""
MOTION_TIMEOUT = 60.0
"""Longest time of a trajectory in [s]."""


@dataclass(slots=True)
class MotionSequence:
    """The parts of the demo, for a client whose drives are enabled.

    Attributes:
        client: The client.
        model: The arm.
        start: The pose from which the parts begin in [rad].
        period: Period of the cycle in [s].
        enter: Called with the name of each part.
        look: Called often; shows how it goes, and raises EndRequested.
        results: Where figures go.
    """

    client: MotionClient
    model: RobotModel
    start: Array
    period: float
    enter: Callable[[str], None]
    look: Callable[[], None]
    results: MotionResults = field(default_factory=MotionResults)
    _run: ActionRun | None = None

    def set_up(self) -> None:
        """Have nothing to set up: each run begins at the start pose."""

    def come_to_rest(self) -> None:
        """Cancel the trajectory that is on its way; a jog ends by itself."""
        run = self._run
        if run is not None and not run.done:
            run.cancel()
            self.client.wait_until(lambda: run.done, MOTION_TIMEOUT, 'the end of the canceled')

    def conclude(self) -> None:
        """Add what was measured all the time."""
        samples, bus = self.client.samples, self.client.figures.bus
        if samples:
            jerk = peak_jerk(samples, self.period, self.model.limits.jerk)
            self.results.motion(jerk, tracking_error(samples, self.period), bus)
        late = bus.jitter_p99
        if math.isfinite(late) and late > self.period / 2:
            self.results.warnings.append(
                f'the cycle was late by {1e3 * late:.0f} ms now and then (p99): this computer is '
                'too busy, drives wait and may lose their path'
            )

    def run(self) -> None:
        """Run every part once.

        Raises:
            CallError: A trajectory was refused or failed, or somebody does not answer.
            GivenUpError: The processes have ended.
            EndRequested: The user asked for the end.
        """
        self.go_to_start()
        if square_fits(self.model, self.start):
            self.square('base frame', self.model.base)
            self.square('tool frame', self.model.tip)
        else:
            self.results.add('squares', 'left out: no pose was found from which they are possible')
        self.singularity()
        self.go_to_start()
        self.trajectory()
        self.cancel()

    def go_to_start(self) -> None:
        """Follow a trajectory to the start pose."""
        self.enter('to the start pose')
        self._wait(SETTLE)
        end = self.start
        begin = self.client.last.position if self.client.samples else np.zeros(len(self.model))
        for pose in free_way(self.model, begin, end):
            self._finish(self._send(pose, duration(begin, pose, self.model.limits)))
            self._rest()
            begin = pose

    def square(self, name: str, frame: str) -> None:
        """Jog the tool along the sides of a square.

        Args:
            name: What the frame is called.
            frame: Link along whose axes.
        """
        self.enter(f'a square in the {name}')
        speeds, commanded, measured, gap = [], 0.0, 0.0, 0.0
        missed = self.client.figures.bus.missed_pdos
        speed = square_speed(self.model, self.start)
        self.client.limited.clear()
        for way in SIDES:
            begin = self.client.last
            axes = self.model.pose(begin.position, frame).rotation
            direction = axes @ np.array(way, dtype=float)
            first = len(self.client.samples)
            gap = max(gap, self._jog(speed * np.array(way), frame, SIDE / speed))
            moving = self.client.samples[first:]
            self._rest()
            side = self.client.samples[first:]
            speeds.append(tool_speed(moving, self.period))
            tools = [each.tool for each in side]
            commanded = max(commanded, away_from_line(tools, begin.tool, direction))
            tools = [each.measured_tool for each in side]
            measured = max(measured, away_from_line(tools, begin.measured_tool, direction))
        reached = max(speeds, key=lambda each: abs(each - speed))
        missed = self.client.figures.bus.missed_pdos - missed
        limited = (self.client.limited or [''])[-1]
        square = Square(speed, reached, commanded, measured, missed, gap, limited)
        self.results.square(f'square, {name}', square)

    def singularity(self) -> None:
        """Jog the tool outwards until the arm is straight, or something else ends it, and back."""
        self.enter('into the straight arm, and back')
        state = self.client.last
        begin, outwards = state.tool, straight_ahead(state.tool)
        if not can_go(self.model, state.position, outwards):
            why = 'left out: this arm cannot lead its tool along a line outwards'
            self.results.add('singularity', why)
            return
        first = len(self.client.samples)
        self.client.limited.clear()
        self._jog(FAST * outwards, self.model.base, LONGEST, self._stuck)
        self._rest()
        singular = [words for words in self.client.limited if 'singular' in words]
        words = (singular or self.client.limited or [''])[-1]
        out = max(float((each.tool - begin) @ outwards) for each in self.client.samples[first:])
        self._jog(
            -FAST * outwards,
            self.model.base,
            2.0 * LONGEST,
            lambda: bool((self.client.last.tool - begin) @ outwards <= 0.0),
        )
        self._rest()
        left = float((self.client.last.tool - begin) @ outwards)
        self.results.singularity(out, out - left, words)

    def trajectory(self) -> None:
        """Follow a trajectory, at 30 % in its middle."""
        self.enter('a trajectory, at 30 % in its middle')
        begin, end, nominal = self._plan()
        first = len(self.client.samples)
        run = self._send(end, nominal)
        self._reach(run, begin, end, EARLY)
        self.client.override(SLOW)
        self._reach(run, begin, end, LATE)
        self.client.override(1.0)
        self._finish(run)
        self._rest()
        slow = min(each.speed for each in self.client.samples[first:])
        took = self._moving_time(first)
        error = self._path_error(first, begin, end)
        figures = (
            f'path error {1e3 * error:.3f} mrad, {nominal:.1f} s planned, {took:.1f} s with '
            f'{100 * slow:.0f} % in its middle'
        )
        problem = ''
        if error > WORST_PATH:
            problem = f'{1e3 * error:.1f} mrad off the path'
        elif slow != SLOW or took < nominal:
            problem = f'the override did not slow it down: {took:.1f} s'
        self.results.add('trajectory', figures, problem)

    def cancel(self) -> None:
        """Cancel a trajectory in its middle: it comes to rest on its path."""
        self.enter('a trajectory, canceled')
        begin, end, nominal = self._plan()
        first = len(self.client.samples)
        run = self._send(end, nominal)
        self._reach(run, begin, end, HALF)
        run.cancel()
        self.client.wait_until(lambda: self._seen(run), MOTION_TIMEOUT, 'the end of the canceled')
        self._rest()
        error = self._path_error(first, begin, end)
        done = float(np.linalg.norm(self.client.last.position - begin))
        share = done / float(np.linalg.norm(end - begin))
        is_canceled = run.status == GoalStatus.STATUS_CANCELED
        problem = '' if is_canceled else f'it was not canceled: {_why(run)}'
        if error > WORST_PATH:
            problem = f'{1e3 * error:.1f} mrad off the path'
        elif np.abs(self.client.last.velocity).max() > 0.0:
            problem = 'the arm does not rest'
        figures = (
            f'at rest after {100 * share:.0f} % of the way, {1e3 * error:.3f} mrad off the path'
        )
        self.results.add('cancel', figures, problem)

    def _plan(self) -> tuple[Array, Array, float]:
        """Return begin, end and time of a trajectory from where the arm is."""
        begin = self.client.last.position
        end = free_end(self.model, begin)
        return begin, end, duration(begin, end, self.model.limits)

    def _path_error(self, first: int, begin: Array, end: Array) -> float:
        points = [each.position for each in self.client.samples[first:]]
        return away_from_line(points, begin, end - begin)

    def _jog(
        self, linear: Array, frame: str, longest: float, done: Callable[[], bool] | None = None
    ) -> float:
        """Jog for a time, or until it is done; return the longest time between commands in [s]."""
        begun = last = time.monotonic()
        gap = 0.0
        while (elapsed := time.monotonic() - begun) < longest:
            self.client.jog(linear, frame)
            now = time.monotonic()
            gap, last = max(gap, now - last), now
            self.client.listen(PERIOD)
            self.look()
            if done is not None and elapsed > 2.0 * SETTLE and done():
                break
        self.client.jog(0.0 * linear, frame)
        return max(gap, time.monotonic() - last)

    def _stuck(self) -> bool:
        """Say whether the tool has hardly moved lately."""
        recent = self.client.samples[-round(SETTLE / self.period) :]
        way = float(np.linalg.norm(recent[-1].tool - recent[0].tool))
        return way < STUCK * SETTLE

    def _send(self, end: Array, nominal: float) -> ActionRun:
        self._run = run = self.client.send(end, nominal)
        return run

    def _finish(self, run: ActionRun) -> None:
        self.client.wait_until(lambda: self._seen(run), MOTION_TIMEOUT, 'the end of a trajectory')
        if run.status != GoalStatus.STATUS_SUCCEEDED:
            raise CallError(f'a trajectory failed: {_why(run)}')

    def _reach(self, run: ActionRun, begin: Array, end: Array, share: float) -> None:
        """Wait until a share of the way is done: times say little on a computer that is busy."""
        way = end - begin

        def there() -> bool:
            done = float((self.client.last.position - begin) @ way) / float(way @ way)
            return self._seen(run) or done >= share

        self.client.wait_until(there, MOTION_TIMEOUT, f'{100 * share:.0f} % of a trajectory')

    def _moving_time(self, first: int) -> float:
        times = [each.time for each in self.client.samples[first:] if each.velocity.any()]
        return times[-1] - times[0] if times else 0.0

    def _seen(self, run: ActionRun) -> bool:
        self.look()
        return run.done

    def _rest(self) -> None:
        """Wait until the arm rests, and what is known of it is new."""
        self._wait(SETTLE)

        def at_rest() -> bool:
            self.look()
            return self.client.age < FRESH and not self.client.last.velocity.any()

        self.client.wait_until(at_rest, MOTION_TIMEOUT, 'the arm to rest')

    def _wait(self, pause: float) -> None:
        end = time.monotonic() + pause
        while (left := end - time.monotonic()) > 0:
            self.client.listen(min(left, PERIOD))
            self.look()


def _why(run: ActionRun) -> str:
    return f'{run.result.error_code}: {run.result.error_string}'


def straight_ahead(tool: Array) -> Array:
    """Return a direction in which an arm becomes straight: away from its axis, and down a little.

    Args:
        tool: Position of the tool in the base in [m].
    """
    ahead = np.array([tool[0], tool[1], 0.0])
    ahead /= max(float(np.linalg.norm(ahead)), 1e-6)
    direction: Array = OUT * ahead - np.array([0.0, 0.0, DOWN])
    return direction
