# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The command that checks a policy: table, exit code, walks, and trials beside the gait."""

from __future__ import annotations

from collections.abc import Sequence
import csv
from dataclasses import replace
import json
import math
from pathlib import Path
import re
import time
from typing import Any

import numpy as np
import onnx
import pytest
import yaml

from quad_controller import find_policy, GaitGenerator, GaitParameters, Velocity
from quad_controller.attach_contract import run as attach
from quad_controller.exceptions import CheckError
from quad_controller.gait.parameters import LOW_AND_WIDE
from quad_controller.gait.velocity import REST
from quad_controller.policy.contract.build import build_contract
from quad_controller.policy.contract.mjlab import CONTRACT_KEY, read_metadata
from quad_controller.policy.contract.model import CommandRanges, Gains, PolicyContract, Source
from quad_controller.policy.network import OnnxNetwork
from quad_controller.policy.options import gain_rows, ServoResponse
from quad_controller.policy_check.arenas import (
    Conditions,
    PhysicsArena,
    RobotChoice,
    serial_arena,
    SerialArena,
    servo_response,
)
from quad_controller.policy_check.course import (
    axis_of,
    course_for,
    CourseFigures,
    CourseWalker,
    Passage,
)
from quad_controller.policy_check.findings import against_gait, is_too_late, timing_notes
from quad_controller.policy_check.main import ExitCode, run
from quad_controller.policy_check.trial import Candidate, chain_duration, run_trials, Trial
from quad_description import robot_urdf, RobotState
from quad_gait_rig import joined, metadata, ROBOT, write_policy
from quad_hardware import NoAnswerError
from quad_sim import CommandTiming, ServedRobot, Watched
from quad_sim.physics import PhysicsBackend, Robot

SHIPPED = str(find_policy('trot_ppo'))
TURN = ['--walk', '0.2', '0', '0.3', '--duration', '4', '--servo', 'firm']
"""A way and a turn, for which left is not right."""
DAMPING = -0.5
"""Of an action by the angular velocity in [s/rad]."""
MIRRORS = {
    name: name[0] + name[1].translate(str.maketrans('lr', 'rl')) + name[2:] for name in ROBOT.names
}


def load_contract() -> PolicyContract:
    """Return the contract of the shipped policy."""
    return build_contract(read_metadata(OnnxNetwork(Path(SHIPPED)).metadata))


def test_the_shipped_policy_passes_and_walks(capsys: pytest.CaptureFixture[str]) -> None:
    """The table is printed, and what the walk came to."""
    assert run([SHIPPED, '--walk', '0.2', '0', '0', '--duration', '3', '--servo', 'firm']) == 0
    output = capsys.readouterr().out
    assert 'REFUSE' not in output
    assert 'sha256' in output
    went = output.rpartition('went ')[2]
    assert float(went.split()[0]) == pytest.approx(0.2, abs=0.03)


@pytest.mark.slow
def test_the_gait_beside_a_policy_is_the_one_of_its_two_stances_that_goes_better(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With an arm on the vendor's soft servos it is the low and wide one."""
    ahead = tuple(each for each in course_for(None) if each.x)
    monkeypatch.setattr('quad_controller.policy_check.main.course_for', lambda _: ahead)
    path, report = write_policy(tmp_path / 'still.onnx', metadata()), tmp_path / 'report.csv'
    soft = ['--arm', '--servo', 'vendor_rl', '--duration', '2']
    assert run([str(path), *soft, '--report', str(report)]) == 1
    rows = csv.DictReader(report.read_text(encoding='utf-8').splitlines())
    went = [float(row['went x [m/s]']) for row in rows if row['walker'] == 'gait']
    assert went == pytest.approx([each.x for each in ahead], abs=0.06)


def test_a_policy_that_bytes_do_not_suffice_for_is_found_over_v1(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Joint velocities are differentiated there, and it was trained with better ones."""
    (term,) = (
        term.name for term in load_contract().terms if term.source is Source.JOINT_VELOCITIES
    )
    path, setting = tmp_path / 'policy.onnx', f'observation.terms.{term}.noise=0.03'
    assert attach([SHIPPED, '--set', setting, '--output', str(path)]) == 0
    walk = [str(path), '--walk', '0.2', '0', '0', '--duration', '1', '--servo', 'firm']
    assert run(walk) == 0
    capsys.readouterr()
    assert run([*walk, '--v1']) == 1
    assert 'set noise' in capsys.readouterr().out


def test_a_policy_that_only_stands_walks_nowhere(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The walk reports what happened, and not what was commanded; that is no success."""
    path = write_policy(tmp_path / 'still.onnx', metadata())
    assert run([str(path), '--walk', '0.2', '0', '0', '--duration', '1']) == 1
    output = capsys.readouterr().out
    assert float(output.partition(' went ')[2].split()[0]) == pytest.approx(0.0, abs=0.02)
    assert 'hardly any: look at the command' in output


def damped(path: Path) -> Path:
    """Write the shipped policy with a feedback that damps roll and pitch by the angular velocity.

    Forward legs give way where the body pitches down, as do those of the side it rolls to.
    """
    model = onnx.load(SHIPPED)
    (seen,), (answer,) = model.graph.input, model.graph.output
    for node in model.graph.node:
        node.output[:] = ['undamped' if name == answer.name else name for name in node.output]
    gains = np.zeros((load_contract().width, len(ROBOT.names)), np.float32)
    for column, name in enumerate(ROBOT.names):
        share = {'thigh': 0.5, 'calf': -1.0}.get(name.split('_')[1], 0.0)
        gains[0, column] = DAMPING * share * (-1.0 if name[1] == 'l' else 1.0)
        gains[1, column] = DAMPING * share * (1.0 if name[0] == 'f' else -1.0)
    model.graph.initializer.append(onnx.numpy_helper.from_array(gains, 'gains'))
    model.graph.node.append(onnx.helper.make_node('MatMul', [seen.name, 'gains'], ['damping']))
    model.graph.node.append(onnx.helper.make_node('Add', ['undamped', 'damping'], [answer.name]))
    onnx.save(model, path)
    return path


WRONG: dict[str, dict[str, object]] = {
    'joints of the other side': {'joints': [MIRRORS[name] for name in ROBOT.names]},
    'joints by kind': {'joints': sorted(ROBOT.names, key=lambda name: name.split('_')[1])},
    'frame of the IMU': {'observation.terms.angular_velocity.frame': 'yawed'},
    'scale of actions': {'action.scale': 0.5},
    'scale of a velocity': {'observation.terms.angular_velocity.scale': 5.0},
    'sign of actions': {'action.scale': -0.25},
    'sign of a velocity': {'observation.terms.angular_velocity.scale': -1.0},
    'sign of commands': {'observation.terms.command.scale': -1.0},
    'sign of gravity': {'observation.terms.gravity.scale': -1.0},
    'absolute positions': {'observation.terms.positions.relative': False},
    'rate': {'period': 0.01},
}


@pytest.mark.parametrize('kind', [*WRONG, 'none'])
def test_a_wrong_contract_is_found_before_a_motor_moves(
    kind: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """By the table, or by a walk and a turn in physics; the right one passes."""
    path = damped(tmp_path / 'policy.onnx')
    settings = [f'{key}={json.dumps(value)}' for key, value in WRONG.get(kind, {}).items()]
    assert attach([str(path), *(part for text in settings for part in ('--set', text))]) == 0
    capsys.readouterr()
    assert run([str(path), *TURN]) == (1 if kind in WRONG else 0), capsys.readouterr().out


def test_a_term_that_a_walk_cannot_check_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The shipped policy uses all of its terms; here is one that another is given in vain."""
    path, width = tmp_path / 'policy.onnx', load_contract().width
    write_wider(path, range(width), width + 3)
    (stated,) = (p.value for p in onnx.load(path).metadata_props if p.key == CONTRACT_KEY)
    contract = yaml.safe_load(stated)
    contract['observation']['terms']['speed'] = {'source': 'linear_velocity', 'frame': 'base'}
    (tmp_path / 'contract.yaml').write_text(yaml.safe_dump(contract, sort_keys=False))
    assert attach([str(path), str(tmp_path / 'contract.yaml')]) == 0
    capsys.readouterr()
    named = re.compile('^note: (.*) hardly counts', re.MULTILINE)
    for policy, terms in ((SHIPPED, set[str]()), (str(path), {'speed'})):
        assert run([policy, *TURN]) == 0
        assert set(named.findall(capsys.readouterr().out)) == terms


def write_wider(path: Path, places: Sequence[int], width: int) -> Path:
    """Write the shipped policy as one that sees more, and heeds what is in some places of it."""
    model = onnx.load(SHIPPED)
    (given,) = model.graph.input
    model.graph.initializer.append(onnx.numpy_helper.from_array(np.array(places), 'heeded'))
    pick = onnx.helper.make_node('Gather', ['more', 'heeded'], [given.name], axis=1)
    model.graph.node.insert(0, pick)
    kind = onnx.helper.make_tensor_value_info('more', onnx.TensorProto.FLOAT, [1, width])
    model.graph.input.remove(given)
    model.graph.input.append(kind)
    onnx.save(model, path)
    return path


HISTORY = 6
"""Steps that a policy of the tests sees."""


def with_history(path: Path) -> Path:
    """Write the shipped policy as one that sees steps, of each term the newest last."""
    places, start = list[int](), 0
    for term in load_contract().terms:
        start += HISTORY * term.width
        places.extend(range(start - term.width, start))
    return write_wider(path, places, start)


@pytest.mark.parametrize('newest', ['last', 'first'])
@pytest.mark.parametrize('layout', ['per_term', 'frames'])
def test_a_wrong_layout_of_the_history_is_found(
    layout: str, newest: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A policy that sees several steps walks with the layout of its training only."""
    path = with_history(tmp_path / 'history.onnx')
    names = [term.name for term in load_contract().terms]
    settings = [f'observation.terms.{name}.history={HISTORY}' for name in names]
    settings += [f'observation.history.layout={layout}', f'observation.history.newest={newest}']
    given = [part for setting in settings for part in ('--set', setting)]
    assert attach([str(path), *given]) == 0
    capsys.readouterr()
    fits = (layout, newest) == ('per_term', 'last')
    assert run([str(path), *TURN]) == (0 if fits else 1), capsys.readouterr().out


@pytest.mark.parametrize(
    ('arguments', 'words'),
    [
        (['--walk', 'nan', '0', '0'], 'nan is not a finite number'),
        (['--duration', '0'], 'must be 0.5 to 600'),
        (['--duration', '-1'], 'must be 0.5 to 600'),
        (['--phase-period', '-0.1'], 'must be 0 to 10'),
        (['--report', '/nowhere/at/all.csv'], 'No such file'),
        (['--minutes', '0.1'], 'must be 0.8 to 120'),
        (['--servo', 'soft'], 'give nominal or firm'),
        (['--v1'], '--v1 needs --walk or --compare'),
        (['--chain', '--v1'], '--chain speaks v2'),
    ],
)
def test_wrong_use_ends_with_two(
    arguments: list[str], words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """Before anything is loaded."""
    with pytest.raises(SystemExit) as ended:
        run([SHIPPED, *arguments])
    assert ended.value.code == ExitCode.WRONG_USE
    assert words in capsys.readouterr().err


def test_what_does_not_fit_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A renamed joint and a missing file end with 1 and their reason; nothing was walked."""
    names = joined(['hip', *ROBOT.names[1:]])
    path = write_policy(tmp_path / 'renamed.onnx', metadata(joint_names=names))
    report = tmp_path / 'report.csv'
    assert run([str(path), '--report', str(report)]) == 1
    assert 'not in the robot: hip' in capsys.readouterr().out
    (headings,) = report.read_text(encoding='utf-8').splitlines()
    assert headings.startswith('tried,walker,axis,')
    assert run([str(tmp_path / 'none.onnx')]) == 1
    assert 'is neither a file' in capsys.readouterr().out


# --- trials beside the gait

DEADLINE = 90.0  # [s]
STAND_TARGETS = GaitGenerator(ROBOT, GaitParameters()).stand_targets
FAIR = Passage(Velocity(0.2), Velocity(0.19), 10.0, 0, 0.05, 0.02, 0.0, 0.05, 5.0)


def course(*passages: Passage) -> CourseFigures:
    """Return the figures of some passages."""
    return CourseFigures(passages or (FAIR,))


# --- what is walked


def test_a_course_has_what_a_policy_was_trained_for() -> None:
    """Three speeds of each axis and one backward, within its commands; none of what it lacks."""
    everything = course_for(None)
    assert len(everything) == 12
    assert {Velocity(-0.2), Velocity(y=-0.1), Velocity(yaw=-1.0)} < set(everything)
    ranges = CommandRanges((-0.15, 0.2), (0.0, 0.0), (0.0, 9.0))
    speeds = (0.0667, 0.1333, 0.2, -0.1)
    assert course_for(ranges)[:4] == tuple(map(Velocity, speeds))
    assert all(each.yaw >= 0.0 for each in course_for(ranges))
    assert {axis_of(each) for each in course_for(ranges)} == {'forward', 'turn'}


def test_minutes_are_shared_among_those_who_walk() -> None:
    """The shortest that the command takes is enough for every command."""
    assert chain_duration(0.8, 2, 12) > 0.5
    assert chain_duration(2.0, 2, 9) == pytest.approx((60.0 - 3.5) / 9 - 1.0)


@pytest.mark.slow
def test_falls_are_counted_and_walked_on_after() -> None:
    """The gait walks one way without a push, and falls when it is hit."""
    arena = PhysicsArena(RobotChoice())
    walker = CourseWalker(arena, ROBOT, None)
    (walked,) = walker.walk([Velocity(0.2)], 3.0).passages
    assert walked.falls == 0
    assert walked.time == pytest.approx(3.0)
    assert walked.error < 0.03
    assert 1.0 < walked.cost_of_transport < 20.0
    assert 0.0 < walked.smoothness < 0.5
    assert walked.timing is None
    toppled = walker.walk([Velocity(0.2), Velocity(yaw=1.0)], 4.1, push=4.0)
    assert toppled.falls > 0
    assert [each.time > 0.0 for each in toppled.passages] == [True, True]
    assert math.isnan(toppled.passages[1].cost_of_transport)


@pytest.mark.slow
def test_the_trained_policy_falls_less_than_half_as_often_as_the_gait() -> None:
    """On firm servos, under pushes that tip the low and wide gait, too; unpushed it goes along."""
    firm, commands = RobotChoice(servo='firm'), (Velocity(0.2), Velocity(yaw=1.0))
    policy = Candidate(find_policy('trot_ppo'), robot=firm)
    pushed, walkers = Conditions(push=2.0), (Candidate(gait=LOW_AND_WIDE, robot=firm), policy)
    trials = [Trial(who, commands, 16.0, pushed) for who in walkers]
    gait, trained, level = run_trials([*trials, Trial(policy, course_for(None), 3.0)])
    assert gait.falls > 3
    assert trained.falls <= 0.5 * gait.falls
    assert level.falls == 0
    assert level.mean('error') < 0.03


@pytest.mark.slow
def test_protocol_v1_costs_the_gait_no_speed() -> None:
    """Positions come in steps of a byte, and velocities from their differences."""
    for preset, widest in (('lite', 30.0), ('mini', 31.0)):  # of a hip [deg], in 255 steps
        backend = PhysicsArena(RobotChoice(preset), Conditions(v1=True)).backend
        state = backend.reset()
        for step in range(20):
            state = backend.step([*STAND_TARGETS[:-1], STAND_TARGETS[-1] + 0.02 * step])
        assert state.joints is not None
        degrees = math.degrees(state.joints.positions[0])
        steps = (degrees + widest) * 255.0 / (2.0 * widest)
        assert steps == pytest.approx(round(steps), abs=1e-6)
        assert state.joints.velocity_error > 0.1  # [rad/s]
    pair = [Trial(Candidate(), (Velocity(0.2),), 3.0, Conditions(v1=v1)) for v1 in (False, True)]
    plain, rounded = run_trials(pair)
    assert rounded.mean('error') < plain.mean('error') + 0.02


class Interrupted(PhysicsArena):
    """An arena on a machine that pauses as often as is said, each time with a fall."""

    times = 0

    @property
    def interruption(self) -> str:
        """The pause, unless none is left."""
        self.times -= 1
        return 'a pause of 0.7 s' if self.times >= 0 else ''

    @interruption.setter
    def interruption(self, _: str) -> None: ...


@pytest.mark.slow
def test_what_the_machine_does_is_no_fall_of_the_robot(monkeypatch: pytest.MonkeyPatch) -> None:
    """A walk that it cut off is walked again; too many of them end the trial."""
    monkeypatch.setattr('quad_controller.policy_check.course.MAX_INTERRUPTIONS', 2)
    arena = Interrupted(RobotChoice(), Conditions())
    arena.times = 1
    walker = CourseWalker(arena, ROBOT, None)
    figures = walker.walk([Velocity(0.1)], 3.0, push=5.0)
    assert walker.interruptions == 1
    assert figures.falls == 1
    arena.times = 1000
    with pytest.raises(CheckError, match=r'too busy .* a pause of 0\.7 s'):
        walker.walk([Velocity(0.1)] * 2, 3.0, push=5.0)


def test_a_robot_that_is_silent_for_a_while_is_waited_for() -> None:
    """And that is noted, as what interrupted the walk."""
    physics, missing = PhysicsBackend(Robot(robot_urdf())), [None] * 3
    step = physics.step

    def late(targets: Sequence[float] | None) -> RobotState:
        if missing:
            missing.pop()
            raise NoAnswerError('no report for 0.5 s')
        return step(targets)

    physics.step = late  # type: ignore[method-assign]
    arena = SerialArena(ServedRobot(), physics)
    arena.step(None)
    assert 'no report' in arena.interruption
    arena.interruption = ''
    arena.step(None)
    assert arena.interruption == ''


@pytest.mark.slow
def test_the_gait_walks_through_the_whole_chain() -> None:
    """Servos, board, line, driver, estimator: it gets on, and its commands are timed."""
    with serial_arena(RobotChoice()) as arena:
        walker = CourseWalker(arena, ROBOT, None)
        end = time.monotonic() + DEADLINE
        measured = walk_on(arena, walker, end)
        while measured.metered.x < 0.1:
            assert time.monotonic() < end, measured
            measured = walk_on(arena, walker, end)
        assert measured.metered.energy > 0.0
        assert 0.0 < measured.timing.latency(0.5) < measured.timing.latency(1.0)
        walker.run(0.5, REST)


def walk_on(arena: SerialArena, walker: CourseWalker, end: float) -> Watched:
    """Walk for a second, from standing where a busy machine has brought the robot down."""
    if walker.is_down:
        walker.restart()
        walker.stand_up()
        arena.robot.begin()
    for _ in range(50):
        if walker.is_down or time.monotonic() > end:
            break
        walker.step(Velocity(0.2))
    return arena.robot.read()


# --- what is judged


def test_a_policy_that_goes_as_commanded_and_falls_no_oftener_stands_up() -> None:
    """Also where both fall alike; going astray is one's own, whatever the gait does."""
    fell = replace(FAIR, falls=1)
    assert list(against_gait(course(), course())) == []
    assert list(against_gait(course(FAIR, fell), course(FAIR, fell))) == []
    slow = course(replace(FAIR, went=Velocity(0.05)))
    (reason,) = against_gait(slow, slow)
    assert 'so does the gait' in reason


@pytest.mark.parametrize(
    ('changes', 'reason'),
    [
        ({'falls': 2}, 'it fell 2 times, the gait 0'),
        ({'went': Velocity(0.05)}, 'x went \\+0.050 of \\+0.200, too slow'),
        ({'went': Velocity(-0.001)}, 'x went -0.001 of \\+0.200, hardly any'),
        ({'went': Velocity(-0.2)}, 'the other way'),
        ({'torque_saturation': 0.4}, 'largest torque for 40% of the time'),
        ({'speed_saturation': 0.3}, 'largest speed for 30% of the time'),
        ({'time': 0.0}, 'never came to walk'),
    ],
)
def test_a_policy_that_does_worse_than_the_gait_does_not(
    changes: dict[str, Any], reason: str
) -> None:
    """With the reason."""
    found = list(against_gait(course(replace(FAIR, **changes)), course()))
    assert len(found) == 1
    assert re.search(reason, found[0])


def test_late_commands_are_named_and_say_nothing_of_a_policy() -> None:
    """Without clocks there is nothing to name."""
    late = course(replace(FAIR, timing=CommandTiming((0.004, 0.005, 0.006), (0.03,) * 3)))
    notes = ' '.join(timing_notes(late))
    assert '5.0 ms (median), goal 3 ms' in notes
    assert '30.0 ms off their period' in notes
    assert is_too_late(late, 0.02)
    fine = replace(FAIR, timing=CommandTiming((0.001,), (0.001,)))
    assert list(timing_notes(course(fine, fine))) == list(timing_notes(course())) == []
    assert not is_too_late(course(), 0.02)


# --- gains

FIRM = servo_response('firm')


def test_the_bandwidth_is_where_a_servo_has_lost_three_decibel() -> None:
    """By the transfer function itself."""
    for servo in (FIRM, servo_response('vendor_rl'), ServoResponse(5.0, 0.02, 1e-3)):
        s = 2j * math.pi * servo.bandwidth
        answer = servo.stiffness / (servo.inertia * s * s + servo.damping * s + servo.stiffness)
        assert abs(answer) == pytest.approx(math.sqrt(0.5))


@pytest.mark.parametrize(
    ('stiffness', 'damping', 'latency', 'words'),
    [
        (10.0, 0.3, 0.005, []),
        (1.1, 0.05, 0.005, ['pulls 9.1 times as hard']),
        (40.0, 0.3, 0.005, ['sag 4.0 times as far', 'times as slowly']),
        (10.0, 2.0, 0.005, ['times as fast']),
        (0.0, 0.3, 0.005, ['0 N m/rad']),
        (10.0, 0.3, 0.03, ['30 ms']),  # half of the period of 20 ms is near enough
    ],
)
def test_other_gains_than_those_of_the_servos_are_named_with_what_they_do(
    stiffness: float, damping: float, latency: float, words: list[str]
) -> None:
    """A warning for each that is far off, none for those that are near."""
    gains = Gains((10.0, stiffness), (0.3, damping))
    rows = gain_rows(gains, replace(FIRM, latency=latency), 0.02)
    warned = [row for row in rows if row.verdict.value == 'warn']
    assert len(warned) == len(words)
    for row, word in zip(warned, words, strict=True):
        assert word in row.found


@pytest.mark.slow
def test_a_policy_that_walks_nowhere_does_not_stand_up_beside_the_gait(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The report has a row for each command of each walker; what was not measured is empty."""
    fastest = course_for(None)[2::4]
    monkeypatch.setattr('quad_controller.policy_check.main.course_for', lambda _: fastest)
    still, report = write_policy(tmp_path / 'still.onnx', metadata()), tmp_path / 'report.csv'
    assert run([str(still), '--duration', '1', '--report', str(report)]) == ExitCode.DOES_NOT
    output = capsys.readouterr().out
    assert 'does not stand up:\n' in output
    assert 'hardly any' in output
    assert 'not stated' in output, 'the gains'
    rows = list(csv.DictReader(report.read_text(encoding='utf-8').splitlines()))
    walked = [(walker, command) for walker in ('policy', 'gait') for command in fastest]
    for row, (walker, command) in zip(rows, walked, strict=True):
        assert (row['walker'], row['axis']) == (walker, axis_of(command))
        assert float(row['commanded yaw [rad/s]']) == pytest.approx(command.yaw, abs=1e-3)
        assert (row['falls'], row['latency p50 [s]']) == ('0', '')
    slow = next(row for row in rows if row['axis'] == 'forward')
    assert abs(float(slow['went x [m/s]'])) < 0.05
