# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Two arms and a gripper of one description, brought up from unedited files."""

from __future__ import annotations

import re
from typing import Any, TYPE_CHECKING

from control_msgs.action import FollowJointTrajectory, GripperCommand, ParallelGripperCommand
from control_msgs.msg import JointJog, JointTrajectoryControllerState
from controller_manager_msgs.srv import ListControllers
from isolation import Isolation, reserve
from processes import RunningProcess
import pytest
from ros_client import RosClient
from sensor_msgs.msg import JointState
from simulated_arm import goal_to, reach
from tf2_msgs.msg import TFMessage
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint
from two_arms import ARMS, DRIVES, FOLLOWER, GRIPPER, write_two_arms

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

pytestmark = pytest.mark.scenario

SUCCEEDED, ABORTED = 4, 6
TARGETS = {'left': [0.4, -0.3, 0.5], 'right': [-0.4, 0.1]}
MIDDLE = {'left': [-1.57, 0.0, 0.0], 'right': [1.57, 0.0]}
"""Where the arms would be in each other."""


class Robot:
    """The robot, brought up with its drives enabled."""

    def __init__(self, client: RosClient) -> None:
        self.client = client  # the test's own node
        self.at: dict[str, float] = {}  # newest position of each joint
        client.node.create_subscription(JointState, '/joint_states', self._take, 10)

    def _take(self, message: JointState) -> None:
        self.at.update(zip(message.name, message.position, strict=True))

    def send(self, action: Any, name: str, goal: Any) -> Any:
        """Send a goal; return the future of its result."""
        client: Any = self.client.action(action, name)
        self.client.spin_until(client.server_is_ready, 60.0, name)
        sent = client.send_goal_async(goal)
        self.client.spin_until(sent.done, 60.0, f'an answer of {name}')
        return sent.result().get_result_async()

    def follow(self, arm: str, seconds: int, target: list[float] | None = None) -> Any:
        """Send an arm somewhere, by default to its target."""
        point = JointTrajectoryPoint(positions=target or TARGETS[arm])
        point.time_from_start.sec = seconds
        trajectory = JointTrajectory(joint_names=list(ARMS[arm]), points=[point])
        goal = FollowJointTrajectory.Goal(trajectory=trajectory)
        return self.send(FollowJointTrajectory, f'/{arm}_controller/follow_joint_trajectory', goal)

    def grip(self, position: float) -> Any:
        """Move the gripper, by the action of grippers of one joint."""
        goal = GripperCommand.Goal()
        goal.command.position = position
        return self.send(GripperCommand, '/hand_controller/gripper_cmd', goal)

    def results(self, futures: Sequence[Any]) -> list[Any]:
        """Wait for the end of goals."""
        self.client.spin_until(lambda: all(each.done() for each in futures), 60.0, 'results')
        return [each.result() for each in futures]


@pytest.fixture(scope='module')
def started(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Robot]:
    """Bring the robot up, with its planner, for all tests of this module."""
    folder = write_two_arms(tmp_path_factory.mktemp('robot') / 'two_arms')
    command = ['ros2', 'run', 'arm_bringup', 'bringup', f'{folder}/', '--simulate', '--enable']
    margin = 'move_group:trajectory_execution.allowed_goal_duration_margin:=60.0'  # [s]
    with reserve() as isolation:
        command += ['--plan', '--can', isolation.bus, '--ros-args', '-p', margin]
        with (
            RunningProcess(command, isolation.env) as bringup,
            RosClient(isolation.domain_id) as client,
        ):
            bringup.wait_for(f'all {len(DRIVES)} drives are enabled', 90.0)
            bringup.wait_for('collisions are checked with wheel at 0', 60.0)
            bringup.wait_for('all is ready', 60.0)
            yield Robot(client)
            assert bringup.stop(30.0) == 0, bringup.output


@pytest.fixture
def robot(started: Robot) -> Robot:
    """Bring both arms and the gripper to 0, one after the other."""
    for arm, joints in ARMS.items():
        reach(started.client, goal_to([0.0] * len(joints), 2.0, joints), f'/{arm}_controller')
    (hand,) = started.results([started.grip(0.0)])
    assert hand.status == SUCCEEDED, hand.result
    return started


def test_both_arms_and_the_gripper_move_at_the_same_time(robot: Robot) -> None:
    """Each by its own controller; /joint_states and /tf have all that has a drive."""
    transforms = robot.client.listen(TFMessage, '/tf')
    listing = robot.client.call(
        ListControllers, '/controller_manager/list_controllers', ListControllers.Request()
    )
    names = {each.name for each in listing.controller}
    assert {'left_controller', 'right_controller', 'hand_controller'} <= names
    runs = [robot.follow('left', 2), robot.follow('right', 2), robot.grip(0.03)]
    left, right, hand = robot.results(runs)
    assert [left.status, right.status, hand.status] == [SUCCEEDED] * 3, (left, right, hand)
    assert hand.result.reached_goal
    for arm, joints in ARMS.items():
        assert [robot.at[name] for name in joints] == pytest.approx(TARGETS[arm], abs=1e-3)
    assert robot.at[GRIPPER] == pytest.approx(0.03, abs=1e-3)
    assert robot.at[FOLLOWER] == robot.at[GRIPPER]
    assert set(robot.at) == {*DRIVES, FOLLOWER}

    def frames() -> set[str]:
        return {each.child_frame_id for message in transforms for each in message.transforms}

    wanted = {f'{name}_link' for name in (*DRIVES, FOLLOWER)}
    robot.client.spin_until(lambda: frames() >= wanted, 60.0, 'frames of all joints')


def test_arms_that_move_towards_each_other_stop_and_may_part(robot: Robot) -> None:
    """The goal of one ends with the pair, as neither is where the other's was planned."""
    name = '/right_controller/controller_state'
    states = robot.client.listen(JointTrajectoryControllerState, name)
    runs = [robot.follow(arm, 4, MIDDLE[arm]) for arm in ARMS]
    ended = [each for each in robot.results(runs) if each.status == ABORTED]
    assert ended
    for each in ended:
        assert each.result.error_code == FollowJointTrajectory.Result.PATH_TOLERANCE_VIOLATED
        assert re.search('left_.*right_|right_.*left_', each.result.error_string)
    robot.client.spin_until(
        lambda: bool(states) and not any(states[-1].reference.velocities), 60.0, 'rest'
    )
    turn = states[-1].reference.positions[0]
    up = robot.follow('right', 4, [turn, 0.1])  # away, wherever either stands
    assert robot.results([up])[0].status == SUCCEEDED, up.result()
    for arm in ('left', 'right'):
        (back,) = robot.results([robot.follow(arm, 4)])
        assert back.status == SUCCEEDED, back.result


def test_a_gripper_takes_goals_of_either_kind_and_the_newer_one_counts(robot: Robot) -> None:
    """A goal beyond the range is refused; a second arm is jogged by a servo of its own."""
    beyond = robot.results([robot.grip(0.2)])[0]
    assert (beyond.status, beyond.result.reached_goal) == (ABORTED, False)
    goal = ParallelGripperCommand.Goal()
    goal.command.name, goal.command.position = [GRIPPER], [0.035]
    goal.command.velocity = [0.005]  # slow enough for another one in between
    first = robot.send(ParallelGripperCommand, '/hand_controller/parallel_gripper_cmd', goal)
    robot.client.spin_until(lambda: robot.at[GRIPPER] > 0.002, 60.0, 'motion of the gripper')
    old, new = robot.results([first, robot.grip(0.001)])
    assert (old.status, new.status) == (ABORTED, SUCCEEDED)
    assert robot.at[GRIPPER] == pytest.approx(0.001, abs=2e-3)
    jogs = robot.client.node.create_publisher(JointJog, '/right_servo_node/delta_joint_cmds', 10)
    jog = JointJog(joint_names=['right_slide'], velocities=[1.0])
    timer = robot.client.node.create_timer(0.02, lambda: jogs.publish(jog))
    robot.client.spin_until(lambda: robot.at['right_slide'] > 0.05, 60.0, 'motion of the slide')
    robot.client.node.destroy_timer(timer)
    assert [robot.at[name] for name in ARMS['left']] == pytest.approx([0.0] * 3, abs=1e-3)


def test_the_panda_with_its_gripper_grips(isolation: Isolation) -> None:
    """A ninth node on its bus opens and closes it; the other finger follows."""
    command = ['ros2', 'run', 'arm_bringup', 'bringup', 'panda_hand', '--simulate', '--enable']
    with (
        RunningProcess([*command, '--can', isolation.bus], isolation.env) as bringup,
        RosClient(isolation.domain_id) as client,
    ):
        bringup.wait_for('all 8 drives are enabled', 90.0)
        robot = Robot(client)
        fingers = ('panda_finger_joint1', 'panda_finger_joint2')
        for place in (0.035, 0.0):
            (hand,) = robot.results([robot.grip(place)])
            assert (hand.status, hand.result.reached_goal) == (SUCCEEDED, True)
            assert [robot.at[name] for name in fingers] == pytest.approx([place] * 2, abs=2e-3)
        assert bringup.stop(30.0) == 0, bringup.output
