# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Planning and execution by move_group from the page, as an ordinary client of move_group."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from importlib import import_module
from itertools import pairwise
import time
from typing import Any

import numpy as np
from rclpy.node import Node
from rclpy.task import Future
from std_msgs.msg import String
from urdf_reader import DescriptionError, link_poses, Transform
from viser import LineSegmentsHandle, TransformControlsEvent, TransformControlsHandle

from node_runner import LATCHED
from node_runner.action_goals import GoalClient

from ..page.live import Hold, RELEASED_AFTER
from ..page.robot_page import RobotPage
from ..page.robot_scene import links_beyond, moved, pose_of, put, RobotScene, Tint
from ..page.style import add_button, add_choice, BAD, GOOD, line, PLAIN, WANTED
from .interfaces import ActionCall
from .motion_plan import (
    ik_request,
    Message,
    plan_goal,
    plan_groups,
    PlanGroup,
    planned_motion,
    PlannedMotion,
    positions_of,
    refusal,
    tip_line,
)
from .planning_scene import PlanningScene

MOVE, EXECUTE = 'move_action', 'execute_trajectory'
OFFERED = {
    f'{MOVE}/_action/send_goal': 'moveit_msgs/action/MoveGroup_SendGoal',
    f'{EXECUTE}/_action/send_goal': 'moveit_msgs/action/ExecuteTrajectory_SendGoal',
}
"""Services that identify a move_group."""
ANSWER_TIME = 2.0  # service timeout in [s]
STOP = 'stop'  # the event that ends every execution
NO_GOAL, DRAGGED = 'none', 'dragged in the view'  # goals that are not SRDF states
HOLD_EXECUTE = 'Hold to execute'
GHOST_TINT: Tint = (0.05, 0.52, 0.6, 0.4)
LINE_COLOR = (24, 100, 171)
LINE_WIDTH = 3.0  # in [px]
GOAL_SIZE = 0.22  # of the goal's drag handles in [m]


class MotionPlanning:
    """Plans and executes motions for the page. Call in the node's thread; never blocks.

    Attributes:
        offered: Whether the panel is on the page; its elements exist only then.
        hold: Number of the execute button.
        scene: The planning scene of move_group.
    """

    def __init__(
        self,
        node: Node,
        page: RobotPage,
        positions: Mapping[str, float],
        order: Callable[[Callable[[], None]], None],
    ) -> None:
        self._node, self._page, self._positions, self._order = node, page, positions, order
        self._connected = self.offered = False
        self.hold = 0
        self._semantic = ''
        self._groups: Mapping[str, PlanGroup] = {}
        self._group = PlanGroup('', (), '', {})
        self._goal = NO_GOAL
        self._pose: Transform | None = None  # dragged tip pose until IK has solved it
        self._joints: dict[str, float] = {}  # of the goal; empty if unknown
        self._asked: float | None = None  # time of the pending IK request
        self._planning: ActionCall | None = None
        self._trajectory: Message = None
        self._motion: PlannedMotion | None = None
        self._shown_since: float | None = None
        self._execution: ActionCall | None = None
        self._canceled_as = ''  # why the page canceled it
        self._held_at = 0.0  # last heartbeat of the execute button
        self._executed_goal: tuple[str, dict[str, float]] = (NO_GOAL, {})
        self._ghost: RobotScene | None = None
        self._links: frozenset[str] = frozenset()  # moved by the group
        self._line: LineSegmentsHandle | None = None
        self._gizmo: TransformControlsHandle | None = None
        self.scene = PlanningScene(node, page, self.ordered, self.say)

    # -- what there is

    def look(self, services: Mapping[str, Sequence[str]]) -> None:
        """Discover a move_group in the node's namespace."""
        there = all(
            kind in services.get(self._node.resolve_service_name(name), ())
            for name, kind in OFFERED.items()
        )
        if not self._connected:
            if there:
                self._connect()
        elif not there and self._execution is not None:
            self._execution = None
            self._page.live.end(self.hold)
            self.say('move_group is gone; what it executed may go on: STOP', failed=True)
        self.scene.look()
        if not self.offered and self._semantic and self._page.robot is not None:
            self._offer(self._page.robot)

    def _connect(self) -> None:
        node, actions = self._node, import_module('moveit_msgs.action')
        solve = import_module('moveit_msgs.srv').GetPositionIK
        self._move = GoalClient(node, actions.MoveGroup, MOVE)
        self._execute = GoalClient(node, actions.ExecuteTrajectory, EXECUTE)
        self._ik = node.create_client(solve, 'compute_ik')
        self._events = node.create_publisher(String, 'trajectory_execution_event', 10)
        self._connected = True
        node.create_subscription(String, 'robot_description_semantic', self._name_groups, LATCHED)
        self.scene.connect()

    def _name_groups(self, message: String) -> None:
        self._semantic = str(message.data)

    def _offer(self, robot: RobotScene) -> None:
        page, gui = self._page, self._page.server.gui
        if not page.has('Plan'):
            return
        try:
            self._groups = plan_groups(robot.tree, self._semantic)
        except DescriptionError as error:
            self._node.get_logger().error(f'robot_description_semantic: {error}')
            self._semantic = ''
            return
        self._robot, do = robot, self.ordered
        with page.place('Plan', self):
            self._group_box = add_choice(gui, 'Group', self._groups, do(self.choose_group))
            self.goal = add_choice(gui, 'Goal', (NO_GOAL, DRAGGED), do(self.choose_goal))
            add_button(gui, 'Plan motion', do(self.plan), WANTED)
            self.outcome = gui.add_html('')
            self._again = add_button(gui, 'Show motion again', do(self.show_again))
            self.hold, html = page.live.button(
                Hold(
                    HOLD_EXECUTE,
                    lambda: self.order(partial(self.go_on, time.monotonic())),
                    lambda: self.order(self.let_go),
                    lambda: self.order(partial(self.execute, time.monotonic())),
                )
            )
            gui.add_html(f'<div class="rv-one">{html}</div>')
            self.scene.offer(robot)
        self.offered = True
        page.cancel = partial(self.order, self._drop)
        self._allow(execute=False)
        self.choose_group(next(iter(self._groups)))

    def remove(self) -> None:
        """Remove the panel from the page before another robot is shown."""
        self._drop()
        self.offered, self._pose = False, None
        self._page.live.remove(self.hold)
        self.scene.remove()
        for node in (self._ghost, self._line, self._gizmo):
            if node is not None:
                node.remove()
        self._ghost = self._line = self._gizmo = None

    # -- what people do

    def order(self, action: Callable[[], object]) -> None:
        """Run an action of the page in the node's thread, unless its robot is no longer shown."""

        def act() -> None:
            if self.offered:
                action()

        self._order(act)

    def ordered(self, action: Callable[..., object]) -> Callable[..., None]:
        """Return a function that runs an action in the node's thread."""
        return lambda *values: self.order(partial(action, *values))

    def show_again(self) -> None:
        """Replay the plan."""
        self._shown_since = time.monotonic() if self._motion else None

    def stop(self) -> None:
        """Stop all execution and planning, also for other clients, and discard the plan."""
        if self._connected:
            self._events.publish(String(data=STOP))
            if self._execution is not None:
                self._execution.cancel()
            self._drop()

    def go_on(self, at: float) -> None:
        """Continue the execution: its button was held at steady time ``at`` in [s]."""
        self._held_at = at

    def let_go(self) -> None:
        """Cancel the execution after its button was released."""
        self._cancel('its button was let go')

    def _cancel(self, why: str) -> None:
        if self._execution is not None:
            self._canceled_as = self._canceled_as or why
            self._execution.cancel()

    @property
    def busy(self) -> bool:
        """Whether a plan is being executed."""
        return self._execution is not None

    @property
    def moves(self) -> bool:
        """Whether a plan is being executed or replayed."""
        return self.busy or self._shown_since is not None

    def advance(self) -> None:
        """Cancel the execution if heartbeats of its button are overdue."""
        if self.busy and time.monotonic() - self._held_at > RELEASED_AFTER:
            self._cancel('heartbeats of its held button came late')

    def draw(self) -> None:
        """Draw the next frame of the replay, if one is running."""
        if self._motion is None or self._shown_since is None:
            return
        places = self._motion.shown(time.monotonic() - self._shown_since)
        if places is None:
            self._shown_since, places = None, self._motion.at(self._motion.duration)
        self._show_ghost(places)

    def choose_group(self, name: str) -> None:
        """Select the planning group."""
        self._group = self._groups[name]
        self._group_box.value = name  # type: ignore[misc]  # it has a setter
        self.goal.options = (NO_GOAL, DRAGGED, *self._group.states)
        links = links_beyond(self._robot.tree, frozenset(self._group.joints))
        if links != self._links and self._ghost is not None:
            self._ghost.remove()
            self._ghost = None
        self._links = links
        self.choose_goal(NO_GOAL)

    def choose_goal(self, name: str) -> None:
        """Select an SRDF state or the dragged pose as the goal."""
        self._drop()
        self._goal, self._pose, self._joints = name, None, {}
        if name in self._group.states or name == DRAGGED:
            here = {each: self._positions.get(each, 0.0) for each in self._group.joints}
            self._joints = {**here, **self._group.states.get(name, {})}
        self.goal.value = name  # type: ignore[misc]
        self.say('')
        if self._joints:
            tree = self._robot.tree
            if self._gizmo is None:
                self._gizmo = self._page.server.scene.add_transform_controls(
                    f'{self._robot.path_of(tree.root)}/goal', GOAL_SIZE, disable_sliders=True
                )
                self._gizmo.on_update(self._dragged)
            poses = link_poses(tree, moved(tree, self._positions, self._joints))
            put(self._gizmo, poses[self._group.tip])
            self._show_ghost(self._joints)
        elif self._ghost is not None:
            self._ghost.show(seen=False)
        if self._gizmo is not None:
            self._gizmo.visible = bool(self._joints)

    async def _dragged(self, event: TransformControlsEvent) -> None:
        self.order(partial(self.drag_goal, pose_of(event.target)))  # coroutines keep their order

    def drag_goal(self, pose: Transform) -> None:
        """Set the goal to a tip pose in the root link frame."""
        self._drop()
        self._goal, self._pose = DRAGGED, pose
        self.goal.value = DRAGGED  # type: ignore[misc]
        self._solve()

    def _solve(self) -> None:
        """Solve IK for the dragged tip pose; one request at a time."""
        pose, now = self._pose, time.monotonic()
        if pose is None or (self._asked is not None and now - self._asked < ANSWER_TIME):
            return
        if not self._ik.service_is_ready():
            self.say('compute_ik is not there', failed=True)
            return
        self._asked = now
        request = ik_request(self._group, pose, self._robot.tree.root, self._joints)
        self._ik.call_async(request).add_done_callback(lambda done: self._solved(pose, done))

    def _solved(self, asked: Transform, future: Future) -> None:
        self._asked = None
        if self._pose is None:
            return
        if future.exception() is not None:
            self.say(f'compute_ik: no answer: {future.exception()}', failed=True)
            return
        response: Any = future.result()
        reason = refusal(response.error_code)
        if not reason:
            self._joints = positions_of(response.solution, self._group)
            self._show_ghost(self._joints)
        if asked != self._pose:
            self._solve()
        else:
            self._pose = self._pose if reason else None  # after success the joints are the goal
            self.say(reason, failed=True)

    def plan(self) -> None:
        """Plan at the speed set on the page."""
        reason = ''
        if not self._joints:
            reason = 'choose a goal first: a state, or one that is dragged'
        elif self._pose is not None:
            reason = 'no joints are known that bring the tip to where it was dragged'
        elif self.busy:
            reason = 'it is still executing; STOP ends it'
        elif not self._move.server_is_ready():
            reason = f'{MOVE} is not there'
        if reason:
            self.say(reason, failed=True)
            return
        self._drop()
        self.say('planning ...')
        message = plan_goal(self._group, self._joints, self._page.speed())
        self._planning = ActionCall(self._move, message, self._planned)

    def _planned(self, call: ActionCall, result: Message, why: str) -> None:
        if call is not self._planning:
            return  # of an outdated request
        self._planning = None
        reason = why or refusal(result.error_code)
        if reason:
            self.say(reason, failed=True)
            return
        self._motion = motion = planned_motion(result.planned_trajectory)
        if motion.duration == 0.0:
            self.say('it is there already', failed=False)
            return
        self._trajectory, self._shown_since = result.planned_trajectory, time.monotonic()
        points = tip_line(self._robot.tree, self._group.tip, self._positions, motion)
        self._line = self._page.server.scene.add_line_segments(
            f'{self._robot.path_of(self._robot.tree.root)}/line',
            np.array(list(pairwise(points))),
            LINE_COLOR,
            thickness=LINE_WIDTH,
            thickness_units='screen',
        )
        self._allow(execute=True)
        notes = f'; {result.error_code.message}' if result.error_code.message else ''
        self.say(
            f'the motion takes {motion.duration:.1f} s, planned in'
            f' {1000.0 * result.planning_time:.0f} ms{notes}',
            failed=False,
        )

    def execute(self, at: float) -> None:
        """Execute the plan; its button was held at steady time ``at`` in [s]."""
        if time.monotonic() - at > RELEASED_AFTER:
            return  # this node was delayed; the button may be released
        if self._trajectory is None or self._motion is None:
            self.say('nothing is planned that may be executed', failed=True)
            return
        if not self._execute.server_is_ready():
            self.say(f'{EXECUTE} is not there', failed=True)
            return
        goal = import_module('moveit_msgs.action').ExecuteTrajectory.Goal()
        goal.trajectory = self._trajectory
        self._trajectory, self._shown_since, self._held_at = None, None, at
        self._canceled_as = ''
        self._executed_goal = self._goal, self._joints
        self._allow(execute=False)
        self._show_ghost(self._motion.at(self._motion.duration))
        self.say('executing ...')
        self._execution = ActionCall(self._execute, goal, self._executed)

    def _executed(self, call: ActionCall, result: Message, why: str) -> None:
        if call is not self._execution:
            return
        self._execution = None
        reason = why or refusal(result.error_code)
        if reason and self._canceled_as:
            reason = f'ended, as {self._canceled_as} ({reason})'
        self._page.live.end(self.hold)
        if self.offered and not reason and self._executed_goal == (self._goal, self._joints):
            self.choose_goal(NO_GOAL)  # unless another one was selected meanwhile
        self.say(reason or 'executed', failed=bool(reason))

    def _drop(self) -> None:
        """Discard the plan, and cancel planning."""
        if self._planning is not None:
            self._planning.cancel()
            self._planning = None
            self.say('canceled')
        if self._line is not None:
            self._line.remove()
            self._line = None
        if self.offered:
            self._allow(execute=False)
        self._trajectory = self._motion = self._shown_since = None

    # -- what is shown

    def _show_ghost(self, goals: Mapping[str, float]) -> None:
        """Show a ghost of the robot with joints at goals."""
        if self._ghost is None:
            self._ghost = self._robot.ghost('ghost', self._links, GHOST_TINT)
        self._ghost.place(moved(self._robot.tree, self._positions, goals))
        self._ghost.show(seen=True)

    def say(self, text: str, *, failed: bool | None = None) -> None:
        """Show the outcome of the last request."""
        if self.offered:
            mark = PLAIN if failed is None else BAD if failed else GOOD
            self.outcome.content = line(text, mark) if text else ''

    def _allow(self, *, execute: bool) -> None:
        """Enable the buttons that need a plan."""
        self._again.disabled = not execute
        self._page.live.off.pop(self.hold, None)
        if not execute:
            self._page.live.off[self.hold] = 'Plan a motion first.'
