# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""From /diagnostics to figures, and from figures to lines and verdicts."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
import math

from hypothesis import given
from hypothesis import strategies as st
import pytest
from urdf_reader import JointRange

from arm_bringup.demos.figures import AxisFigures, BusFigures, DriveFigures, Figures
from arm_bringup.demos.report import problems, progress_line, summary_lines, warnings

JOINTS = ['joint1', 'joint2']
RANGES = {name: JointRange(name, -2.0, 2.0, 1.0) for name in JOINTS}


@dataclass
class KeyValue:
    """As diagnostic_msgs/KeyValue."""

    key: str
    value: str


@dataclass
class Status:
    """As diagnostic_msgs/DiagnosticStatus."""

    name: str
    message: str = ''
    values: list[KeyValue] = field(default_factory=list)


def status(name: str, message: str = '', **values: str) -> Status:
    """Build a status."""
    return Status(name, message, [KeyValue(*pair) for pair in values.items()])


MESSAGE = [
    status(
        'master: bus',
        frames_per_second='2912.4',
        bus_load='26.91',
        frames_lost='0',
        jitter_p50='0.000140',
        jitter_p99='0.001220',
        missed_pdos='3',
    ),
    *(
        status(
            f'{joint}: drive',
            'all well',
            online='True',
            nmt_state='OPERATIONAL',
            state='Operation enabled',
            mode='Cyclic position',
            position='1.5',
            velocity='-0.25',
            setpoint='1.505',
            following_error='0.005',
        )
        for joint in JOINTS
    ),
]
AXES = {joint: AxisFigures(True, -0.45, 0.45, 0.012, 0.004) for joint in JOINTS}
READ = replace(Figures().updated(MESSAGE), axes=AXES)
GOOD = replace(READ, bus=replace(READ.bus, missed_pdos=0))


def test_figures_are_read_from_the_statuses() -> None:
    """Of bus and drives, with their units."""
    assert READ.bus == BusFigures(2912.4, 26.91, 0, 0.00014, 0.00122, 3)
    assert list(GOOD.drives) == JOINTS
    assert GOOD.drives['joint1'] == DriveFigures(
        online=True,
        nmt='OPERATIONAL',
        state='Operation enabled',
        mode='Cyclic position',
        position=1.5,
        velocity=-0.25,
        setpoint=1.505,
        following_error=0.005,
        message='all well',
    )
    assert GOOD.axes == AXES  # which are the demo's own
    assert GOOD.enabled == 2


def test_other_statuses_are_passed_over() -> None:
    """Other nodes publish diagnostics, too."""
    others = [status('battery', level='low'), status('joint1: encoder', position='7')]
    assert READ.updated(others) == READ


texts = st.dictionaries(
    st.sampled_from(['online', 'state', 'position', 'frames_lost', 'jitter_p50', 'setpoint']),
    st.sampled_from(['', 'nan', 'inf', '-1', '1e400', 'words of any kind', '0x12 text', '3 rad']),
)


@given(st.sampled_from(['master: bus', 'joint1: drive']), texts)
def test_no_text_in_a_status_is_an_error(name: str, values: dict[str, str]) -> None:
    """What is missing or is no number is shown as unknown."""
    figures = Figures().updated([status(name, **values)])
    lines = [progress_line(figures, RANGES), *summary_lines(figures, RANGES, 1.0)]
    assert not any(word in line for line in lines for word in ('nan', 'inf'))
    assert problems(figures, RANGES)


def test_a_good_demo_has_no_problems_and_a_summary_of_each_joint() -> None:
    """The summary names frames, losses, jitter, and range and path error of each joint."""
    assert problems(GOOD, RANGES) == []
    assert warnings(GOOD) == []
    text = '\n'.join(summary_lines(GOOD, RANGES, 12.0))
    for words in ('2/2 joints enabled', '2912 frames/s', 'lost 0', '0.14/1.22 ms', '12.0 s'):
        assert words in text
    row = next(line for line in text.splitlines() if line.startswith('joint2')).split()
    assert row == ['joint2', '-0.450', '0.450', '0.900', 'rad', '12.00', 'mrad', '4.00']


@pytest.mark.parametrize(
    ('drive', 'axis', 'words'),
    [
        (DriveFigures(message='offline: no answer'), AxisFigures(), 'not enabled: offline'),
        (DriveFigures(online=True, state='Fault'), AxisFigures(), 'not enabled: Fault'),
        (None, replace(GOOD.axes['joint2'], lowest=0.4), 'did not move'),
        (None, AxisFigures(), 'did not move'),
        (None, AxisFigures(True, -math.inf, math.inf), 'did not move'),
        (None, replace(GOOD.axes['joint2'], error_max=0.5), '0.500 rad away'),
    ],
    ids=['offline', 'fault', 'lazy', 'silent', 'infinite', 'astray'],
)
def test_a_joint_that_did_not_do_it_is_named(
    drive: DriveFigures | None, axis: AxisFigures, words: str
) -> None:
    """Only that one, with the reason."""
    drives = GOOD.drives if drive is None else {**GOOD.drives, 'joint2': drive}
    figures = replace(GOOD, drives=drives, axes={**GOOD.axes, 'joint2': axis})
    (problem,) = problems(figures, RANGES)
    assert problem.startswith('joint2')
    assert words in problem


@pytest.mark.parametrize(
    ('limits', 'moved', 'error', 'words'),
    [
        (JointRange('joint2', 0.0, 0.04, 0.1, 'm'), 0.02, 0.001, ''),
        (JointRange('joint2', 0.0, 0.04, 0.1, 'm'), 0.001, 0.0, 'did not move: 0.001 m, less'),
        (JointRange('joint2', 0.0, 0.04, 0.1, 'm'), 0.02, 0.01, '0.010 m away from its path'),
        (JointRange('joint2', 0.0, 0.35, 0.02, 'm'), 0.005, 0.001, ''),
        (JointRange('joint2', -math.inf, math.inf, 0.0), 0.05, 0.0, 'did not move: 0.050 rad'),
    ],
    ids=['gripper', 'stuck gripper', 'astray gripper', 'slow lift', 'endless'],
)
def test_a_joint_is_judged_in_its_own_unit_and_range(
    limits: JointRange, moved: float, error: float, words: str
) -> None:
    """A gripper has done it with 20 of its 40 mm, which is little for an arm."""
    axes = {**GOOD.axes, 'joint2': AxisFigures(True, 0.0, moved, error, error)}
    found = problems(replace(GOOD, axes=axes), {**RANGES, 'joint2': limits})
    assert [words in text for text in found] == [True] * bool(words)


def test_a_joint_without_diagnostics_is_a_problem() -> None:
    """An empty /diagnostics is no success."""
    assert [text.split()[0] for text in problems(Figures(), RANGES)] == JOINTS


def test_lost_frames_are_a_warning() -> None:
    """They are a matter of the host, not of the arm."""
    lost = replace(GOOD, bus=replace(GOOD.bus, lost=12))
    assert '12 frames were lost' in warnings(lost)[0]
    assert problems(lost, RANGES) == []


def test_late_answers_are_a_warning_and_judge_no_path() -> None:
    """An old measurement lies behind its set-point, as far as the joint went meanwhile."""
    axes = {name: replace(axis, error_max=0.5) for name, axis in GOOD.axes.items()}
    late = replace(GOOD, axes=axes, bus=replace(GOOD.bus, missed_pdos=7))
    assert '7 PDOs of drives missed their cycle' in warnings(late)[0]
    assert problems(late, RANGES) == []
    assert problems(replace(GOOD, axes=axes), RANGES)
