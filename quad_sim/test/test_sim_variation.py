# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A robot that differs from what it was made as, and the same robot as MJCF."""

from __future__ import annotations

import math
from pathlib import Path
from xml.etree import ElementTree as ET

import mujoco
import numpy as np
import pytest

from quad_description import robot_urdf
from quad_description.presets import run as print_urdf
from quad_sim import ServoModel, ServoParameters, Terrain
from quad_sim.export_mjcf import run
from quad_sim.physics import Robot, Variation
from quad_sim.physics.model import build_model
from quad_sim.physics.robot import TIMESTEP
from quad_sim.plant import parse_servo

FIRM = ServoModel.FIRM.parameters


def settled(robot: Robot) -> tuple[object, ...]:
    """Return the state after a second of moving."""
    start = robot.joint_positions
    for step in range(50):
        robot.set_targets((start + 0.1 * math.sin(0.4 * step)).tolist())
        robot.step(0.02)
    return robot.base_pose, robot.joint_positions.tolist(), robot.joint_torques.tolist()


def test_a_varied_robot_is_the_one_that_was_made_so() -> None:
    """Softer servos on smoother ground are what those arguments make."""
    varied = Robot(robot_urdf(), FIRM)
    late = {'delay': 0.03, 'backlash': 0.02, 'refresh': 0.04}
    varied.reset(variation=Variation(friction=0.3, stiffness=0.5, damping=2.0, **late))
    softer = ServoParameters(
        stiffness=0.5 * FIRM.stiffness,
        velocity_gain=FIRM.velocity_gain,  # half as stiff, twice as damped
        damping=2.0 * FIRM.damping,
        interpolation=FIRM.interpolation,
        **late,
    )
    made = Robot(robot_urdf(), softer, Terrain(friction=0.3))
    assert settled(varied) == settled(made)


FIXED = """<link name="base_link"/><joint name="floating_base" type="fixed">
<parent link="base_link"/><child link="trunk"/></joint></robot>"""
A1 = robot_urdf().replace('"base_link"', '"trunk"').replace('</robot>', FIXED)
"""A trunk that is fixed to a link without shape, as that of Unitree's A1."""


def test_a_fixed_trunk_is_the_body() -> None:
    """The legs touch it where they touch any trunk."""
    robots = Robot(robot_urdf(), FIRM), Robot(A1, FIRM)
    for robot in robots:
        robot.set_targets([-0.5, -1.5, -1.5] * 4)
        robot.step(0.6)
    plain, fixed = (robot.joint_positions for robot in robots)
    assert fixed == pytest.approx(plain, abs=1e-6)


@pytest.mark.parametrize('urdf', [robot_urdf(), A1])
def test_the_trunk_gets_heavier(urdf: str) -> None:
    """By its own mass only; the legs carry it, and it turns more slowly."""
    plain, heavy = Robot(urdf), Robot(urdf)
    heavy.reset(variation=Variation(trunk_mass=2.0))
    assert plain.mass < heavy.mass < 2.0 * plain.mass
    for robot in (plain, heavy):
        robot.step(0.5)
    carried = [np.abs(robot.joint_torques).sum() for robot in (plain, heavy)]
    assert carried[1] > 1.3 * carried[0]
    for robot in (plain, heavy):
        robot.push((0.0, 3.0, 0.0), 0.02)
        robot.step(0.02)
    assert abs(heavy.base_velocity.linear[1]) < 0.8 * abs(plain.base_velocity.linear[1])


def test_a_servo_that_was_off_holds_with_its_own_stiffness() -> None:
    """That of the variation."""
    one, other = Robot(robot_urdf()), Robot(robot_urdf())
    for robot in (one, other):
        robot.reset(variation=Variation(stiffness=0.5))
    other.set_torque(False, ['fl_calf_joint'])
    other.set_torque(True, ['fl_calf_joint'], hold=False)
    assert settled(one) == settled(other)


def of_dynamics(model: mujoco.MjModel) -> dict[str, np.ndarray]:
    """Return the arrays that decide how a model moves."""
    names = (
        *('body_mass', 'body_inertia', 'body_pos', 'jnt_range'),
        *('dof_damping', 'dof_armature', 'dof_frictionloss'),
        *('actuator_gainprm', 'actuator_biasprm', 'actuator_forcerange', 'actuator_ctrlrange'),
        *('sensor_type', 'sensor_adr'),
    )
    return {name: getattr(model, name) for name in names}


def test_mjcf_is_the_same_robot(tmp_path: Path) -> None:
    """Masses, joints, servos and sensors; on the floor it moves as ours does from its keyframe.

    Newton reads position servos alone as servos; MuJoCo Warp refuses the flag `autoreset`.
    """
    path = tmp_path / 'xgo.xml'
    servo = 'kp=6,kv=0.2,damping=0.05,interpolation=0'
    assert run([str(path), '--servo', servo, '--floor']) == 0
    model = mujoco.MjModel.from_xml_path(str(path))
    parameters = parse_servo(servo)
    assert isinstance(parameters, ServoParameters)
    original = build_model(robot_urdf(), parameters, Terrain(), TIMESTEP)
    for name, values in of_dynamics(original).items():
        assert getattr(model, name) == pytest.approx(values, rel=1e-4, abs=1e-6), name
    robot = Robot(robot_urdf(), parameters)
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key('stand').id)
    start = robot.joint_positions
    for step in range(50):
        targets = start + 0.05 * math.sin(0.3 * step)
        robot.set_targets(targets.tolist(), 0.0)
        data.ctrl[:] = targets
        robot.step(0.02)
        mujoco.mj_step(model, data, 10)
    assert data.qpos[:3] == pytest.approx(robot.base_pose.position, abs=2e-3)
    root = ET.parse(path)  # noqa: S314  # written by us
    servos = list(root.iter('position'))
    assert [(each.get('kp'), each.get('kv')) for each in servos] == [('6', '0.2')] * 12
    assert all(each.get('forcerange') and each.get('ctrlrange') for each in servos)
    assert not list(root.iter('general'))
    assert not model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_AUTORESET


def test_other_tools_read_the_robot_alone(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """As MJCF without a floor for a scene of the trainer, with feet to give friction to by name.

    And as URDF: base_footprint would be a body without mass on a joint of its own.
    """
    path = tmp_path / 'xgo.xml'
    assert run([str(path), '--servo', 'vendor_rl']) == 0
    model = mujoco.MjModel.from_xml_path(str(path))
    assert mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_GEOM, 'floor') == -1
    robot = Robot(robot_urdf())
    assert all(model.geom(foot).name == foot for foot in robot.feet)
    assert tuple(model.actuator(index).name for index in range(model.nu)) == robot.joint_names
    capsys.readouterr()
    assert print_urdf(['--preset', 'lite']) == 0
    assert mujoco.MjModel.from_xml_string(capsys.readouterr().out).nq == 12
    assert print_urdf(['--base-footprint']) == 0
    assert 'base_footprint' in capsys.readouterr().out


def test_a_file_that_cannot_be_written_is_reported(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """As are servos that there are not."""
    assert run([str(tmp_path / 'no' / 'xgo.xml')]) == 1
    assert run([str(tmp_path / 'xgo.xml'), '--servo', 'wrong']) == 1
    said = capsys.readouterr().err
    assert 'No such file' in said
    assert '--servo' in said


def test_bumps_are_as_high_as_the_variation_says() -> None:
    """A robot that slides over them is shaken more by higher ones, and not by none."""
    ground = Terrain(friction=0.05, roughness=0.02, seed=1)

    def largest_tilt(bumps: float) -> float:
        robot, tilt = Robot(robot_urdf(), FIRM, ground), 0.0
        robot.reset(variation=Variation(bumps=bumps))
        robot.kick((1.0, 0.0, 0.0))
        for _ in range(50):
            robot.step(0.02)
            tilt = max(tilt, robot.base_pose.tilt)
        return tilt

    none, half, all_ = map(largest_tilt, (0.0, 0.5, 1.0))
    assert none < 0.01
    assert 0.03 < half < all_
