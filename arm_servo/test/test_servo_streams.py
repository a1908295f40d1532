# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Streams of clients that go on after a stop move nothing: jogs that are held, trajectories."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from itertools import pairwise
from typing import Any

from control_msgs.action import FollowJointTrajectory
from control_msgs.msg import JointTolerance
from isolation import Isolation
import numpy as np
import pytest
from sensor_msgs.msg import JointState
from servo_commands import Drives, PERIOD
from servo_nodes import GoalNode, ros_node
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from arm_canopen import Refusal, RefusalCause
from arm_model import JointLimits
from arm_servo import (
    CoreSettings,
    ExecutionSettings,
    JogRequest,
    JointCommand,
    NotReadyError,
    Source,
    TargetRequest,
)
from arm_servo.core.gateway import TOGETHER
from arm_servo.core.requests import by_joint
from arm_servo.ros.gripper import PARALLEL
from arm_servo.ros.group_motion import build_tool
from arm_servo.ros.trajectory import TrajectoryController
from arm_servo.ros.trajectory_goals import declare_trajectory, goal_of_action
from arm_trajectory import GoalRules
from arm_trajectory import JointTolerance as Tolerance

STEP = 0.004  # how far each trajectory of a stream goes in [rad]
MOVED = 0.01  # farther than this a stream has moved the arm in [rad]


class Client:
    """What sends commands for the first joint of drives that others may take."""

    def __init__(self, drives: Drives) -> None:
        self.drives = drives

    def wait(self, seconds: float) -> None:
        """Send nothing."""
        self.drives.run(round(seconds / PERIOD))

    @property
    def position(self) -> float:
        """Where the first joint was sent in [rad]."""
        return self.drives.axes[0].setpoint


class Arm(Client):
    """A trajectory controller whose messages the test hands over, cycle by cycle."""

    def __init__(self, node: Any) -> None:
        rules = GoalRules(end_velocity=True)
        super().__init__(Drives(settings=CoreSettings(execution=ExecutionSettings(rules))))
        joints = self.drives.gateway.model.joints
        parameters = declare_trajectory(node, joints)
        self.drives.gateway.get_ready = self._get_ready
        self.controller = TrajectoryController(node, self.drives.gateway, parameters)
        self.taken_back = 0
        self._joints = list(joints)
        (self._subscription,) = (
            each for each in node.subscriptions if each.topic_name.endswith('/joint_trajectory')
        )
        self.drives.attach()
        self.drives.run(2)

    def _get_ready(self) -> bool:
        is_detached = self.drives.source.get_ready()
        self.taken_back += is_detached
        return is_detached

    def publish(self, target: float, duration: float, speed: float | None = None) -> None:
        """Send the first joint to a place in [rad], with a speed in [rad/s] there."""
        row = [axis.setpoint for axis in self.drives.axes]
        point = JointTrajectoryPoint(positions=[target, *row[1:]])
        if speed is not None:
            point.velocities = [speed, *(0.0 for _ in row[1:])]
        point.time_from_start.nanosec = round(duration * 1e9)
        self._subscription.callback(JointTrajectory(joint_names=self._joints, points=[point]))

    def send(self, target: float, duration: float = 0.02) -> None:
        """Send the first joint to a place in [rad], and run a few cycles."""
        self.publish(target, duration)
        self.drives.run(2)

    def stream(self, count: int = 40) -> None:
        """Send trajectories as moveit_servo does: each goes on from where the arm is sent."""
        for _ in range(count):
            self.send(self.position + STEP)

    def let_go(self) -> None:
        """Send an empty trajectory."""
        self._subscription.callback(JointTrajectory())
        self.drives.run(2)


class Stick(Client):
    """A client that jogs."""

    def __init__(self, client: str = 'stick') -> None:
        super().__init__(Drives().following())
        self.drives.gateway.get_ready = self.drives.source.get_ready
        self.client = client
        self.refusals: list[str] = []

    def push(self, speed: float, cycles: int = 1) -> None:
        """Command a speed in each cycle, as the servo node does."""
        for _ in range(cycles):
            velocities = {'panda_joint1': speed}
            command = JointCommand(*by_joint(self.drives.gateway.model, velocities, 'velocities'))
            request = JogRequest(command, self.drives.now + 0.1, client=self.client)
            future = self.drives.gateway.command(request)
            self.drives.run()
            if (error := future.exception(0.0)) is not None:
                self.refusals.append(str(error))


def halt(drives: Drives) -> None:
    """Halt a drive from outside."""
    drives.source.released('panda_joint1', Refusal(RefusalCause.COMMANDED, 'halted'))


def fault(drives: Drives) -> None:
    """Fault a drive, and reset it from outside."""
    axis = drives.axes[1]
    drives.axes[1] = replace(axis, followable=False, refusal=Refusal(RefusalCause.FAULT))
    drives.run(100)
    drives.axes[1] = axis


def select(drives: Drives) -> None:
    """Select the mode in which the drives follow, as ``--enable`` does."""
    for name in drives.source.axes:
        selected = Refusal(RefusalCause.MODE_SELECTED, 'Cyclic synchronous position')
        drives.source.released(name, selected)


@pytest.fixture
def node(isolation: Isolation) -> Iterator[Any]:
    """The node of the controller."""
    with ros_node(isolation, 'panda_arm_controller') as node:
        yield node


@pytest.fixture
def arm(node: Any) -> Arm:
    """The controller on it."""
    return Arm(node)


def test_the_tolerance_at_the_goal_is_by_the_range_of_the_joint(node: Any) -> None:
    """5 cm is not there for a slide of half a metre; an end effector may end at what it holds."""
    names = ('slide', 'turn', 'round')
    low, high = np.array([0.0, -3.0, -np.inf]), np.array([0.5, 3.0, np.inf])
    one = np.ones(3)
    limits = JointLimits(names, low, high, one, one, one)
    goal = declare_trajectory(node, names, limits).execution.goal
    assert isinstance(goal, Mapping)
    assert [goal[name].position for name in names] == pytest.approx([0.01, 0.05, 0.05])


def test_tolerances_of_a_goal_are_those_of_its_fields() -> None:
    """By the names of their joints."""
    goal = FollowJointTrajectory.Goal()
    goal.path_tolerance = [JointTolerance(name='elbow', position=0.1)]
    goal.goal_tolerance = [JointTolerance(name='wrist', position=-1.0)]
    made = goal_of_action(goal, 0.0)
    assert made.path_tolerance == {'elbow': Tolerance(0.1)}
    assert made.goal_tolerance == {'wrist': Tolerance(-1.0)}


@pytest.mark.parametrize('pause', [0.0, 3.0])
@pytest.mark.parametrize('happens', [halt, fault])
def test_a_stream_that_goes_on_moves_no_arm_that_was_stopped(
    arm: Arm, happens: Callable[[Drives], None], pause: float
) -> None:
    """Not after a pause either, as a stalled process makes it; let go and begun anew, it does."""
    begin = arm.position
    arm.stream()
    assert arm.position > begin + MOVED
    happens(arm.drives)
    arm.wait(0.5)
    rest = arm.position
    arm.wait(pause)
    arm.stream()
    arm.let_go()  # of no avail while it goes on
    arm.stream(10)
    assert arm.position == pytest.approx(rest, abs=1e-6)
    assert arm.taken_back == 0
    arm.wait(TOGETHER + 0.1)
    arm.let_go()
    arm.stream()
    assert arm.position > rest + MOVED


def test_a_stream_moves_no_arm_that_is_enabled(arm: Arm) -> None:
    """It began while the drives were disabled; they were enabled for something else."""
    enabled, refusal = list(arm.drives.axes), Refusal(RefusalCause.NOT_ENABLED)
    arm.drives.axes = [replace(axis, followable=False, refusal=refusal) for axis in enabled]
    arm.wait(0.1)
    arm.stream(5)
    arm.drives.axes = enabled
    rest = arm.position
    arm.stream()
    assert arm.position == pytest.approx(rest, abs=1e-6)


def test_a_stream_that_begins_takes_the_arm_back(arm: Arm) -> None:
    """Its first trajectory is a request; those that follow are not ended by it."""
    halt(arm.drives)
    arm.wait(0.5)
    rest = arm.position
    arm.stream()
    assert arm.position > rest + MOVED
    assert arm.taken_back == 1


@pytest.mark.parametrize('rate', [30.0, 100.0])
def test_the_newest_trajectory_of_a_stream_counts(arm: Arm, rate: float) -> None:
    """As moveit_servo sends them: steadily, soon, and no longer than they come."""
    speed, ahead, duration = 0.3, 0.034, 2.0  # [rad/s], [s], [s]
    drives, begin, number = arm.drives, arm.drives.now, 0
    while (end := drives.now) < begin + duration:
        while (sent := begin + number / rate) <= end:
            drives.now = sent
            arm.publish(speed * (sent + ahead - begin), ahead, speed)
            number += 1
        drives.now = end
        drives.run()
    last = arm.position
    assert last > speed * (duration - 0.1)
    speeds = np.diff([row[0] for row in drives.path[-100:]]) / PERIOD
    assert speeds == pytest.approx(speed, rel=0.1)
    arm.wait(0.6)
    assert not np.ptp([row[0] for row in drives.path[-5:]])
    assert arm.position < last + 0.2 * speed


def test_one_trajectory_after_another_is_no_stream(arm: Arm) -> None:
    """Each is a request, after a halt as well."""
    for target in (0.05, 0.1):
        arm.send(target, 1.0)
        arm.wait(TOGETHER + 0.1)
    halt(arm.drives)
    arm.wait(0.1)
    arm.send(0.2, 1.0)
    arm.wait(1.5)
    assert arm.position == pytest.approx(0.2, abs=1e-6)


def test_who_activates_the_controller_lets_a_stream_in(arm: Arm) -> None:
    """A person has requested it, while none came. Deactivated it moves nothing."""
    arm.send(1.0, 4.0)
    arm.wait(1.0)
    arm.controller.set_active(False)
    arm.wait(1.0)
    assert arm.drives.gateway.snapshot.source is Source.NONE
    with pytest.raises(NotReadyError, match='panda_arm_controller is inactive'):
        arm.controller.check_active()
    rest = arm.position
    arm.send(1.0, 4.0)
    assert arm.position == rest < 0.6
    arm.controller.set_active(True)
    arm.stream(10)
    halt(arm.drives)
    arm.wait(TOGETHER + 0.1)
    arm.controller.set_active(False)
    arm.controller.set_active(True)
    rest = arm.position
    arm.stream()
    assert arm.position > rest + MOVED


def test_a_deactivated_controller_moves_no_gripper(
    node: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What is under way comes to rest, and what comes next is refused."""
    drives, goals = Drives().following(), GoalNode(monkeypatch)
    node.servers = goals.servers
    tool = build_tool(drives.gateway.model, node, lambda *_: drives.gateway)
    del goals.servers[0]  # of trajectories
    command = drives.gateway.request(TargetRequest({'panda_joint1': 1.0}, 0.1))
    drives.run(20)
    assert not command.ended.done()
    assert tool.set_active is not None
    tool.set_active(False)
    drives.run(100)
    assert command.ended.result(0.0).canceled
    rest = drives.path[-1]
    state = JointState(name=['panda_joint1'], position=[1.0])
    handle = goals.send(PARALLEL.action.Goal(command=state))
    drives.run(20)
    assert (handle.ending, drives.path[-1].tolist()) == ('aborted', rest.tolist())


def test_an_empty_trajectory_stops(arm: Arm) -> None:
    """On the way, without a jump."""
    arm.send(1.0, 4.0)
    arm.wait(1.5)
    between = arm.position
    arm.let_go()
    arm.wait(1.0)
    rest = arm.position
    assert between <= rest < 0.6
    arm.wait(1.0)
    assert arm.position == rest
    assert max(abs(b[0] - a[0]) for a, b in pairwise(arm.drives.path)) < 0.02


@pytest.mark.parametrize('pause', [0.0, 3.0])
@pytest.mark.parametrize('happens', [halt, select, fault])
def test_a_stick_that_is_held_moves_nothing_after_a_stop(
    happens: Callable[[Drives], None], pause: float
) -> None:
    """Its commands pause as a stalled process makes them; let go and pushed again, it moves."""
    stick = Stick()
    stick.push(0.2, 50)
    assert stick.drives.gateway.snapshot.source is Source.JOG
    happens(stick.drives)
    stick.wait(1.0)
    rest, attached = stick.position, len(stick.drives.attachments)
    stick.wait(pause)
    stick.push(0.2, 100)
    assert stick.position == pytest.approx(rest, abs=1e-6)
    assert len(stick.drives.attachments) == attached
    assert 'release and jog again' in stick.refusals[-1]
    assert 'call its ~/cyclic_position_mode' not in stick.refusals[-1]  # it is selected
    stick.push(0.0)
    stick.push(0.2, 50)
    assert stick.position > rest + 0.02


def test_a_stick_that_is_held_moves_no_arm_that_is_enabled() -> None:
    """It was pushed while the drives were disabled; they were enabled for something else."""
    stick = Stick()
    enabled, refusal = list(stick.drives.axes), Refusal(RefusalCause.NOT_ENABLED)
    stick.drives.axes = [replace(axis, followable=False, refusal=refusal) for axis in enabled]
    stick.wait(0.1)
    stick.push(0.2, 100)
    stick.drives.axes = enabled
    rest = stick.position
    stick.push(0.2, 100)
    assert stick.position == pytest.approx(rest, abs=1e-6)
    stick.push(0.0)
    stick.push(0.2, 50)
    assert stick.position > rest + 0.02


@pytest.mark.parametrize('who', ['let go by a zero', 'was silent', 'is another'])
@pytest.mark.parametrize('happens', [halt, select, fault])
def test_who_did_not_hold_when_the_arm_stopped_moves_it_after_that(
    happens: Callable[[Drives], None], who: str
) -> None:
    """A new push gets the drives back. By silence clients of moveit_servo let go."""
    stick = Stick()
    stick.push(0.2, 50)
    if who == 'let go by a zero':
        stick.push(0.0)
    elif who == 'is another':
        stick.client = 'another'
    else:
        stick.wait(5.0)
    happens(stick.drives)
    stick.wait(1.0)
    rest = stick.position
    stick.push(0.2, 50)
    assert stick.refusals == [] or who == 'is another'
    assert stick.position > rest + 0.02
