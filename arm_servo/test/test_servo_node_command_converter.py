# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Units, caps and frames: how the numbers of a message become the speed of the tool."""

from __future__ import annotations

from collections.abc import Sequence

from control_msgs.msg import JointJog
import core_commands
from geometry_msgs.msg import PoseStamped, TwistStamped
from model_robots import ready, robot
import numpy as np
import pytest

from arm_model import Array, CommandError, Pose
from arm_servo import JogRequest, MotionCore, PoseCommand, ServoSettings
from arm_servo.ros.servo.command_converter import CommandConverter
from arm_servo.ros.servo.parameters import Scales, ServoParameters, Units

PERIOD = 0.01
SPEED = Scales(Units.SPEED, 0.2, 0.5, 0.5, 1.0)
UNITLESS = Scales(Units.UNITLESS, 0.2, 0.5, 0.4, 1.0)


class Frames:
    """Links of the arm, and one frame of TF beside it, turned by a quarter about z."""

    def link(self, frame: str) -> str | None:
        """Return a frame that is a link."""
        return frame if frame in robot('gp110').frames else None

    def pose(self, frame: str) -> Pose:
        """Return the pose of the table; any other frame is unknown."""
        if frame != 'table':
            raise CommandError(f'no frame {frame!r}')
        return Pose(np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1.0]]), np.array([0.5, 0.0, 0.0]))


def converter(scales: Scales, *, about_tip: bool = True) -> CommandConverter:
    """Return what makes commands."""
    parameters = ServoParameters(0.1, about_tip, '', '', '', '', '', 25.0, 0.005, ServoSettings())
    return CommandConverter(robot('gp110'), Frames(), parameters, scales)


def twist(numbers: Sequence[float], frame: str = '') -> TwistStamped:
    """Return a twist."""
    message = TwistStamped()
    message.header.frame_id = frame
    linear, angular = message.twist.linear, message.twist.angular
    linear.x, linear.y, linear.z, angular.x, angular.y, angular.z = map(float, numbers)
    return message


def tool_twist(made: CommandConverter, message: TwistStamped) -> tuple[Array, Array]:
    """Carry a command out for a while; return the twist reached in the base, and the positions."""
    core = MotionCore(robot('gp110'))
    core.reset(ready('gp110'))
    for number in range(60):
        now = number * PERIOD
        core_commands.command(core, made.twist(message, now), now)
        core.step(number * PERIOD, PERIOD)
    state = core.state
    return core.model.jacobian(state.position) @ state.velocity, state.position


def test_unitless_numbers_are_shares_of_the_scales() -> None:
    """Half of 0.2 m/s is 0.1 m/s, within a hundredth."""
    reached, _ = tool_twist(converter(UNITLESS), twist([0, 0, 0.5, 0, 0, 0]))
    assert reached == pytest.approx([0, 0, 0.1, 0, 0, 0], abs=1e-3)


def test_speeds_are_taken_as_they_are_up_to_the_cap() -> None:
    """The direction is kept, and what was cut off is reported."""
    made = converter(SPEED)
    reached, _ = tool_twist(made, twist([0, 0.05, 0.05, 0, 0, 0]))
    assert reached == pytest.approx([0, 0.05, 0.05, 0, 0, 0], abs=1e-3)
    assert made.capped == ''
    reached, _ = tool_twist(made, twist([0, 0.3, 0.4, 0, 0, 0]))
    assert reached == pytest.approx([0, 0.12, 0.16, 0, 0, 0], abs=2e-3)
    assert '0.40x' in made.capped


def test_a_twist_in_a_frame_of_tf_is_turned() -> None:
    """X of the table is y of the base; it turns nothing."""
    reached, _ = tool_twist(converter(SPEED), twist([0.1, 0, 0, 0, 0, 0], 'table'))
    assert reached == pytest.approx([0, 0.1, 0, 0, 0, 0], abs=1e-3)


def test_a_twist_may_turn_about_the_origin_of_its_frame() -> None:
    """The tip then moves on a circle about the table, else it only turns."""
    message = twist([0, 0, 0, 0, 0, 0.1], 'table')
    turned, _ = tool_twist(converter(SPEED), message)
    assert turned == pytest.approx([0, 0, 0, 0, 0, 0.1], abs=1e-3)
    carried, at = tool_twist(converter(SPEED, about_tip=False), message)
    arm = robot('gp110').pose(at).position - Frames().pose('table').position
    wanted = [*np.cross([0, 0, 0.1], arm), 0, 0, 0.1]
    assert carried == pytest.approx(wanted, abs=3e-3)


def test_a_joint_jog_is_cut_and_scaled() -> None:
    """Twice full speed is full speed, which the scale says."""
    made = converter(UNITLESS)
    core = MotionCore(robot('gp110'))
    core.reset(ready('gp110'))
    name = core.model.joints[0]
    for number in range(60):
        request = made.jog(JointJog(joint_names=[name], velocities=[2.0]), number * PERIOD)
        assert isinstance(request, JogRequest)
        core_commands.command(core, request)
        core.step(number * PERIOD, PERIOD)
    assert core.state.velocity[0] == pytest.approx(0.4, abs=1e-3)
    assert 'cut' in made.capped


@pytest.mark.parametrize(
    ('message', 'words'),
    [
        (JointJog(joint_names=['a', 'a'], velocities=[1.0, 1.0]), 'twice'),
        (JointJog(joint_names=['a']), 'either'),
        (JointJog(joint_names=['a'], velocities=[1.0], displacements=[1.0]), 'either'),
        (JointJog(joint_names=['a'], velocities=[1.0], duration=-1.0), 'duration'),
        (JointJog(joint_names=['a'], velocities=[1.0], duration=float('nan')), 'duration'),
    ],
)
def test_a_joint_jog_that_makes_no_sense_is_refused(message: JointJog, words: str) -> None:
    """Before it reaches the core."""
    with pytest.raises(CommandError, match=words):
        converter(UNITLESS).jog(message, 0.0)


def test_a_command_expires_a_time_out_after_it_was_sent() -> None:
    """Not after it arrived: what is old already has less time; a duration counts likewise."""
    made = converter(UNITLESS)
    assert made.twist(twist([0, 0, 0.5, 0, 0, 0]), 20.0).expires == pytest.approx(20.1)
    jog = made.jog(JointJog(joint_names=['joint_1_s'], velocities=[1.0], duration=2.0), 20.0)
    assert isinstance(jog, JogRequest)
    assert jog.expires == pytest.approx(22.0)


def test_a_pose_is_approached_at_the_speeds_of_the_scales() -> None:
    """As they are now, times the override."""
    made = converter(Scales(Units.SPEED, 0.2, 0.5, 0.5, 0.5))
    message = PoseStamped()
    message.pose.orientation.w = 1.0
    command = made.pose(message, 0.0).command
    assert isinstance(command, PoseCommand)
    assert (command.linear_speed, command.angular_speed) == pytest.approx((0.1, 0.25))
    made.scales = Scales(Units.SPEED, 0.4, 0.8, 0.5, 1.0)
    command = made.pose(message, 0.0).command
    assert isinstance(command, PoseCommand)
    assert (command.linear_speed, command.angular_speed) == pytest.approx((0.4, 0.8))


def test_a_pose_is_not_approached_faster_than_its_speed() -> None:
    """Seen on the tool."""
    core = MotionCore(robot('gp110'))
    core.reset(ready('gp110'))
    here = core.model.pose(core.state.position)
    there = Pose(here.rotation, here.position + np.array((0.0, 0.3, 0.0)))
    jog = JogRequest(PoseCommand(there, 0.05, 0.8), 10.0)
    core_commands.command(core, jog)
    for number in range(200):
        core.step(number * PERIOD, PERIOD)
    speed = core.model.jacobian(core.state.position) @ core.state.velocity
    assert speed[1] == pytest.approx(0.05, rel=0.05)
