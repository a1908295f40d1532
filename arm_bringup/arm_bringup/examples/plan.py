# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``ros2 run arm_bringup plan_demo``: a simulated arm picks and places among obstacles.

The demo is an ordinary client of move_group's public topics, services and actions. Poses are in
the frame of the description's root link, in [m] and [rad].
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping, Sequence
import contextlib
from dataclasses import dataclass
from itertools import product
import json
import math
import os
from pathlib import Path
import sys
import time
from typing import Any

from control_msgs.action import GripperCommand
from geometry_msgs.msg import Point, Pose, PoseStamped, Quaternion
from moveit_msgs.action import MoveGroup
from moveit_msgs.msg import (
    AttachedCollisionObject,
    CollisionObject,
    Constraints,
    DisplayTrajectory,
    JointConstraint,
    MoveItErrorCodes,
    OrientationConstraint,
    PlanningScene,
    PositionConstraint,
    RobotState,
)
from moveit_msgs.srv import ApplyPlanningScene, GetPositionIK, GetStateValidity
import numpy as np
from sensor_msgs.msg import JointState
from shape_msgs.msg import SolidPrimitive
from urdf_reader import JointRange, read_urdf

import arm_model
from arm_model import ArmError, Array, Clearances, load_limits, RobotModel, start_pose
from arm_model.ros import seconds
from arm_planning import PlanningCode
from node_runner import LATCHED
from node_runner.action_goals import GoalClient
from process_supervisor import CallError, namespaced_parameters, RosOptions

from ..groups import controller_names, MovedGroups, planning_files
from ..robots import read_semantic, Robot, RobotError
from ..service_client import ServiceClient
from ..session import locate, MOTION_NODE, Session
from .arm import ActionRun, ANSWER_TIMEOUT, ArmDemo, parse, QUEUE, run

SLOW, CAREFUL, FREE = 0.1, 0.2, 0.5
"""Shares of the limits for motions towards a box, along lines, and in free space."""
LONG = 15.0
"""Motion duration in [s] that lets a box appear in time; a slow arm needs less slowing down."""
PLANNING_TIME, IK_TIMEOUT = 5.0, 0.5
"""Longest time in [s] for planning (the default of MoveGroupInterface), and for IK."""
JOINT_TOLERANCE, POSITION_TOLERANCE, TURN_TOLERANCE = 1e-4, 1e-4, 1e-3
"""Goal tolerances in [rad], [m] and [rad], the defaults of MoveGroupInterface."""
START_TIMEOUT, MOTION_TIMEOUT, SETTLE_TIMEOUT = 60.0, 120.0, 5.0
"""Longest times in [s]: until move_group has received joint states (DDS is slow on a busy
computer), for a motion, and until its result is seen."""
DURATION_MARGIN = 20.0  # how much longer than planned a motion may take on a busy computer in [s]
WORST_JOINT, WORST_PLACE, STILL = 5e-3, 2e-3, 1e-2
"""Greatest distances: of a joint from its goal in [rad] or [m], of the tool or part from its goal
in [m], and of a joint's motion in [rad] or [m] after a refused goal."""
EARLY, CHOSEN = 0.15, 0.25
"""Shares of the path after which a box appears, and at which the arm is still clear of it."""
AT_REST, REST_STATES, SHORT_REST_STATES = 5e-4, 16, 4
"""An arm rests if its joints move less than this in [rad] or [m] over this number of joint states;
the last number is for replanning, which may move the arm again within 0.1 s."""
EDGES, SHARES, ROOM = (0.08, 0.06, 0.04, 0.03, 0.02), (0.6, 0.5, 0.7, 0.45), 0.06
"""Edges of a blocking box as shares of the arm's reach, of which the largest possible is used; its
positions on a path; and its least distance from both ends, as a share of the reach."""
LEAST_TURN = 1.0  # least joint motion that leaves room for a box on the path in [rad]
LEAST_REACH, LEAST_WAY, TURN, FAR = 0.05, 0.25, 2.0, 1.0
"""Least assumed reach in [m]; least tip motion to a pose as a share of the reach; motion of the
first joint in [rad] or [m]; and the cap of measured distances in [m]."""
GAP, APPROACH = 0.003, 0.1
"""Gap below the part in [m]; length of approach and retreat as a share of the reach."""
PART, PILLAR, VISITOR = 'part', 'pillar', 'visitor'
WITH_GRIPPER = '_hand'  # suffix of robot folders with a gripper


@dataclass(frozen=True)
class Cell:
    """Work cell for pick and place: a table, with a pillar between two places."""

    group: str
    reach: float  # reach of the arm in [m]; table, pillar and wall are shares of it
    centre: tuple[float, float, float]
    """Direction of the pillar, its distance, and the height of the table."""
    part: tuple[float, float, float]  # edges of the part in [m]
    below: float  # how far the middle of the part is below the tip while it is held in [m]
    turn: float  # turn of the tip against the part in [rad]
    touch_links: tuple[str, ...]  # links that the part may touch while it is held
    above: tuple[tuple[float, ...], tuple[float, ...]]
    """Seed joint positions for the start of the straight approach to each of the two places."""
    aside: tuple[str, float]  # joint and position of a goal on whose path a box can appear
    gripper: tuple[str, str, float, float] | None = None
    """Group and joint of the gripper, its open and closed positions; None without gripper."""

    def at(self, spread: float, height: float, further: float = 0.0) -> tuple[float, ...]:
        """Return x, y, z and yaw at an angle from the pillar and a height above the table."""
        direction, radius, top = self.centre
        angle, radius = direction + spread, radius + further
        return radius * math.cos(angle), radius * math.sin(angle), top + height, angle

    def part_at(self, place: int) -> tuple[float, ...]:
        """Return x, y, z and yaw of the part at one of the two places."""
        return self.at((0.6, -0.6)[place], GAP + self.part[2] / 2)

    def tip_at(self, place: int, lifted: float = 0.0) -> Pose:
        """Return the tip pose for gripping the part, raised by ``lifted`` in [m]."""
        x, y, z, yaw = self.part_at(place)
        return downwards(x, y, z + self.below + lifted, yaw + self.turn)

    def obstacles(self) -> list[CollisionObject]:
        """Return the collision objects: table, pillar and wall."""
        thin, wide, deep, tall, thick = (
            share * self.reach for share in (0.03, 1.3, 0.5, 0.3, 0.06)
        )
        return [
            box('table', (deep, wide, thin), self.at(0.0, -thin / 2, 0.05 * self.reach)),
            box(PILLAR, (thick, thick, tall), self.at(0.0, tall / 2)),
            box('wall', (thin, wide, 2 * tall), self.at(0.0, tall, 0.33 * self.reach)),
        ]


CELLS = {
    'panda_hand': Cell(
        group='panda_arm',
        reach=0.986,
        centre=(0.0, 0.5424, 0.1479),
        part=(0.04, 0.052, 0.08),
        below=0.1386,
        turn=-0.75 * math.pi,
        touch_links=('panda_link7', 'panda_hand', 'panda_leftfinger', 'panda_rightfinger'),
        above=(
            (-0.189, -0.016, 0.785, -2.091, 0.013, 2.079, 2.347),
            (-0.607, -0.012, 0.007, -2.091, 0.0, 2.079, 2.356),
        ),
        aside=('panda_joint4', -0.856),
        gripper=('hand', 'panda_finger_joint1', 0.035, 0.02585),
    ),
    'prbt': Cell(
        group='manipulator',
        reach=0.741,
        centre=(math.pi, 0.4076, 0.1111),
        part=(0.052, 0.067, 0.0741),
        below=0.0466,
        turn=0.0,
        touch_links=('prbt_flange',),
        above=((0.6, -0.537, 1.765, 0.0, 0.839, 0.0), (-0.6, -0.537, 1.765, 0.0, 0.839, 0.0)),
        aside=('prbt_joint_1', -1.5),
    ),
    'gp110': Cell(
        group='gp110_arm',
        reach=2.645,
        centre=(0.0, 1.4548, 0.3968),
        part=(0.185, 0.241, 0.2645),
        below=0.1443,
        turn=0.0,
        touch_links=('link_6_t',),
        above=((0.6, 0.14, -0.339, 0.0, -1.093, 0.0), (-0.6, 0.14, -0.339, 0.0, -1.093, 0.0)),
        aside=('joint_1_s', 1.5),
    ),
}
"""Cells of the robots in this package, by robot folder."""


class Plan(ArmDemo):
    """Demo: pick, place, a box in the way, a blocked goal; without a cell only the box.

    A refusal or timeout of move_group or the gripper raises CallError.
    """

    beside = ', and move_group'
    label = 'plan'

    def __init__(
        self,
        arm: Session,
        limits: Mapping[str, JointRange],
        duration: float | None,
        groups: MovedGroups,
    ) -> None:
        scene, ros = 'moveit_msgs/srv/GetPlanningScene', arm.ros
        commands = [
            f'ros2 topic echo {ros.resolve("display_planned_path")}',
            f'ros2 service call {ros.resolve("get_planning_scene")} {scene}',
        ]
        super().__init__(arm, limits, duration, commands)
        robot = arm.robot
        self.root = read_urdf(arm.urdf).root
        self.group = groups.arms[0]
        self.model = RobotModel(
            arm.urdf,
            read_semantic(robot),
            load_limits(robot.limits),
            self.group,
            robot.tip_link or None,
            folder=robot.description.parent,
        )
        cell = CELLS.get(robot.name)
        self.cell = cell if cell is not None and cell.group == self.group else None
        self.home = start_pose(self.model)
        if self.cell is not None and self.cell.gripper:
            group, joint, opened, _ = self.cell.gripper
            self.model = self.model.with_others({joint: opened})
            self.gripper_action = f'{controller_names(robot, groups)[group]}/gripper_cmd'
        self.positions: dict[str, float] = {}
        self.states = 0  # how many joint states have come
        self.paths: list[DisplayTrajectory] = []
        self.scene = PlanningScene()  # the scene as viewers receive it
        self.planning_times: list[float] = []
        self.text = ''
        self._place = 0  # where the part is

    def join(self, given_up: Callable[[], bool]) -> ServiceClient:
        """Join the ROS graph as a client of move_group and as a viewer."""
        client = super().join(given_up)
        node = client.node
        self._move = GoalClient(node, MoveGroup, 'move_action')
        self._apply = node.create_client(ApplyPlanningScene, 'apply_planning_scene')
        self._ik = node.create_client(GetPositionIK, 'compute_ik')
        self._validity = node.create_client(GetStateValidity, 'check_state_validity')
        if self.cell is not None and self.cell.gripper:
            self._gripper = GoalClient(node, GripperCommand, self.gripper_action)
        node.create_subscription(JointState, 'joint_states', self._take_joints, QUEUE)
        path, scene = 'display_planned_path', 'monitored_planning_scene'
        node.create_subscription(DisplayTrajectory, path, self.paths.append, LATCHED)
        node.create_subscription(PlanningScene, scene, self._take_scene, LATCHED)
        return client

    def line(self) -> str:
        """Return a line about the last plan."""
        planned = f'planned in {_ms(self.planning_times[-1])}   ' if self.planning_times else ''
        return planned + self.text

    def move(self) -> None:
        """Run the parts until time is up; at Ctrl-C cancel the current goal."""
        self.repeat(self._begin, self._parts)
        planned = 'nothing was planned'
        if times := self.planning_times:
            planned = (
                f'{len(times)} plans, p50 {_ms(np.median(times))}, greatest {_ms(max(times))}'
            )
        self.add('planning', planned)
        self.add('bus and loop', self.bus_line())
        self.conclude()

    def _begin(self) -> None:
        self.enter('putting the scene up')
        self.wait_moving(lambda: self.states > 0, SETTLE_TIMEOUT, 'joint states')
        if self.cell is not None:
            part = box(PART, self.cell.part, self.cell.part_at(0))
            self._add(*self.cell.obstacles(), part)
        home = self._joints(self.home)
        self.enter('home, by free motion')
        deadline = time.monotonic() + START_TIMEOUT
        goal = self._attempt(home)
        while code_of(goal) == 'ROBOT_STATE_STALE' and time.monotonic() < deadline:
            goal = self._attempt(home)  # move_group has received no joint states yet
        self._judge('home', goal, home)

    def _parts(self) -> None:
        if self.cell is None:
            self.add('pick and place', 'left out: no place for it is known for this arm')
            self._go_there_and_back()
        else:
            self._pick_and_place(self.cell)

    def _pick_and_place(self, cell: Cell) -> None:
        source, target = self._place, 1 - self._place
        home = self._joints(self.home)
        self._pick(cell, source)
        self._put(cell, target)
        self._place = target
        self.enter('home, by free motion')
        self._go('home', home, FREE)
        joint, place = cell.aside
        if abs(place - home[joint]) < LEAST_TURN:  # a user's robot with another start pose
            place = -place
        self._meet({**home, joint: place})
        pillar, grasp = cell.at(0.0, 0.15 * cell.reach), cell.tip_at(source)
        inside = Pose(position=Point(x=pillar[0], y=pillar[1], z=pillar[2]))
        inside.orientation = grasp.orientation
        self._refused('blocked goal', self._solve(inside, cell.above[source], free=False), PILLAR)
        self.enter('home, by free motion')
        self._go('home', home, FREE)

    def _pick(self, cell: Cell, place: int) -> None:
        name, held = 'pick', ''
        self.enter('to the part, by free motion')
        if cell.gripper:
            self._grip(cell.gripper[2])
        free = self._go_above(name, cell, place)
        self.enter('picking: a straight approach, attach, a straight retreat')
        down = self._go(name, cell.tip_at(place), CAREFUL)
        self._rest()
        body = AttachedCollisionObject(link_name=self.model.tip, touch_links=cell.touch_links)
        body.object.id, body.object.operation = PART, CollisionObject.ADD
        self._change(attached=body)
        if cell.gripper:
            _, joint, _, closed = cell.gripper
            self._grip(closed)
            self._arrives(name, lambda: abs(self.positions[joint] - closed), WORST_JOINT, 'm')
            held = f'; gripped with {joint} at {1e3 * closed:.1f} mm'
        up = self._go(name, cell.tip_at(place, APPROACH * cell.reach), CAREFUL)
        self.add(name, f'free motion {_ms(free)}; LIN {_ms(down)} down, {_ms(up)} up{held}')

    def _put(self, cell: Cell, place: int) -> None:
        name = 'place'
        self.enter('with the part around the pillar, by free motion')
        free = self._go_above(name, cell, place)
        self.enter('placing: a straight approach, detach, a straight retreat')
        down = self._go(name, cell.tip_at(place), CAREFUL)
        if cell.gripper:
            self._grip(cell.gripper[2])
        self._rest()
        body = AttachedCollisionObject(link_name=self.model.tip)
        body.object.id, body.object.operation = PART, CollisionObject.REMOVE
        self._change(attached=body)
        seen = next((each for each in self.scene.world.collision_objects if each.id == PART), None)
        off = math.inf
        if seen is not None:
            at = seen.pose.position
            off = math.dist((at.x, at.y, at.z), cell.part_at(place)[:3])
        self._arrives(f'{name}: the part', lambda: off, WORST_PLACE, 'm')
        up = self._go(name, cell.tip_at(place, APPROACH * cell.reach), CAREFUL)
        self.add(
            name,
            f'free motion {_ms(free)}; LIN {_ms(down)} down, {_ms(up)} up; the part is '
            f'{1e3 * off:.1f} mm from where it was to go',
        )

    def _go_above(self, name: str, cell: Cell, place: int) -> float:
        """Move in free space to the start of a straight approach, found by compute_ik."""
        above = cell.tip_at(place, APPROACH * cell.reach)
        return self._go(name, self._solve(above, cell.above[place], free=True), FREE)

    def _meet(self, target: Mapping[str, float], speed: float = SLOW) -> None:
        """Place a box in the path of a motion; the arm must stop, then reach the goal past it."""
        name = 'box in the way'
        self.enter('slowly on, until a box appears in the way')
        shown = len(self.paths)
        goal = self._send(target, speed, replan=True)
        end = np.array([target[joint] for joint in self.model.joints])
        begin = self._here()

        def begins() -> bool:
            executes = any(each.state == 'MONITOR' for each in goal.feedback)
            return goal.done or (executes and len(self.paths) > shown)

        def on_the_way() -> bool:
            done = np.abs(self._here() - begin).max() / max(np.abs(end - begin).max(), 1e-9)
            return goal.done or done > EARLY

        self.wait_moving(begins, MOTION_TIMEOUT, 'motion')
        rows = [] if goal.done else self._rows(self.paths[-1])
        rows = rows[int(CHOSEN * len(rows)) :]
        visitor = box_ahead(self.model, rows) if rows else None  # it takes its time: before
        self.wait_moving(on_the_way, MOTION_TIMEOUT, 'motion')
        least = 0.5 * ROOM * max(self.model.reach, LEAST_REACH)
        if goal.done or (visitor and distance_of(self.model, visitor, self._here()) < least):
            visitor = None
        if visitor is None:
            self._finish(name, goal, target)
            report = self.add if self.cell is None else self.problem
            report(name, 'no place was found for a box in its way')
            return
        self.enter('a box is in the way: stop before it, plan anew, go around')
        appeared = time.monotonic()
        self._change(visitor)
        at_rest, stop = self._rest(goal), 'not seen to rest'
        if not goal.done:
            room = 1e3 * distance_of(self.model, visitor, self._here())
            stop = f'at rest {at_rest - appeared:.1f} s after it came, {room:.0f} mm before it'
        planning_time = self._finish(name, goal, target)
        plans = sum(each.state == 'PLANNING' for each in goal.feedback)
        if plans < 2:  # once, and once more
            self.problem(name, f'planned {plans} times: nothing was in the way')
        self.add(name, f'{stop}, planned anew in {_ms(planning_time)} ({plans} plans)')
        self._change(CollisionObject(id=VISITOR, operation=CollisionObject.REMOVE))

    def _go_there_and_back(self) -> None:
        """Move to the farthest known pose, and back around a box."""
        limits, turn = self.model.limits, TURN * np.eye(len(self.home))[0]
        turned = [np.clip(self.home + way, limits.lower, limits.upper) for way in (turn, -turn)]
        poses = [
            pose
            for pose in (*self.model.poses.values(), *turned)
            if self.model.clearance(pose) > GAP
        ]
        tip = self.model.pose(self.home).position

        def way(pose: Array) -> float:
            return math.dist(self.model.pose(pose).position, tip)

        far = max(poses, key=way, default=self.home)
        if way(far) < LEAST_WAY * max(self.model.reach, LEAST_REACH):
            self.add('box in the way', 'left out: no pose is known that is far from home')
            return
        self.enter('to the farthest pose, by free motion')
        self._go('there', self._joints(far), FREE)
        lasted = seconds(self.paths[-1].trajectory[-1].joint_trajectory.points[-1].time_from_start)
        self._meet(self._joints(self.home), float(np.clip(FREE * lasted / LONG, SLOW, FREE)))

    def _refused(self, name: str, target: Mapping[str, float], obstacle: str) -> None:
        """Check that a goal in collision is refused by naming the obstacle, without motion."""
        self.enter('a goal that is blocked')
        before = self._here()
        goal = self._attempt(target)
        code, message = code_of(goal), goal.result.error_code.message
        self.text = f'{code}: {message}'
        self.pause(0.5)
        moved = float(np.abs(self._here() - before).max())
        if code != 'GOAL_IN_COLLISION':
            self.problem(name, f'{code} instead of GOAL_IN_COLLISION: {message}')
        elif obstacle not in message:
            self.problem(name, f'the message does not name {obstacle}: {message}')
        if moved > STILL:
            self.problem(name, f'a joint moved by {moved:.3f}')
        self.add(name, f'{code}: {message}')

    def _go(self, name: str, target: Mapping[str, float] | Pose, speed: float) -> float:
        """Move to joint positions freely, or to a pose on a line; return planning time in [s]."""
        return self._finish(name, self._send(target, speed), target)

    def _finish(self, name: str, goal: ActionRun, target: Mapping[str, float] | Pose) -> float:
        self.wait_moving(lambda: goal.done, MOTION_TIMEOUT, f'the end of a motion ({name})')
        return self._judge(name, goal, target)

    def _attempt(self, target: Mapping[str, float]) -> ActionRun:
        """Move in free space, and wait for the end, whether success or failure."""
        goal = self._send(target, FREE)
        self.wait_moving(lambda: goal.done, MOTION_TIMEOUT, 'the end of a motion')
        return goal

    def _judge(self, name: str, goal: ActionRun, target: Mapping[str, float] | Pose) -> float:
        """Check the end of a motion: measured joint positions, and contact."""
        if (code := code_of(goal)) != 'SUCCESS':
            raise CallError(f'{name}: {code}: {goal.result.error_code.message}')
        planning_time = float(goal.result.planning_time)
        self.planning_times.append(planning_time)

        def off() -> float:
            if not isinstance(target, Pose):
                return max(abs(self.positions[joint] - at) for joint, at in target.items())
            tip = self.model.kinematics.link_pose(self.model.tip, self._here()).position
            return math.dist(tip, (target.position.x, target.position.y, target.position.z))

        worst, unit = (WORST_PLACE, 'm') if isinstance(target, Pose) else (WORST_JOINT, 'rad')
        self._arrives(name, off, worst, unit)
        request = GetStateValidity.Request(group_name=self.group)
        request.robot_state.is_diff = True
        answer = self._call(self._validity, request, 'check_state_validity')
        if not answer.valid:
            pairs = (
                f'{each.contact_body_1} and {each.contact_body_2}' for each in answer.contacts
            )
            self.problem(name, f'not valid at its end; in contact: {", ".join(pairs)}')
        return planning_time

    def _arrives(self, name: str, off: Callable[[], float], worst: float, unit: str) -> None:
        """Check that an error ``off`` falls below ``worst`` within some seconds."""
        with contextlib.suppress(CallError):
            self.wait_moving(lambda: off() <= worst, SETTLE_TIMEOUT, 'it')
        if not off() <= worst:
            self.problem(name, f'{1e3 * off():.1f} m{unit} from its goal')

    def _rest(self, goal: ActionRun | None = None) -> float:
        """Wait until no joint moves or a goal has ended; return when a joint moved last in [s]."""
        enough = SHORT_REST_STATES if goal else REST_STATES
        last, moved, states = self._here(), time.monotonic(), self.states

        def rests() -> bool:
            nonlocal last, moved, states
            here = self._here()
            if float(np.abs(here - last).max()) > AT_REST:
                last, moved, states = here, time.monotonic(), self.states
            return self.states - states >= enough or (goal is not None and goal.done)

        self.wait_moving(rests, MOTION_TIMEOUT, 'rest')
        return moved

    def _here(self) -> Array:
        """Return the last received joint positions of the arm."""
        return np.array([self.positions[joint] for joint in self.model.joints])

    def _joints(self, positions: Array) -> dict[str, float]:
        return dict(zip(self.model.joints, positions.tolist(), strict=True))

    def _rows(self, path: DisplayTrajectory) -> list[Array]:
        """Return the joint positions of the arm along a path."""
        rows = []
        for each in path.trajectory:
            names = list(each.joint_trajectory.joint_names)
            order = [names.index(joint) for joint in self.model.joints]
            rows += [np.array(point.positions)[order] for point in each.joint_trajectory.points]
        return rows

    def _send(
        self, target: Mapping[str, float] | Pose, speed: float, *, replan: bool = False
    ) -> ActionRun:
        """Send a goal to move_action, as MoveGroupInterface::move does; LIN to a pose."""
        goal = MoveGroup.Goal()
        request, options = goal.request, goal.planning_options
        request.group_name = self.group
        request.num_planning_attempts, request.allowed_planning_time = 1, PLANNING_TIME
        request.max_velocity_scaling_factor = request.max_acceleration_scaling_factor = speed
        request.start_state.is_diff = True
        options.planning_scene_diff.is_diff = True
        options.planning_scene_diff.robot_state.is_diff = True
        options.replan = replan
        if isinstance(target, Pose):
            request.planner_id = 'LIN'
            request.goal_constraints = [pose_goal(self.root, self.model.tip, target)]
        else:
            request.goal_constraints = [joint_goal(target)]
        self.text = request.planner_id or 'free motion'
        self.goal = ActionRun(self.client, self._move, goal, 'move_action')
        return self.goal

    def _solve(self, pose: Pose, seed: Sequence[float], *, free: bool) -> dict[str, float]:
        """Solve IK for a tip pose near ``seed``; ``free`` excludes solutions in collision."""
        request = GetPositionIK.Request()
        wanted = request.ik_request
        wanted.group_name, wanted.ik_link_name = self.group, self.model.tip
        wanted.avoid_collisions = free
        wanted.pose_stamped = PoseStamped(pose=pose)
        wanted.pose_stamped.header.frame_id = self.root
        wanted.robot_state = RobotState(is_diff=True)
        wanted.robot_state.joint_state.name = list(self.model.joints)
        wanted.robot_state.joint_state.position = [float(each) for each in seed]
        wanted.timeout.nanosec = round(1e9 * IK_TIMEOUT)
        answer = self._call(self._ik, request, 'compute_ik')
        code = answer.error_code
        if code.val != MoveItErrorCodes.SUCCESS:
            raise CallError(f'compute_ik: {PlanningCode(code.val).name}: {code.message}')
        state = answer.solution.joint_state
        places = dict(zip(state.name, state.position, strict=True))
        return {joint: places[joint] for joint in self.model.joints}

    def _grip(self, position: float) -> None:
        """Move the gripper, and wait until it has reached the position."""
        goal, name = GripperCommand.Goal(), self.gripper_action
        goal.command.position = position
        grip = ActionRun(self.client, self._gripper, goal, name)
        self.client.wait_until(lambda: grip.done, ANSWER_TIMEOUT, f'the end of {name}')
        if not grip.result.reached_goal:
            where = grip.result.position
            raise CallError(f'{name}: {position:.4f} was not reached: {where:.4f}')

    def _add(self, *things: CollisionObject) -> None:
        """Add objects to the scene, and wait until viewers receive them."""
        self._change(*things)
        names = {each.id for each in things}
        self.wait_moving(
            lambda: names <= {each.id for each in self.scene.world.collision_objects},
            SETTLE_TIMEOUT,
            f'{", ".join(sorted(names))} in monitored_planning_scene',
        )

    def _change(
        self, *things: CollisionObject, attached: AttachedCollisionObject | None = None
    ) -> None:
        """Change the scene, as PlanningSceneInterface does."""
        diff = PlanningScene(is_diff=True)
        diff.robot_state.is_diff = True
        for each in things:
            each.header.frame_id = self.root
        diff.world.collision_objects = list(things)
        if attached is not None:
            diff.robot_state.attached_collision_objects = [attached]
        request = ApplyPlanningScene.Request(scene=diff)
        if not self._call(self._apply, request, 'apply_planning_scene').success:
            raise CallError('apply_planning_scene: refused; the log of move_group says why')

    def _call(self, client: Any, request: Any, name: str) -> Any:  # noqa: ANN401
        self.client.wait_until(client.service_is_ready, ANSWER_TIMEOUT, f'the service {name}')
        self.client.wait_until_known([name], ANSWER_TIMEOUT)
        future = client.call_async(request)
        self.client.wait_until(future.done, ANSWER_TIMEOUT, f'the answer of {name}')
        return future.result()

    def _take_joints(self, message: JointState) -> None:
        self.positions.update(zip(message.name, message.position, strict=False))
        self.states += 1

    def _take_scene(self, message: PlanningScene) -> None:
        self.scene = message


def _ms(duration: float) -> str:
    return f'{1e3 * duration:.0f} ms'


def code_of(goal: ActionRun) -> str:
    """Return the name of MoveIt's error code of an ended goal."""
    value = goal.result.error_code.val
    try:
        return PlanningCode(value).name
    except ValueError:
        return str(value)


def joint_goal(joints: Mapping[str, float]) -> Constraints:
    """Return goal constraints for joint positions."""
    return Constraints(
        joint_constraints=[
            JointConstraint(
                joint_name=name,
                position=position,
                tolerance_above=JOINT_TOLERANCE,
                tolerance_below=JOINT_TOLERANCE,
                weight=1.0,
            )
            for name, position in joints.items()
        ]
    )


def pose_goal(frame: str, link: str, pose: Pose) -> Constraints:
    """Return goal constraints for the pose of a link."""
    place = PositionConstraint(link_name=link, weight=1.0)
    turn = OrientationConstraint(link_name=link, weight=1.0, orientation=pose.orientation)
    place.header.frame_id = turn.header.frame_id = frame
    sphere = SolidPrimitive(type=SolidPrimitive.SPHERE, dimensions=[POSITION_TOLERANCE])
    place.constraint_region.primitives = [sphere]
    place.constraint_region.primitive_poses = [pose]
    turn.absolute_x_axis_tolerance = TURN_TOLERANCE
    turn.absolute_y_axis_tolerance = TURN_TOLERANCE
    turn.absolute_z_axis_tolerance = TURN_TOLERANCE
    return Constraints(position_constraints=[place], orientation_constraints=[turn])


def downwards(x: float, y: float, z: float, yaw: float) -> Pose:
    """Return a pose whose z axis points down, turned by half a turn about its x axis."""
    turn = Quaternion(x=math.cos(yaw / 2), y=math.sin(yaw / 2), z=0.0, w=0.0)
    return Pose(position=Point(x=x, y=y, z=z), orientation=turn)


def box(name: str, edges: Sequence[float], place: Sequence[float]) -> CollisionObject:
    """Return a box centred at a place given as x, y, z and yaw."""
    x, y, z, yaw = place
    message = CollisionObject(id=name, operation=CollisionObject.ADD)
    turn = Quaternion(z=math.sin(yaw / 2), w=math.cos(yaw / 2))
    message.pose = Pose(position=Point(x=x, y=y, z=z), orientation=turn)
    message.primitives = [SolidPrimitive(type=SolidPrimitive.BOX, dimensions=list(edges))]
    message.primitive_poses = [Pose()]
    return message


def distance_of(model: RobotModel, thing: CollisionObject, positions: Array) -> float:
    """Return the distance of an upright box from an arm in [m]; negative where they touch."""
    at = thing.pose.position
    pose = arm_model.Pose(arm_model.ORIGIN.rotation, arm_model.frozen([at.x, at.y, at.z]))
    shape = arm_model.Box(*thing.primitives[0].dimensions)
    scene = model.scene.with_object(arm_model.CollisionObject(thing.id, shape, pose=pose))
    distances = Clearances(scene).least(positions, FAR).tolist()
    pairs = zip(scene.pairs, distances, strict=True)
    return min((distance for pair, distance in pairs if thing.id in pair), default=FAR)


def box_ahead(model: RobotModel, rows: Sequence[Array]) -> CollisionObject | None:
    """Return a box in an arm's path, clear of both ends of it; None if there is no room."""
    reach = max(model.reach, LEAST_REACH)
    for edge, share in product(EDGES, SHARES):
        at = rows[int(share * (len(rows) - 1))]
        tip = model.kinematics.link_pose(model.tip, at).position
        thing = box(VISITOR, 3 * (edge * reach,), (*tip.tolist(), 0.0))
        room = min(distance_of(model, thing, each) for each in (rows[0], rows[-1]))
        if distance_of(model, thing, at) < 0.0 and room > ROOM * reach:
            return thing
    return None


def with_gripper(arguments: argparse.Namespace) -> Robot:
    """Find the robot; for a robot given by name, prefer its folder with a gripper.

    Raises:
        RobotError: The robot does not exist.
    """
    robot = locate(arguments)
    if os.sep not in arguments.robot:
        both = argparse.Namespace(**{**vars(arguments), 'robot': robot.name + WITH_GRIPPER})
        with contextlib.suppress(RobotError):
            robot = locate(both)
            arguments.robot = both.robot
    return robot


def demo_files(robot: Robot, folder: Path, ros: RosOptions, groups: MovedGroups) -> Sequence[Path]:
    """Write the parameter files of a bring-up, with longer time limits for a busy computer."""
    execution = {'allowed_goal_duration_margin': DURATION_MARGIN}
    values = {'move_group': {'ros__parameters': {'trajectory_execution': execution}}}
    path = folder / 'demo.yaml'
    path.write_text(json.dumps(values), encoding='utf-8')
    files = planning_files(robot, folder, ros, groups)
    return [*files, namespaced_parameters(path, ros, folder)]


def main(argv: Sequence[str] | None = None) -> int:
    """Run the demo; see :func:`.wave.main`."""
    parsed = parse(
        sys.argv[1:] if argv is None else argv,
        'plan_demo',
        'Bring a simulated arm up with move_group, and have it pick and place among obstacles, '
        'go around a box that appears in its way, and refuse a blocked goal. Ends with what was '
        'measured at the joint states.',
        'repeat it until so many seconds are over, once at least (default: until Ctrl-C)',
    )
    return run(
        parsed,
        Plan,
        master=MOTION_NODE,
        find_robot=with_gripper,
        files=demo_files,
        plan=True,
        errors=(ArmError,),
    )
