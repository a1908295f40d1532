# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``ros2 run quad_hardware calibrate``: calibrates joints, IMU, odometry; identifies servos."""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
import math
from pathlib import Path
from typing import Any, cast

import yaml

from quad_description import LEGS, movable_joints, PRESETS, robot_urdf, run_command
from quad_description.rotations import roll_pitch_yaw

from ..estimation import ImuMounting
from ..exceptions import CommandError, HardwareError
from ..joints import JointServo, servo_of
from ..link import AUTO, DEFAULT_PORT, LinkOptions, MODEL_CHOICES, PROTOCOL_CHOICES
from ..link.open import is_pseudo_terminal
from ..protocol import LEG_MOTORS
from ..serial_robot import JOINTS_CHECKED, UNCHECKED_JOINTS
from .imu import calibrate_imu
from .wizard import calibrate_joints, CancelledError, Console, limp_robot, with_zero

NODE, PARAMETERS = 'hardware_node', 'ros__parameters'

Tree = dict[str, object]


def read_parameters(path: Path) -> Tree:
    """Read hardware_node's parameters from a file; empty if the file does not exist.

    Raises:
        CommandError: The file is not a parameter file.
    """
    if not path.exists():
        return {}
    try:
        content = yaml.safe_load(path.read_text(encoding='utf-8')) or {}
    except yaml.YAMLError as error:
        raise CommandError(f'{path} is not YAML: {error}') from error
    node = content.get(NODE, {}) if isinstance(content, dict) else None
    parameters = node.get(PARAMETERS, {}) if isinstance(node, dict) else None
    if not isinstance(parameters, dict):
        raise CommandError(f'{path} holds no parameters of {NODE}: {NODE}: {PARAMETERS}: ...')
    return cast('Tree', parameters)


def write_parameters(path: Path, changes: Mapping[str, object]) -> None:
    """Merge parameters into a file.

    Args:
        path: The file; it is replaced atomically.
        changes: Values by name; a mapping changes only its own keys.

    Raises:
        CommandError: The existing file is not a parameter file.
    """
    tree = _merged(read_parameters(path), changes)
    text = yaml.safe_dump({NODE: {PARAMETERS: tree}}, sort_keys=False)
    temporary = path.with_suffix(f'{path.suffix}.new')
    temporary.write_text(text, encoding='utf-8')
    temporary.replace(path)


def servo_parameters(servos: Iterable[JointServo]) -> Tree:
    """Return measured servo data as parameters of hardware_node, by joint."""
    joints: dict[str, Tree] = {}
    for servo in servos:
        numbers = {'offset': servo.offset, 'lower': servo.lower, 'upper': servo.upper}
        finite = {name: round(value, 5) for name, value in numbers.items() if math.isfinite(value)}
        joints[servo.joint] = {'motor': servo.motor, 'sign': servo.sign, **finite}
    return {'joints': joints}


def imu_parameters(mounting: ImuMounting) -> Tree:
    """Return the IMU mounting as parameters of hardware_node, with signs if checked."""
    gyro: Tree = (
        {'rate_signs': list(mounting.rate_signs), 'rates_checked': True}
        if mounting.rates_checked
        else {}
    )
    return {
        'imu': {
            'mounting': [round(angle, 5) for angle in roll_pitch_yaw(mounting.rotation)],
            'attitude_signs': list(mounting.attitude_signs),
            'acceleration_signs': list(mounting.acceleration_signs),
            'mounting_checked': mounting.checked,
            **gyro,
        }
    }


def _merged(old: Mapping[str, object], new: Mapping[str, object]) -> Tree:
    result = dict(old)
    for key, value in new.items():
        before = result.get(key)
        nested = isinstance(before, dict) and isinstance(value, Mapping)
        result[key] = _merged(cast('Tree', before), cast('Tree', value)) if nested else value
    return result


DEFAULT_FILE = Path('quad_calibration.yaml')


def main() -> None:
    """Entry point."""
    run_command(lambda argv: run_calibrate(argv, Console()))


def _joints(options: argparse.Namespace, console: Console) -> None:
    servos = [servo_of(joint) for joint in movable_joints(robot_urdf(options.preset, options.arm))]
    names = [servo.joint for servo in servos]
    if unknown := [name for name in options.joint if name not in names]:
        raise CommandError(f'no joint is called {unknown[0]!r}; there are {", ".join(names)}')
    chosen = [servo for servo in servos if not options.joint or servo.joint in options.joint]
    console.write(f'{len(chosen)} joints. The servos will let go: support the robot.')
    motors = [servo.motor for servo in servos]
    with limp_robot(_link(options), motors) as robot:
        console.prompt('Enter takes their torque away; Ctrl-C leaves')
        with robot.limp():
            if options.zero_only:
                console.prompt('Put all joints to zero, and hold them there. Enter')
                now = robot.angles()
                found = [with_zero(s, now[s.motor]) if s.motor in now else s for s in chosen]
            else:
                found = calibrate_joints(console, robot, chosen, limits=options.limits)
        console.write('the servos hold again, where they are')
    if found == chosen and not options.zero_only:
        raise CancelledError('every joint was skipped; nothing was written')
    write_parameters(options.output, {**servo_parameters(found), JOINTS_CHECKED: False})


def _imu(options: argparse.Namespace, console: Console) -> None:
    console.write('The servos stay as they are. Hold the robot by its body, not by its legs.')
    with limp_robot(_link(options), ()) as robot:
        found = imu_parameters(calibrate_imu(console, robot))
    console.write(f'found: {found["imu"]}')
    write_parameters(options.output, found)


def _link(options: argparse.Namespace) -> LinkOptions:
    protocols, model = PROTOCOL_CHOICES[options.protocol], MODEL_CHOICES[options.model]
    return LinkOptions(
        options.port, protocols, model=model, preset=vars(options).get('preset', '')
    )


def _odometry(options: argparse.Namespace, console: Console) -> None:
    from .odometry import calibrate_odometry

    found = calibrate_odometry(console, options.axis, options.distance, options.speed)
    write_parameters(options.output, {'odometry': {f'scale_{options.axis}': found}})


def _servos(options: argparse.Namespace, console: Console) -> None:
    from .servos import calibrate_servos

    urdf = robot_urdf(options.preset, options.arm)
    known = read_parameters(options.calibration or DEFAULT_FILE)
    if options.calibration is not None and not known:
        raise CommandError(f'{options.calibration} is no file of calibrate joints')
    if known.get(JOINTS_CHECKED) is not True and not is_pseudo_terminal(options.port):
        raise CommandError(UNCHECKED_JOINTS)
    servos = _calibrated(urdf, known)
    with limp_robot(_link(options), [servo.motor for servo in servos]) as robot:
        calibrate_servos(console, robot, servos, urdf, options.leg, repeat=options.repeat)


def _calibrated(urdf: str, known: Mapping[str, object]) -> list[JointServo]:
    """Return the servos of all joints, with the known parameters applied."""
    joints = cast('Mapping[str, Mapping[str, Any]]', known.get('joints', {}))
    return [
        replace(servo_of(joint), **joints.get(joint.name, {})) for joint in movable_joints(urdf)
    ]


def _first_motion(options: argparse.Namespace, console: Console) -> None:
    try:
        from operator_input import Keyboard, TerminalError

        from .first_motion import check_joint
    except ImportError as error:
        raise CommandError(f"{error}; pip install './quad_hardware[first_motion]'") from error
    urdf = robot_urdf(options.preset, options.arm)
    servos = _calibrated(urdf, read_parameters(options.output))
    with limp_robot(_link(options), [servo.motor for servo in servos]) as robot:
        console.prompt(
            'Put the trunk on a stand, so that all legs hang free; each joint of them will move '
            'by 10 degrees, while you hold a key. Enter begins; Ctrl-C leaves'
        )
        try:
            for servo in (each for each in servos if each.motor in LEG_MOTORS):
                check_joint(console, robot, Keyboard, servo)
        except TerminalError as error:
            raise CommandError(str(error)) from error
    write_parameters(options.output, {JOINTS_CHECKED: True})


_PARTS = {
    'joints': _joints,
    'first-motion': _first_motion,
    'imu': _imu,
    'odometry': _odometry,
    'servos': _servos,
}


def run_calibrate(argv: Sequence[str], console: Console) -> int:
    """Run the calibration that the command line requests; return the exit code."""
    options = _parser().parse_args(argv)
    try:
        _PARTS[options.what](options, console)
    except KeyboardInterrupt:
        console.write('cancelled; nothing was written')
        return 1
    except (HardwareError, CancelledError) as error:
        console.write(str(error))
        return 1
    if options.what == 'servos':
        return 0
    console.write(f'written to {options.output}; use it with:')
    console.write(
        f'  ros2 run quad_hardware hardware_node --ros-args --params-file {options.output}'
    )
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=__doc__, allow_abbrev=False)
    kinds = parser.add_subparsers(dest='what', required=True)
    joints = kinds.add_parser(
        'joints', help='signs, offsets and limits; moves joints by hand', allow_abbrev=False
    )
    first = kinds.add_parser(
        'first-motion', help='each joint moves while a key is held', allow_abbrev=False
    )
    imu = kinds.add_parser(
        'imu', help='how the IMU is mounted; tilts the robot by hand', allow_abbrev=False
    )
    servos = kinds.add_parser(
        'servos', help='stiffness, play and delay; one leg swings', allow_abbrev=False
    )
    for kind in (joints, first, imu, servos):
        kind.add_argument('--port', default=DEFAULT_PORT, help='of the robot (%(default)s)')
        kind.add_argument(
            '--protocol',
            choices=PROTOCOL_CHOICES,
            default=AUTO,
            help='what the robot speaks (%(default)s)',
        )
        kind.add_argument(
            '--model',
            choices=MODEL_CHOICES,
            default=AUTO,
            help='ranges of protocol v1 (%(default)s)',
        )
    for kind in (joints, first, servos):
        kind.add_argument('--preset', choices=PRESETS, default='lite', help='(%(default)s)')
        kind.add_argument('--arm', action='store_true', help='with the arm on its back')
    servos.add_argument(
        '--calibration',
        type=Path,
        help=f'file of calibrate joints and first-motion ({DEFAULT_FILE})',
    )
    servos.add_argument('--leg', choices=LEGS, default=LEGS[0], help='(%(default)s)')
    servos.add_argument(
        '--repeat', type=int, choices=range(1, 5), default=1, help='of the motion (%(default)s)'
    )
    joints.add_argument('--joint', action='append', default=[], help='only this one; repeatable')
    joints.add_argument('--limits', action='store_true', help='record the ends of the travel, too')
    joints.add_argument('--zero-only', action='store_true', help='all offsets at once, in a jig')
    odometry = kinds.add_parser(
        'odometry', help='scale; walks while bringup runs', allow_abbrev=False
    )
    odometry.add_argument('--axis', choices=('x', 'y'), default='x', help='(%(default)s)')
    odometry.add_argument('--distance', type=_positive, default=1.0, help='[m] (%(default)s)')
    odometry.add_argument('--speed', type=_positive, default=0.15, help='[m/s] (%(default)s)')
    for kind in (joints, first, imu, odometry):
        kind.add_argument(
            '--output', type=Path, default=DEFAULT_FILE, help='parameter file (%(default)s)'
        )
    return parser


def _positive(text: str) -> float:
    number = float(text)
    if not 0.0 < number < math.inf:
        raise argparse.ArgumentTypeError(f'{text} is not a positive number')
    return number


if __name__ == '__main__':
    main()
