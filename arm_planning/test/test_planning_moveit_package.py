# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Packages of MoveIt's Setup Assistant: they start move_group, or it says what is broken."""

from __future__ import annotations

from collections.abc import Iterator
import json
from pathlib import Path
import re
from typing import Any

from action_msgs.msg import GoalStatus
from control_msgs.msg import JointTrajectoryControllerState
from isolation import Isolation, reserve
import move_group_rig as mg
from moveit_msgs import srv
from moveit_msgs.action import ExecuteTrajectory, MoveGroup
from moveit_msgs.msg import MoveItErrorCodes
from planning_messages import box, pose_at
from processes import executable, RunningProcess
import pytest
import rclpy
from rclpy.action.server import ActionServer
from shape_msgs.msg import SolidPrimitive

from arm_model import ArmError
from arm_model.ros import seconds
from arm_planning import ConfigError
from arm_planning.moveit_package import MoveItPackage, read_package
from arm_planning.moveit_settings import MANAGER, misspelt, of_nothing, read_settings
from arm_planning.nodes import move_group

FIXED = 'panda_joint8'
FINGERS = ['panda_finger_joint1', 'panda_finger_joint2']
MOVERS = ['panda_arm_controller', 'panda_hand_controller']
MOVED = [0.4, *mg.READY[1:]]


def settings_of(folder: Path) -> Any:
    """Read a package as the program does."""
    package = read_package(folder)
    return read_settings(package.parameters, package.places)


def test_packages_of_the_assistant_are_read(tmp_path: Path) -> None:
    """Limits in a table of their own or without one; files of former versions."""
    folder = mg.moveit_package('panda', tmp_path)
    path = folder / 'config' / 'joint_limits.yaml'
    lines = path.read_text().splitlines()
    for text in ('\n'.join(lines), 'robot_description_planning:\n  ' + '\n  '.join(lines)):
        path.write_text(text)
        settings = settings_of(folder)
        assert settings.joint_limits['panda_joint2']['max_velocity'] == 2.175
        assert settings.ik_timeouts == {'panda_arm': 0.25}
        assert settings.planners.configs['TRRTkConfigDefault']['min_temperature'] == 1e-9
    # names in capitals, a URDF elsewhere, controllers by the robot's name, no planner_configs
    folder = mg.moveit_package('prbt', tmp_path)
    package = read_package(folder)
    assert '<robot name="prbt"' in str(package.parameters['robot_description'])
    names = package.parameters['moveit_simple_controller_manager.controller_names']
    assert names == ['prbt_joint_trajectory_controller']
    settings = settings_of(folder)
    assert settings.joint_limits is None
    assert settings.planners.search('SBLkConfigDefault') == 'geometric::SBL'
    path = folder / '.setup_assistant'
    path.write_text(path.read_text().replace('package: arm_bringup', 'package: nobodys_arm'))
    with pytest.raises(ConfigError, match='nobodys_arm is not installed'):
        read_package(folder)


LIMITS, OMPL, CONTROLLERS = 'joint_limits.yaml', 'ompl_planning.yaml', 'moveit_controllers.yaml'
PILZ, CARTESIAN = 'pilz_industrial_motion_planner_planning.yaml', 'pilz_cartesian_limits.yaml'
BROKEN = [
    (LIMITS, 'max_velocity: 2.175', 'max_velocity: fast', 'is .fast.; it must be a number'),
    (LIMITS, 'has_velocity_limits: true', 'has_velocity_limits: 1', 'must be true or false'),
    (LIMITS, 'max_velocity:', 'max_speed:', r"has no 'max_speed'; it has .*max_velocity"),
    (LIMITS, 'factor: 0.1', 'factor: 1.5', 'a number above 0, up to 1'),
    (LIMITS, 'max_velocity: 2.175', 'max_velocity: .nan', 'it must be a number'),
    (LIMITS, '  panda_joint2:', '  panda_joint1:', 'there twice'),
    (LIMITS, 'max_velocity: 2.175', 'max_velocity: "2', 'no YAML'),
    ('kinematics.yaml', 'timeout: 0.25', 'timeout: -1', 'a number of 0 or more'),
    (CARTESIAN, '-5.0', '5.0', 'must be a negative number'),
    (CARTESIAN, 'max_rot_vel', 'max_rot_speed', "no 'max_rot_speed'"),
    (OMPL, 'arm:\n  planner_configs:', 'arm:\n  planner_configs: [TRRT]\n  x:', "'TRRT'"),
    (OMPL, 'config: RRTstarkConfigDefault', 'config: RRT', "names 'RRT', which .*; it has RRTs"),
    (PILZ, 'config: PTP', 'config: SPLINE', 'must be PTP, LIN or CIRC'),
    (CONTROLLERS, 'default: true', 'default: maybe', 'true or false'),
    (CONTROLLERS, 'margin: 0.5', 'margin: -2', '0 or more'),
]


@pytest.mark.parametrize(('file', 'before', 'after', 'words'), BROKEN)
def test_a_broken_file_is_refused_with_its_place(
    tmp_path: Path, file: str, before: str, after: str, words: str
) -> None:
    """File, line, key and what it must be."""
    folder = mg.moveit_package('panda', tmp_path)
    path = folder / 'config' / file
    text = path.read_text()
    line = text[: text.index(before)].count('\n') + before.count('\n') + 1
    path.write_text(text.replace(before, after, 1))
    with pytest.raises(ConfigError, match=words) as refused:
        settings_of(folder)
    found = re.match(r'(.*):(\d+): ', str(refused.value))
    assert found is not None, refused.value
    assert Path(found[1]) == path
    # a text without its end ends where the file does
    assert int(found[2]) == line or words == 'no YAML', refused.value


@pytest.mark.parametrize(
    ('remove', 'words'),
    [
        ('config/panda.srdf', r'\.setup_assistant: srdf: no file .*panda.srdf'),
        ('.', 'no folder'),
        ('config/initial_positions.yaml', r'panda\.urdf\.xacro: .*initial_positions'),
    ],
)
def test_what_is_missing_is_named(tmp_path: Path, remove: str, words: str) -> None:
    """The file that names it too."""
    folder = mg.moveit_package('panda', tmp_path)
    path = folder / remove
    path.rename(tmp_path / 'elsewhere')
    with pytest.raises(ConfigError, match=words):
        settings_of(folder)


@pytest.fixture(name='running_panda', scope='module')
def start_panda(tmp_path_factory: pytest.TempPathFactory) -> Iterator[mg.MoveGroupRig]:
    """Start move_group with the Panda's package."""
    folder = mg.moveit_package('panda', tmp_path_factory.mktemp('package'))
    positions = dict(zip([*mg.JOINTS, 'panda_finger_joint1'], [*mg.READY, 0.0], strict=True))
    with (
        reserve() as isolation,
        mg.MoveGroupRig(isolation, '--moveit-config', str(folder), positions=positions) as rig,
    ):
        yield rig


@pytest.fixture(name='panda')
def reset_panda(running_panda: mg.MoveGroupRig) -> Iterator[mg.MoveGroupRig]:
    """Return it with the robot at ready and an empty scene; end what the test has begun."""
    running_panda.reset()
    node = running_panda.client.node
    timers = list(node.timers)
    yield running_panda
    goals = [each for each in running_panda.held if each.is_active]
    for goal in goals:
        goal.execute()
    running_panda.client.spin_until(
        lambda: not any(each.is_active for each in goals), 60.0, 'end of goals'
    )
    for timer in set(node.timers).difference(timers):
        node.destroy_timer(timer)
    for server in [each for each in node.waitables if isinstance(each, ActionServer)]:
        server.destroy()  # type: ignore[no-untyped-call]


def duration(response: Any) -> float:
    """Return how long a plan takes in [s]."""
    assert response.error_code.val == MoveItErrorCodes.SUCCESS, response.error_code
    return seconds(response.trajectory.joint_trajectory.points[-1].time_from_start)


def test_planners_of_the_package_plan(panda: mg.MoveGroupRig) -> None:
    """By all names that clients have for them; those that are not here have another search."""
    goal = mg.joint_goal(MOVED)
    for name in ('', 'panda_arm', 'RRTConnectkConfigDefault', 'panda_arm[TRRTkConfigDefault]'):
        assert duration(panda.plan(mg.motion_request(goal, planner_id=name)))
    code = panda.plan(mg.motion_request(goal, planner_id='Dijkstra')).error_code
    assert code.val != MoveItErrorCodes.SUCCESS
    assert re.search("'Dijkstra'; choose one of RRT.*, TRRTkConfigDefault, PTP", code.message)
    # RViz takes the names of a group out of the brackets
    asked: Any = srv.QueryPlannerInterfaces.Request()
    listed = panda.client.call(srv.QueryPlannerInterfaces, '/query_planner_interface', asked)
    names = listed.planner_interfaces[0].planner_ids
    assert names[:2] == ['panda_arm', 'panda_arm[RRTConnectkConfigDefault]']
    assert 'panda_arm[RRTstarkConfigDefault]' in names
    asked = srv.GetPlannerParams.Request(planner_config='RRTstarkConfigDefault', group='panda_arm')
    params = panda.client.call(srv.GetPlannerParams, '/get_planner_params', asked).params
    assert dict(zip(params.keys, params.values, strict=True)) == {
        'type': 'geometric::RRTstar', 'range': '0.0', 'goal_bias': '0.05',
        'delay_collision_checking': '1',
    }  # fmt: skip


def test_the_packages_factors_count_where_a_request_has_none(panda: mg.MoveGroupRig) -> None:
    """A tenth of velocity and acceleration, as beginners get it."""
    request = mg.motion_request(mg.joint_goal(MOVED))
    lasts = []
    for factor in (0.0, 0.1, 1.0):
        request.max_velocity_scaling_factor = request.max_acceleration_scaling_factor = factor
        lasts.append(duration(panda.plan(request)))
    beginners, tenth, whole = lasts
    assert beginners == pytest.approx(tenth, rel=1e-6)
    assert beginners > 2.0 * whole


def test_cartesian_limits_of_the_package_bound_a_line(panda: mg.MoveGroupRig) -> None:
    """0.5 m/s; the world of the SRDF is the frame of the goal."""
    pose = panda.fk()
    pose.position.z -= 0.2
    request = mg.motion_request(
        mg.pose_goal(pose, 'panda_link8', 'world'),
        pipeline_id='pilz_industrial_motion_planner',
        planner_id='LIN',
        max_velocity_scaling_factor=0.2,
        max_acceleration_scaling_factor=1.0,
    )
    # 0.2 m at 0.2 * 0.5 m/s, and some time to accelerate; 1 m/s would take less than 1.5 s
    assert 2.0 < duration(panda.plan(request)) < 2.6


def test_the_gripper_of_the_package_is_moved(panda: mg.MoveGroupRig) -> None:
    """A GripperCommand with the joint that follows the other one in its list."""
    panda.serve_gripper('panda_hand_controller', 'panda_finger_joint1')
    # MoveGroupInterface names joints that follow others, too
    for place, joints in ((0.03, FINGERS[:1]), (0.01, FINGERS)):
        goal = mg.joint_goal([place] * len(joints), joints)
        _status, result = panda.move(mg.action_goal(mg.motion_request(goal, 'hand')))
        assert result.error_code.val == MoveItErrorCodes.SUCCESS, result.error_code
        assert panda.followed[-1].command.position == pytest.approx(place)
        panda.settle()
    trajectory = result.planned_trajectory.joint_trajectory
    trajectory.joint_names = FINGERS
    back = [[*point.positions] * 2 for point in reversed(trajectory.points)]
    for point, positions in zip(trajectory.points, back, strict=True):
        point.positions, point.velocities, point.accelerations = positions, [], []
    execute = ExecuteTrajectory.Goal(trajectory=result.planned_trajectory)
    panda.followed.clear()
    _status, result = panda.run(ExecuteTrajectory, 'execute_trajectory', execute)
    assert result.error_code.val == MoveItErrorCodes.SUCCESS, result.error_code
    assert panda.followed[-1].command.position == pytest.approx(0.03)
    apart = mg.joint_goal([0.01, 0.03], FINGERS)
    _status, result = panda.move(mg.action_goal(mg.motion_request(apart, 'hand')))
    assert result.error_code.val == MoveItErrorCodes.INVALID_GOAL_CONSTRAINTS
    assert 'panda_finger_joint1 contradict' in result.error_code.message


def held(rig: mg.MoveGroupRig, goal: Any, group: str) -> tuple[Any, float]:
    """Have a controller begin with a goal; return its result to come, and how long it may last.

    The controller keeps it until the test has it go on.
    """
    rig.held.clear()
    request = mg.motion_request(goal, group, max_velocity_scaling_factor=1.0)
    request.max_acceleration_scaling_factor = 1.0
    allowed = 1.2 * duration(rig.plan(request)) + 0.5  # moveit_controllers.yaml
    handle = rig.send(MoveGroup, '/move_action', mg.action_goal(request))
    result = handle.get_result_async()
    rig.client.spin_until(lambda: bool(rig.held) or result.done(), 60.0, 'goal of a controller')
    assert not result.done(), result.result().result.error_code
    return result, allowed


def outcome(rig: mg.MoveGroupRig, result: Any) -> int:
    """Let the controller that holds end; return the code of the result."""
    rig.held[0].execute()
    rig.client.spin_until(result.done, 60.0, 'result')
    return int(result.result().result.error_code.val)


def test_a_gripper_takes_the_time_that_it_needs(panda: mg.MoveGroupRig) -> None:
    """It closes until it stalls, and a cancel would end its grip."""
    panda.serve_gripper('panda_hand_controller', 'panda_finger_joint1', holds=True)
    result, allowed = held(panda, mg.joint_goal([0.02], ['panda_finger_joint1']), 'hand')
    panda.client.spin_for(allowed + 1.0)
    assert not panda.held[0].is_cancel_requested
    assert outcome(panda, result) == MoveItErrorCodes.SUCCESS


def test_the_state_of_a_controller_says_how_long_it_may_take(panda: mg.MoveGroupRig) -> None:
    """Paused, or held up and going on, it is waited for; at full speed it is too slow.

    So is one that leaves the factor at 0, as many releases of joint_trajectory_controller do.
    """
    panda.serve_arm('panda_arm_controller', holds=True)
    topic = '/panda_arm_controller/controller_state'
    node, slow = panda.client.node, MoveItErrorCodes.TIMED_OUT
    states = node.create_publisher(JointTrajectoryControllerState, topic, 10)
    state, step = JointTrajectoryControllerState(speed_scaling_factor=0.0), 0.0
    state.reference.positions = [0.0]

    def publish() -> None:
        state.reference.positions[0] += step
        states.publish(state)

    node.create_timer(0.02, publish)
    panda.client.spin_until(lambda: states.get_subscription_count() > 0, 60.0, 'subscription')

    def begun() -> tuple[Any, float]:
        return held(panda, mg.joint_goal([0.1], mg.JOINTS[:1]), 'panda_arm')

    def is_canceled() -> bool:
        return bool(panda.held[0].is_cancel_requested)

    result, _ = begun()
    panda.client.spin_until(is_canceled, 60.0, 'cancel where the factor was never filled')
    assert outcome(panda, result) == slow
    result, allowed = begun()
    step = 1e-4  # a busy computer held it up, and it goes on
    panda.client.spin_for(allowed + 1.0)
    assert not is_canceled()
    assert outcome(panda, result) == MoveItErrorCodes.SUCCESS
    step, state.speed_scaling_factor = 0.0, 1.0
    panda.client.spin_for(0.5)
    state.speed_scaling_factor = 0.0
    panda.reset()
    result, allowed = begun()
    panda.client.spin_for(allowed + 1.0)
    assert not is_canceled(), 'paused'
    state.speed_scaling_factor = 1.0
    panda.client.spin_until(is_canceled, 60.0, 'cancel at full speed')
    assert outcome(panda, result) == slow


def test_a_search_ends_with_its_goal_and_holds_up_no_other_group(panda: mg.MoveGroupRig) -> None:
    """A goal behind a wall, for which a minute is allowed."""
    wall = box('wall', 0.0, 0.0, 0.0)
    sizes = [1.1, 0.02, 1.0], [1.1, 0.02, 1.0], [2.5, 2.5, 0.02]
    wall.primitives = [SolidPrimitive(type=SolidPrimitive.BOX, dimensions=each) for each in sizes]
    places = (0.69, 0.0, 0.5), (-0.7, 0.0, 0.5), (0.0, 0.0, 0.8)
    wall.primitive_poses = [pose_at(*each) for each in places]
    panda.positions[mg.JOINTS[0]] = 1.2
    panda.settle()
    panda.add(wall)
    request = mg.motion_request(mg.joint_goal([-1.2, *mg.READY[1:]]))
    request.allowed_planning_time = 60.0
    handle = panda.send(MoveGroup, '/move_action', mg.action_goal(request, plan_only=True))
    result = handle.get_result_async()
    hand = mg.motion_request(mg.joint_goal([0.02], ['panda_finger_joint1']), 'hand')
    asked = srv.GetMotionPlan.Request(motion_plan_request=hand)
    plan = panda.client.call_async(srv.GetMotionPlan, '/plan_kinematic_path', asked)
    panda.client.spin_until(plan.done, 20.0, 'plan of the hand')
    assert plan.result().motion_plan_response.error_code.val == MoveItErrorCodes.SUCCESS
    assert not result.done(), result.result().result.error_code
    handle.cancel_goal_async()
    panda.client.spin_until(result.done, 20.0, 'result')
    assert result.result().status == GoalStatus.STATUS_CANCELED
    assert result.result().result.error_code.val == MoveItErrorCodes.PREEMPTED


def test_the_log_has_what_is_without_effect_once(panda: mg.MoveGroupRig) -> None:
    """And nothing that has one."""
    (line,) = (line for line in panda.process.lines if 'without effect' in line)
    names = re.sub(r'.*here: ', '', line).split(', ')
    assert names.count('ompl.planner_configs.*.goal_bias') == 1
    assert {'sensors', 'robot_description_kinematics.panda_arm.kinematics_solver'} < {*names}
    assert any(name.endswith('longest_valid_segment_fraction') for name in names)
    assert not any('cartesian' in name or 'kinect_pointcloud' in name for name in names)


CONTROLLER, JOINT = '  panda_arm_contoller: {type: x}\n', '  panda_joint8: {max_velocity: 1.0}\n'
GROUP = 'panda_amr: {kinematics_solver_timeout: 0.1}\n'
PROJECTION = 'panda_amr: {projection_evaluator: joints(a)}\n'
NO = 'without effect, there is no'


@pytest.mark.parametrize(
    ('name', 'old', 'new', 'words'),
    [
        ('moveit_controllers', 'joints:', 'jionts:', "jionts: .*did you mean 'joints'"),
        ('moveit_controllers', 'start_tolerance:', 'start_tolerence:', "mean 'allowed_start_tol"),
        ('kinematics', 'solver_timeout:', 'solver_timout:', "mean 'kinematics_solver_timeout'"),
        ('ompl_planning', 'default_planner_', 'default_planer_', "mean 'default_planner_config'"),
        ('moveit_controllers', f'{MANAGER}:\n', CONTROLLER, f'{NO} controller '),
        ('joint_limits', 'joint_limits:\n', JOINT, f'{NO} movable joint '),
        ('kinematics', '', GROUP, f'{NO} group '),
        ('ompl_planning', '', PROJECTION, f'{NO} group '),
    ],
)  # fmt: skip
def test_keys_without_effect_are_named(
    tmp_path: Path, name: str, old: str, new: str, words: str
) -> None:
    """With file and line; of tables of what the robot lacks with what there is."""
    folder = mg.moveit_package('panda', tmp_path)
    robot = ['panda_arm', 'hand'], [*mg.JOINTS, *FINGERS], MOVERS
    path = folder / 'config' / f'{name}.yaml'

    def found(*others: str) -> list[str]:
        package = read_package(folder)
        keys = [*package.parameters, *others]
        return [*misspelt(keys, package.places), *of_nothing(keys, package.places, *robot)]

    assert not found('robot_description_kinematics.panda_arm.bio_ik.threads')
    new = new if old[-1:] in {':', '_'} else old + new
    path.write_text(path.read_text().replace(old, new, 1))
    (line,) = found()
    assert re.search(rf'{name}\.yaml:\d+: .*{words}', line), line


def test_the_prbts_package_starts(isolation: Isolation, tmp_path: Path) -> None:
    """With the least that an assistant wrote; limits of the description count."""
    joints = [f'prbt_joint_{number}' for number in range(1, 7)]
    folder = mg.moveit_package('prbt', tmp_path)
    with (folder / 'config' / 'kinematics.yaml').open('a') as file:
        file.write('\nmanipulatr:\n  kinematics_solver_timeout: 0.1\n')
    at = dict.fromkeys(joints, 0.0)
    with mg.MoveGroupRig(isolation, '--moveit-config', str(folder), positions=at) as rig:
        goal = mg.joint_goal([0.5] * 6, joints)
        request = mg.motion_request(goal, 'manipulator', planner_id='SBLkConfigDefault')
        assert duration(rig.plan(request)) > 0.3
        assert any("no group 'manipulatr'" in line for line in rig.process.lines)


def test_parameters_of_moveits_launch_files_do_the_same(
    isolation: Isolation, tmp_path: Path
) -> None:
    """The same names, flattened, without --moveit-config; execution can be forbidden."""
    values = dict(read_package(mg.moveit_package('panda', tmp_path)).parameters)
    for name in [each for each in values if each.startswith('kinect') or each == 'sensors']:
        del values[name]
    values |= {'publish_planning_scene': True, 'capabilities': '', 'monitor_dynamics': False}
    values['allow_trajectory_execution'] = False
    path = tmp_path / 'launch_params.json'
    path.write_text(json.dumps({'/**': {'ros__parameters': values}}))
    with mg.MoveGroupRig(isolation, '--ros-args', '--params-file', str(path)) as rig:
        request = mg.motion_request(mg.joint_goal(MOVED), planner_id='TRRTkConfigDefault')
        slow = duration(rig.plan(request))
        request.max_velocity_scaling_factor = request.max_acceleration_scaling_factor = 1.0
        assert slow > 2.0 * duration(rig.plan(request))
        rig.serve_arm('panda_arm_controller')
        _status, result = rig.move(mg.action_goal(request))
        assert result.error_code.val == MoveItErrorCodes.CONTROL_FAILED
        assert 'allow_trajectory_execution' in result.error_code.message
        assert not rig.followed


def refusal(package: MoveItPackage | None, *arguments: str) -> str:
    """Return why the node does not start."""
    rclpy.init(args=list(arguments))
    try:
        with pytest.raises(ArmError) as refused:
            move_group.MoveGroup(package)
    finally:
        rclpy.shutdown()
    return str(refused.value)


def test_what_does_not_fit_the_robot_is_refused(isolation: Isolation, tmp_path: Path) -> None:
    """With file and line, by the program itself."""
    folder = mg.moveit_package('panda', tmp_path)
    path = folder / 'config' / CONTROLLERS
    path.write_text(path.read_text().replace('- panda_joint7', '- panda_joint8', 1))
    text = refusal(read_package(folder))
    assert re.search(rf"{CONTROLLERS}:\d+: .*names 'panda_joint8'", text), text
    path = folder / 'config' / LIMITS
    path.write_text(path.read_text().replace('max_velocity: 2.175', 'max_velocity: 21.75', 1))
    command = [executable('arm_planning', 'move_group'), '--moveit-config', str(folder)]
    with RunningProcess(command, isolation.env) as process:
        assert process.wait(60.0) == 1, process.output
        process.wait_for(rf'{LIMITS}:\d+: .*panda_joint1.*21.75 is wider')
    limits = tmp_path / 'limits.yaml'  # of the parameter joint_limits
    limits.write_text('joint_limits: {elbow: {}}')
    path = mg.panda_parameters(tmp_path, joint_limits=limits)
    text = refusal(None, '--ros-args', '--params-file', str(path))
    words = rf'joint panda_joint1 is missing .*\(joint_limits: {re.escape(str(limits))}\)'
    assert re.search(words, text), text
