# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Command line of the simulated robot; builds the robot from it."""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
import math
from pathlib import Path

from quad_description import Pose, pose_positions, PRESETS, robot_urdf
from quad_hardware.protocol import Model, Protocol, PROTOCOLS, V1, V2

from .board import Board
from .exceptions import SetupError, SimulationError
from .faults import FaultKind, FaultPlan, parse_fault, SETTINGS
from .plant import KinematicRobot, parse_servo
from .robot_line import RobotLine
from .servos import Mount, Plant
from .state import BOARD, NONE, Terrain

DEFAULT_LINK = Path('/tmp/xgo')  # noqa: S108  the path that the documentation names
SETTLE_TIME = 1.0  # [s] until a robot that was put down is at rest

_PROTOCOLS = {'both': (V2, V1), **{each.name: (each,) for each in PROTOCOLS}}
_NOISE = {'none': NONE, 'board': BOARD}


@dataclass(frozen=True, slots=True)
class Simulation:
    """A robot and its line, ready to run."""

    plant: Plant
    board: Board  # its board
    line: RobotLine  # its serial line


def parse_arguments(argv: Sequence[str]) -> argparse.Namespace:
    """Parse the command line; exit with 2 if it is invalid."""
    parser = argparse.ArgumentParser(
        prog='fake_xgo',
        description='A simulated XGO on a pseudo-terminal that speaks its serial protocols.',
        allow_abbrev=False,
    )
    add = parser.add_argument
    add('--link', type=Path, default=DEFAULT_LINK, help='path of the port (%(default)s)')
    add('--protocol', choices=_PROTOCOLS, default='both', help='what the board speaks')
    add('--big-endian', action='store_true', help='floats of the developer firmware')
    add(
        '--v1-baud',
        type=int,
        default=V1.baud,
        metavar='BAUD',
        help='speed of protocol v1 (%(default)s); programs have switched boards to others',
    )
    add('--preset', choices=PRESETS, default='lite', help='the robot (%(default)s)')
    add('--arm', action='store_true', help='with the arm on its back')
    add('--trunk-mass', type=float, metavar='KG', help="mass of the trunk, not the preset's")
    add('--firmware', default='', help='version that the board reports, e.g. L-4.3.3')
    add('--physics', choices=('mujoco', 'none'), default='mujoco', help='none: in the air')
    add('--servo', default='nominal', help='nominal, firm, vendor_rl, or kp=2.45,delay=0.04,...')
    add('--slope', type=float, default=0.0, metavar='DEG', help='of the ground, uphill ahead')
    add('--roughness', type=float, default=0.0, metavar='M', help='height of its highest bumps')
    add('--friction', type=float, default=0.8, help='of the ground (%(default)s)')
    add('--start', choices=[pose.value for pose in Pose], default='lie', help='how it begins')
    add('--held', action='store_true', help='the trunk is on a stand, legs hang free')
    add('--noise', choices=_NOISE, default='board', help='of its sensors (%(default)s)')
    add('--battery', type=float, default=100.0, metavar='PERCENT', help='charge at the start')
    add(
        '--command-gap',
        type=float,
        default=0.0,
        metavar='S',
        help='the board loses frames, but of v2, that follow each other faster, e.g. 0.001',
    )
    add('--fault', action='append', default=[], metavar='KIND,name=value', help=_fault_help())
    add('--seed', type=int, default=0, help='of noise and damage (%(default)s)')
    add(
        '--mount',
        action='append',
        default=[],
        metavar='ID=SIGN,DEGREES',
        help='a servo that is mounted otherwise, to practise calibration: 12=-1,4.5',
    )
    add('--no-ros', action='store_true', help='without node, services and topics')
    return parser.parse_args(argv)


def build(options: argparse.Namespace) -> Simulation:
    """Build the robot from the command line; return it at rest.

    Raises:
        SetupError: An option is wrong.
        SimulationError: MuJoCo is not installed.
    """
    for name, most, unit in (('battery', 100, 'percent'), ('command_gap', 1, 'seconds')):
        value = getattr(options, name)
        if not 0.0 <= value <= most:
            raise SetupError(f'--{name.replace("_", "-")} {value}: give 0 to {most} {unit}')
    if len(options.firmware) > 10 or not options.firmware.isascii():
        raise SetupError(f'--firmware {options.firmware!r}: give up to 10 ASCII characters')
    faults = FaultPlan(parse_fault(text) for text in options.fault)
    speeds = _choose_speeds(options.protocol, options.v1_baud)
    try:
        urdf = robot_urdf(options.preset, options.arm, options.trunk_mass)
    except ValueError as error:
        raise SetupError(str(error)) from error
    plant = _make_plant(options, urdf)
    plant.step(SETTLE_TIME)
    board = Board(
        plant,
        urdf,
        Model(options.preset),
        firmware=options.firmware,
        charge=options.battery,
        mounts=dict(map(parse_mount, options.mount)),
    )
    line = RobotLine(
        board,
        speeds,
        faults=faults,
        command_gap=options.command_gap,
        big_endian=options.big_endian,
        seed=options.seed,
    )
    return Simulation(plant, board, line)


def parse_mount(text: str) -> tuple[int, Mount]:
    """Parse ``ID=SIGN[,DEGREES]`` into a motor id and its servo mounting.

    Raises:
        SetupError: The text is wrong; the message shows the syntax.
    """
    motor, _, rest = text.partition('=')
    sign, _, offset = rest.partition(',')
    try:
        numbers = int(motor), int(sign), float(offset or '0')
    except ValueError:
        raise SetupError(f'--mount {text!r}: give ID=SIGN,DEGREES, such as 12=-1,4.5') from None
    return numbers[0], Mount(*numbers[1:])


def _choose_speeds(name: str, v1_baud: int) -> Mapping[int, Protocol]:
    """Return the board's protocols by baud rate [bit/s]."""
    protocols = _PROTOCOLS[name]
    if v1_baud <= 0:
        raise SetupError(f'--v1-baud {v1_baud}: give bits a second, e.g. {V1.baud}')
    if V2 in protocols and V1 in protocols and v1_baud == V2.baud:
        raise SetupError(f'--v1-baud {v1_baud} is that of v2; add --protocol v1')
    return {v1_baud if protocol is V1 else protocol.baud: protocol for protocol in protocols}


def _make_plant(options: argparse.Namespace, urdf: str) -> Plant:
    pose = pose_positions(Pose(options.start), options.arm)
    noise = _NOISE[options.noise]
    if options.physics == 'none':
        return KinematicRobot(urdf, pose=pose, noise=noise, seed=options.seed)
    try:
        from .physics import Robot
    except ImportError as error:
        raise SimulationError(
            f'physics needs MuJoCo ({error}); install mujoco, or take --physics none'
        ) from error
    return Robot(
        urdf,
        parse_servo(options.servo),
        Terrain(
            math.radians(options.slope),
            friction=options.friction,
            roughness=options.roughness,
            seed=options.seed,
        ),
        options.seed,
        pose=pose,
        noise=noise,
        held=options.held,
    )


def _fault_help() -> str:
    kinds = ', '.join(
        f'{kind.value}({", ".join(SETTINGS[kind])})' if SETTINGS[kind] else kind.value
        for kind in FaultKind
    )
    return f'what goes wrong, with at= and for= in seconds; may be given again: {kinds}'
