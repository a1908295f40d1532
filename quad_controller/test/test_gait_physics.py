# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The gait in physics: it goes as commanded, upright, and survives pushes."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from itertools import islice
import math
import operator
from random import Random

import pytest

from quad_builds import go2_urdf
from quad_controller import (
    BodyPose,
    Controller,
    find_policy,
    GaitGenerator,
    GaitParameters,
    load_policy,
    ParameterError,
    PolicyOptions,
    ServoModel,
    StateParameters,
    Velocity,
)
from quad_controller.gait.parameters import AS_TUNED, LOW_AND_WIDE
from quad_description import OdometryState, quadruped, robot_urdf, RobotState, Targets
from quad_gait_rig import FIRM, firm, MODEL, PERIOD, PhysicsRig
from quad_hardware.estimation import LegOdometry, OdometrySettings
from quad_sim import ServoModel as ServoModels
from quad_sim import Terrain
from quad_sim.physics import PhysicsBackend, Robot
from quad_sim.plant import parse_servo
from robot_primitives import settings_of

pytestmark = pytest.mark.slow

LEVEL = math.radians(5.0)


def goes(
    rig: PhysicsRig, velocity: Velocity, within: Velocity, mode: str = 'walk', tilt: float = LEVEL
) -> None:
    """Walk for eight seconds: as commanded, within a tolerance for each axis, and upright."""
    rig.mode(mode)
    rig.run(2.0, velocity)
    travel = rig.travel(8.0, velocity)
    assert not rig.faulted
    for axis in ('x', 'y', 'yaw'):
        went, commanded, most = (getattr(each, axis) for each in (travel, velocity, within))
        assert went == pytest.approx(commanded, abs=most), axis
    assert travel.tilt < tilt


@pytest.mark.parametrize(
    'velocity',
    [Velocity(0.2), Velocity(0.0, -0.1), Velocity(0.0, 0.0, 1.0), Velocity(0.15, 0.0, -0.6)],
)
def test_trot_goes_as_commanded(velocity: Velocity) -> None:
    """35 periods of trot keep speed and direction, and the body upright.

    The test of servos of any stiffness has other velocities.
    """
    goes(PhysicsRig(), velocity, Velocity(0.03, 0.02, max(0.02 * abs(velocity.yaw), 0.01)))


@pytest.mark.parametrize(
    'velocity', [Velocity(0.1), Velocity(0.3), Velocity(-0.2), Velocity(0.0, 0.15)]
)
def test_the_slowest_loop_that_is_allowed_walks_at_true_speed(velocity: Velocity) -> None:
    """A loop with fewer set-points in a period of the gait is refused."""
    slowest = next(span for name, _, span, _ in settings_of(StateParameters) if name == 'period')
    assert slowest is not None
    rig = PhysicsRig(states=StateParameters(period=slowest[1]))
    goes(rig, velocity, Velocity(0.025, 0.025, 0.1), tilt=2.0 * LEVEL)


def test_short_silences_of_joint_states_do_not_let_a_soft_robot_creep_down() -> None:
    """It gives way to its weight each time by as much as before, and no more."""
    silent = [False]
    rig = PhysicsRig(
        Robot(robot_urdf(), ServoModels.VENDOR_RL),
        sense=lambda state: replace(state, joints=None) if silent[0] else state,
    )
    rig.mode('walk')
    rig.run(0.5, Velocity(0.1))
    silent[0] = True
    rig.run(1.0)
    assert rig.faulted
    heights = []
    for _ in range(8):
        silent[0] = False
        rig.step(Velocity())
        silent[0] = True
        rig.run(0.3)
        heights.append(rig.robot.base_pose.position[2])
    assert min(heights) > heights[0] - 0.003


@pytest.mark.parametrize(('preset', 'arm'), [('mini', False), ('lite', True)])
def test_other_builds_of_the_robot_walk_too(preset: str, arm: bool) -> None:
    """What differs is read from the URDF: limits, and an arm's weight, which stays in place."""
    goes(PhysicsRig(urdf=robot_urdf(preset, arm)), Velocity(0.2), Velocity(0.03, 0.03, 0.1))


@pytest.mark.parametrize(
    'velocity', [Velocity(1.0), Velocity(-0.5), Velocity(0.0, 0.3), Velocity(0.0, 0.0, 1.0)]
)
def test_a_robot_of_another_size_trots_by_its_own_urdf(velocity: Velocity) -> None:
    """Three times the legs of the XGO: the gait's times grow with them, limits are the URDF's."""
    urdf, pose = go2_urdf(), {'hip': 0.0, 'thigh': 0.8, 'calf': -1.5}
    servo = parse_servo('kp=60,kv=5,damping=0.1,armature=0.01')
    start = {name: pose[name.split('_')[1]] for name in quadruped(urdf).names}
    gait = GaitParameters(
        nominal_height=0.28,
        swing_height=0.05,
        foot_speed=1.2,
        max_linear_velocity_x=1.2,
        max_linear_velocity_y=0.4,
        servo=ServoModel(kp=60.0, damping=5.1),
    )
    states = StateParameters(lie_height=0.12)
    rig = PhysicsRig(Robot(urdf, servo, pose=start), gait, urdf=urdf, states=states)
    goes(rig, velocity, Velocity(0.1, 0.1, 0.1), tilt=math.radians(12.0))


def test_servos_that_cannot_carry_another_robot_are_refused() -> None:
    """Those of the XGO under a robot of 15 kg, with what to set."""
    robot = quadruped(go2_urdf())
    with pytest.raises(ParameterError, match=r'sag by .* rad below .* kg; set servo_comp.*kp'):
        GaitGenerator(robot, GaitParameters(nominal_height=0.28))


@pytest.mark.parametrize('gait', ['crawl', 'pace'])
@pytest.mark.parametrize(
    'velocity', [Velocity(0.05), Velocity(0.0, 0.04), Velocity(0.0, 0.0, 0.4)]
)
def test_other_gaits_go_as_commanded(gait: str, velocity: Velocity) -> None:
    """Crawl and pace keep a fifth of the speed, at least, and do not fall."""
    rig = PhysicsRig(firm(), FIRM)
    goes(rig, velocity, Velocity(0.015, 0.015, 0.08), mode=f'gait:{gait}')


@pytest.mark.parametrize('kick', [(0.0, 0.5, 0.0), (0.5, 0.0, 0.0), (-0.5, 0.0, 0.0)])
def test_a_push_is_survived(kick: tuple[float, float, float]) -> None:
    """A change of the whole robot's velocity by 0.5 m/s throws it neither over nor off course."""
    rig = PhysicsRig()
    rig.mode('walk')
    rig.run(2.0, Velocity(0.2))
    rig.robot.kick(kick)
    rig.run(2.0, Velocity(0.2))
    assert not rig.faulted
    travel = rig.travel(4.0, Velocity(0.2))
    assert travel.x == pytest.approx(0.2, abs=0.03)
    assert travel.tilt < LEVEL


def test_a_lower_wider_stance_survives_more_pushes() -> None:
    """Pushes to each side of which half tip the gait tip no more than one with it."""
    falls = []
    for gait in (AS_TUNED, LOW_AND_WIDE):
        rigs = [PhysicsRig(gait=gait) for _ in range(8)]
        for side, rig in enumerate(rigs):
            angle = math.tau * side / len(rigs)
            rig.mode('walk')
            rig.run(2.0, Velocity(0.2))
            rig.robot.kick((1.3 * math.cos(angle), 1.3 * math.sin(angle), 0.0))
            rig.run(1.5, Velocity(0.2))
        falls.append(sum(rig.faulted for rig in rigs))
    usual, wide = falls
    assert usual >= 3
    assert wide <= 1


def test_a_whole_outing() -> None:
    """It stands up, walks about with every change of direction, and lies down where it stands."""
    rig = PhysicsRig()
    start = rig.robot.base_pose.position[2]
    rig.mode('walk')
    for velocity in (
        Velocity(0.3), Velocity(-0.2), Velocity(0.0, 0.1), Velocity(0.0, 0.0, 1.5),
        Velocity(0.15, 0.0, -0.6), Velocity(),
    ):  # fmt: skip
        rig.run(2.0, velocity)
    assert rig.tilt < LEVEL
    rig.mode('lie')
    rig.run(3.0)
    assert not rig.faulted
    assert rig.robot.base_pose.position[2] < start - 0.02
    assert rig.controller.status.unreachable == 0
    rig.mode('stand')
    rig.run(3.0)
    assert rig.state == 'stand'
    assert rig.robot.base_pose.position[2] == pytest.approx(start, abs=0.005)


def test_the_body_takes_its_pose_while_it_walks() -> None:
    """Lowered and leaning, the body keeps both and the speed."""
    rig = PhysicsRig()
    height = rig.robot.base_pose.position[2]
    rig.mode('walk')
    rig.controller.set_body_pose(BodyPose(z=-0.012, roll=0.1, pitch=0.08))
    rig.run(2.0, Velocity(0.1))
    travel = rig.travel(3.0, Velocity(0.1))
    roll, pitch, _ = rig.robot.base_pose.roll_pitch_yaw
    assert roll == pytest.approx(0.1, abs=0.03)
    assert pitch == pytest.approx(0.08, abs=0.03)
    assert rig.robot.base_pose.position[2] < height - 0.008
    assert travel.x == pytest.approx(0.1, abs=0.03)


@pytest.mark.parametrize(('speed', 'most'), [(0.1, 19.0), (0.2, 18.0)])
def test_a_trot_that_is_stopped_anywhere_leans_and_does_not_fall(
    speed: float, most: float
) -> None:
    """When reports vanish, the servos hold their targets, with two feet in the air."""
    tilts = []
    for phase in range(7):  # steps of half a period; the other half is its mirror image
        rig = PhysicsRig()
        rig.mode('walk')
        rig.run(1.0 + phase * PERIOD, Velocity(speed))
        held = rig.step(Velocity(speed))
        rig.tilt = 0.0
        rig.hold(1.5, held)
        tilts.append(math.degrees(rig.tilt))
    assert min(tilts) < 2.0
    assert 15.0 < max(tilts) < most  # below LEANING of tests/simulated_quad.py, which is 20


def test_levelling_turns_the_body_towards_level_on_a_slope() -> None:
    """Across a slope the body is tilted less with levelling than without."""
    tilts = []
    for gain in (0.0, 0.8):
        slope = Terrain.slope(math.radians(8.0), math.pi / 2)
        rig = PhysicsRig(firm(slope), replace(FIRM, level_gain=gain))
        rig.mode('walk')
        rig.run(2.0, Velocity(0.1))
        assert not rig.faulted
        tilts.append(abs(rig.robot.base_pose.roll_pitch_yaw[0]))
    assert tilts[1] < 0.75 * tilts[0]


@pytest.mark.parametrize(
    ('stiffness', 'delay', 'most'),
    [(1.1, 0.06, 0.05), (2.45, 0.02, 0.02), (2.45, 0.06, 0.02), (10.0, 0.04, 0.02)],
)
def test_the_gait_keeps_its_speed_on_servos_of_any_stiffness(
    stiffness: float, delay: float, most: float
) -> None:
    """With the dead band, backlash and delay of the nominal ones, when it knows how stiff."""
    nominal = ServoModels.NOMINAL.parameters
    gain = nominal.velocity_gain * stiffness / nominal.stiffness
    servo = replace(nominal, stiffness=stiffness, velocity_gain=gain, delay=delay)
    for velocity in (Velocity(0.1), Velocity(0.3), Velocity(-0.2), Velocity(0.0, 0.1)):
        gait = GaitParameters(servo=ServoModel(kp=stiffness))
        rig = PhysicsRig(Robot(robot_urdf(), servo), gait)
        rig.mode('walk')
        rig.run(2.0, velocity)
        travel = rig.travel(3.0, velocity)
        assert math.hypot(travel.x - velocity.x, travel.y - velocity.y) < most, velocity
        assert not rig.faulted


WAYS = Velocity(0.2), Velocity(-0.15), Velocity(0.0, 0.1)


@pytest.mark.parametrize(
    ('mode', 'velocity', 'slope', 'within', 'rightly'),
    [
        *(('walk', velocity, 0.0, 0.1, 0.9) for velocity in WAYS),
        *(('policy', velocity, 0.0, 0.1, 0.68) for velocity in WAYS),  # lifts its feet by 2 mm
        # feet stand on the ground and not on the horizon; they creep downhill, unfelt
        *(('walk', Velocity(0.2), slope, 0.2, 0.0) for slope in (8.0, -8.0)),
    ],
)
def test_odometry_follows_gait_and_policy(
    mode: str, velocity: Velocity, slope: float, within: float, rightly: float
) -> None:
    """Within a tenth of the way, by noisy joints; and it shows most contacts of the feet."""
    policy, random = None, Random(1)
    if mode == 'policy':
        stand = GaitGenerator(MODEL, FIRM).stand_targets
        policy = load_policy(find_policy('trot_ppo'), MODEL, stand, PolicyOptions(), PERIOD).runner
    ground = Terrain.slope(math.radians(slope))
    rig = PhysicsRig(firm(ground), FIRM, policy) if policy or slope else PhysicsRig()
    odometry = LegOdometry(OdometrySettings(), MODEL.foot_radius)

    def go(duration: float) -> tuple[OdometryState, float]:
        right, steps = 0, round(duration / PERIOD)
        for _ in range(steps):
            joints = [q + random.gauss(0.0, 0.0017) for q in rig.robot.joint_positions]
            feet, attitude = MODEL.foot_poses(joints), rig.robot.base_pose.orientation
            state = odometry.update(rig.robot.time, feet, attitude)
            right += sum(map(operator.eq, state.standing, rig.robot.foot_contacts))
            rig.step(velocity)
        return state, right / (len(feet) * steps)

    rig.mode(mode)
    (begun, _), start = go(3.0), rig.robot.base_pose
    (ended, right), end = go(5.0), rig.robot.base_pose
    found = ended.x - begun.x, ended.y - begun.y
    went = end.position[0] - start.position[0], end.position[1] - start.position[1]
    assert math.hypot(*went) > 0.3
    assert math.dist(found, went) < within * math.hypot(*went)
    assert right > rightly, right


def test_a_recorded_walk_is_commanded_alike() -> None:
    """The controller is a function of states and time: a replay asks for the same targets."""

    def command(states: Iterable[RobotState]) -> Iterator[Targets | None]:
        controller = Controller(MODEL, GaitParameters(), StateParameters())
        for tick, state in enumerate(states):
            yield controller.step(state, PERIOD).targets
            if tick == 0:
                controller.set_mode('walk')
            controller.set_velocity(Velocity(0.2))

    physics = PhysicsBackend(Robot(robot_urdf()), PERIOD)
    recorded, targets = [physics.reset()], []
    for sent in islice(command(recorded), 300):  # each state is what the targets before made
        targets.append(sent)
        recorded.append(physics.step(sent))
    assert recorded[-1].position is not None
    assert recorded[-1].position[0] > 0.2
    assert list(command(recorded[:-1])) == targets
