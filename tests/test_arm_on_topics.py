# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Motion for drives that listen to topics: programs of arm_servo, and --controller-only."""

from __future__ import annotations

from itertools import pairwise
import math
from pathlib import Path
import shutil
import signal
import time
from typing import TYPE_CHECKING
from xml.etree import ElementTree as ET

from control_msgs.action import FollowJointTrajectory
from control_msgs.msg import JointJog, JointTrajectoryControllerState
from controller_manager_msgs.srv import ListControllers, SwitchController
from processes import executable, RunningProcess
import pytest
from simulated_arm import CONTROLLER, goal_to, GoalRun, reach, READY
from topic_arm import PATIENT, standalone, TopicArm
from two_arms import ARMS, GRIPPER, write_two_arms

from arm_bringup.robots import expand_xacro, installed_robots_folder

if TYPE_CHECKING:
    from collections.abc import Sequence

    from isolation import Isolation


pytestmark = pytest.mark.scenario

RESULT = FollowJointTrajectory.Result
READY_WORDS = 'ready for commands'


def test_trajectories_go_out_as_arrays(isolation: Isolation, tmp_path: Path) -> None:
    """Goals are reached, held, not reached and aborted; each step leaves the arm at rest."""
    command = standalone(tmp_path, 'trajectory_controller', 'constraints.goal_time:=0.3')
    with TopicArm(isolation, command, READY_WORDS) as arm:
        _reaches_a_goal_while_it_is_active(arm)
        _holds_a_goal_on_its_path(arm)
        _does_not_report_a_stuck_arm_as_a_success(arm)
        _stops_without_joint_states(arm)
        _aborts_a_goal_when_the_program_ends(arm)


def _reaches_a_goal_while_it_is_active(arm: TopicArm) -> None:
    """The controller is listed, switched off and on."""
    reach(arm.client, goal_to([0.3, *READY[1:]], 1.0))
    _comes_to(arm, 0.3)
    listed = arm.client.call(
        ListControllers, '/controller_manager/list_controllers', ListControllers.Request()
    ).controller
    assert [(each.name, each.state) for each in listed] == [('panda_arm_controller', 'active')]
    assert 'JointTrajectoryController' in listed[0].type
    _switch(arm, [], ['panda_arm_controller'])
    refused = GoalRun(arm.client, goal_to(READY, 1.0)).wait()[1]
    assert 'inactive' in refused.error_string
    _switch(arm, ['panda_arm_controller'], [])


def _comes_to(arm: TopicArm, goal: float) -> None:
    """Its first joint; result and set-points are not ordered, and the last may come later."""
    arm.client.spin_until(lambda: abs(arm.at[0] - goal) < 1e-6, 10.0, f'{goal} rad')


def _holds_a_goal_on_its_path(arm: TopicArm) -> None:
    """A pause holds the arm, with speed 0 in the state; the goal is reached behind it."""
    states = arm.client.listen(JointTrajectoryControllerState, f'{CONTROLLER}/controller_state')
    idle = arm.client.trigger(f'{CONTROLLER}/resume')
    assert (idle.success, idle.message) == (True, 'was not paused')
    run = GoalRun(arm.client, goal_to([0.7, *READY[1:]], 1.5))
    arm.client.spin_until(lambda: arm.at[0] > 0.4, 10.0, 'motion')
    held = arm.client.trigger(f'{CONTROLLER}/pause')
    assert held.success
    assert 'the trajectory comes to rest on its path' in held.message
    assert 'already' in arm.client.trigger(f'{CONTROLLER}/pause').message
    arm.client.spin_until(lambda: _rests(arm), 10.0, 'rest')
    states.clear()
    arm.client.spin_until(lambda: len(states) > 5, 10.0, 'state of the controller')
    assert {state.speed_scaling_factor for state in states} == {0.0}
    assert arm.at[0] < 0.65
    assert not run.done
    on = arm.client.trigger(f'{CONTROLLER}/resume')
    assert (on.success, on.message) == (True, 'the trajectory goes on')
    result = run.wait()[1]
    assert result.error_code == RESULT.SUCCESSFUL, result.error_string
    _comes_to(arm, 0.7)


def _does_not_report_a_stuck_arm_as_a_success(arm: TopicArm) -> None:
    """A stuck arm is reported without a tolerance in the goal: at its end, on long ways sooner."""
    arm.moves = False
    near = GoalRun(arm.client, goal_to([0.6, *READY[1:]], 1.0)).wait()[1]
    assert near.error_code == RESULT.GOAL_TOLERANCE_VIOLATED
    assert 'panda_joint1' in near.error_string
    far = GoalRun(arm.client, goal_to([-0.3, *READY[1:]], 2.0)).wait()[1]
    assert far.error_code == RESULT.PATH_TOLERANCE_VIOLATED
    assert 'panda_joint1 does not follow' in far.error_string
    arm.moves = True


def _stops_without_joint_states(arm: TopicArm) -> None:
    """It slows down; the goal names the joint."""
    run = _under_way(arm, goal_to(READY, 8.0))
    arm.publishes = False
    first = len(arm.arrays) - 1
    assert 'no joint states of panda_joint1' in run.wait()[1].error_string
    assert _steps(arm, first)[-1] < 1e-4
    assert max(_steps(arm, first)) < 0.01
    arm.publishes = True


def _aborts_a_goal_when_the_program_ends(arm: TopicArm) -> None:
    """Ctrl-C in the middle of it: the arm comes to rest on the path, the client gets a result."""
    run = _under_way(arm, goal_to([1.5, *READY[1:]], 6.0))
    arm.process.signal(signal.SIGINT)
    result = run.wait()[1]
    assert result.error_code != RESULT.SUCCESSFUL
    assert 'the program ends' in result.error_string
    assert arm.process.wait() == 0
    assert _steps(arm)[-1] < 1e-4


def _under_way(arm: TopicArm, goal: FollowJointTrajectory.Goal) -> GoalRun:
    """Send a goal until the arm moves: what stopped it before has to be seen to have ended."""
    deadline = time.monotonic() + 20.0
    while True:
        run = GoalRun(arm.client, goal)
        arm.client.spin_until(lambda: len(run.feedback) > 8 or run.done, 10.0, 'motion')  # noqa: B023
        if not run.done:
            return run
        assert time.monotonic() < deadline, run.wait()[1].error_string
        arm.client.spin_for(0.5)  # an arm that did not follow wants 0.3 s without commands


def _steps(arm: TopicArm, first: int = 0) -> list[float]:
    """Return the steps of the first joint between set-points, from one of them on."""
    return [abs(after[0] - before[0]) for before, after in pairwise(arm.arrays[first:])]


def test_one_program_is_chosen_by_its_back_end(isolation: Isolation, tmp_path: Path) -> None:
    """motion_node jogs and follows trajectories; a second program is an error that it logs."""
    command = standalone(tmp_path, 'motion_node', 'backend:=topics')
    with TopicArm(isolation, command, READY_WORDS) as arm:
        reach(arm.client, goal_to([0.3, *READY[1:]], 1.0))
        assert '/servo_node' in _names(arm)
        assert 'another program' not in arm.process.output
        assert 'without effect' not in arm.process.output
        servo = standalone(tmp_path, 'servo_node')
        with RunningProcess(servo, isolation.env) as other:
            other.wait_for('is a trajectory controller of arm_servo')
            arm.process.wait_for('another program has a node /servo_node')


def _names(arm: TopicArm) -> set[str]:
    return {
        f'{namespace.rstrip("/")}/{name}'
        for name, namespace in arm.client.node.get_node_names_and_namespaces()
    }


def _rests(arm: TopicArm) -> bool:
    places = [each[0] for each in arm.arrays[-50:]]
    return max(places) - min(places) < 1e-9


def _switch(arm: TopicArm, on: list[str], off: list[str]) -> None:
    request = SwitchController.Request(
        activate_controllers=on,
        deactivate_controllers=off,
        strictness=SwitchController.Request.STRICT,
    )
    name = '/controller_manager/switch_controller'
    assert arm.client.call(SwitchController, name, request).ok
    request.activate_controllers = ['nobody']
    answer = arm.client.call(SwitchController, name, request)
    assert not answer.ok
    assert 'nobody' in answer.message
    request.strictness = 0  # not set is best effort
    answer = arm.client.call(SwitchController, name, request)
    assert answer.ok
    assert 'nobody' in answer.message


def test_jogging_goes_out_as_trajectories(isolation: Isolation, tmp_path: Path) -> None:
    """A jog moves its joint; Ctrl-C in the middle of it ends at rest, with exit code 0.

    What is left out of the description is reported, and libraries log nothing at the end.
    """
    odd = '<group_state name="odd" group="panda_arm"><joint name="elbow" value="0"/></group_state>'
    command = standalone(tmp_path, 'servo_node', semantic=odd)
    with TopicArm(isolation, command, READY_WORDS) as arm:
        note = "pose 'odd' of the SRDF has no joint of the group (elbow is none of them)"
        assert note in arm.process.output
        publisher = arm.client.node.create_publisher(JointJog, '/servo_node/delta_joint_cmds', 10)
        jog = JointJog(joint_names=['panda_joint1'], velocities=[1.0], duration=10.0)
        arm.client.node.create_timer(
            0.05, lambda: None if arm.trajectories else publisher.publish(jog)
        )
        arm.client.spin_until(lambda: arm.at[0] > 0.1, 10.0, 'motion of the first joint')
        assert arm.at[1:] == pytest.approx(READY[1:], abs=1e-4)
        arm.process.signal(signal.SIGINT)
        arm.client.spin_until(lambda: not arm.process.is_running(), 10.0, 'end of the program')
        assert arm.process.wait() == 0
        assert 'leaked' not in arm.process.output
        speeds = [message.points[0].velocities[0] for message in arm.trajectories]
        assert max(speeds) == pytest.approx(0.5, abs=0.01)
        assert speeds[-1] == 0.0
        drops = [a - b for a, b in pairwise(speeds)]
        assert max(drops) < 0.2  # no message of the way down to rest is missing


@pytest.mark.parametrize(
    ('program', 'argument', 'words'),
    [
        ('motion_node', 'backend:=can', 'it must be canopen or topics'),
        ('servo_node', 'moveit_servo.scale.linaer:=0.2', "did you mean 'moveit_servo.scale.lin"),
    ],
)
def test_a_program_that_cannot_begin_says_why(
    isolation: Isolation, tmp_path: Path, program: str, argument: str, words: str
) -> None:
    """A wrong parameter ends it with exit code 1, and what is wrong is named."""
    command = standalone(tmp_path, program, argument)
    with RunningProcess(command, isolation.env) as process:
        assert process.wait() == 1
        assert words in process.output


def test_each_group_has_a_topic_of_its_own(isolation: Isolation, tmp_path: Path) -> None:
    """Two arms and a gripper move at the same time; one is canceled, and the others go on."""
    groups = {**ARMS, 'hand': (GRIPPER,)}
    commands = 'forward_position_controller/commands'
    topics = {
        f'/{"" if group == "left" else group + "_"}{commands}': joints
        for group, joints in groups.items()
    }
    command = [executable('arm_bringup', 'bringup'), f'{write_two_arms(tmp_path / "two_arms")}/']
    command += ['--controller-only', '--ros-args']
    for group in groups:
        for name, value in PATIENT.items():
            command += ['-p', f'{group}_controller:{name}:={value}']
    start = [0.0] * sum(map(len, groups.values()))
    with TopicArm(isolation, command, 'all is ready', topics=topics, start=start) as robot:

        def follow(group: str, positions: Sequence[float], time: float) -> GoalRun:
            goal = goal_to(positions, time, groups[group])
            return GoalRun(robot.client, goal, f'/{group}_controller')

        runs = {
            'left': follow('left', [0.4, -0.3, 0.5], 4.0),
            'right': follow('right', [-1.5, 0.2], 20.0),
            'hand': follow('hand', [0.03], 4.0),
        }
        for name in ('left', 'hand'):
            result = runs[name].wait()[1]
            assert result.error_code == 0, (name, result.error_string)
        places = dict(zip(robot.joints, robot.at, strict=True))
        assert [places[name] for name in ARMS['left']] == pytest.approx([0.4, -0.3, 0.5], abs=1e-6)
        assert places[GRIPPER] == pytest.approx(0.03, abs=1e-6)
        assert -1.4 < places['right_turn'] < -0.05
        runs['right'].cancel()
        runs['right'].wait()
        jogs = robot.client.node.create_publisher(
            JointJog, '/right_servo_node/delta_joint_cmds', 10
        )
        jog = JointJog(joint_names=['right_turn'], velocities=[1.0])
        robot.client.node.create_timer(0.02, lambda: jogs.publish(jog))
        turn, before = robot.joints.index('right_turn'), places['right_turn']
        robot.client.spin_until(lambda: robot.at[turn] > before + 0.1, 20.0, 'a jog')
        robot.process.signal(signal.SIGINT)
        robot.client.spin_until(lambda: not robot.process.is_running(), 15.0, 'end')
        assert robot.process.wait() == 0


FOLDED = [0.0, 1.7, 0.0, -3.0, 0.0, 1.5, 0.7]
"""A pose of the Panda within its limits, with the forearm in its base."""


def prism(radius: float, length: float) -> str:
    """Return a prism of eight sides along z as Wavefront OBJ."""
    turns = [math.pi * number / 4 for number in range(8)]
    lines = [
        f'v {radius * math.cos(turn)} {radius * math.sin(turn)} {side * length / 2}'
        for side in (-1, 1)
        for turn in turns
    ]
    return '\n'.join([*lines, *(f'f {n} {n + 1} {n + 8}' for n in range(1, 8))])


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Make the Panda's folder with a mesh in the place of each capsule, beside a plain URDF."""
    panda, folder = installed_robots_folder() / 'panda', tmp_path / 'panda'
    shutil.copytree(panda, folder, ignore=shutil.ignore_patterns('*.xacro'))
    (folder / 'meshes').mkdir()
    robot = ET.fromstring(expand_xacro(panda / 'panda.urdf.xacro'))  # noqa: S314  our own
    for link in robot.iter('link'):
        for number, collision in enumerate(link.findall('collision')):
            geometry = collision.find('geometry')
            assert geometry is not None
            cylinder = geometry.find('cylinder')
            if cylinder is None:
                link.remove(collision)
                continue
            name = f'meshes/{link.get("name")}_{number}.obj'
            text = prism(*(float(cylinder.get(key, 0)) for key in ('radius', 'length')))
            (folder / name).write_text(text, encoding='utf-8')
            geometry.remove(cylinder)
            ET.SubElement(geometry, 'mesh', filename=name)
    ET.ElementTree(robot).write(folder / 'panda.urdf')
    return folder


def test_a_goal_and_a_jog_move_drives_elsewhere(isolation: Isolation, folder: Path) -> None:
    """A goal is reached; a jog takes over from the next one, without a jump; it ends at rest.

    One in which meshes meet is refused with the links and the time.
    """
    command = [executable('arm_bringup', 'bringup'), str(folder), '--controller-only']
    with TopicArm(isolation, command, 'all is ready') as arm:
        refused = GoalRun(arm.client, goal_to(FOLDED, 6.0)).wait()[1]
        assert refused.error_code == FollowJointTrajectory.Result.INVALID_GOAL
        assert 'would collide at' in refused.error_string
        assert 'panda_link' in refused.error_string
        assert arm.at == READY
        reach(arm.client, goal_to([0.3, *READY[1:]], 2.0))
        assert arm.at[0] == pytest.approx(0.3, abs=1e-6)
        run = GoalRun(arm.client, goal_to([1.0, *READY[1:]], 6.0))
        arm.client.spin_until(lambda: arm.at[0] > 0.35, 10.0, 'motion')
        publisher = arm.client.node.create_publisher(JointJog, '/servo_node/delta_joint_cmds', 10)
        jog = JointJog(joint_names=['panda_joint1'], velocities=[-1.0])
        arm.client.node.create_timer(0.02, lambda: publisher.publish(jog))
        arm.client.spin_until(lambda: arm.at[0] < 0.2, 10.0, 'motion the other way')
        result = run.wait()[1]
        assert result.error_code == FollowJointTrajectory.Result.INVALID_GOAL
        assert 'jogging took over' in result.error_string
        assert max(abs(b[0] - a[0]) for a, b in pairwise(arm.arrays)) < 0.01
        assert not arm.trajectories  # they would go to the trajectory controller
        names = arm.client.node.get_node_names()
        assert 'robot_state_publisher' not in names
        arm.process.signal(signal.SIGINT)
        arm.client.spin_until(lambda: not arm.process.is_running(), 15.0, 'end of the bring-up')
        assert arm.process.wait() == 0
        steps = [abs(b[0] - a[0]) for a, b in pairwise(arm.arrays)]
        assert steps[-1] < 1e-4
