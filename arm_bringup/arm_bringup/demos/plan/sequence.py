# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What the demo does: pick, place, a box in the way, a blocked goal, further arms."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
import contextlib
from dataclasses import dataclass
import math
import time

import numpy as np

from arm_model import Array, AttachedBody, CollisionObject, PlanningScene, Pose, RobotModel
from process_supervisor import CallError

from .boxes import box_ahead, distance_of, Swing
from .observer import Watch
from .orders import (
    BLOCKED,
    DisplayedPath,
    MotionEnd,
    MotionOrder,
    MotionRun,
    PlanningClient,
    SceneChange,
    SUCCESS,
    UNKNOWN_STATE,
)
from .results import apart, clearance, Results, WORST_JOINT, WORST_PLACE, WORST_TURN
from .tool import PART, Tool
from .workcell import by_joint, PILLAR, Station, Workcell

SLOW, CAREFUL, FREE = 0.1, 0.2, 0.5
"""Shares of the limits at which the arm meets a box, follows lines, and moves freely."""
MOTION_TIMEOUT = 120.0
"""Longest time of a motion in [s]."""
START_TIMEOUT = 60.0
"""Longest time until move_group has received joint states in [s]: DDS takes long on a busy
computer."""
SETTLE_TIMEOUT = 5.0
"""Longest time from the end of a motion until the joints are seen at its goal in [s]."""
LOOK_PERIOD = 0.02
"""Time between two looks in [s]."""
DISPLAYED = 4
"""How many of the last paths on display_planned_path may be the one that is looked for."""
EARLY = 0.15
"""Share of the way after which a box appears."""
STILL = 1e-2
"""How far joints of an arm that was refused a motion may be off in [rad] or [m]."""
AT_REST, REST_TIME = 5e-4, 0.15
"""An arm whose joints move less than so far in so long rests, in [rad] or [m], and [s]."""
VISITOR = 'visitor'
"""Name of the box that appears in the way."""


class EndRequested(Exception):  # noqa: N818  # it is no error: the user asked for the end
    """The user asked for the end."""


@dataclass(frozen=True, slots=True, eq=False)
class Arm:
    """An arm that plays.

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
        client: The client.
        arms: The arms; the first shows what it can.
        results: Where figures go.
        enter: Called with the name of each part.
        look: Called often; shows how it goes, and raises EndRequested.
        clock: Steady time in [s].
    """

    client: PlanningClient
    arms: Sequence[Arm]
    results: Results
    enter: Callable[[str], None] = lambda _: None
    look: Callable[[], None] = lambda: None
    clock: Callable[[], float] = time.monotonic
    _run: MotionRun | None = None
    _is_turned: bool = False

    def set_up(self) -> None:
        """Put the scene up.

        Raises:
            CallError: It was refused, or somebody does not answer.
            GivenUpError: The processes have ended.
            EndRequested: The user asked for the end.
        """
        self.enter('putting the scene up')
        observer = self.client.observer
        self._wait(lambda: observer.positions is not None, SETTLE_TIMEOUT, 'joint states')
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
        watch, deadline = self.client.observer.watch(), self.clock() + START_TIMEOUT
        run = self._attempt(order)
        while run.end().code == UNKNOWN_STATE and self.clock() < deadline:
            run = self._attempt(order)
        self._finish('home', order, run, watch)

    def _attempt(self, order: MotionOrder) -> MotionRun:
        """Send a motion, and wait for its end, whatever that is."""
        run = self._send(order)
        self._wait(lambda: run.done, MOTION_TIMEOUT, 'the end of a motion')
        return run

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
        self._report_display(shown)

    def come_to_rest(self) -> None:
        """Cancel what is on its way, and wait for its end."""
        run = self._run
        if run is not None and not run.done:
            run.cancel()
            self.client.wait_until(lambda: run.done, SETTLE_TIMEOUT, 'the end of the canceled')

    def _pick_and_place(self, arm: Arm, cell: Workcell, tool: Tool) -> None:
        source, target = cell.stations[::-1] if self._is_turned else cell.stations
        self._pick(arm, tool, source)
        self._place(arm, tool, target)
        self._is_turned = not self._is_turned
        home = MotionOrder(arm.model.group, by_joint(arm.model, cell.home), speed=FREE)
        self.enter('home, by free motion')
        self._move('home', home)
        self._visit(arm, by_joint(arm.model, cell.aside))
        self._blocked(arm, source)
        self.enter('home, by free motion')
        self._move('home', home)

    def _pick(self, arm: Arm, tool: Tool, station: Station) -> None:
        name, model = 'pick', arm.model
        self.enter('to the part, by free motion')
        if tool.gripper:
            self.client.grip(arm.gripper, tool.gripper.open)
        free = self._go_above(name, arm, station)
        self.enter('picking: a straight approach, attach, a straight retreat')
        down = self._line(name, arm, station.grasp)
        self._rest()
        body = AttachedBody(tool.part, model.tip, frozenset(tool.links))
        self.client.change(SceneChange(attach=body))
        observer = self.client.observer
        observer.change(
            observer.scene.attached(PART, model.tip, self._positions(), tool.links), {PART}
        )
        held = ''
        if tool.gripper:
            self.client.grip(arm.gripper, tool.gripper.closed)
            held = self._gripped(name, tool)
        up = self._line(name, arm, station.above)
        self._shown(name, attached=True)
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
        self._rest()
        body = AttachedBody(tool.part, arm.model.tip)
        self.client.change(SceneChange(detach=body))
        observer.change(observer.scene.detached(PART, self._positions()), {PART})
        off, turn = apart(observer.scene.pose(PART, self._positions()), station.part.pose)
        self.results.arrived(f'{name}: the part', off, WORST_PLACE, 'm')
        self.results.arrived(f'{name}: the part', turn, WORST_TURN, 'rad')
        up = self._line(name, arm, station.above)
        observer.change(observer.scene)
        self._shown(name, attached=False)
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
            return abs(float(self._positions()[place]) - gripper.closed)

        with contextlib.suppress(CallError):
            self._wait(lambda: off() <= WORST_JOINT, SETTLE_TIMEOUT, 'the grip')
        self.results.arrived(f'{name}: {gripper.joint}', off(), WORST_JOINT, 'm')
        width = 1e3 * gripper.closed
        return f'; gripped with {gripper.joint} at {width:.1f} mm'

    def _go_above(self, name: str, arm: Arm, station: Station) -> MotionEnd:
        """Move freely to where a straight approach begins: what compute_ik finds for it."""
        seed = by_joint(arm.model, station.joints)
        joints = self.client.ik(arm.model.group, arm.model.tip, station.above, seed, free=True)
        return self._move(name, MotionOrder(arm.model.group, joints, speed=FREE))

    def _line(self, name: str, arm: Arm, pose: Pose) -> MotionEnd:
        observer = self.client.observer
        observer.change(observer.scene, {PART})
        order = MotionOrder(
            arm.model.group, link=arm.model.tip, pose=pose, planner_id='LIN', speed=CAREFUL
        )
        return self._move(name, order)

    def _visit(self, arm: Arm, joints: Mapping[str, float]) -> None:
        """Put a box in the way of a motion: it must not be touched, and the goal be reached."""
        name = 'box in the way'
        self.enter('slowly on, until a box appears in the way')
        client, observer = self.client, self.client.observer
        shown = len(client.paths)
        order = MotionOrder(arm.model.group, joints, speed=SLOW, replan=True)
        run, watch = self._send(order), observer.watch()
        self._wait(
            lambda: run.done or (run.executing and len(client.paths) > shown), 60.0, 'motion'
        )
        self._wait(lambda: run.done or self._share(client.paths[-1]) > EARLY, 60.0, 'motion')
        path = client.paths[-1] if len(client.paths) > shown else None
        box = None
        if path is not None and not run.done:
            box = box_ahead(arm.model, observer.scene, self._ahead(path), VISITOR)
        if box is None:
            self._finish(name, order, run, watch)
            self.results.problem(name, 'no place was found for a box in its way')
            return
        self.enter('a box is in the way: stop before it, plan anew, go around')
        observer.change(observer.scene.with_object(box))
        watch.clearance, watch.nearest = math.inf, ('', '')
        appeared = self.clock()
        client.change(SceneChange(add=[box]))
        stop = self._stop(run, appeared)
        end = self._finish(name, order, run, watch)
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
        before = self._positions()
        pairs = observer.contacts(observer.row(order.joints))
        end = self._attempt(order).end()
        self.client.show(f'{end.code}: {end.message}', end.planning_time)
        self._watch_for(0.5)
        moved = float(np.abs(self._positions() - before).max())
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
        self._move(name, MotionOrder(model.group, by_joint(model, swing.begin), speed=FREE))
        self._add(swing.box)
        watch = observer.watch()
        there = self._move(name, MotionOrder(model.group, by_joint(model, swing.end)))
        observer.end(watch)
        inside = by_joint(model, swing.inside)
        self._refused(f'{model.group}: blocked goal', MotionOrder(model.group, inside))
        back = by_joint(model, swing.begin)
        if with_visitor:
            self._visit(arm, back)
        else:
            self._move(name, MotionOrder(model.group, back))
        self.results.add(name, f'planned in {_times(there)}, {clearance(watch)}')
        self._remove(swing.box.name)

    def _together(self) -> None:
        """Have all arms that can swing move at the same time, in one scene."""
        name = 'arms at the same time'
        self.enter('all arms at the same time')
        client, observer = self.client, self.client.observer
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
            runs = [client.send(order) for order in orders]
            overlap += self._overlap(runs)
            for order, run in zip(orders, runs, strict=True):
                self._judge_end(name, order, run.end())
        observer.end(watch)
        self.results.watched(name, watch)
        if overlap <= 0.0:
            self.results.problem(name, 'they were never under way at the same time')
        self.results.add(
            name, f'{" and ".join(goals)}, {overlap:.1f} s side by side, without a contact'
        )

    def _overlap(self, runs: Sequence[MotionRun]) -> float:
        """Wait for the end of motions; return for how long all were under way in [s]."""
        overlap, last = 0.0, self.clock()

        def done() -> bool:
            nonlocal overlap, last
            now = self.clock()
            if all(run.executing and not run.done for run in runs):
                overlap += now - last
            last = now
            return all(run.done for run in runs)

        self._wait(done, MOTION_TIMEOUT, 'the end of the motions')
        return overlap

    def _move(self, name: str, order: MotionOrder) -> MotionEnd:
        """Move, and judge it: contacts, and where the joints were seen at its end."""
        watch = self.client.observer.watch()
        return self._finish(name, order, self._send(order), watch)

    def _send(self, order: MotionOrder) -> MotionRun:
        self.client.show(order.planner_id or 'free motion', math.nan)
        self._run = self.client.send(order)
        return self._run

    def _finish(self, name: str, order: MotionOrder, run: MotionRun, watch: Watch) -> MotionEnd:
        self._wait(lambda: run.done, MOTION_TIMEOUT, f'the end of a motion ({name})')
        end = run.end()
        self._judge_end(name, order, end)
        self.client.observer.end(watch)
        self.results.watched(name, watch)
        return end

    def _judge_end(self, name: str, order: MotionOrder, end: MotionEnd) -> None:
        if end.code != SUCCESS:
            raise CallError(f'{name}: {end.code}: {end.message}')
        self.results.planning_times.append(end.planning_time)
        self.client.show(order.planner_id or 'free motion', end.planning_time)

        def there() -> bool:
            return all(off <= most for off, most, _ in self._off(order))

        with contextlib.suppress(CallError):
            self._wait(there, SETTLE_TIMEOUT, 'arrival')
        for off, most, unit in self._off(order):
            self.results.arrived(name, off, most, unit)
        with contextlib.suppress(CallError):
            self._wait(lambda: self._is_displayed(order), SETTLE_TIMEOUT, 'its path')
        if not self._is_displayed(order):
            self.results.problem(name, 'display_planned_path has no path that ends at the goal')

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

    def _ahead(self, path: DisplayedPath) -> Sequence[Array]:
        """Return positions of all joints on what is left of a path, from where they are."""
        observer = self.client.observer
        rows = [observer.row(dict(zip(path.joints, row, strict=True))) for row in path.rows]
        here = self._positions()
        passed = min(range(len(rows)), key=lambda row: float(np.abs(rows[row] - here).max()))
        return [here, *rows[passed + 1 :]]

    def _share(self, path: DisplayedPath) -> float:
        """Return which share of the way from the begin to the end of a path is done."""
        begin, end = np.array(path.rows[0]), np.array(path.rows[-1])
        joints = list(self.client.observer.joints)
        here = self._positions()[[joints.index(name) for name in path.joints]]
        way = float(np.abs(end - begin).max())
        return float(np.abs(here - begin).max()) / way if way > 0.0 else 1.0

    def _stop(self, run: MotionRun, begun: float) -> str:
        """Wait until no joint moves; say how long after a time in [s] that was, and how near."""
        at_rest = self._rest(run)
        if run.done:
            return 'not seen to rest'
        room = distance_of(self.client.observer.scene, self._positions(), VISITOR)
        return f'at rest {at_rest - begun:.1f} s after it came, {1e3 * room:.0f} mm before it'

    def _rest(self, run: MotionRun | None = None) -> float:
        """Wait until no joint moves, or a motion has ended; return when one moved last in [s]."""
        last, moved = self._positions(), self.clock()

        def rests() -> bool:
            nonlocal last, moved
            here, now = self._positions(), self.clock()
            if float(np.abs(here - last).max()) > AT_REST:
                last, moved = here, now
            return now - moved > REST_TIME or (run is not None and run.done)

        self._wait(rests, MOTION_TIMEOUT, 'rest')
        return moved

    def _report_display(self, first: int) -> None:
        """Judge whether a viewer has the robot where it rests; say what else it was shown."""
        name, client = 'viewer', self.client

        def off() -> float:
            here = self._positions()
            shown = self.client.observer.row(client.scene.joints)
            return float(np.abs(shown - here).max()) if client.scene.joints else math.inf

        with contextlib.suppress(CallError):
            self._wait(lambda: off() <= WORST_JOINT, SETTLE_TIMEOUT, 'the scene')
        where = f'{name}: the robot in monitored_planning_scene'
        self.results.arrived(where, off(), WORST_JOINT, 'rad')
        paths = client.paths[first:]
        things = ', '.join(client.scene.objects) or 'nothing'
        self.results.add(
            name, f'{len(paths)} paths on display_planned_path; in the scene at the end: {things}'
        )

    def _shown(self, name: str, *, attached: bool) -> None:
        """Judge whether the scene that viewers get has the part where it is."""
        client = self.client

        def right() -> bool:
            return (PART in client.scene.attached) == attached and (
                PART in client.scene.objects
            ) != attached

        try:
            self._wait(right, SETTLE_TIMEOUT, 'the scene')
        except CallError:
            where = 'attached' if attached else 'in the world'
            self.results.problem(name, f'monitored_planning_scene does not have the part {where}')
            return
        if not attached:
            observer = self.client.observer
            seen = observer.scene.pose(PART, self._positions())
            off, _ = apart(client.scene.objects[PART], seen)
            self.results.arrived(
                f'{name}: the part in monitored_planning_scene', off, WORST_PLACE, 'm'
            )

    def _add(self, *things: CollisionObject) -> None:
        self.client.change(SceneChange(add=things))
        observer = self.client.observer
        scene: PlanningScene = observer.scene
        for each in things:
            scene = scene.with_object(each)
        observer.change(scene)
        names = {each.name for each in things}
        self._wait(
            lambda: names <= {*self.client.scene.objects},
            SETTLE_TIMEOUT,
            f'{", ".join(sorted(names))} in monitored_planning_scene',
        )

    def _remove(self, name: str) -> None:
        self.client.change(SceneChange(remove=[name]))
        observer = self.client.observer
        observer.change(observer.scene.without(name))

    def _positions(self) -> Array:
        positions = self.client.observer.positions
        if positions is None:
            raise CallError('joint_states: nothing came')
        return positions

    def _wait(self, condition: Callable[[], bool], timeout: float, what: str) -> None:
        def reached() -> bool:
            self.look()
            return condition()

        self.client.wait_until(reached, timeout, what)

    def _watch_for(self, pause: float) -> None:
        end = self.clock() + pause
        self._wait(lambda: self.clock() > end, pause + SETTLE_TIMEOUT, 'a pause')


def _times(end: MotionEnd) -> str:
    return f'{1e3 * end.planning_time:.0f} ms'
