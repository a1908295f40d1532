# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Calibration of joints: a robot with turned and shifted servos gets its true parameters back."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace
from functools import partial
import math
from pathlib import Path
import re
import threading
from typing import Any

from geometry_msgs.msg import Twist
from hypothesis import given
from hypothesis import strategies as st
from isolation import Isolation
from nav_msgs.msg import Odometry
import pytest
import rclpy
from rclpy.context import Context
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
import yaml

from quad_hardware import CommandError
from quad_hardware.calibration import odometry
from quad_hardware.calibration.main import read_parameters, run_calibrate, write_parameters
from quad_hardware.calibration.odometry import Place, way
from quad_hardware.calibration.wizard import MIN_TURN, with_direction
from quad_hardware.joints import JointServo
from quad_hardware.protocol import Protocol, V1, V2
from quad_pty_peer import PtyPeer, Script, wait_for

PERIOD = 0.01  # [s]


class WalkingRobot(Node):
    """Goes as commanded; its odometry counts what its scale says."""

    def __init__(self, context: Context) -> None:
        """Stand at an angle, for the way counts in the robot's own heading."""
        super().__init__('hardware_node', context=context)
        self.declare_parameter('odometry.scale_x', 1.25)
        self.velocity = Twist()
        self.way = 0.0
        self._odom = self.create_publisher(Odometry, 'odom', 10)
        self.create_subscription(Twist, 'cmd_vel', self._move, 1)
        self.create_timer(PERIOD, self._step)

    def _move(self, message: Twist) -> None:
        self.velocity = message

    def _step(self) -> None:
        self.way += self.velocity.linear.x * PERIOD
        message = Odometry()
        message.pose.pose.position.y = self.way
        message.pose.pose.orientation.z = message.pose.pose.orientation.w = math.sqrt(0.5)
        self._odom.publish(message)


@pytest.fixture
def walking_robot(isolation: Isolation, monkeypatch: pytest.MonkeyPatch) -> Iterator[WalkingRobot]:
    """A robot in a domain of its own, served in a thread."""
    for name, value in isolation.env.items():
        monkeypatch.setenv(name, value)
    context = Context()
    rclpy.init(context=context)
    robot = WalkingRobot(context)
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(robot)

    def spin() -> None:
        with suppress(ExternalShutdownException):
            executor.spin()

    thread = threading.Thread(target=spin)
    thread.start()
    yield robot
    rclpy.shutdown(context=context)
    thread.join()
    robot.destroy_node()


@pytest.mark.scenario
def test_the_scale_is_what_the_tape_says(walking_robot: WalkingRobot, tmp_path: Path) -> None:
    """It walks, stops, and the scale of before is multiplied by tape over odometry.

    It is asked for until it is a number, and one of metres: centimetres would make a scale that
    the bridge refuses. A comma is a point.
    """
    output = tmp_path / 'found.yaml'
    script = Script('', 'far', '', '-1', 'inf', '15', '0,15')
    command = ['odometry', '--distance', '0.3', '--speed', '0.5', '--output', str(output)]
    assert run_calibrate(command, script) == 0, script.said
    assert walking_robot.velocity.linear.x == 0.0
    assert any('was it in metres?' in text for text in script.said)
    assert sum('is not a positive number' in text for text in script.said) == 4
    said = float(
        next(line for line in script.said if line.startswith('odometry measured')).split()[2]
    )
    assert said >= 0.3
    scale = read_parameters(output)['odometry']['scale_x']  # type: ignore[index]
    assert scale == pytest.approx(1.25 * 0.15 / said, rel=2e-3)


@pytest.mark.parametrize('value', ['0', '-1', 'nan', 'inf', 'far'])
@pytest.mark.parametrize('option', ['--speed', '--distance'])
def test_a_way_that_cannot_be_walked_is_refused(
    option: str, value: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """Before anything moves, and the message names the option."""
    with pytest.raises(SystemExit) as ended:
        run_calibrate(['odometry', f'{option}={value}'], Script())
    assert ended.value.code == 2
    assert option in capsys.readouterr().err


@pytest.mark.scenario
def test_who_breaks_off_has_it_stopped(
    walking_robot: WalkingRobot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Ctrl-C on the way: the robot is commanded to stand, and nothing is written."""
    place = odometry.Walker.place

    def break_off(walker: odometry.Walker) -> Place:
        if walking_robot.way > 0.02:
            raise KeyboardInterrupt
        return place(walker)

    monkeypatch.setattr(odometry.Walker, 'place', break_off)
    output = tmp_path / 'found.yaml'
    script = Script('')
    command = ['odometry', '--speed', '0.5', '--output', str(output)]
    assert run_calibrate(command, script) == 1
    assert script.said[-1] == 'cancelled; nothing was written'
    assert not output.exists()
    wait_for(lambda: walking_robot.velocity.linear.x == 0.0, 'end of the walk')


@pytest.mark.scenario
def test_nobody_there_is_said(
    isolation: Isolation, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """Without a robot in the domain, and nothing is written."""
    for name, value in isolation.env.items():
        monkeypatch.setenv(name, value)
    monkeypatch.setattr(odometry, 'ODOMETRY_TIMEOUT', 0.3)
    script = Script('')
    output = tmp_path / 'found.yaml'
    assert run_calibrate(['odometry', '--output', str(output)], script) == 1
    assert 'bringup' in script.said[-1]
    assert not output.exists()


@pytest.mark.scenario
@given(*[st.floats(-3, 3)] * 3, *[st.floats(-2, 2)] * 2)
def test_a_way_is_taken_in_the_heading_of_its_start(
    x: float, y: float, yaw: float, ahead: float, aside: float
) -> None:
    """Both axes, from any place."""
    end = (
        x + math.cos(yaw) * ahead - math.sin(yaw) * aside,
        y + math.sin(yaw) * ahead + math.cos(yaw) * aside,
        0.0,
    )
    assert way((x, y, yaw), end, 'x') == pytest.approx(ahead, abs=1e-9)
    assert way((x, y, yaw), end, 'y') == pytest.approx(aside, abs=1e-9)


KNEE = JointServo('fl_calf_joint', 11, lower=-1.134, upper=0.8727)


@pytest.mark.slow
@given(
    st.sampled_from([1, -1]), st.floats(-1.0, 1.0), st.floats(math.radians(MIN_TURN) + 0.01, 1.5)
)
def test_sign_and_offset_are_found(sign: int, offset: float, turn: float) -> None:
    """From two angles of a servo that is mounted in any way."""
    true = replace(KNEE, sign=sign, offset=offset)
    found = with_direction(KNEE, true.angle(0.0), true.angle(turn))
    assert found.sign == sign
    assert found.offset == pytest.approx(offset)
    assert found.position(true.angle(0.7)) == pytest.approx(0.7)


@pytest.mark.slow
@pytest.mark.parametrize('protocol', [V2, V1], ids=lambda protocol: protocol.name)
def test_a_joint_is_calibrated_by_hand(tmp_path: Path, protocol: Protocol) -> None:
    """Torque off, four places, torque on where it is, and the file has what was found.

    The limits are the ends of its travel, with a margin to the stop, within those of the URDF;
    ends that leave nothing between them are measured again.
    """
    output = tmp_path / 'found.yaml'
    with PtyPeer(tmp_path / 'port', protocol) as peer:
        limp: list[bool] = []

        def put(angle: float) -> None:
            limp.append(not peer.torque)
            peer.angles[11] = angle

        ends = (45.0, -60.0) if protocol is V2 else (-60.0, 45.0)  # in either order
        ways = (10.0, -15.0, 1.0, 2.0), (10.0, -15.0, *ends)  # zero, turned, both ends
        answers = [(partial(put, angle), '') for way in ways for angle in way]
        script = Script('', *answers, 'y')
        command = ['joints', '--limits', '--joint', 'fl_calf_joint', '--output', str(output)]
        assert run_calibrate([*command, '--port', str(peer.link)], script) == 0, script.said
        assert limp == [True] * 8
        assert peer.torque
        legs = [command for command in peer.commands if 11 in command]
        assert legs[-1][11] == pytest.approx(ends[-1], abs=0.5)
    assert any('nothing is left between' in text for text in script.said)
    joint: Any = read_parameters(output)['joints']['fl_calf_joint']  # type: ignore[index]
    assert joint['sign'] == -1
    assert joint['offset'] == pytest.approx(math.radians(10.0), abs=0.01)
    assert joint['lower'] == pytest.approx(math.radians(10.0 - 45.0 + 2.0), abs=0.01)
    assert joint['upper'] == pytest.approx(KNEE.upper, abs=1e-4)


@pytest.mark.slow
def test_who_leaves_gets_torque_back_and_no_file(tmp_path: Path) -> None:
    """In the middle of a joint; the robot holds where it was put."""
    output = tmp_path / 'found.yaml'
    with PtyPeer(tmp_path / 'port') as peer:
        script = Script('', '')
        command = ['joints', '--port', str(peer.link), '--output', str(output)]
        assert run_calibrate(command, script) == 1
        assert peer.torque
        assert script.said[-1] == 'cancelled; nothing was written'
    assert not output.exists()


@pytest.mark.slow
def test_a_wrong_motor_is_noticed(tmp_path: Path) -> None:
    """Someone moves another joint than asked: it is said which motor turned, and asked again.

    So it is of a turn that shows nothing: a hand that shakes is no direction. A joint that is
    skipped is not written as if it had been found.
    """
    output = tmp_path / 'found.yaml'
    with PtyPeer(tmp_path / 'port') as peer:

        def turn(*motors: int) -> None:
            peer.angles.update(dict.fromkeys(motors, peer.angles[11] + 3.0) | {21: 30.0})

        script = Script('', '', (turn, ''), 'n', '', (lambda: turn(11), ''), 's')
        command = ['joints', '--joint', 'fl_calf_joint', '--output', str(output)]
        assert run_calibrate([*command, '--port', str(peer.link)], script) == 1  # skipped
    text = '\n'.join(script.said)
    assert 'motor 21 turned by 30 degrees, not 11' in text
    assert 'motor 11 turned by 0.0 degrees; at least 8 are needed. Is this the right' in text
    assert 'motor 11 turned by 3.0 degrees' in text
    assert script.said[-1] == 'every joint was skipped; nothing was written'
    assert not output.exists()


@pytest.mark.slow
@pytest.mark.parametrize(
    ('protocol', 'firmware', 'words', 'options'),
    [
        (V1, 'X-1', 'name its ranges with the parameter or option model', ['--model', 'lite']),
        (V1, 'M-4.3.3', "'M-4.3.3'.*start with preset mini", ['--preset', 'mini']),
        (V2, 'M-4.3.3', "'M-4.3.3'.*start with preset mini", ['--preset', 'mini']),
    ],
)
def test_a_robot_of_another_kind_is_refused(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    *,
    protocol: Protocol,
    firmware: str,
    words: str,
    options: list[str],
) -> None:
    """Other limits or ranges would count: the message names the option, which does it.

    Then all zeros are found at once, in a jig: offsets are where servos are, every sign stays.
    """
    output = tmp_path / 'found.yaml'
    command = ['joints', '--zero-only', '--output', str(output), '--protocol', protocol.name]
    with PtyPeer(tmp_path / 'port', protocol, firmware=firmware) as peer:
        peer.angles.update(dict.fromkeys(peer.angles, 5.0))
        command += ['--port', str(peer.link)]
        for timeout in (0.5, 10.0):  # [s]; a busy machine takes longer to know the robot
            script = Script('', '')
            with monkeypatch.context() as patched:
                patched.setattr('quad_hardware.calibration.wizard.REPORT_TIMEOUT', timeout)
                assert run_calibrate(command, script) == 1
            if re.search(words, script.said[-1]):
                break
        assert re.search(words, script.said[-1])
        assert run_calibrate([*command, *options], Script('', '')) == 0
    joints: Any = read_parameters(output)['joints']
    assert len(joints) == 12
    offsets = [each['offset'] for each in joints.values()]
    assert offsets == pytest.approx([-math.radians(5.0)] * 12, abs=0.01)


def test_a_command_that_does_not_leave_is_said(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Not the state of a line that is well again."""
    monkeypatch.setattr('quad_hardware.calibration.wizard.SEND_TIMEOUT', 0.0)
    monkeypatch.chdir(tmp_path)
    with PtyPeer(tmp_path / 'port') as peer:
        script = Script('')
        assert run_calibrate(['servos', '--port', str(peer.link)], script) == 1
    assert script.said[-1] == 'a command did not leave within 0.0 s'


def test_a_file_keeps_what_it_had(tmp_path: Path) -> None:
    """New values go beside old ones, also within a joint; other files are refused."""
    path = tmp_path / 'p.yaml'
    write_parameters(path, {'joints': {'a': {'sign': 1, 'offset': 0.1}}})
    write_parameters(path, {'joints': {'a': {'sign': -1}, 'b': {'sign': 1}}, 'port': 'x'})
    assert yaml.safe_load(path.read_text()) == {
        'hardware_node': {
            'ros__parameters': {
                'joints': {'a': {'sign': -1, 'offset': 0.1}, 'b': {'sign': 1}},
                'port': 'x',
            }
        }
    }
    path.write_text('- a list')
    with pytest.raises(CommandError, match='holds no parameters of hardware_node'):
        write_parameters(path, {})


@pytest.mark.slow
@pytest.mark.parametrize(
    ('arguments', 'checked', 'words'),
    [
        (['joints'], False, 'no such device'),
        (['joints', '--joint', 'fl_femur'], False, "'fl_femur'; there are fl_hip_joint"),
        (['servos'], False, 'calibrate first-motion'),
        (['servos'], True, 'no such device'),
    ],
)
def test_what_cannot_be_calibrated_is_said(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    arguments: list[str],
    checked: bool,
    words: str,
) -> None:
    """No robot, no such joint; and no leg swings before the first motion. No file is written."""
    monkeypatch.setattr('quad_hardware.calibration.wizard.REPORT_TIMEOUT', 0.5)
    monkeypatch.chdir(tmp_path)
    if checked:
        write_parameters(tmp_path / 'quad_calibration.yaml', {'joints_checked': True})
    script = Script('')
    assert run_calibrate([*arguments, '--port', str(tmp_path / 'none')], script) == 1
    assert words in script.said[-1]
    assert len(list(tmp_path.iterdir())) == checked
