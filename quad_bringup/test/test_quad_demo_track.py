# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""From poses to velocities of the body: laws on random motions."""

from __future__ import annotations

import math

from hypothesis import given
from hypothesis import strategies as st
import pytest

from quad_bringup.demo.segments import Velocity
from quad_bringup.demo.track import mean_velocity, Milestone, Pose, Track
from quad_description.rotations import tilt_of

PERIOD = 0.02
"""Time between two poses in [s]."""

speed = st.floats(-0.5, 0.5)
rate = st.floats(-3.0, 3.0)
angle = st.floats(-math.pi, math.pi)


def pose(stamp: float, x: float, y: float, yaw: float) -> Pose:
    """Make a pose of a level body."""
    return Pose(stamp, x, y, 0.1, (0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2)))


def drive(
    track: Track, velocity: Velocity, start: tuple[float, float, float], time: float
) -> None:
    """Let a body move at a constant velocity of its own frame: along a circle."""
    x, y, yaw = start
    for index in range(round(time / PERIOD) + 1):
        elapsed = index * PERIOD
        turned = velocity.turn * elapsed
        # the mean direction of a circle's chord is that at half the angle
        chord = math.sin(turned / 2) / (turned / 2) * elapsed if abs(turned) > 1e-9 else elapsed
        heading = yaw + turned / 2
        cosine, sine = math.cos(heading), math.sin(heading)
        dx = chord * (cosine * velocity.forward - sine * velocity.left)
        dy = chord * (sine * velocity.forward + cosine * velocity.left)
        track.take(pose(100.0 + elapsed, x + dx, y + dy, yaw + turned))


@given(st.builds(Velocity, speed, speed, rate), st.tuples(speed, speed, angle))
def test_a_constant_velocity_of_the_body_is_found_wherever_it_goes(
    velocity: Velocity, start: tuple[float, float, float]
) -> None:
    """Over many turns, too: the angle is not wrapped."""
    track = Track()
    drive(track, velocity, start, 4.0)
    assert track.milestone is not None
    mean = mean_velocity(Milestone(100.0), track.milestone)
    for found in (mean, track.velocity):
        assert found is not None
        assert found.forward == pytest.approx(velocity.forward, abs=2e-4)
        assert found.left == pytest.approx(velocity.left, abs=2e-4)
        assert found.turn == pytest.approx(velocity.turn, abs=1e-6)


def test_the_velocity_of_the_moment_forgets_what_was_before() -> None:
    """It is that of the last second."""
    track = Track()
    drive(track, Velocity(forward=0.3), (0.0, 0.0, 0.0), 2.0)
    last = 0.6
    for index in range(100):
        track.take(pose(102.0 + (index + 1) * PERIOD, last, 0.0, 0.0))
    assert track.velocity is not None
    assert track.velocity.forward == pytest.approx(0.0, abs=1e-9)


def test_a_pose_that_is_not_newer_is_passed_over() -> None:
    """Messages that come twice, or out of order, cover no way."""
    track = Track()
    for stamp, x in ((1.0, 0.0), (2.0, 0.2), (2.0, 0.9), (1.5, 5.0), (3.0, 0.4)):
        track.take(pose(stamp, x, 0.0, 0.0))
    assert track.milestone == Milestone(3.0, pytest.approx(0.4), 0.0, 0.0)  # type: ignore[arg-type]


def test_nothing_is_known_before_two_poses() -> None:
    """And nothing is divided by zero."""
    track = Track()
    assert (track.velocity, track.milestone) == (None, None)
    track.take(pose(1.0, 0.0, 0.0, 0.0))
    assert track.velocity is None
    assert track.milestone is not None
    assert mean_velocity(track.milestone, track.milestone) is None


@given(st.floats(0.0, math.pi), angle, angle)
def test_tilt_is_the_angle_of_the_body_from_the_vertical(
    lean: float, direction: float, yaw: float
) -> None:
    """Whatever its heading and the direction in which it leans are."""
    axis = (math.cos(direction), math.sin(direction))
    sine, cosine = math.sin(lean / 2), math.cos(lean / 2)
    half = math.sin(yaw / 2), math.cos(yaw / 2)
    leaned = (sine * axis[0], sine * axis[1], 0.0, cosine)
    rotation = (
        half[1] * leaned[0] - half[0] * leaned[1],
        half[1] * leaned[1] + half[0] * leaned[0],
        half[0] * leaned[3],
        half[1] * leaned[3],
    )
    assert tilt_of(rotation) == pytest.approx(lean, abs=1e-6)
