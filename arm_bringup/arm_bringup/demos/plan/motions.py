# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Motions that the demo asks for: sent, waited for, and judged by what is seen of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
import contextlib
from dataclasses import dataclass, field
import math
import time

import numpy as np

from arm_model import Array
from process_supervisor import CallError

from .observer import Watch
from .orders import DisplayedPath, MotionEnd, MotionOrder, MotionRun, PlanningClient, SUCCESS
from .results import apart, PlanResults, WORST_JOINT, WORST_PLACE, WORST_TURN

MOTION_TIMEOUT = 120.0
"""Longest time of a motion in [s]."""
SETTLE_TIMEOUT = 5.0
"""Longest time from the end of a motion until the joints are seen at its goal in [s]."""
DISPLAYED = 4
"""How many of the last paths on display_planned_path may be the one that is looked for."""
AT_REST = 5e-4
"""An arm whose joints move less than so far rests, in [rad] or [m], in so many joint states:"""
REST_STATES, SHORT_REST_STATES = 16, 4
"""What is planned anew while a motion goes on may follow the rest within a tenth of a second."""


@dataclass(slots=True, eq=False)
class Motions:
    """Motions by a client, of any number of arms at a time.

    Whatever waits raises CallError where it was in vain, GivenUpError where the processes have
    ended, and EndRequested.

    Attributes:
        client: The client.
        results: Where problems go.
        look: Called often; shows how it goes, and raises EndRequested.
        clock: Steady time in [s].
    """

    client: PlanningClient
    results: PlanResults
    look: Callable[[], None]
    clock: Callable[[], float] = time.monotonic
    _runs: list[MotionRun] = field(default_factory=list)

    @property
    def positions(self) -> Array:
        """Where the joints were seen last, in [rad] or [m]."""
        positions = self.client.observer.positions
        if positions is None:
            raise CallError('joint_states: nothing came')
        return positions

    def send(self, order: MotionOrder) -> MotionRun:
        """Send a motion."""
        self.client.show(order.planner_id or 'free motion', math.nan)
        run = self.client.send(order)
        self._runs = [each for each in self._runs if not each.done] + [run]
        return run

    def attempt(self, order: MotionOrder) -> MotionRun:
        """Send a motion, and wait for its end, whatever that is."""
        run = self.send(order)
        self.wait(lambda: run.done, MOTION_TIMEOUT, 'the end of a motion')
        return run

    def move(self, name: str, order: MotionOrder) -> MotionEnd:
        """Move, and judge it: contacts, and where the joints were seen at its end."""
        watch = self.client.observer.watch()
        return self.finish(name, order, self.send(order), watch)

    def finish(self, name: str, order: MotionOrder, run: MotionRun, watch: Watch) -> MotionEnd:
        """Wait for the end of a motion, and judge it by what was watched of it, too."""
        self.wait(lambda: run.done, MOTION_TIMEOUT, f'the end of a motion ({name})')
        end = run.end()
        self.judge(name, order, end)
        self.client.observer.end(watch)
        self.results.watched(name, watch)
        return end

    def judge(self, name: str, order: MotionOrder, end: MotionEnd) -> None:
        """Judge the end of a motion: where the joints are seen, and what a viewer was shown.

        Raises:
            CallError: It failed.
        """
        if end.code != SUCCESS:
            raise CallError(f'{name}: {end.code}: {end.message}')
        self.results.planning_times.append(end.planning_time)
        self.client.show(order.planner_id or 'free motion', end.planning_time)

        def there() -> bool:
            return all(off <= most for off, most, _ in self._off(order))

        with contextlib.suppress(CallError):
            self.wait(there, SETTLE_TIMEOUT, 'arrival')
        for off, most, unit in self._off(order):
            self.results.arrived(name, off, most, unit)
        with contextlib.suppress(CallError):
            self.wait(lambda: self._is_displayed(order), SETTLE_TIMEOUT, 'its path')
        if not self._is_displayed(order):
            self.results.problem(name, 'display_planned_path has no path that ends at the goal')

    def cancel(self) -> None:
        """Cancel what is on its way, and wait for the end of all of it."""
        runs = [run for run in self._runs if not run.done]
        for run in runs:
            run.cancel()
        self.client.wait_until(
            lambda: all(run.done for run in runs), SETTLE_TIMEOUT, 'the end of the canceled'
        )

    def overlap(self, runs: Sequence[MotionRun]) -> float:
        """Wait for the end of motions; return for how long all were under way in [s]."""
        overlap, last = 0.0, self.clock()

        def done() -> bool:
            nonlocal overlap, last
            now = self.clock()
            if all(run.executing and not run.done for run in runs):
                overlap += now - last
            last = now
            return all(run.done for run in runs)

        self.wait(done, MOTION_TIMEOUT, 'the end of the motions')
        return overlap

    def rest(self, run: MotionRun | None = None) -> float:
        """Wait until no joint moves, or a motion has ended; return when one moved last in [s]."""
        observer, enough = self.client.observer, SHORT_REST_STATES if run else REST_STATES
        last, moved, states = self.positions, self.clock(), observer.states

        def rests() -> bool:
            nonlocal last, moved, states
            here = self.positions
            if float(np.abs(here - last).max()) > AT_REST:
                last, moved, states = here, self.clock(), observer.states
            return observer.states - states >= enough or (run is not None and run.done)

        self.wait(rests, MOTION_TIMEOUT, 'rest')
        return moved

    def wait(self, condition: Callable[[], bool], timeout: float, what: str) -> None:
        """Wait for something, for so many seconds at most."""

        def reached() -> bool:
            self.look()
            return condition()

        self.client.wait_until(reached, timeout, what)

    def pause(self, duration: float) -> None:
        """Let a time in [s] pass."""
        end = self.clock() + duration
        self.wait(lambda: self.clock() > end, duration + SETTLE_TIMEOUT, 'a pause')

    def ahead(self, path: DisplayedPath) -> Sequence[Array]:
        """Return positions of all joints on what is left of a path, from where they are."""
        observer = self.client.observer
        rows = [observer.row(dict(zip(path.joints, row, strict=True))) for row in path.rows]
        here = self.positions
        passed = min(range(len(rows)), key=lambda row: float(np.abs(rows[row] - here).max()))
        return [here, *rows[passed + 1 :]]

    def share(self, path: DisplayedPath) -> float:
        """Return which share of the way from the begin to the end of a path is done."""
        begin, end = np.array(path.rows[0]), np.array(path.rows[-1])
        joints = list(self.client.observer.joints)
        here = self.positions[[joints.index(name) for name in path.joints]]
        way = float(np.abs(end - begin).max())
        return float(np.abs(here - begin).max()) / way if way > 0.0 else 1.0

    def _is_displayed(self, order: MotionOrder) -> bool:
        """Whether a viewer got a path, with the state in which it begins, that ends at a goal."""
        return any(
            set(path.joints) <= set(path.start)
            and path.robot
            and all(off <= most for off, most, _ in self._apart(order, path.ghost))
            for path in self.client.paths[-DISPLAYED:]
        )

    def _off(self, order: MotionOrder) -> Sequence[tuple[float, float, str]]:
        """Return how far the arm is seen from a goal, how far it may be, and the unit."""
        return self._apart(order, {})

    def _apart(
        self, order: MotionOrder, places: Mapping[str, float]
    ) -> Sequence[tuple[float, float, str]]:
        """Return how far joints at places, the others as seen, are from a goal."""
        observer = self.client.observer
        here = observer.row(places)
        if order.pose is None:
            goal = observer.row({**places, **order.joints})
            return [(float(np.abs(goal - here).max()), WORST_JOINT, 'rad')]
        off, turn = apart(observer.scene.kinematics.link_pose(order.link, here), order.pose)
        return [(off, WORST_PLACE, 'm'), (turn, WORST_TURN, 'rad')]
