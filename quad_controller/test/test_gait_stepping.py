# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Laws of the feet: no slip, no jump, back home; and what is asked of the servos."""

from __future__ import annotations

import itertools
import math

from hypothesis import example, given, settings
from hypothesis import strategies as st
import numpy as np
import pytest

from quad_builds import urdf
from quad_controller import Gait, GaitGenerator, GaitParameters, Velocity
from quad_controller.gait.parameters import SCHEDULES, ServoModel
from quad_controller.gait.stepping import Stepper, SwingLift
from quad_controller.gait.velocity import REST, UPRIGHT
from quad_controller.states.motion import StepLimiter
from quad_description import quadruped, Targets

pytestmark = pytest.mark.slow

ROBOT = quadruped(urdf())
NEUTRAL = ROBOT.footprint(0.085, [0.0] * 12)
PERIOD = 0.02  # [s]
HEIGHT = 0.02  # [m]
LIFTS = {gait: SwingLift(ROBOT, NEUTRAL, SCHEDULES[gait], HEIGHT) for gait in Gait}
speeds = st.floats(-1.0, 1.0)

gaits = pytest.mark.parametrize('gait', Gait)
velocities = st.builds(Velocity, st.floats(-0.2, 0.2), st.floats(-0.1, 0.1), st.floats(-1.0, 1.0))


def stepper(gait: Gait = Gait.TROT) -> Stepper:
    """Return a stepper with feet at their places."""
    return Stepper(SCHEDULES[gait], NEUTRAL, lambda _x, _y: 0.02, 0.0)


@gaits
def test_enough_feet_stand_in_every_phase(gait: Gait) -> None:
    """Two feet stand in a trot and a pace, three in a crawl."""
    least = 3 if gait is Gait.CRAWL else 2
    schedule = SCHEDULES[gait]
    for phase in np.linspace(0.0, 1.0, 997, endpoint=False):
        stand = sum((phase + offset) % 1.0 < schedule.duty for offset in schedule.offsets)
        assert stand >= least


@gaits
@settings(max_examples=30)
@given(velocity=velocities)
def test_standing_feet_do_not_slip(gait: Gait, velocity: Velocity) -> None:
    """While a foot stands and the body moves on, the foot's place in the world stays."""
    walker = stepper(gait)
    dt = 0.002
    places: list[np.ndarray | None] = [None] * 4
    x = y = heading = 0.0
    for _ in range(round(1.2 * walker.schedule.period / dt)):
        before = walker.contacts
        feet = walker.step(velocity, dt)
        x += (velocity.x * math.cos(heading) - velocity.y * math.sin(heading)) * dt
        y += (velocity.x * math.sin(heading) + velocity.y * math.cos(heading)) * dt
        heading += velocity.yaw * dt
        turn = np.array(
            [[math.cos(heading), -math.sin(heading)], [math.sin(heading), math.cos(heading)]]
        )
        for index, (foot, stood, stands) in enumerate(
            zip(feet, before, walker.contacts, strict=True)
        ):
            if not (stands and stood):
                places[index] = None
                continue
            place = turn @ foot[:2] + [x, y]
            first = places[index]
            if first is None:
                places[index] = place
            else:
                # the rest is Euler's error of the integration, second order in dt
                assert np.linalg.norm(place - first) < 1e-3


@gaits
@settings(max_examples=30)
@given(commands=st.lists(st.tuples(velocities, st.integers(1, 30)), min_size=1, max_size=6))
@example([(Velocity(yaw=1.0), 24), (Velocity(), 5), (Velocity(yaw=1.0), 12)])  # ends in a sway
def test_feet_move_continuously_and_come_home(
    gait: Gait, commands: list[tuple[Velocity, int]]
) -> None:
    """Whatever is asked for, no foot jumps; after a stop all are where they began."""
    generator = GaitGenerator(ROBOT, GaitParameters())
    generator.choose(gait)
    at_home = generator.stand_targets
    previous = np.array(ROBOT.feet(at_home))
    rest = [(REST, 200)]
    for velocity, steps in [*commands, *rest]:
        for _ in range(steps):
            step = generator.step(velocity, UPRIGHT, None, PERIOD)
            feet = np.array(ROBOT.feet(step.targets))
            # a swing covers a stroke and a lift within some 6 steps
            assert np.linalg.norm(feet - previous, axis=1).max() < 0.03
            previous = feet
            if velocity is REST and generator.standing and all(step.contacts):
                break
    assert generator.standing
    assert step.targets == pytest.approx(at_home, abs=1e-5)
    assert all(step.contacts)


@settings(max_examples=20)
@given(velocity=velocities)
def test_no_foot_touches_ground_at_another_speed(velocity: Velocity) -> None:
    """A swinging foot leaves and meets the ground with the ground's velocity."""
    walker = stepper()
    dt = 2.5e-4
    previous = np.array(walker.step(velocity, dt))
    stood, last = walker.contacts, np.zeros((4, 2))
    for _ in range(2400):
        feet = np.array(walker.step(velocity, dt))
        speed = (feet - previous)[:, :2] / dt
        for index, (was, stands) in enumerate(zip(stood, walker.contacts, strict=True)):
            if was != stands:
                x, y = feet[index, :2]
                ground = [-velocity.x + velocity.yaw * y, -velocity.y - velocity.yaw * x]
                swung = last if stands else speed  # the last step in the air, or the first
                assert swung[index] == pytest.approx(ground, abs=0.01)
        previous, stood, last = feet, walker.contacts, speed


@given(velocities, velocities, st.floats(0.001, 0.1))
def test_velocity_changes_no_faster_than_allowed(
    present: Velocity, target: Velocity, dt: float
) -> None:
    """Accelerations are bounded and the target is reached in the end."""
    limits = GaitParameters().velocity_limits
    after = limits.approach(present, target, dt)
    change = math.hypot(after.x - present.x, after.y - present.y)
    assert change <= limits.acceleration * dt + 1e-12
    assert abs(after.yaw - present.yaw) <= limits.yaw_acceleration * dt + 1e-12
    for _ in range(2000):
        after = limits.approach(after, target, dt)
    assert after == target


@given(st.builds(Velocity, *[st.floats(-100, 100)] * 3))
def test_velocity_is_clamped_in_its_direction(velocity: Velocity) -> None:
    """The clamped velocity is in the ellipse and does not turn to a side."""
    limits = GaitParameters().velocity_limits
    clamped = limits.clamp(velocity)
    assert math.hypot(clamped.x / limits.x, clamped.y / limits.y) <= 1.0 + 1e-12
    assert abs(clamped.yaw) <= limits.yaw
    assert clamped.x * velocity.y == pytest.approx(clamped.y * velocity.x, abs=1e-9)


@gaits
def test_gait_changes_only_at_rest(gait: Gait) -> None:
    """Asked for another gait while it walks, the robot stops first and then goes on."""
    generator = GaitGenerator(ROBOT, GaitParameters())
    for _ in range(60):
        generator.step(Velocity(0.1), UPRIGHT, None, PERIOD)
    generator.choose(gait)
    seen = [generator.gait]
    for _ in range(200):
        generator.step(Velocity(0.1), UPRIGHT, None, PERIOD)
        if generator.gait is not seen[-1]:
            assert generator.velocity.x <= 0.021
            seen.append(generator.gait)
    assert seen[-1] is gait
    assert generator.velocity.x > 0.03


def steady(gait: Gait, velocity: Velocity, servo: ServoModel | None) -> list[Targets]:
    """Return the targets of a gait from its start on."""
    generator = GaitGenerator(ROBOT, GaitParameters(servo=servo))
    generator.choose(gait)
    return [generator.step(velocity, UPRIGHT, None, PERIOD).targets for _ in range(300)]


def fastest(rows: list[Targets]) -> float:
    """Return the largest speed of a target as a share of its joint's, in a gait that goes on."""
    return max(
        abs(after - before) / (limits.velocity * PERIOD)
        for one, other in itertools.pairwise(rows[100:])
        for before, after, limits in zip(one, other, ROBOT.limits, strict=True)
    )


@pytest.mark.parametrize(
    ('gait', 'velocity', 'most'),
    [
        (Gait.TROT, Velocity(0.2), 1.0),
        (Gait.TROT, Velocity(-0.2), 1.0),
        (Gait.TROT, Velocity(0.0, 0.15), 1.0),
        (Gait.TROT, Velocity(0.0, 0.0, 1.5), 1.0),
        (Gait.TROT, Velocity(0.15, 0.0, 0.6), 1.0),
        (Gait.TROT, Velocity(0.3), 1.15),  # a lower foot would scuff; the controller cuts it
        (Gait.CRAWL, Velocity(0.3), 1.0),  # clamped, as the next ones are
        (Gait.CRAWL, Velocity(0.0, 0.15), 1.0),
        (Gait.PACE, Velocity(0.3), 1.0),
        (Gait.PACE, Velocity(yaw=1.5), 1.0),
    ],
)
def test_no_joint_is_asked_for_more_than_its_speed(
    gait: Gait, velocity: Velocity, most: float
) -> None:
    """In every direction, at what the README names; slow gaits also when asked for more.

    That is the motion; set-points that push soft servos are ahead of it by their speed.
    """
    assert fastest(steady(gait, velocity, None)) <= most


@pytest.mark.parametrize(
    ('gait', 'velocity'),
    [
        (Gait.TROT, Velocity(0.2)),
        (Gait.TROT, Velocity(0.3)),
        (Gait.CRAWL, Velocity(0.0, 0.15)),
        (Gait.PACE, Velocity(yaw=1.5)),
    ],
)
def test_set_points_ahead_of_soft_servos_are_cut_to_the_speed_of_joints(
    gait: Gait, velocity: Velocity
) -> None:
    """The compensation asks for more than a joint's speed; the controller's limiter lets none by.

    What it cuts is made up for before the next step, and counted.
    """
    rows = steady(gait, velocity, ServoModel())
    assert fastest(rows) > 1.0
    limiter = StepLimiter(ROBOT.limits, PERIOD)
    sent = [limiter.step(row, PERIOD) for row in rows]
    assert fastest(sent) <= 1.0 + 1e-9
    assert limiter.limited
    late = np.abs(np.array(rows) - np.array(sent))[100:]
    assert late.min(axis=0).max() < 1e-9
    assert late.max() < 0.12  # [rad]


@given(st.sampled_from(Gait), speeds, speeds)
@example(Gait.CRAWL, 0.06, 0.0)
@example(Gait.TROT, 0.1, 0.0)
def test_a_foot_is_lifted_less_the_faster_it_is_and_never_dragged(
    gait: Gait, x: float, y: float
) -> None:
    """Whatever its direction, and beyond what the gait does; slow, as high as commanded."""
    lift = LIFTS[gait]
    slow, fast = lift.height(0.5 * x, 0.5 * y), lift.height(x, y)
    assert 0.35 * HEIGHT < fast <= slow + 1e-12 <= HEIGHT + 2e-12
    assert lift.height(-x, -y) == fast
    if y == 0.0 and abs(x) <= {Gait.CRAWL: 0.06, Gait.TROT: 0.1}.get(gait, -1.0):
        assert fast == HEIGHT
