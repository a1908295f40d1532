# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``check_policy``: compares an ONNX policy with the robot and tests it in simulation."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from dataclasses import replace
from enum import Enum, IntEnum
import json
import logging
import math
from pathlib import Path
import sys
from typing import TYPE_CHECKING

from quad_description import DescriptionError, PRESETS, quadruped, robot_urdf, run_command
from robot_primitives import settings_of

from ..exceptions import CheckError, PolicyError, QuadControllerError
from ..gait.generator import GaitGenerator
from ..gait.parameters import AS_TUNED, GaitParameters, LOW_AND_WIDE
from ..gait.velocity import Velocity
from ..policy.load import find_policy, load_policy, LoadedPolicy
from ..policy.network import OnnxNetwork
from ..policy.options import PolicyOptions, table_text
from ..states.modes import StateParameters
from .course import course_for, CourseWalker
from .findings import (
    against_gait,
    astray,
    Compared,
    figures_table,
    Findings,
    is_too_late,
    timing_notes,
    tracking_table,
    unseen_terms,
    velocity_text,
    write_csv,
)

if TYPE_CHECKING:
    from .arenas import PhysicsArena

NOMINAL = 'nominal'
"""Servos as they are known to be; policies of the vendor's training expect ``vendor_rl``."""

MIN_DURATION, MAX_DURATION = 0.5, 600.0
"""Times of a walk in [s]."""
WALK_DURATION, COMPARE_DURATION = 10.0, 4.0
"""Of each command in virtual time in [s]."""
MINUTES, MIN_MINUTES, MAX_MINUTES = 2.0, 0.8, 120.0
"""Of the chain, in real time."""


class ExitCode(IntEnum):
    """Exit codes of the command."""

    STANDS_UP = 0
    DOES_NOT = 1
    WRONG_USE = 2
    NOT_TRIED = 3


def run(arguments: Sequence[str]) -> int:
    """Check a policy and print the findings; return an :class:`ExitCode`."""
    parser = _parser()
    options = parser.parse_args(arguments)
    if options.v1 and (options.chain or not (options.walk or options.compare or options.report)):
        parser.error('--v1 needs --walk or --compare; --chain speaks v2')
    found = Findings()
    try:
        loaded = _load(options)
        _print(str(loaded))
        _try_out(options, loaded, found)
    except CheckError as error:
        _print(f'it could not be tried: {error}')
        return ExitCode.NOT_TRIED
    except (QuadControllerError, DescriptionError) as error:
        found.reasons.append(error.reason if isinstance(error, PolicyError) else str(error))
        _print(str(error))
    for note in found.notes:
        _print(f'note: {note}')
    if found.courses:
        _print(_verdict(options.policy, found.reasons))
    if options.report is not None:
        with options.report.open('w', encoding='utf-8', newline='') as file:
            write_csv(file, found)
        _print(f'report: {options.report}')
    return ExitCode.DOES_NOT if found.reasons else ExitCode.STANDS_UP


def main() -> None:
    """Entry point."""
    # the driver's warnings of a robot that was put on its feet are no trouble of the policy
    logging.getLogger('quad_hardware').setLevel(logging.CRITICAL)
    run_command(run)


def _load(options: argparse.Namespace) -> LoadedPolicy:
    robot = quadruped(robot_urdf(options.preset, arm=options.arm))
    return load_policy(
        find_policy(options.policy),
        robot,
        GaitGenerator(robot, GaitParameters()).stand_targets,
        _policy_options(options),
        StateParameters().period,
    )


def _policy_options(options: argparse.Namespace) -> PolicyOptions:
    values = {name: getattr(options, name) for name, *_ in settings_of(PolicyOptions)}
    plain = PolicyOptions.from_json(json.dumps(values), options.contract)
    try:
        from .arenas import servo_response
    except ImportError:  # the table alone needs no simulator
        return plain
    return replace(plain, servo=servo_response(options.servo))


def _try_out(options: argparse.Namespace, loaded: LoadedPolicy, found: Findings) -> None:
    """Test a policy in all ways that the command line requests."""
    compare = options.compare or (options.report and not (options.walk or options.chain))
    if not (options.walk or compare or options.chain):
        return
    try:
        from .arenas import Conditions, PhysicsArena, RobotChoice
        from .trial import Candidate, chain_duration, run_chain, run_trials, Trial
    except ImportError as error:
        raise CheckError(f'a walk needs quad_sim and MuJoCo: {error}') from error
    choice = RobotChoice(options.preset, options.arm, options.servo)
    policy = Candidate(find_policy(options.policy), _policy_options(options), choice)
    conditions = Conditions(v1=options.v1)
    if options.walk is not None:
        _walk(options, loaded, PhysicsArena(choice, conditions), found)
    if not (compare or options.chain):
        return
    commands = course_for(loaded.contract.commands)
    stances = [Candidate(robot=choice, gait=gait) for gait in (AS_TUNED, LOW_AND_WIDE)]
    duration = options.duration or COMPARE_DURATION
    trials = [Trial(who, commands, duration, conditions) for who in (policy, *stances)]
    mine, *others = run_trials(trials)
    pairs = zip(stances, others, strict=True)
    gait, other = min(pairs, key=lambda pair: (pair[1].falls, pair[1].mean('error')))
    if compare:
        sensors = 'the bytes of protocol v1' if options.v1 else 'ideal sensors'
        title = f'in physics with {sensors}, in virtual time'
        _add_course(found, Compared(title, mine, other))
    if options.chain:
        duration = chain_duration(options.minutes, 2, len(commands))
        title = (
            f'behind the serial line in real time, {options.minutes:g} minutes: servos, board, '
            'line, estimator, clocks'
        )
        mine, other = run_chain((policy, gait), commands, duration)
        _add_course(found, Compared(title, mine, other))


def _add_course(found: Findings, compared: Compared) -> None:
    """Record and print the results of policy and gait on a course."""
    found.courses.append(compared)
    reasons = list(against_gait(compared.policy, compared.gait))
    late = list(timing_notes(compared.policy))
    found.notes += late
    _print(f'\nbeside the gait, {compared.title}')
    tables = (table(compared) for table in (tracking_table, figures_table))
    _print('\n\n'.join(table_text(each, numbers=True) for each in tables))
    if reasons and is_too_late(compared.policy, StateParameters().period):
        raise CheckError(f'{"; ".join(late)}; try again when the machine has less to do')
    found.reasons += reasons


def _walk(
    options: argparse.Namespace, loaded: LoadedPolicy, arena: PhysicsArena, found: Findings
) -> None:
    velocity, duration = Velocity(*options.walk), options.duration or WALK_DURATION
    robot = quadruped(robot_urdf(options.preset, arm=options.arm))
    walker = CourseWalker(arena, robot, loaded.runner)
    figures = walker.walk([velocity], duration, max_falls=1)
    found.walks.append(figures)
    (walked,) = figures.passages
    _print(
        f'walked with {options.servo} servos for {walked.time:.3g} s: commanded '
        f'{velocity_text(velocity)}, went {velocity_text(walked.went)}, '
        f'tilt at most {math.degrees(walked.tilt):.1f} deg'
    )
    if trouble := walker.failure or '; '.join(astray(walked.went, velocity)):
        found.reasons.append(trouble)
        _print(f'it did not go well: {trouble}')
    elif not loaded.contract.recurrence:
        network = OnnxNetwork(find_policy(options.policy))
        found.notes += unseen_terms(network, loaded.contract, walker.seen)


def _verdict(name: str, reasons: Sequence[str]) -> str:
    if not reasons:
        return f'\n{name} stands up'
    return '\n'.join([f'\n{name} does not stand up:', *(f'  - {reason}' for reason in reasons)])


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        description='Compare an ONNX policy with the robot, and let it walk in physics.',
        epilog='exit code: 0 it stands up, 1 it does not, 2 wrong use, 3 it could not be tried',
        allow_abbrev=False,
    )
    add = parser.add_argument
    add('policy', help='ONNX file, or the name of one that is shipped')
    add('--preset', choices=list(PRESETS), default='lite', help='the robot')
    add('--arm', action='store_true', help='the robot has its arm')
    files = 'YAML, deploy.yaml, env.yaml, config.yaml, config.json'
    add('--contract', type=Path, metavar='FILE', help=f'contract of the policy: {files}')
    for name, default, span, meaning in settings_of(PolicyOptions):
        option = f'--{name.replace("_", "-")}'
        if isinstance(default, Enum):
            choices = [each.value for each in type(default)]
            add(option, choices=choices, default=default.value, help=meaning)
        elif span is not None:
            add(option, type=number(name.replace('_', ' '), *span), default=default, help=meaning)
        else:
            add(option, action='store_true', help=meaning)
    servo = 'of the simulation: nominal, firm, vendor_rl, or kp=4,...'
    add('--servo', type=_servo, default=NOMINAL, help=servo)
    ways = parser.add_argument_group('ways to try it, beside the gait but for the first')
    add, velocity = ways.add_argument, number('velocity')
    units = '[m/s], [m/s], [rad/s]'
    add('--walk', nargs=3, type=velocity, metavar=('X', 'Y', 'YAW'), help=units)
    add(
        '--duration',
        type=number('duration [s]', MIN_DURATION, MAX_DURATION),
        help=f'of --walk ({WALK_DURATION:g}), of each command of --compare '
        f'({COMPARE_DURATION:g}) [s]',
    )
    course = 'three speeds of each axis and one backward, in virtual time'
    add('--compare', action='store_true', help=course)
    chain = 'the same through servos, board, serial line and estimator, in real time'
    add('--chain', action='store_true', help=chain)
    minutes = number('time [min]', MIN_MINUTES, MAX_MINUTES)
    add('--minutes', type=minutes, default=MINUTES, help='of --chain (default: %(default)g)')
    add(
        '--v1',
        action='store_true',
        help='--walk and --compare through the bytes of protocol v1, with differentiated joint '
        'velocities',
    )
    parser.add_argument(
        '--report',
        type=_report_file,
        metavar='FILE',
        help='write the figures of all that walked as CSV; alone, it means --compare, too',
    )
    return parser


def _report_file(text: str) -> Path:
    """Return the path of a writable file; check before the test takes its time."""
    path = Path(text)
    try:
        with path.open('a', encoding='utf-8'):
            return path
    except OSError as error:
        raise argparse.ArgumentTypeError(f'{text}: {error.strerror}') from error


def _servo(text: str) -> str:
    """Reject servos unknown to quad_sim, if that is installed."""
    try:
        from quad_sim import parse_servo, SetupError
    except ImportError:
        return text
    try:
        parse_servo(text)
    except SetupError as error:
        raise argparse.ArgumentTypeError(str(error)) from error
    return text


def number(what: str, low: float = -math.inf, high: float = math.inf) -> Callable[[str], float]:
    """Return an argparse type for a number within a range."""
    limits = f': it must be {low:g} {"or more" if high == math.inf else f"to {high:g}"}'

    def read(text: str) -> float:
        value = float(text)
        if not (math.isfinite(value) and low <= value <= high):
            kind = what if math.isfinite(value) else 'finite number'
            raise argparse.ArgumentTypeError(
                f'{text} is not a {kind}{limits if math.isfinite(low) else ""}'
            )
        return value

    return read


def _print(text: str) -> None:
    sys.stdout.write(f'{text}\n')
    sys.stdout.flush()


if __name__ == '__main__':
    main()
