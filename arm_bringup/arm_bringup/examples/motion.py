# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``ros2 run arm_bringup motion_demo``: jog a simulated arm, and run trajectories on it.

Joint vectors are in model order in [rad]; tool positions are of the first group's tip in its base.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
import json
import math
from pathlib import Path
import sys
import time

from action_msgs.msg import GoalStatus
from control_msgs.action import FollowJointTrajectory
from control_msgs.msg import JointTrajectoryControllerState, SpeedScalingFactor
from geometry_msgs.msg import TwistStamped
from moveit_msgs.msg import ServoStatus
import numpy as np
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint
from urdf_reader import JointRange

from arm_canopen import load_bus
from arm_model import ArmError, Array, load_limits, ModelError, RobotModel, start_pose
from arm_trajectory import PathCheck
from node_runner import LATCHED
from node_runner.action_goals import GoalClient
from process_supervisor import CallError, namespaced_parameters, RosOptions

from ..groups import controller_names, motion_files, MovedGroups
from ..robots import read_semantic, Robot
from ..service_client import ServiceClient
from ..session import MOTION_NODE, Session
from .arm import ActionRun, ArmDemo, number, parse, QUEUE, run

RATE = 100.0  # rate of the controller's states in [Hz]
JOG_PERIOD = 0.02  # time between two jog commands in [s]
LATE_COMMANDS = 0.05
"""Time in [s] between two jog commands above which the tool may stop in between: a command is
valid for 0.1 s, less its latency."""
SETTLE = 0.35  # least pause after a motion in [s]
MOTION_TIMEOUT = 60.0  # longest time of a trajectory in [s]

SIDE, SPEED = 0.08, 0.1  # side of a square in [m], and speed of the tool on it in [m/s]
SIDES = ((1, 0, 0), (0, 1, 0), (-1, 0, 0), (0, -1, 0))  # directions of the sides of a square

OUTWARDS, DOWN, FAST = 0.866, 0.5, 0.2
"""Motion to the singular pose: outward and downward components, and speed in [m/s]."""
STUCK, LONGEST = 0.05, 6.0
"""Speed in [m/s] below which the tool has reached the end of this motion, and its longest time in
[s]; the motion back may take twice as long."""

WAYS = (0.5, 0.25, 0.1)
"""Joint motions of a trajectory in [rad] or [m]; the first one without collision is used."""
LIMIT_SHARE, VELOCITY_SHARE, SHORTEST, CANCELED = 0.6, 0.35, 1.5, 5.0
"""Shares of the acceleration and jerk limits and of the speed limits for a trajectory (so that a
drive does not lose its path on a busy computer); its least duration in [s], and that of the
canceled one, since canceling takes a second on a busy computer."""
SLOW = 0.3  # speed override

WORST_LINE, WORST_SPEED = 3e-3, 0.01
"""Greatest tool distance in [m] from the line of a jog, and relative difference from the commanded
speed."""
LEAST_WAY, LEAST_RETURN = 1e-3, 0.9
"""Least outward tool motion in [m] for a valid test, and the share of this motion by which the
tool must come back from the singular pose."""
WORST_PATH = 5e-3  # greatest distance of a set-point from the path of a trajectory in [rad]


@dataclass(frozen=True, eq=False)
class Sample:
    """One controller state; values are set-points unless their name says measured."""

    time: float  # time of its cycle in [s]
    position: Array
    velocity: Array
    measured: Array
    speed: float  # speed override, 0 to 1
    tool: Array  # position of the tool in [m]
    measured_tool: Array


class Motion(ArmDemo):
    """Demo: squares, a singular pose, a trajectory with speed override, a canceled one."""

    label = 'motion'

    def __init__(
        self,
        arm: Session,
        limits: Mapping[str, JointRange],
        duration: float | None,
        groups: MovedGroups,
    ) -> None:
        self.controller = controller_names(arm.robot, groups)[groups.names[0]]
        commands = [
            f'ros2 run arm_servo servo_keyboard_input{arm.ros.hint}',
            f'ros2 topic echo {arm.ros.resolve("servo_node/status")}',
            f'ros2 topic echo {arm.ros.resolve(self.controller)}/controller_state',
        ]
        super().__init__(arm, limits, duration, commands)
        semantic, bounds = read_semantic(arm.robot), load_limits(arm.robot.limits)
        tip = arm.robot.tip_link or None
        self.model = RobotModel(arm.urdf, semantic, bounds, groups.arms[0], tip)
        self.period = load_bus(arm.robot.bus_config).master.sync_period
        self.pose = start_pose(self.model)
        self.moved = {*self.model.joints}
        self.samples: list[Sample] = []
        self.status = ''  # last status message of the servo
        self.limited: list[str] = []  # status messages while the motion was limited

    def join(self, given_up: Callable[[], bool]) -> ServiceClient:
        """Join the ROS graph: twists and an override out, states of controller and servo in."""
        client = super().join(given_up)
        node, state = client.node, JointTrajectoryControllerState
        self._twist = node.create_publisher(TwistStamped, 'servo_node/delta_twist_cmds', 10)
        self._speed = node.create_publisher(
            SpeedScalingFactor, f'{self.controller}/speed_scaling_input', LATCHED
        )
        self._action_name = f'{self.controller}/follow_joint_trajectory'
        self._action = GoalClient(node, FollowJointTrajectory, self._action_name)
        node.create_subscription(state, f'{self.controller}/controller_state', self._take, QUEUE)
        node.create_subscription(ServoStatus, 'servo_node/status', self._take_status, 10)
        return client

    def line(self) -> str:
        """Return a line that says what moves the arm."""
        speed = tool_speed(self.samples[-2:], self.period)
        override = 100 * self.samples[-1].speed if self.samples else 100
        return f'tool {speed:.3f} m/s   override {override:.0f} %   {self.status}'

    def move(self) -> None:
        """Run the parts until time is up; at Ctrl-C cancel the current goal."""
        self.repeat(lambda: None, self._parts)
        self._sum_up()
        self.conclude()

    def _parts(self) -> None:
        self.go_to_start()
        for name, frame in (('base frame', self.model.base), ('tool frame', self.model.tip)):
            self.square(name, frame)
        self.singularity()
        self.go_to_start()
        self.trajectory()
        self.cancel()

    @property
    def last(self) -> Sample:
        """The latest controller state."""
        if not self.samples:
            raise CallError('the trajectory controller publishes no state: is the arm enabled?')
        return self.samples[-1]

    def go_to_start(self) -> None:
        """Follow a trajectory to the start pose."""
        self.enter('to the start pose')
        self.pause(SETTLE)
        begin = self.last.position if self.samples else np.zeros(len(self.model))
        for pose in free_way(self.model, begin, self.pose):
            self._finish(self._send(pose, duration_of(self.model, begin, pose)))
            begin = pose

    def square(self, name: str, frame: str) -> None:
        """Jog the tool along the sides of a square in a frame."""
        self.enter(f'a square in the {name}')
        speeds, commanded, measured, gap, missed = [], 0.0, 0.0, 0.0, self.missed
        self.limited.clear()
        for way in SIDES:
            begin, first = self.last, len(self.samples)
            direction = self.model.pose(begin.position, frame).rotation @ np.array(way, float)
            gap = max(gap, self._jog(SPEED * np.array(way), frame, SIDE / SPEED))
            moving = self.samples[first:]
            speeds.append(tool_speed(moving[len(moving) // 2 : -(len(moving) // 4)], self.period))
            self._rest()
            side = self.samples[first:]
            tools, seen = [each.tool for each in side], [each.measured_tool for each in side]
            commanded = max(commanded, off_line(tools, begin.tool, direction))
            measured = max(measured, off_line(seen, begin.measured_tool, direction))
        reached = max(speeds, key=lambda each: abs(each - SPEED))
        # late PDOs: joint positions of different times give a wrong tool position
        worst = commanded if self.missed > missed else measured
        limited = (self.limited or [''])[-1]
        figures = (
            f'TCP speed asked {SPEED:.3f} m/s, reached {reached:.4f} m/s; off the line '
            f'{1e3 * commanded:.2f} mm commanded, {1e3 * measured:.2f} mm measured'
        )
        problem = ''
        if worst > WORST_LINE:
            problem = f'the tool was {1e3 * worst:.1f} mm off its line'
        elif abs(reached - SPEED) > WORST_SPEED * SPEED:
            if gap > LATE_COMMANDS:
                figures += (
                    f'; speed not judged: jog commands were up to {gap:.2f} s apart, this '
                    'computer is too busy'
                )
            elif limited and reached < SPEED:
                figures += f'; the limits of this arm allow no more: {limited}'
            else:
                problem = f'the tool moved at {reached:.4f} m/s instead of {SPEED:.3f} m/s'
        self.add(f'square, {name}', figures, problem)

    def singularity(self) -> None:
        """Jog the tool outwards until the arm is straight or otherwise limited, and back."""
        self.enter('into the straight arm, and back')
        begin, first = self.last.tool, len(self.samples)
        ahead = np.array([begin[0], begin[1], 0.0])
        ahead /= max(float(np.linalg.norm(ahead)), 1e-6)
        outwards = OUTWARDS * ahead - np.array([0.0, 0.0, DOWN])
        self.limited.clear()

        def out() -> float:
            return float((self.last.tool - begin) @ outwards)

        self._jog(FAST * outwards, self.model.base, LONGEST, self._stuck)
        self._rest()
        singular = [text for text in self.limited if 'singular' in text]
        text = (singular or self.limited or [''])[-1]
        reached = max(float((each.tool - begin) @ outwards) for each in self.samples[first:])
        self._jog(-FAST * outwards, self.model.base, 2.0 * LONGEST, lambda: out() <= 0.0)
        self._rest()
        back, problem = reached - out(), ''
        if reached < LEAST_WAY and text:
            self.add('singularity', f'left out: {text}')  # too few joints to follow a line
            return
        if reached < LEAST_WAY or back < LEAST_RETURN * reached:
            why = text or 'no reason given'
            problem = f'the tool came back {back:.3f} m of {reached:.3f} m; {why}'
        figures = f'{reached:.3f} m out, {back:.3f} m back; there: {text or "nothing limits"}'
        self.add('singularity', figures, problem)

    def trajectory(self) -> None:
        """Follow a trajectory, with the speed override at 30 % in its middle."""
        self.enter('a trajectory, at 30 % in its middle')
        begin, end, nominal, first = self._plan()
        goal = self._send(end, nominal)
        self._reach(goal, begin, end, 0.2)
        self._speed.publish(SpeedScalingFactor(factor=SLOW))
        self._reach(goal, begin, end, 0.6)
        self._speed.publish(SpeedScalingFactor(factor=1.0))
        self._finish(goal)
        slow = min(each.speed for each in self.samples[first:])
        times = [each.time for each in self.samples[first:] if each.velocity.any()]
        took = times[-1] - times[0] if times else 0.0
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
        self.add('trajectory', figures, problem)

    def cancel(self) -> None:
        """Cancel a trajectory in its middle; the arm must come to rest on the path."""
        self.enter('a trajectory, canceled')
        begin, end, nominal, first = self._plan()
        goal = self._send(end, max(nominal, CANCELED))
        self._reach(goal, begin, end, 0.4)
        goal.cancel()
        self._rest()
        error = self._path_error(first, begin, end)
        done = float(np.linalg.norm(self.last.position - begin) / np.linalg.norm(end - begin))
        problem = ''
        if error > WORST_PATH:
            problem = f'{1e3 * error:.1f} mrad off the path'
        elif np.abs(self.last.velocity).max() > 0.0:
            problem = 'the arm does not rest'
        elif goal.status != GoalStatus.STATUS_CANCELED:
            problem = f'it was not canceled: {_why(goal)}'
        figures = (
            f'at rest after {100 * done:.0f} % of the way, {1e3 * error:.3f} mrad off the path'
        )
        self.add('cancel', figures, problem)

    def _sum_up(self) -> None:
        """Add bus and loop statistics of the whole demo to the summary."""
        if self.samples:
            self.add('bus and loop', self.bus_line())
        late = number(self.bus, 'jitter_p99')
        if late > self.period / 2:
            text = f'the cycle was late by {1e3 * late:.0f} ms now and then (p99): this computer '
            self.warnings = [f'{text}is too busy, drives wait and may lose their path']

    def _jog(
        self, linear: Array, frame: str, longest: float, done: Callable[[], bool] | None = None
    ) -> float:
        """Jog for ``longest`` [s] or until ``done``; return the longest command gap in [s]."""
        begun = last = time.monotonic()
        gap = 0.0
        while (elapsed := time.monotonic() - begun) < longest:
            self._publish_twist(linear, frame)
            now = time.monotonic()
            gap, last = max(gap, now - last), now
            self.client.listen(JOG_PERIOD)
            self.look()
            if done is not None and elapsed > 2.0 * SETTLE and done():
                break
        self._publish_twist(0.0 * linear, frame)
        return max(gap, time.monotonic() - last)

    def _publish_twist(self, linear: Array, frame: str) -> None:
        message = TwistStamped()
        message.header.stamp = self.client.node.get_clock().now().to_msg()
        message.header.frame_id = frame
        vector = message.twist.linear
        vector.x, vector.y, vector.z = (float(value) for value in linear)
        self._twist.publish(message)

    def _stuck(self) -> bool:
        """Return whether the tool has stopped, judged by the last ``SETTLE`` seconds."""
        recent = self.samples[-round(SETTLE / self.period) :]
        return float(np.linalg.norm(recent[-1].tool - recent[0].tool)) < STUCK * SETTLE

    def _plan(self) -> tuple[Array, Array, float, int]:
        """Return start, end, duration in [s] and first sample number of a trajectory from here."""
        begin = self.last.position
        end = free_end(self.model, begin)
        return begin, end, duration_of(self.model, begin, end), len(self.samples)

    def _send(self, end: Array, nominal: float) -> ActionRun:
        """Send a trajectory that ends at rest in a pose, and wait until it is accepted."""
        rest = [0.0] * len(end)
        point = JointTrajectoryPoint(positions=end.tolist(), velocities=rest, accelerations=rest)
        point.time_from_start.sec = int(nominal)
        point.time_from_start.nanosec = round(nominal % 1.0 * 1e9)
        goal = FollowJointTrajectory.Goal(
            trajectory=JointTrajectory(joint_names=list(self.model.joints), points=[point])
        )
        self.goal = ActionRun(self.client, self._action, goal, self._action_name)
        return self.goal

    def _finish(self, goal: ActionRun) -> None:
        self.wait_moving(lambda: goal.done, MOTION_TIMEOUT, 'the end of a trajectory')
        if goal.status != GoalStatus.STATUS_SUCCEEDED:
            raise CallError(f'a trajectory failed: {_why(goal)}')
        self._rest()

    def _reach(self, goal: ActionRun, begin: Array, end: Array, share: float) -> None:
        """Wait until a share of the motion is done; on a busy computer time does not show that."""
        way = end - begin

        def there() -> bool:
            return goal.done or float((self.last.position - begin) @ way / (way @ way)) >= share

        self.wait_moving(there, MOTION_TIMEOUT, f'{100 * share:.0f} % of a trajectory')

    def _rest(self) -> None:
        """Wait until the arm rests according to recent states."""
        self.pause(SETTLE)
        asked = 1e-9 * self.client.node.get_clock().now().nanoseconds

        def at_rest() -> bool:
            return self.last.time > asked and not self.last.velocity.any()

        self.wait_moving(at_rest, MOTION_TIMEOUT, 'the arm to rest')

    def _path_error(self, first: int, begin: Array, end: Array) -> float:
        return off_line([each.position for each in self.samples[first:]], begin, end - begin)

    def _take(self, message: JointTrajectoryControllerState) -> None:
        reference, stamp = message.reference, message.header.stamp
        position, velocity, measured = map(
            np.array, (reference.positions, reference.velocities, message.feedback.positions)
        )
        tools = (self.model.pose(each).position for each in (position, measured))
        sample = Sample(
            stamp.sec + 1e-9 * stamp.nanosec,
            *(position, velocity, measured),
            message.speed_scaling_factor,
            *tools,
        )
        self.samples.append(sample)

    def _take_status(self, message: ServoStatus) -> None:
        self.status = message.message
        if message.code > 0:
            self.limited.append(message.message)


def _why(goal: ActionRun) -> str:
    return f'{goal.result.error_code}: {goal.result.error_string}'


def tool_speed(samples: Sequence[Sample], period: float) -> float:
    """Return the median commanded tool speed in [m/s]; 0 for fewer than two samples."""
    speeds = [
        float(np.linalg.norm(after.tool - before.tool)) / (cycles * period)
        for before, after in pairwise(samples)
        if (cycles := round((after.time - before.time) / period)) >= 1
    ]
    return float(np.median(speeds)) if speeds else 0.0


def off_line(points: Sequence[Array], begin: Array, direction: Array) -> float:
    """Return the greatest distance of points, of any dimension, from a straight line."""
    unit = direction / np.linalg.norm(direction)
    offsets = [point - begin for point in points]
    return max(
        (float(np.linalg.norm(each - (each @ unit) * unit)) for each in offsets), default=0.0
    )


def duration_of(model: RobotModel, begin: Array, end: Array) -> float:
    """Return the duration in [s] of a quintic from rest to rest within all limits.

    Its velocity, acceleration and jerk peaks for unit distance and time: 15/8, 10/sqrt(3), 60.
    """
    way, limits = np.abs(end - begin), model.limits
    needed = (
        15 / 8 * way / (VELOCITY_SHARE * limits.velocity),
        np.sqrt(10 / math.sqrt(3) * way / (LIMIT_SHARE * limits.acceleration)),
        np.cbrt(60 * way / (LIMIT_SHARE * limits.jerk)),
    )
    return float(max(SHORTEST, *(each.max() for each in needed)))


def is_free(model: RobotModel, begin: Array, end: Array) -> bool:
    """Return whether the straight joint path is free of collision, as the controller checks."""
    way = end - begin
    contact = PathCheck(model.scene).contact(lambda times: begin + np.outer(times, way), 1.0)
    return contact is None


def free_way(model: RobotModel, begin: Array, end: Array) -> list[Array]:
    """Return the waypoints to the end: directly, or via an SRDF pose that avoids collision."""
    if not is_free(model, begin, end):
        for via in model.poses.values():
            if is_free(model, begin, via) and is_free(model, via, end):
                return [via, end]
    return [end]  # else the controller reports the colliding links


def free_end(model: RobotModel, begin: Array) -> Array:
    """Return a trajectory end that moves each joint in the direction with more room."""
    for end in _ends(model, begin):
        if (end != begin).any() and is_free(model, begin, end):
            return end
    raise ModelError(f'group {model.group}: links are in the way of all trajectories')


def _ends(model: RobotModel, begin: Array) -> Iterator[Array]:
    limits = model.limits
    up, down = limits.upper - begin, begin - limits.lower
    for way in WAYS:
        room = np.minimum(way, 0.5 * np.maximum(up, down))
        step = np.where(up >= down, room, -room)
        yield begin + step
        yield np.clip(begin - step, limits.lower, limits.upper)


def demo_files(robot: Robot, folder: Path, ros: RosOptions, groups: MovedGroups) -> Sequence[Path]:
    """Write the parameter files of the demo: the robot's, and parameters the demo requires."""
    controller = controller_names(robot, groups)[groups.names[0]]
    servo = {'command_in_type': 'speed_units', 'scale': {'linear': 1.0}}  # cap [m/s]
    values = {
        controller: {'ros__parameters': {'state_publish_rate': RATE}},
        'servo_node': {'ros__parameters': {'moveit_servo': servo}},
    }
    path = folder / 'demo.yaml'
    path.write_text(json.dumps(values), encoding='utf-8')
    # the later of two equal names wins; a pattern of an earlier file loses to any name
    return [*motion_files(robot, folder, ros, groups), namespaced_parameters(path, ros, folder)]


def main(argv: Sequence[str] | None = None) -> int:
    """Run the demo; see :func:`.wave.main`."""
    parsed = parse(
        sys.argv[1:] if argv is None else argv,
        'motion_demo',
        'Bring a simulated arm up and move it: a square with the tool in the base frame and in '
        'its own, into the straight arm and back, a trajectory with a speed override in its '
        'middle, and one that is canceled. Ends with what was measured.',
        'repeat it until so many seconds are over, once at least (default: until Ctrl-C)',
    )
    return run(parsed, Motion, master=MOTION_NODE, files=demo_files, errors=(ArmError,))
