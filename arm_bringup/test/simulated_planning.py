# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""move_group and drives without ROS, in virtual time, which can misbehave on request."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from arm_bringup.demos.plan.figures import PlanFigures
from arm_bringup.demos.plan.observer import Observer
from arm_bringup.demos.plan.orders import (
    BLOCKED,
    DisplayedPath,
    DisplayedScene,
    MotionEnd,
    MotionOrder,
    SceneChange,
    SUCCESS,
    UNKNOWN_STATE,
)
from arm_bringup.demos.plan.workcell import by_joint
from arm_model import Array, PlanningScene, Pose, RobotModel
from arm_planning import (
    JointGoal,
    MotionPlan,
    MotionRequest,
    Planner,
    PlanningCode,
    PlanningError,
    PoseGoal,
)
from process_supervisor import CallError

STEP = 0.02
"""Virtual time between two joint states in [s]."""
PAUSE = 0.4
"""Virtual time from a stop to the motion that was planned anew in [s]."""


@dataclass(frozen=True, slots=True)
class Misbehaviour:
    """What goes wrong.

    Attributes:
        unseen: Object that its planner does not know of.
        is_silent: Refusals do not name what touches.
        accepts_blocked: A blocked goal is called a success.
        short: How far from its goal each joint stops in [rad].
        is_blind: No joint states come during motions.
        no_display: Paths are not displayed.
        stale: So many goals are refused, because it does not know where the joints are.
        old_scene: Viewers have the robot where it never was.
    """

    unseen: str = ''
    is_silent: bool = False
    accepts_blocked: bool = False
    short: float = 0.0
    is_blind: bool = False
    no_display: bool = False
    stale: int = 0
    old_scene: bool = False


@dataclass(slots=True, eq=False)
class Run:
    """A motion on its way."""

    order: MotionOrder
    plan: MotionPlan | None = None
    plans: int = 1
    time: float = 0.0
    pause: float = 0.0
    code: str = ''
    message: str = ''

    @property
    def executing(self) -> bool:
        """Whether it is planned, and begins."""
        return self.plan is not None

    @property
    def done(self) -> bool:
        """Whether it has ended."""
        return bool(self.code)

    def cancel(self) -> None:
        """End at once."""
        self.code = 'PREEMPTED'

    def end(self) -> MotionEnd:
        """Return how it ended."""
        return MotionEnd(self.code, self.message, 0.01, self.plans)


@dataclass(slots=True, eq=False)
class SimulatedPlanning:
    """A client whose motions are planned by arm_planning, and followed exactly."""

    observer: Observer
    model: RobotModel
    positions: Array
    wrong: Misbehaviour
    paths: list[DisplayedPath] = field(default_factory=list)
    scene: DisplayedScene = field(default_factory=DisplayedScene)
    figures: PlanFigures = field(default_factory=PlanFigures)
    now: float = 0.0
    _world: PlanningScene | None = None
    _run: Run | None = None
    _sent: int = 0

    def __post_init__(self) -> None:
        """Begin with the robot alone."""
        self._world = self.model.scene
        self._publish()

    def prepare(self, services: Iterable[str]) -> None:
        """Nothing is needed."""

    def call(self, services: list[str], timeout: float) -> Mapping[str, str]:
        """Accept everything."""
        return dict.fromkeys(services, '')

    def close(self) -> None:
        """Nothing is open."""

    def clock(self) -> float:
        """Return virtual time in [s]."""
        return self.now

    def show(self, words: str, planning_time: float) -> None:
        """Nobody looks."""

    def listen(self, duration: float) -> None:
        """Let time pass."""
        self._advance(duration)

    def wait_until(self, condition: Callable[[], bool], timeout: float, what: str) -> None:
        """Let time pass until something is there."""
        end = self.now + timeout
        while not condition():
            if self.now > end:
                raise CallError(f'waited {timeout:g} s in vain for {what}')
            self._advance(STEP)

    def change(self, change: SceneChange) -> None:
        """Change the scene."""
        scene = self.world
        for thing in change.add:
            scene = scene.with_object(thing)
        for name in change.remove:
            scene = scene.without(name)
        if change.attach is not None:
            body = change.attach
            name = body.object.name
            scene = scene.attached(name, body.link, self.positions, body.touch_links)
        if change.detach is not None:
            scene = scene.detached(change.detach.object.name, self.positions)
        self._world = scene
        bodies = {name: each.link for name, each in scene.attached_bodies.items()}
        self.scene = DisplayedScene(
            {name: each.pose for name, each in scene.objects.items()}, bodies
        )
        run = self._run
        if run is not None and not run.done and run.order.replan and not self._is_clear(run):
            run.plan, run.pause = None, PAUSE

    def ik(
        self, group: str, link: str, pose: Pose, seed: Mapping[str, float], *, free: bool
    ) -> Mapping[str, float]:
        """Return joint positions for a pose of a link."""
        scene = self.world if free else self.model.scene
        start = [seed[name] for name in self.model.joints]
        try:
            (found, *_) = Planner(self.model).ik(pose, start, link=link, scene=scene)
        except PlanningError as error:
            raise CallError(str(error)) from error
        return by_joint(self.model, found)

    def send(self, order: MotionOrder) -> Run:
        """Plan a motion, and begin it."""
        self._run = run = Run(order)
        self._sent += 1
        if self._sent <= self.wrong.stale:
            self.now += 1.0
            run.code, run.message = UNKNOWN_STATE, 'no joint states'
        else:
            self._plan(run)
        return run

    def grip(self, controller: str, position: float) -> None:
        """The arm has no gripper."""
        raise CallError(f'{controller}: no gripper')

    @property
    def world(self) -> PlanningScene:
        """The scene."""
        assert self._world is not None
        return self._world

    def _seen(self) -> PlanningScene:
        """Return the scene as the planner knows it."""
        unseen = self.wrong.unseen
        return self.world.without(unseen) if unseen in self.world.objects else self.world

    def _plan(self, run: Run) -> None:
        order = run.order
        if order.pose is None:
            goal: Any = JointGoal(np.array([order.joints[name] for name in self.model.joints]))
        else:
            goal = PoseGoal(order.pose, order.link)
        request = MotionRequest(self.positions, [goal], order.planner_id, order.speed, order.speed)
        try:
            run.plan = Planner(self.model).plan(request, self._seen())
        except PlanningError as error:
            run.code, run.message = error.code.name, str(error)
            if error.code is PlanningCode.GOAL_IN_COLLISION:
                run.code = SUCCESS if self.wrong.accepts_blocked else BLOCKED
                run.message = 'no' if self.wrong.is_silent else run.message
            return
        run.time = 0.0
        path = run.plan.path
        rows = [path.at(time).position.tolist() for time in np.linspace(0.0, path.duration, 40)]
        start = by_joint(self.model, self.positions)
        if not self.wrong.no_display:
            self.paths.append(DisplayedPath(self.model.name, start, self.model.joints, rows))

    def _is_clear(self, run: Run) -> bool:
        if run.plan is None:
            return True
        check = Planner(self.model)
        times = np.linspace(run.time, run.plan.path.duration, 60).tolist()
        return all(
            check.is_valid(run.plan.path.at(at).position, self._seen()) is None for at in times
        )

    def _advance(self, duration: float) -> None:
        self.now += duration
        run = self._run
        if run is not None and not run.done:
            if run.plan is None:
                run.pause -= duration
                if run.pause <= 0.0:
                    run.plans += 1
                    self._plan(run)
            else:
                path = run.plan.path
                run.time = min(run.time + duration, path.duration)
                self.positions = path.at(run.time).position
                if run.time >= path.duration:
                    self.positions = self.positions - self.wrong.short
                    run.code = SUCCESS
                if self.wrong.is_blind:
                    return
        self._publish()

    def _publish(self) -> None:
        places = by_joint(self.model, self.positions)
        self.observer.see(places)
        if not self.wrong.old_scene:
            self.scene = replace(self.scene, joints=places)
