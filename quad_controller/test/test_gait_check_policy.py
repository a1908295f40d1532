# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The command that checks a policy: its table, its exit code, and a walk."""

from __future__ import annotations

from collections.abc import Sequence
import csv
import json
from pathlib import Path
import re

import numpy as np
import onnx
import pytest
import yaml

from quad_controller import find_policy
from quad_controller.attach_contract import run as attach
from quad_controller.policy.contract.build import build_contract
from quad_controller.policy.contract.mjlab import CONTRACT_KEY, read_metadata
from quad_controller.policy.contract.model import PolicyContract, Source
from quad_controller.policy.network import OnnxNetwork
from quad_controller.policy_check.course import course_for
from quad_controller.policy_check.main import ExitCode, run
from quad_gait_rig import joined, metadata, ROBOT, write_policy

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
