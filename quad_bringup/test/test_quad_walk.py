# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What the demo of the quadruped measures, and what it calls wrong."""

from __future__ import annotations

import argparse
import io
import math
import re

from hypothesis import given
from hypothesis import strategies as st
from nav_msgs.msg import Odometry
import pytest
from rich.console import Console

from process_supervisor import RosOptions
from quad_bringup.bringup import Stack
from quad_bringup.walk import Segment, STANDSTILL, Track, Walk, wrong_speed
from quad_controller import Velocity

PERIOD = 0.02
"""Time between two poses in [s]."""

speed = st.floats(-0.5, 0.5)
rate = st.floats(-3.0, 3.0)
angle = st.floats(-math.pi, math.pi)
AHEAD = Velocity(x=0.2)


def pose(stamp: float, x: float, y: float, yaw: float) -> Odometry:
    """Make a pose of a level body."""
    message = Odometry()
    message.header.stamp.sec = int(stamp)
    message.header.stamp.nanosec = round(1e9 * (stamp % 1.0))
    message.pose.pose.position.x, message.pose.pose.position.y = x, y
    turn = message.pose.pose.orientation
    turn.z, turn.w = math.sin(yaw / 2), math.cos(yaw / 2)
    return message


def drive(
    track: Track, velocity: Velocity, start: tuple[float, float, float], time: float
) -> None:
    """Move a body at a constant velocity of its own frame: along a circle."""
    x, y, yaw = start
    for index in range(round(time / PERIOD) + 1):
        elapsed = index * PERIOD
        turned = velocity.yaw * elapsed
        # the mean direction of a circle's chord is that at half the angle
        chord = math.sin(turned / 2) / (turned / 2) * elapsed if abs(turned) > 1e-9 else elapsed
        heading = yaw + turned / 2
        cosine, sine = math.cos(heading), math.sin(heading)
        dx = chord * (cosine * velocity.x - sine * velocity.y)
        dy = chord * (sine * velocity.x + cosine * velocity.y)
        track.take(pose(100.0 + elapsed, x + dx, y + dy, yaw + turned))


@given(st.builds(Velocity, speed, speed, rate), st.tuples(speed, speed, angle))
def test_a_constant_velocity_of_the_body_is_found_wherever_it_goes(
    velocity: Velocity, start: tuple[float, float, float]
) -> None:
    """Over many turns, too: the angle is not wrapped."""
    track = Track()
    drive(track, velocity, start, 4.0)
    for found in (track.mean_since(100.0, STANDSTILL), track.velocity):
        assert found is not None
        assert found.x == pytest.approx(velocity.x, abs=2e-4)
        assert found.y == pytest.approx(velocity.y, abs=2e-4)
        assert found.yaw == pytest.approx(velocity.yaw, abs=1e-6)
    # a pose that is not newer covers no way; one pose is no motion
    latest = (track.stamp, track.way)
    for stamp in (track.stamp, track.stamp - 0.5):
        track.take(pose(stamp, 9.0, 9.0, 1.0))
    assert (track.stamp, track.way) == latest
    assert track.mean_since(*latest) is None
    assert Track().velocity is None


CRAWL = Velocity(x=0.04)


@pytest.mark.parametrize(
    ('commanded', 'moved', 'odometry', 'words'),
    [
        (AHEAD, Velocity(0.196, 0.002, -0.01), None, ''),
        (AHEAD, Velocity(0.12, 0.0, 0.0), None, 'walk: commanded .0.200.*moved .0.120'),
        (AHEAD, Velocity(0.2, 0.06, 0.0), None, 'walk: .*moved'),
        (AHEAD, Velocity(0.2, 0.0, 0.3), None, 'walk: .*moved'),
        (AHEAD, Velocity(math.nan, 0.0, 0.0), None, 'walk: .*moved'),
        (AHEAD, None, None, 'walk: no motion was measured'),
        # what may be missing of a crawl is less than the whole of it
        (CRAWL, STANDSTILL, None, r'walk: commanded \+0.040'),
        (CRAWL, Velocity(x=0.03), None, ''),
        # odometry is second
        (AHEAD, None, AHEAD, ''),
        (AHEAD, None, Velocity(x=0.1), 'walk: '),
        (AHEAD, AHEAD, Velocity(x=0.1), ''),
    ],
)
def test_a_robot_that_moves_otherwise_is_reported(
    commanded: Velocity, moved: Velocity | None, odometry: Velocity | None, words: str
) -> None:
    """By the segment, with both velocities."""
    reported = wrong_speed(Segment('walk', 8.0, commanded, moved, odometry))
    assert bool(reported) is bool(words)
    assert re.search(words, reported)


@pytest.mark.parametrize('is_known', [False, True])
def test_the_table_fits_a_usual_terminal(is_known: bool) -> None:
    """80 columns, in as many lines as it says, also before the robot is seen."""
    quad = Stack('/tmp/xgo', simulate=True)
    walk = Walk(quad, RosOptions(), argparse.Namespace(policy=None, gait='crawl', duration=None))
    if is_known:
        walk.fault, walk.tilt, walk.battery = 'fallen ' * 20, 1.0, 99.0
        drive(walk.truth, Velocity(-0.2, -0.1, -1.5), (0.0, 0.0, 0.0), 1.0)
    console = Console(file=io.StringIO(), width=80, height=24)
    lines = [line for part in walk.table(80) for line in console.render_lines(part, pad=False)]
    assert len(lines) == Walk.lines - 2  # a title, and one that is left free
    texts = [''.join(each.text for each in line) for line in lines]
    assert max(map(len, texts)) <= 80
    assert any('-1.500' in text for text in texts) == is_known
    assert ('waiting for the controller' in walk.progress()) == (not walk.state)
    assert walk.share < 1.0
