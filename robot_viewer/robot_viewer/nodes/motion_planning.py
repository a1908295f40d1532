# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Plans and their execution by move_group, for people at the page: what any client may do."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
import time
from typing import Any, Protocol

from rclpy.action.client import ActionClient
from rclpy.client import Client
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.task import Future
from std_msgs.msg import String
from urdf_reader import DescriptionError, KinematicTree, Transform

from node_runner import LATCHED

from ..link_poses import link_pose, moved
from ..page.deadman import RELEASED_AFTER
from ..page.motion_plan import (
    DRAGGED,
    NO_GOAL,
    Order,
    plan_groups,
    PlanActions,
    PlanGroup,
    PlannedMotion,
    SceneActions,
    tip_line,
)
from ..page.plan_panel import PlanPanel
from .action_call import ActionCall
from .planning_messages import (
    ik_request,
    Message,
    plan_goal,
    planned_motion,
    positions_of,
    refusal,
)
from .scene_editor import SceneEditor

MOVE, EXECUTE = 'move_action', 'execute_trajectory'
OFFERED = {
    f'{MOVE}/_action/send_goal': 'moveit_msgs/action/MoveGroup_SendGoal',
    f'{EXECUTE}/_action/send_goal': 'moveit_msgs/action/ExecuteTrajectory_SendGoal',
}
"""Services that say that there is a move_group."""
ANSWER_TIME = 2.0
"""Time in [s] after which an answer counts as lost."""
STOP = 'stop'
"""The event that ends every execution."""


class Page(Protocol):
    """Where it is shown."""

    def offer_plan(
        self, groups: Sequence[str], actions: tuple[PlanActions, SceneActions, Order]
    ) -> PlanPanel | None:
        """Offer to plan motions; None as long as there is no robot."""


@dataclass(frozen=True, slots=True)
class _Links:
    """Clients of a move_group, and where executions are ended."""

    move: ActionClient
    execute: ActionClient
    ik: Client
    events: Publisher


class MotionPlanning:
    """What people plan; everything in the thread of the node, and nothing waits."""

    def __init__(
        self,
        node: Node,
        page: Page,
        positions: Mapping[str, float],
        order: Order,
    ) -> None:
        """Find no move_group yet."""
        self._node, self._page, self._positions, self._order = node, page, positions, order
        self._links: _Links | None = None
        self._tree: KinematicTree | None = None
        self._semantic = ''
        self._panel: PlanPanel | None = None
        self._groups: Mapping[str, PlanGroup] = {}
        self._group = PlanGroup('', (), '', {})
        self._goal = NO_GOAL
        self._pose: Transform | None = None  # where the tip is dragged to
        self._joints: dict[str, float] = {}  # of the goal; none where none is known
        self._asked: float | None = None  # when inverse kinematics were asked for
        self._planning: ActionCall | None = None
        self._trajectory: Message = None
        self._motion: PlannedMotion | None = None
        self._shown_since: float | None = None
        self._execution: ActionCall | None = None
        self._canceled_as = ''  # why the page has canceled it
        self._held_at = 0.0  # when the button of the execution was seen to be held
        self._executed_goal: tuple[str, dict[str, float]] = (NO_GOAL, {})
        self._scene = SceneEditor(node)

    # -- what there is

    def describe(self, tree: KinematicTree) -> None:
        """Use another robot; the page has removed the panel."""
        self._tree, self._panel = tree, None
        self._drop()

    def look(self, services: Mapping[str, Sequence[str]]) -> None:
        """Find a move_group in the namespace of the node."""
        there = all(
            kind in services.get(self._node.resolve_service_name(name), ())
            for name, kind in OFFERED.items()
        )
        if self._links is None:
            if there:
                self._connect()
        elif not there and self._execution is not None:
            self._execution = None
            self._say('move_group is gone; what it executed may go on: STOP', failed=True)
        if self._panel is None and self._semantic and self._tree is not None:
            self._offer(self._tree)

    def _connect(self) -> None:
        node, actions = self._node, import_module('moveit_msgs.action')
        solve = import_module('moveit_msgs.srv').GetPositionIK
        self._links = _Links(
            ActionClient(node, actions.MoveGroup, MOVE),
            ActionClient(node, actions.ExecuteTrajectory, EXECUTE),
            node.create_client(solve, 'compute_ik'),
            node.create_publisher(String, 'trajectory_execution_event', 10),
        )
        node.create_subscription(String, 'robot_description_semantic', self._name_groups, LATCHED)
        self._scene.connect()

    def _name_groups(self, message: String) -> None:
        self._semantic = str(message.data)

    def _offer(self, tree: KinematicTree) -> None:
        try:
            self._groups = plan_groups(tree, self._semantic)
        except DescriptionError as error:
            self._node.get_logger().error(f'robot_description_semantic: {error}')
            self._semantic = ''
            return
        actions = (self, self._scene, self._order_here)
        self._panel = self._page.offer_plan(list(self._groups), actions)
        if self._panel is not None:
            self.choose_group(next(iter(self._groups)))
            self._scene.show_on(self._panel, tree.root)

    # -- what people do

    def _order_here(self, action: Callable[[], None]) -> None:
        """Carry out actions of the page, unless they belong to a robot that has gone."""

        def act() -> None:
            if self._panel is not None:
                action()

        self._order(act)

    def show_again(self) -> None:
        """Show once more what was planned."""
        self._shown_since = time.monotonic() if self._motion else None

    def stop(self) -> None:
        """End what is executed and planned, also of others; nothing planned stays executable."""
        if self._links is None:
            return
        self._links.events.publish(String(data=STOP))
        if self._execution is not None:
            self._execution.cancel()
        self._drop()

    def go_on(self, at: float) -> None:
        """Go on with the execution: its button was seen to be held at a steady time in [s]."""
        self._held_at = at

    def let_go(self) -> None:
        """Cancel the execution: its button was let go."""
        self._cancel('its button was let go')

    def _cancel(self, why: str) -> None:
        if self._execution is not None:
            self._canceled_as = self._canceled_as or why
            self._execution.cancel()

    @property
    def busy(self) -> bool:
        """Whether a plan is executed."""
        return self._execution is not None

    def advance(self) -> None:
        """Cancel the execution when nothing holds its button any more."""
        if self.busy and time.monotonic() - self._held_at > RELEASED_AFTER:
            self._cancel('heartbeats of its held button came late')

    def draw(self) -> None:
        """Show the next picture of a plan, if it is being shown."""
        if self._panel is None or self._motion is None or self._shown_since is None:
            return
        places = self._motion.shown(time.monotonic() - self._shown_since)
        if places is None:
            self._shown_since, places = None, self._motion.at(self._motion.duration)
        self._show_ghost(places)

    def _show_ghost(self, goals: Mapping[str, float]) -> None:
        if self._panel is not None and self._tree is not None:
            self._panel.show_ghost(moved(self._tree, self._positions, goals))

    def choose_group(self, name: str) -> None:
        """Plan for another group."""
        self._group = self._groups[name]
        if self._panel is not None:
            self._panel.show_group(self._group)
        self.choose_goal(NO_GOAL)

    def choose_goal(self, name: str) -> None:
        """Go to a state of the SRDF, or to where the goal is dragged."""
        panel, tree = self._panel, self._tree
        if panel is None or tree is None:
            return
        self._drop()
        self._goal, self._pose, self._joints = name, None, {}
        if name in self._group.states or name == DRAGGED:
            here = {each: self._positions.get(each, 0.0) for each in self._group.joints}
            self._joints = {**here, **self._group.states.get(name, {})}
        panel.show_goal(name)
        panel.say('')
        if not self._joints:
            panel.place_goal(None)
            panel.show_ghost(None)
            return
        everywhere = moved(tree, self._positions, self._joints)
        panel.place_goal(link_pose(tree, self._group.tip, everywhere))
        panel.show_ghost(everywhere)

    def drag_goal(self, pose: Transform) -> None:
        """Set the goal of the tip to a pose in the root link."""
        self._drop()
        if self._goal != DRAGGED and self._panel is not None:
            self._goal = DRAGGED
            self._panel.show_goal(DRAGGED)
        self._pose = pose
        self._solve()

    def _solve(self) -> None:
        """Solve for joints that bring the tip to the dragged pose; one request at a time."""
        links, tree = self._links, self._tree
        pose, now = self._pose, time.monotonic()
        if pose is None or links is None or tree is None:
            return
        if self._asked is not None and now - self._asked < ANSWER_TIME:
            return
        if not links.ik.service_is_ready():
            self._say('compute_ik is not there', failed=True)
            return
        self._asked = now
        request = ik_request(self._group, pose, tree.root, self._joints)
        links.ik.call_async(request).add_done_callback(lambda done: self._solved(pose, done))

    def _solved(self, asked: Transform, future: Future) -> None:
        self._asked = None
        if self._pose is None or self._panel is None:
            return
        if future.exception() is not None:
            self._say(f'compute_ik: no answer: {future.exception()}', failed=True)
            return
        response: Any = future.result()
        reason = refusal(response.error_code)
        if not reason:
            self._joints = positions_of(response.solution, self._group)
            self._show_ghost(self._joints)
        if asked != self._pose:
            self._solve()
        else:
            self._pose = self._pose if reason else None  # the joints are the goal
            self._say(reason, failed=True)

    def plan(self, share: float) -> None:
        """Plan, at a share of the greatest velocity and acceleration."""
        links, tree = self._links, self._tree
        goal = self._pose or self._joints
        if links is None or tree is None:
            return
        if not goal:
            self._say('choose a goal first: a state, or one that is dragged', failed=True)
            return
        if self._execution is not None:
            self._say('it is still executing; STOP ends it', failed=True)
            return
        if not links.move.server_is_ready():
            self._say(f'{MOVE} is not there', failed=True)
            return
        self._drop()
        self._say('planning ...')
        message = plan_goal(self._group, goal, tree.root, share)
        call = ActionCall(
            links.move, message, lambda result, why: self._planned(call, result, why)
        )
        self._planning = call

    def _planned(self, call: ActionCall, result: Message, why: str) -> None:
        if call is not self._planning or self._panel is None or self._tree is None:
            return  # of a request that counts no more
        self._planning = None
        reason = why or refusal(result.error_code)
        if reason:
            self._say(reason, failed=True)
            return
        self._trajectory = result.planned_trajectory
        self._motion = motion = planned_motion(self._trajectory)
        if motion.duration == 0.0:
            self._trajectory = None
            self._say('it is there already', failed=False)
            return
        self._shown_since = time.monotonic()
        self._panel.show_line(tip_line(self._tree, self._group.tip, self._positions, motion))
        self._panel.allow(execute=True)
        notes = f'; {result.error_code.message}' if result.error_code.message else ''
        self._say(
            f'the motion takes {motion.duration:.1f} s, planned in'
            f' {1000.0 * result.planning_time:.0f} ms{notes}',
            failed=False,
        )

    def execute(self, at: float) -> None:
        """Execute what was planned; the button was seen to be held at a steady time in [s]."""
        if time.monotonic() - at > RELEASED_AFTER:
            return  # this node was held up; the button may be let go
        links = self._links
        if links is None or self._panel is None:
            return
        if self._trajectory is None:
            self._say('nothing is planned that may be executed', failed=True)
            return
        if not links.execute.server_is_ready():
            self._say(f'{EXECUTE} is not there', failed=True)
            return
        goal = import_module('moveit_msgs.action').ExecuteTrajectory.Goal()
        goal.trajectory = self._trajectory
        self._trajectory, self._shown_since, self._held_at = None, None, at
        self._executed_goal = self._goal, self._joints
        self._panel.allow(execute=False)
        if self._motion is not None:
            self._show_ghost(self._motion.at(self._motion.duration))
        self._say('executing ...')
        call = ActionCall(
            links.execute, goal, lambda result, why: self._executed(call, result, why)
        )
        self._execution = call

    def _executed(self, call: ActionCall, result: Message, why: str) -> None:
        if call is not self._execution:
            return
        self._execution = None
        reason = why or refusal(result.error_code)
        if reason and self._canceled_as:
            reason = f'ended, as {self._canceled_as} ({reason})'
        self._canceled_as = ''
        if self._panel is not None:
            self._panel.end_hold()
        if not reason and self._executed_goal == (self._goal, self._joints):
            self.choose_goal(NO_GOAL)  # unless another one was chosen meanwhile
        self._say(reason or 'executed', failed=bool(reason))

    def _drop(self) -> None:
        """Forget what is planned or being planned."""
        if self._planning is not None:
            self._planning.cancel()
            self._planning = None
            self._say('canceled')
        if self._motion is not None and self._panel is not None:
            self._panel.show_line(())
            self._panel.allow(execute=False)
        self._trajectory = self._motion = self._shown_since = None

    def _say(self, text: str, *, failed: bool | None = None) -> None:
        if self._panel is not None:
            self._panel.say(text, failed=failed)
