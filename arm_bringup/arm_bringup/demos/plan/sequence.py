# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What the demo does: pick, place, a box in the way, a blocked goal, further arms."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
import contextlib
from dataclasses import dataclass
import math

import numpy as np

from arm_model import Array, AttachedBody, CollisionObject, PlanningScene, Pose, RobotModel
from process_supervisor import CallError

from ..report import bus_line
from .boxes import box_ahead, distance_of, Swing
from .motions import Motions, SETTLE_TIMEOUT
from .orders import (
    BLOCKED,
    MotionEnd,
    MotionOrder,
    MotionRun,
    PlanningClient,
    SceneChange,
    UNKNOWN_STATE,
)
from .results import apart, clearance, PlanResults, WORST_JOINT, WORST_PLACE, WORST_TURN
from .tool import PART, Tool
from .viewer import judge_display, judge_part
from .workcell import by_joint, PILLAR, Station, Workcell

SLOW, CAREFUL, FREE = 0.1, 0.2, 0.5
"""Shares of the limits at which the arm meets a box, follows lines, and moves freely."""
START_TIMEOUT = 60.0
"""Longest time until move_group has received joint states in [s]: DDS takes long on a busy
computer."""
EARLY = 0.15
"""Share of the way after which a box appears."""
STILL = 1e-2
"""How far joints of an arm that was refused a motion may be off in [rad] or [m]."""
VISITOR = 'visitor'
"""Name of the box that appears in the way."""


@dataclass(frozen=True, slots=True, eq=False)
class Arm:
    """An arm of the demo.

    Attributes:
        model: The arm.
        tool: What it takes a part up with; None for an arm that moves only.
        cell: Where it picks and places; None for an arm that moves only.
        swing: A motion around a box, for an arm that moves only; None where none was found.
        gripper: Controller of its gripper; empty without one.
    """

    model: RobotModel
    tool: Tool | None = None
    cell: Workcell | None = None
    swing: Swing | None = None
    gripper: str = ''


@dataclass(slots=True, eq=False)
class PlanSequence:
    """The parts of the demo, for a client whose drives are enabled.

    Attributes:
        arms: The arms; the first shows what it can.
        enter: Called with the name of each part.
        motions: How they move.
    """

    arms: Sequence[Arm]
    enter: Callable[[str], None]
    motions: Motions
    _is_turned: bool = False

    @property
    def client(self) -> PlanningClient:
        """Through which it calls and sees move_group."""
        return self.motions.client

    @property
    def results(self) -> PlanResults:
        """Where figures go."""
        return self.motions.results

    def set_up(self) -> None:
        """Put the scene up.

        Raises:
            CallError: It was refused, or somebody does not answer.
            GivenUpError: The processes have ended.
            EndRequested: The user asked for the end.
        """
        self.enter('putting the scene up')
        observer = self.client.observer
        self.motions.wait(lambda: observer.positions is not None, SETTLE_TIMEOUT, 'joint states')
        main = self.arms[0]
        if main.cell is not None:
            self._add(*main.cell.obstacles, main.cell.stations[0].part)
        home = main.cell.home if main.cell else main.swing.begin if main.swing else None
        if home is not None:
            self._begin_at(main.model, home)

    def _begin_at(self, model: RobotModel, home: Array) -> None:
        """Move home, as soon as move_group knows where the joints are."""
        self.enter('home, by free motion')
        order = MotionOrder(model.group, by_joint(model, home), speed=FREE)
        watch, deadline = self.client.observer.watch(), self.motions.clock() + START_TIMEOUT
        run = self.motions.attempt(order)
        while run.end().code == UNKNOWN_STATE and self.motions.clock() < deadline:
            run = self.motions.attempt(order)
        self.motions.finish('home', order, run, watch)

    def run(self) -> None:
        """Run every part once.

        Raises:
            CallError: Somebody does not answer, or what others rest on failed.
            GivenUpError: The processes have ended.
            EndRequested: The user asked for the end.
        """
        main = self.arms[0]
        shown = len(self.client.paths)
        if main.cell is None or main.tool is None:
            self.results.add('pick and place', 'left out: no place was found that it can work at')
        else:
            self._pick_and_place(main, main.cell, main.tool)
        for number, arm in enumerate(self.arms):
            if number or main.cell is None:
                self._swing(arm, with_visitor=not number)
        if len(self.arms) > 1:
            self._together()
        judge_display(self.motions, shown)

    def come_to_rest(self) -> None:
        """Cancel what is on its way, and wait for its end."""
        self.motions.cancel()

    def conclude(self) -> None:
        """Add what was measured all the time."""
        self.results.add('planning', self.results.planned())
        self.results.add('bus and loop', bus_line(self.client.figures.bus))

    def _pick_and_place(self, arm: Arm, cell: Workcell, tool: Tool) -> None:
        source, target = cell.stations[::-1] if self._is_turned else cell.stations
        self._pick(arm, tool, source)
        self._place(arm, tool, target)
        self._is_turned = not self._is_turned
        home = MotionOrder(arm.model.group, by_joint(arm.model, cell.home), speed=FREE)
        self.enter('home, by free motion')
        self.motions.move('home', home)
        self._visit(arm, by_joint(arm.model, cell.aside))
        self._blocked(arm, source)
        self.enter('home, by free motion')
        self.motions.move('home', home)

    def _pick(self, arm: Arm, tool: Tool, station: Station) -> None:
        name, model = 'pick', arm.model
        self.enter('to the part, by free motion')
        if tool.gripper:
            self.client.grip(arm.gripper, tool.gripper.open)
        free = self._go_above(name, arm, station)
        self.enter('picking: a straight approach, attach, a straight retreat')
        down = self._line(name, arm, station.grasp)
        self.motions.rest()
        body = AttachedBody(tool.part, model.tip, frozenset(tool.links))
        self.client.change(SceneChange(attach=body))
        observer = self.client.observer
        observer.change(
            observer.scene.attached(PART, model.tip, self.motions.positions, tool.links), {PART}
        )
        held = ''
        if tool.gripper:
            self.client.grip(arm.gripper, tool.gripper.closed)
            held = self._gripped(name, tool)
        up = self._line(name, arm, station.above)
        judge_part(self.motions, name, attached=True)
        self.results.add(
            name,
            f'free motion {_times(free)}; LIN {_times(down)} down, {_times(up)} up{held}',
        )

    def _place(self, arm: Arm, tool: Tool, station: Station) -> None:
        name, observer = 'place', self.client.observer
        self.enter('with the part around the pillar, by free motion')
        observer.change(observer.scene)
        watch = observer.watch()
        free = self._go_above(name, arm, station)
        observer.end(watch)
        self.enter('placing: a straight approach, detach, a straight retreat')
        down = self._line(name, arm, station.grasp)
        if tool.gripper:
            self.client.grip(arm.gripper, tool.gripper.open)
        self.motions.rest()
        body = AttachedBody(tool.part, arm.model.tip)
        self.client.change(SceneChange(detach=body))
        observer.change(observer.scene.detached(PART, self.motions.positions), {PART})
        off, turn = apart(observer.scene.pose(PART, self.motions.positions), station.part.pose)
        self.results.arrived(f'{name}: the part', off, WORST_PLACE, 'm')
        self.results.arrived(f'{name}: the part', turn, WORST_TURN, 'rad')
        up = self._line(name, arm, station.above)
        observer.change(observer.scene)
        judge_part(self.motions, name, attached=False)
        self.results.add(
            name,
            f'free motion {_times(free)}, {clearance(watch)}; LIN {_times(down)} down, '
            f'{_times(up)} up; the part is {1e3 * off:.1f} mm from where it was to go',
        )

    def _gripped(self, name: str, tool: Tool) -> str:
        """Judge whether the gripper was seen where it holds the part."""
        gripper = tool.gripper
        if gripper is None:
            return ''
        observer = self.client.observer
        place = list(observer.joints).index(gripper.joint)

        def off() -> float:
            return abs(float(self.motions.positions[place]) - gripper.closed)

        with contextlib.suppress(CallError):
            self.motions.wait(lambda: off() <= WORST_JOINT, SETTLE_TIMEOUT, 'the grip')
        self.results.arrived(f'{name}: {gripper.joint}', off(), WORST_JOINT, 'm')
        width = 1e3 * gripper.closed
        return f'; gripped with {gripper.joint} at {width:.1f} mm'

    def _go_above(self, name: str, arm: Arm, station: Station) -> MotionEnd:
        """Move freely to where a straight approach begins: what compute_ik finds for it."""
        seed = by_joint(arm.model, station.joints)
        joints = self.client.ik(arm.model.group, arm.model.tip, station.above, seed, free=True)
        return self.motions.move(name, MotionOrder(arm.model.group, joints, speed=FREE))

    def _line(self, name: str, arm: Arm, pose: Pose) -> MotionEnd:
        observer = self.client.observer
        observer.change(observer.scene, {PART})
        order = MotionOrder(
            arm.model.group, link=arm.model.tip, pose=pose, planner_id='LIN', speed=CAREFUL
        )
        return self.motions.move(name, order)

    def _visit(self, arm: Arm, joints: Mapping[str, float]) -> None:
        """Put a box in the way of a motion: it must not be touched, and the goal be reached."""
        name = 'box in the way'
        self.enter('slowly on, until a box appears in the way')
        client, observer = self.client, self.client.observer
        shown = len(client.paths)
        order = MotionOrder(arm.model.group, joints, speed=SLOW, replan=True)
        run, watch = self.motions.send(order), observer.watch()
        self.motions.wait(
            lambda: run.done or (run.executing and len(client.paths) > shown), 60.0, 'motion'
        )
        self.motions.wait(
            lambda: run.done or self.motions.share(client.paths[-1]) > EARLY, 60.0, 'motion'
        )
        path = client.paths[-1] if len(client.paths) > shown else None
        box = None
        if path is not None and not run.done:
            box = box_ahead(arm.model, observer.scene, self.motions.ahead(path), VISITOR)
        if box is None:
            self.motions.finish(name, order, run, watch)
            self.results.problem(name, 'no place was found for a box in its way')
            return
        self.enter('a box is in the way: stop before it, plan anew, go around')
        observer.change(observer.scene.with_object(box))
        watch.clearance, watch.nearest = math.inf, ('', '')
        appeared = self.motions.clock()
        client.change(SceneChange(add=[box]))
        stop = self._stop(run, appeared)
        end = self.motions.finish(name, order, run, watch)
        if end.plans < 2:  # once, and once more
            self.results.problem(name, f'planned {end.plans} times: nothing was in the way')
        self.results.add(
            name,
            f'{stop}, planned anew in {_times(end)} ({end.plans} plans), {clearance(watch)}',
        )
        self._remove(VISITOR)

    def _blocked(self, arm: Arm, station: Station) -> None:
        """Ask for a goal inside of the pillar."""
        cell = arm.cell
        if cell is None:
            return
        (pillar,) = (each for each in cell.obstacles if each.name == PILLAR)
        model = arm.model
        pose = Pose(station.above.rotation, pillar.pose.position)
        seed = by_joint(model, station.joints)
        joints = self.client.ik(model.group, model.tip, pose, seed, free=False)
        self._refused('blocked goal', MotionOrder(model.group, joints, speed=FREE))

    def _refused(self, name: str, order: MotionOrder) -> None:
        """Judge a goal that is in contact: it is refused, the pair is named, nothing moves."""
        self.enter('a goal that is blocked')
        observer = self.client.observer
        before = self.motions.positions
        pairs = observer.contacts(observer.row(order.joints))
        end = self.motions.attempt(order).end()
        self.client.show(f'{end.code}: {end.message}', end.planning_time)
        self.motions.pause(0.5)
        moved = float(np.abs(self.motions.positions - before).max())
        if end.code != BLOCKED:
            self.results.problem(name, f'{end.code} instead of {BLOCKED}: {end.message}')
        elif not any(all(each in end.message for each in pair) for pair in pairs):
            named = ', '.join(' and '.join(sorted(pair)) for pair in pairs)
            self.results.problem(name, f'the message names none of {named}: {end.message}')
        if moved > STILL:
            self.results.problem(name, f'a joint moved by {moved:.3f}')
        self.results.add(name, f'{end.code}: {end.message}')

    def _swing(self, arm: Arm, *, with_visitor: bool) -> None:
        """Have an arm of any number of joints move around a box, and back."""
        model, observer = arm.model, self.client.observer
        name = f'{model.group} around a box'
        self.enter(f'{model.group}: around a box, by free motion')
        swing = arm.swing
        if swing is None:
            self.results.add(name, 'left out: no motion was found for it')
            return
        self.motions.move(name, MotionOrder(model.group, by_joint(model, swing.begin), speed=FREE))
        self._add(swing.box)
        watch = observer.watch()
        there = self.motions.move(name, MotionOrder(model.group, by_joint(model, swing.end)))
        observer.end(watch)
        inside = by_joint(model, swing.inside)
        self._refused(f'{model.group}: blocked goal', MotionOrder(model.group, inside))
        back = by_joint(model, swing.begin)
        if with_visitor:
            self._visit(arm, back)
        else:
            self.motions.move(name, MotionOrder(model.group, back))
        self.results.add(name, f'planned in {_times(there)}, {clearance(watch)}')
        self._remove(swing.box.name)

    def _together(self) -> None:
        """Have all arms that can swing move at the same time, in one scene."""
        name = 'arms at the same time'
        self.enter('all arms at the same time')
        observer = self.client.observer
        goals = {arm.model.group: (arm, arm.swing) for arm in self.arms if arm.swing is not None}
        if len(goals) < 2:  # one alone is not at the same time
            self.results.add(name, 'left out: fewer than two of them have a motion')
            return
        watch, overlap = observer.watch(), 0.0
        for ends in (
            {group: swing.end for group, (_, swing) in goals.items()},
            {group: swing.begin for group, (_, swing) in goals.items()},
        ):
            orders = [
                MotionOrder(group, by_joint(goals[group][0].model, end), speed=FREE)
                for group, end in ends.items()
            ]
            runs = [self.motions.send(order) for order in orders]
            overlap += self.motions.overlap(runs)
            for order, run in zip(orders, runs, strict=True):
                self.motions.judge(name, order, run.end())
        observer.end(watch)
        self.results.watched(name, watch)
        if overlap <= 0.0:
            self.results.problem(name, 'they were never under way at the same time')
        self.results.add(
            name, f'{" and ".join(goals)}, {overlap:.1f} s side by side, without a contact'
        )

    def _stop(self, run: MotionRun, begun: float) -> str:
        """Wait until no joint moves; say how long after a time in [s] that was, and how near."""
        at_rest = self.motions.rest(run)
        if run.done:
            return 'not seen to rest'
        room = distance_of(self.client.observer.scene, self.motions.positions, VISITOR)
        return f'at rest {at_rest - begun:.1f} s after it came, {1e3 * room:.0f} mm before it'

    def _add(self, *things: CollisionObject) -> None:
        self.client.change(SceneChange(add=things))
        observer = self.client.observer
        scene: PlanningScene = observer.scene
        for each in things:
            scene = scene.with_object(each)
        observer.change(scene)
        names = {each.name for each in things}
        self.motions.wait(
            lambda: names <= {*self.client.scene.objects},
            SETTLE_TIMEOUT,
            f'{", ".join(sorted(names))} in monitored_planning_scene',
        )

    def _remove(self, name: str) -> None:
        self.client.change(SceneChange(remove=[name]))
        observer = self.client.observer
        observer.change(observer.scene.without(name))


def _times(end: MotionEnd) -> str:
    return f'{1e3 * end.planning_time:.0f} ms'
