# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Whether a demo went well, and how it is written."""

from __future__ import annotations

from dataclasses import replace
import io
import math
import re

from hypothesis import given
from hypothesis import strategies as st
import pytest
from rich.console import Console

from demo_runner import DemoStatus
from quad_bringup.demo.figures import Figures
from quad_bringup.demo.period_statistics import PeriodFigures
from quad_bringup.demo.report import Measured, problems, progress_line, summary_lines
from quad_bringup.demo.segments import Segment, Velocity
from quad_bringup.demo.view import BODY_LINES, NARROWEST, QuadView

LEGS = ('fl', 'fr', 'bl', 'br')
JOINTS = [f'{leg}_{part}_joint' for leg in LEGS for part in ('hip', 'thigh', 'calf')]
WALK = Segment('walk', Velocity(forward=0.2), 8.0)
TURN = Segment('turn', Velocity(turn=0.8), 5.0)
GOOD = Figures(
    state='walk',
    commanded=WALK.velocity,
    measured=Velocity(0.196, 0.002, -0.01),
    odometry=Velocity(0.19, 0.0, 0.0),
    height=0.085,
    tilt=math.radians(1.0),
    tilt_max=math.radians(2.5),
    targets=dict.fromkeys(JOINTS, 0.5),
    positions=dict.fromkeys(JOINTS, 0.49),
    periods=PeriodFigures(50.0, 0.0001, 0.0009),
    battery=87.0,
)
SEGMENTS = [
    Measured(WALK, Velocity(0.196, 0.002, -0.01), Velocity(0.19, 0.0, 0.0)),
    Measured(TURN, Velocity(0.01, 0.0, 0.84), Velocity(0.0, 0.0, 0.8)),
]
VIEW = QuadView('XGO lite, simulated', LEGS)
STATUS = DemoStatus(12.34, 'walk', (), ('ros2 topic hz /joint_command',))


def test_a_robot_that_moves_as_commanded_is_no_problem() -> None:
    """The summary has commanded, measured, odometry, tilt and jitter."""
    assert problems(GOOD, SEGMENTS) == []
    lines = summary_lines(GOOD, SEGMENTS)
    assert max(map(len, lines)) < 80
    text = '\n'.join(lines)
    for words in ('+0.200', '+0.196', '+0.190', '+0.84', '2.5°', '50.0 Hz', '0.10/0.90 ms'):
        assert words in text


def test_a_slow_robot_that_stands_has_not_walked() -> None:
    """What may be missing of a crawl is less than the whole of it."""
    crawl = Segment('walk', Velocity(forward=0.04), 8.0)
    stands, walks = (Measured(crawl, Velocity(forward=speed), None) for speed in (0.0, 0.03))
    assert 'walk: commanded +0.040' in problems(GOOD, [stands])[0]
    assert problems(GOOD, [walks]) == []


@pytest.mark.parametrize(
    ('moved', 'words'),
    [
        (Velocity(0.12, 0.0, 0.0), 'walk: commanded .0.200.*moved .0.120'),
        (Velocity(0.2, 0.06, 0.0), 'walk: .*moved'),
        (Velocity(0.2, 0.0, 0.3), 'walk: .*moved'),
        (Velocity(math.nan, 0.0, 0.0), 'walk: .*moved'),
        (None, 'walk: no motion was measured'),
    ],
    ids=['slow', 'sideways', 'turning', 'nan', 'unknown'],
)
def test_a_robot_that_moves_otherwise_is_reported(moved: Velocity | None, words: str) -> None:
    """By the segment, with both velocities."""
    (text,) = problems(GOOD, [Measured(WALK, moved, None)])
    assert re.search(words, text)


def test_odometry_counts_where_there_is_no_ground_truth() -> None:
    """And only there."""
    good, bad = Velocity(forward=0.2), Velocity(forward=0.1)
    assert problems(GOOD, [Measured(WALK, None, good)]) == []
    assert problems(GOOD, [Measured(WALK, None, bad)])
    assert problems(GOOD, [Measured(WALK, good, bad)]) == []


@pytest.mark.parametrize(
    ('change', 'words'),
    [
        ({'fault': 'fallen: tilt 80°'}, 'in a fault: fallen'),
        ({'tilt_max': math.radians(20.0)}, 'leaned by 20.0°'),
        ({'tilt_max': math.nan}, 'leaned by'),
        ({'periods': PeriodFigures(31.0, 0.01, 0.02)}, '31.0 joint commands a second'),
        ({'periods': PeriodFigures()}, 'joint commands a second'),
    ],
    ids=['fault', 'tilt', 'no tilt', 'slow loop', 'no loop'],
)
def test_what_else_can_go_wrong_is_reported(change: dict[str, object], words: str) -> None:
    """One sentence each."""
    (text,) = problems(replace(GOOD, **change), SEGMENTS)  # type: ignore[arg-type]
    assert words in text


def test_progress_says_state_speeds_tilt_and_periods() -> None:
    """In one line, with or without a robot."""
    text = progress_line(GOOD)
    for words in ('walk', 'commanded +0.200', 'measured +0.196', 'tilt 1.0°', '50.0 Hz'):
        assert words in text
    assert progress_line(Figures()) == 'waiting for the controller'


def draw(figures: Figures, status: DemoStatus, width: int, height: int) -> list[str]:
    """Draw into a terminal; return its lines."""
    file = io.StringIO()
    console = Console(file=file, width=width, height=height, color_system=None)
    console.print(VIEW.render(figures, status, width, height))
    return file.getvalue().splitlines()


def test_the_table_has_speeds_legs_body_and_loop() -> None:
    """In the usual 80 x 24, nothing cut."""
    lines = draw(GOOD, STATUS, 80, 24)
    text = '\n'.join(lines)
    forward = next(line for line in lines if line.startswith('forward'))
    assert forward.split()[-3:] == ['+0.200', '+0.196', '+0.190']
    for leg in LEGS:
        assert next(line for line in lines if line.startswith(leg)).count('+0.500 +0.490') == 3
    for words in ('walk  12.3 s', '0.085 m', '1.0°', '87 %', '50.0 Hz', 'ros2 topic hz'):
        assert words in text
    assert '…' not in text


numbers = st.floats(-999, 999) | st.just(math.nan) | st.just(math.inf)
velocities = st.none() | st.builds(Velocity, numbers, numbers, numbers)
pictures = st.builds(
    Figures,
    state=st.sampled_from(['walk', 'fault', 'unknown']),
    fault=st.text('fault ', max_size=200),
    measured=velocities,
    odometry=velocities,
    height=numbers,
    tilt=numbers,
    tilt_max=numbers,
    targets=st.dictionaries(st.sampled_from(JOINTS), numbers),
    periods=st.builds(PeriodFigures, numbers, numbers, numbers),
    battery=numbers,
)


@pytest.mark.slow
@given(
    pictures,
    st.integers(NARROWEST, 180),
    st.integers(BODY_LINES, 40),
    st.lists(st.text('message ', min_size=1, max_size=200), max_size=5),
)
def test_the_picture_never_outgrows_the_terminal(
    figures: Figures, width: int, height: int, messages: list[str]
) -> None:
    """One line is left free and no row is broken, whatever there is to be shown."""
    lines = draw(figures, replace(STATUS, messages=messages), width, height)
    assert len(lines) < height
    assert all(len(line) <= width for line in lines)
    assert sum(line.startswith(LEGS) for line in lines) == len(LEGS)


@pytest.mark.parametrize(
    ('width', 'height', 'room'), [(80, 24, True), (79, 24, False), (80, 17, True), (80, 16, False)]
)
def test_too_small_a_terminal_is_reported_in_time(width: int, height: int, room: bool) -> None:
    """The usual 80 x 24 is enough."""
    assert VIEW.fits(width, height) is room
