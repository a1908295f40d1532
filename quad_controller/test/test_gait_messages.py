# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Messages, and the pace of the loop's thread, without a graph."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
import itertools
import math
import queue
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus
from geometry_msgs.msg import Pose
from hypothesis import given, settings
from hypothesis import strategies as st
import pytest
from rclpy.serialization import serialize_message
from sensor_msgs.msg import Imu, JointState

from message_templates import FastReader
from quad_controller import Controller, GaitParameters, Output, StateParameters
from quad_controller.nodes.control_loop import ControlLoop, loop_figures, Pacer, WINDOW
from quad_controller.nodes.messages import (
    body_pose,
    CommandFilter,
    IMU_NUMBERS,
    imu_sample,
    JointReader,
    state_diagnostic,
)
from quad_controller.policy.observation import gravity
from quad_controller.policy.options import GravitySource
from quad_description import ImuSample, JointSample, Targets
from quad_description.rotations import conjugate, from_rpy, rotate
from quad_gait_rig import ARM_ROBOT, FOLDED, PERIOD, Rig, ROBOT, tilted, UPRIGHT

TEST_TIMEOUT = 10.0  # [s]
angles = st.floats(-1.2, 1.2)


def joints(reader: JointReader, message: JointState, sent: Targets) -> JointSample:
    """Read a message as it comes from a raw subscription."""
    known, numbers = FastReader(JointState, 'position', 'velocity').read(
        serialize_message(message)
    )
    return reader.read(known, numbers, sent)


def sample(message: Imu) -> ImuSample:
    """Read a message as it comes from a raw subscription."""
    read = FastReader(Imu, *IMU_NUMBERS).read(serialize_message(message))
    return imu_sample(*read, ROBOT.rotation_of)


@given(st.permutations(range(14)))
def test_joints_are_found_by_name(order: list[int]) -> None:
    """Whatever the order of a message, and whatever else is in it, values go to their names."""
    known = [*ROBOT.names, 'hand', 'tail']
    message = JointState(
        name=[known[index] for index in order],
        position=[index * 0.1 for index in order],
        velocity=[index * 1.0 for index in order],
    )
    sample = joints(JointReader(ROBOT), message, FOLDED)
    assert sample.positions == pytest.approx([index * 0.1 for index in range(12)])
    assert sample.velocities == pytest.approx([float(index) for index in range(12)])


def test_odd_joint_states_are_refused_and_the_next_good_one_is_taken() -> None:
    """A missing joint and a wrong length are named; missing velocities are no zeros."""
    reader = JointReader(ROBOT)
    with pytest.raises(ValueError, match='without fl_hip_joint'):
        joints(reader, JointState(name=list(ROBOT.names[1:]), position=[0.0] * 11), FOLDED)
    with pytest.raises(ValueError, match='11 positions for 12 names'):
        joints(reader, JointState(name=list(ROBOT.names), position=[0.0] * 11), FOLDED)
    sample = joints(reader, JointState(name=list(ROBOT.names), position=[0.5] * 12), FOLDED)
    assert sample == JointSample((0.5,) * 12, None)


def test_a_joint_of_the_arm_that_is_never_reported_is_where_it_is_sent() -> None:
    """Protocol v1 does not report one; once it was reported, it may not get lost."""
    reader, sent = JointReader(ARM_ROBOT), (*FOLDED, 0.4)
    legs = JointState(name=list(ROBOT.names), position=[0.5] * 12, velocity=[1.0] * 12)
    assert joints(reader, legs, sent) == JointSample((*[0.5] * 12, 0.4), (*[1.0] * 12, 0.0))
    assert reader.unreported == ('arm_yaw_joint',)
    names = list(ARM_ROBOT.names)
    whole = JointState(name=names, position=[0.5] * 13, velocity=[1.0] * 13)
    assert joints(reader, whole, sent) == JointSample((0.5,) * 13, (1.0,) * 13)
    assert not reader.unreported
    with pytest.raises(ValueError, match='without arm_yaw_joint'):
        joints(reader, legs, sent)


def test_a_joint_that_nobody_measures_is_left_alone_until_it_is_to_move() -> None:
    """Nobody knows how far it would jump."""
    targets, names = (*FOLDED, 0.4), ('arm_yaw_joint',)
    still = CommandFilter(ARM_ROBOT, others_move=False)
    assert still.select(targets, 'walk', names) == FOLDED
    assert still.select(targets, 'walk', ()) == targets
    posed = CommandFilter(ARM_ROBOT, others_move=True)
    assert posed.select(targets, 'to lie', names) == FOLDED
    assert posed.select(targets, 'to stand', names) == targets
    assert posed.select(targets, 'lie', names) == targets


def imu(attitude: float = 0.0, rate: float = 0.0, force: float = 0.0) -> Imu:
    """Return the message of a level IMU; -1 says that a quantity is not measured."""
    message = Imu()
    message.orientation.w, message.angular_velocity.x = 1.0, 0.2
    message.linear_acceleration.z = 9.8
    message.orientation_covariance[0] = attitude
    message.angular_velocity_covariance[0] = rate
    message.linear_acceleration_covariance[0] = force
    return message


def test_what_an_imu_does_not_measure_is_not_taken_for_zero() -> None:
    """REP 145: a first covariance of -1 says that there is no such measurement."""
    assert sample(imu()) == ImuSample((0.0, 0.0, 0.0, 1.0), (0.2, 0.0, 0.0), (0.0, 0.0, 9.8))
    with pytest.raises(ValueError, match='has no orientation'):
        sample(imu(attitude=-1.0))
    assert sample(imu(rate=-1.0)).angular_velocity is None
    assert gravity(sample(imu(force=-1.0)), GravitySource.ACCEL) == (0.0, 0.0, -1.0)


def test_an_imu_is_read_in_the_frame_that_its_header_names() -> None:
    """Upside down and turned, of a level body: attitude, rate and force are those of the body."""
    mounted, message = from_rpy(math.pi, 0.0, 2.0), imu()
    message.header.frame_id = 'imu_link'
    for field, value in zip('xyzw', mounted, strict=True):
        setattr(message.orientation, field, value)
    for vector in (message.angular_velocity, message.linear_acceleration):
        turned = rotate(conjugate(mounted), (vector.x, vector.y, vector.z))
        vector.x, vector.y, vector.z = turned
    read = FastReader(Imu, *IMU_NUMBERS).read(serialize_message(message))
    found = imu_sample(*read, {'imu_link': mounted}.__getitem__)
    assert found.orientation == pytest.approx((0.0, 0.0, 0.0, 1.0))
    assert found.angular_velocity == pytest.approx((0.2, 0.0, 0.0))
    assert found.acceleration == pytest.approx((0.0, 0.0, 9.8))


@pytest.mark.parametrize(
    ('index', 'variance', 'uncertain'),
    [(0, 1.0, True), (4, math.inf, True), (0, 1e-4, False), (8, 1e6, False), (8, math.inf, False),
     (0, math.nan, None), (4, -0.5, None), (8, math.nan, None)],
)  # fmt: skip
def test_roll_and_pitch_make_an_attitude_uncertain(
    index: int, variance: float, uncertain: bool | None
) -> None:
    """Each alone; a heading need not be known. What is no variance is refused by its name."""
    message = imu()
    message.orientation_covariance[index] = variance
    if uncertain is not None:
        assert sample(message).is_uncertain is uncertain
        return
    with pytest.raises(ValueError, match=rf'orientation_covariance\[{index}\] .*{variance}'):
        sample(message)


@given(angles, angles, angles, st.floats(0.1, 3.0))
def test_body_pose_is_read_from_a_quaternion(
    roll: float, pitch: float, yaw: float, length: float
) -> None:
    """Also of one that is not quite a quaternion; one that nobody filled in is upright."""
    message = Pose()
    message.position.z = 0.01
    turn = message.orientation
    turn.x, turn.y, turn.z, turn.w = (length * part for part in from_rpy(roll, pitch, yaw))
    assert body_pose(message) == pytest.approx((0.0, 0.0, 0.01, roll, pitch, yaw), abs=1e-9)
    turn.x = turn.y = turn.z = turn.w = 0.0
    assert body_pose(message) == (0.0, 0.0, 0.01, 0.0, 0.0, 0.0)


def test_diagnostics_say_what_is_wrong() -> None:
    """Waiting is STALE, standing OK, a fault ERROR with its reason."""
    rig = Rig()
    rig.joints = False
    rig.step()
    assert state_diagnostic('node', rig.controller.status).level == DiagnosticStatus.STALE
    rig.joints = True
    rig.step()
    rig.ask('stand')
    rig.run(0.5)
    status = state_diagnostic('node', rig.controller.status)
    assert (status.level, status.message) == (DiagnosticStatus.OK, 'to stand')
    rig.run(2.0)
    rig.imu = tilted(1.5)
    rig.run(0.5)
    status = state_diagnostic('node', rig.controller.status)
    assert status.level == DiagnosticStatus.ERROR
    assert 'tilted by 86 deg' in status.message


@contextmanager
def running(publish: Any, fail: Any = None) -> Iterator[ControlLoop]:
    """Run a loop with a controller of its own."""
    controller = Controller(ROBOT, GaitParameters(), StateParameters())
    loop = ControlLoop(controller, 0.02, publish, fail or (lambda error: None))
    loop.start()
    try:
        yield loop
    finally:
        loop.stop()


def test_feedback_makes_steps_and_is_used_once() -> None:
    """An output follows the joint states, and the figures know of their latency."""
    outputs: queue.Queue[Output] = queue.Queue()
    with running(outputs.put) as loop:
        assert outputs.get(timeout=TEST_TIMEOUT).targets is None
        loop.offer(joints=JointSample(FOLDED, (0.0,) * 12))
        loop.offer(imu=UPRIGHT)
        output = outputs.get(timeout=TEST_TIMEOUT)
        while output.targets is None:
            output = outputs.get(timeout=TEST_TIMEOUT)
        assert output.targets == FOLDED
        outputs.get(timeout=TEST_TIMEOUT)
        figures = loop.figures()
    assert figures['feedback_to_command_p50'] > 0.0
    assert figures['steps'] >= 2


def test_a_defect_is_reported_and_ends_the_loop() -> None:
    """What goes wrong in the thread reaches the node, and stopping afterwards does not hang."""
    failures: queue.Queue[Exception] = queue.Queue()

    def broken(_output: Output) -> None:
        raise RuntimeError('no DDS')

    with running(broken, failures.put):
        assert 'no DDS' in str(failures.get(timeout=TEST_TIMEOUT))


def simulate(arrivals: list[float], duration: float) -> list[tuple[float, float | None]]:
    """Return the times of steps, each with the arrival that it used."""
    pacer = Pacer(PERIOD, 0.0)
    now, steps, waiting = 0.0, [], None
    queue = list(arrivals)
    while now < duration:
        deadline = pacer.deadline(waiting is not None)
        if queue and queue[0] < deadline:
            now = max(now, queue.pop(0))
            waiting = now
            if not pacer.takes(now):
                continue
        else:
            now = max(now, deadline)
        steps.append((now, waiting))
        pacer.stepped(now, waiting)
        waiting = None
    return steps


@pytest.mark.slow
@settings(max_examples=30)
@given(
    offset=st.floats(0.0, 0.019),
    jitter=st.lists(st.floats(0.0, 0.0012), min_size=200, max_size=220),
)
def test_with_feedback_steps_follow_arrivals(offset: float, jitter: list[float]) -> None:
    """After a second of getting in step, every arrival is used at once."""
    arrivals = [offset + index * PERIOD + late for index, late in enumerate(jitter)]
    steps = simulate(arrivals, arrivals[-1])
    late = [time - used for time, used in steps[80:-1] if used is not None]
    assert len(late) >= len(steps) - 83
    assert max(late) < 1e-9


@given(st.floats(0.005, 0.05))
def test_the_rate_stays_whatever_the_feedback_does(between: float) -> None:
    """Feedback at 20 to 200 Hz changes the rate by no more than its pull allows; none, not."""
    plain = [time for time, _ in simulate([], 1.0)]
    assert plain == pytest.approx([index * PERIOD for index in range(len(plain))])
    arrivals = [index * between for index in range(int(10 / between))]
    steps = simulate(arrivals, 10.0)
    assert len(steps) == pytest.approx(500, rel=0.06)
    times = [time for time, _ in steps]
    least = min(b - a for a, b in itertools.pairwise(times))
    assert least > (1 - 2 * WINDOW) * PERIOD - 1e-9


def test_a_late_step_is_not_made_up_for() -> None:
    """After a pause the schedule goes on without a burst, and the pause is counted."""
    pacer = Pacer(PERIOD, 0.0)
    pacer.stepped(0.0, None)
    pacer.stepped(0.105, None)
    assert pacer.overruns == 4
    assert 0.105 < pacer.deadline(fresh=False) <= 0.125


def test_jitter_is_the_distance_of_intervals_from_the_period() -> None:
    """A short interval counts as a long one does."""
    steps = [(interval, 0.0002, 0.001) for interval in (0.02, 0.021, 0.018)]
    expected = {'rate': 3 / 0.059, 'jitter_p50': 0.001, 'jitter_max': 0.002}
    figures = loop_figures(steps, PERIOD)
    assert {name: figures[name] for name in expected} == pytest.approx(expected)
