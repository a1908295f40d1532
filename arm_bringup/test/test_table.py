# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The live table, drawn from synthetic figures into terminals of all sizes."""

from __future__ import annotations

from dataclasses import replace
import io

from hypothesis import given
from hypothesis import strategies as st
import pytest
from rich.console import Console
from urdf_reader import JointRange

from arm_bringup.demos.figures import AxisFigures, BusFigures, DriveFigures, Figures
from arm_bringup.demos.table import (
    ArmView,
    GAUGE_FROM,
    GAUGE_WIDTH,
    LINES_AROUND,
    NARROWEST,
    WORDS_FROM,
)
from demo_runner import DemoStatus

pytestmark = pytest.mark.slow

JOINTS = [f'panda_joint{i}' for i in range(1, 8)]
LIMITS = {name: JointRange(name, -2.0, 2.0, 1.0) for name in JOINTS}
DRIVE = DriveFigures(
    online=True,
    nmt='OPERATIONAL',
    state='Operation enabled',
    mode='Cyclic position',
    position=0.5,
    velocity=-0.25,
    following_error=0.004,
)
FIGURES = Figures(
    drives=dict.fromkeys(JOINTS, DRIVE),
    bus=BusFigures(2912.4, 26.9, 0, 0.00014, 0.00122, 3),
    axes=dict.fromkeys(JOINTS, AxisFigures(True, -0.4, 0.4, 0.01, 0.005)),
)
COMMANDS = ['source env.sh', 'ros2 topic hz /joint_states', f'ros2 {"x" * 100}']
VIEW = ArmView('panda on vcan0', LIMITS)
STATUS = DemoStatus(12.34, 'waving', (), COMMANDS)


def draw(figures: Figures, status: DemoStatus, width: int, height: int) -> list[str]:
    """Draw into a terminal; return its lines."""
    file = io.StringIO()
    console = Console(file=file, width=width, height=height, color_system=None)
    console.print(VIEW.render(figures, status, width, height))
    return file.getvalue().splitlines()


@pytest.mark.parametrize('width', [NARROWEST, GAUGE_FROM, WORDS_FROM, 200])
def test_every_joint_has_a_row_with_its_figures(width: int) -> None:
    """Nothing is cut, however wide the terminal is."""
    lines = draw(FIGURES, STATUS, width, 40)
    rows = [line for line in lines if line.startswith('panda_joint')]
    assert [row.split()[0] for row in rows] == JOINTS
    mode = 'Cyclic position' if width >= WORDS_FROM else 'CSP'
    for row in rows:
        for words in ('OPERATIONAL', 'Operation enabled', mode, '+0.500', '-0.250', '+0.004'):
            assert words in row
    assert '…' not in '\n'.join(lines)
    assert all(('●' in row) == (width >= GAUGE_FROM) for row in rows)


def test_bus_and_cycle_are_below() -> None:
    """Frames, load, losses, missed PDOs and jitter."""
    text = '\n'.join(draw(FIGURES, STATUS, 100, 40))
    for words in (
        '2912 frames/s',
        'load 27 %',
        '0 lost',
        '3 PDOs missed',
        'p50 0.14 ms',
        'p99 1.22 ms',
        'waving  12.3 s',
    ):
        assert words in text


states = st.sampled_from(['', 'Fault reaction active', 'Operation enabled', 'Ready to switch on'])
modes = st.sampled_from(['', 'No mode', 'Interpolated position', 'Cyclic velocity', 'Mode -3'])
nmts = st.sampled_from(['', 'PRE_OPERATIONAL', 'OFFLINE', 'STOPPED'])
numbers = st.floats(-999, 999) | st.just(float('nan')) | st.just(float('inf'))
drives = st.builds(DriveFigures, st.booleans(), nmts, states, modes, *[numbers] * 4, st.just(''))


@given(
    st.lists(drives, max_size=7),
    st.integers(NARROWEST, 180),
    st.integers(len(JOINTS) + LINES_AROUND, 40),
    st.lists(st.text('message ', min_size=1, max_size=200), max_size=5),
)
def test_the_picture_never_outgrows_the_terminal(
    found: list[DriveFigures], width: int, height: int, messages: list[str]
) -> None:
    """One line is left free and no row is broken, whatever there is to be shown."""
    figures = Figures(drives=dict(zip(JOINTS, found, strict=False)))
    lines = draw(figures, replace(STATUS, messages=messages), width, height)
    assert len(lines) < height
    assert all(len(line) <= width for line in lines)
    assert sum(line.startswith('panda_joint') for line in lines) == len(JOINTS)


def test_messages_come_before_commands() -> None:
    """In a small terminal a warning is more important than a hint."""
    status = replace(STATUS, messages=['master: [WARN] heartbeat lost'])
    small = '\n'.join(draw(FIGURES, status, 80, len(JOINTS) + LINES_AROUND + 2))
    assert 'heartbeat lost' in small
    assert 'second terminal' not in small
    large = '\n'.join(draw(FIGURES, status, 80, 40))
    assert 'heartbeat lost' in large
    assert 'ros2 topic hz /joint_states' in large


@pytest.mark.parametrize(
    ('position', 'place'), [(-2.0, 0), (0.0, GAUGE_WIDTH // 2), (2.0, -1), (-9.0, 0), (9.0, -1)]
)
def test_the_gauge_shows_where_a_joint_is_between_its_limits(position: float, place: int) -> None:
    """At its ends, in the middle, and at the end when it is outside."""
    figures = replace(FIGURES, drives={JOINTS[0]: replace(DRIVE, position=position)})
    row = next(line for line in draw(figures, STATUS, 140, 40) if line.startswith(JOINTS[0]))
    gauge = row.rstrip()[-GAUGE_WIDTH:]
    assert gauge[place] == '●'
    assert gauge.count('─') == GAUGE_WIDTH - 1


def test_before_the_first_message_the_rows_are_empty() -> None:
    """And the bus says that it waits."""
    lines = draw(Figures(), STATUS, 100, 40)
    assert any('waiting for the master' in line for line in lines)


@pytest.mark.parametrize(
    ('width', 'height', 'room'),
    [(80, 24, True), (79, 24, False), (80, 14, True), (80, 13, False)],
)
def test_too_small_a_terminal_is_noticed_in_time(width: int, height: int, room: bool) -> None:
    """The usual 80 x 24 is enough for seven joints."""
    assert VIEW.fits(width, height) is room
