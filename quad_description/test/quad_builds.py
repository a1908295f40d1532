# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""URDFs of quadrupeds for tests, made from numbers."""

from __future__ import annotations

from dataclasses import dataclass

from quad_description import LEGS


@dataclass(frozen=True)
class Build:
    """What differs between two robots; lengths in [m], angles in [rad]."""

    thigh: float = 0.06
    calf: tuple[float, float] = (0.0715, -0.0226)
    offset: tuple[float, float, float] = (-0.0186, 0.0496, 0.0)
    foot_inward: float = 0.0186
    hip_sign: int = -1
    pitch_axis: str = '0 1 0'
    calf_range: tuple[float, float] = (-1.134, 1.047)
    arm: bool = False


def joint(
    name: str, links: tuple[str, str], xyz: str, axis: str, limits: tuple[float, float]
) -> str:
    """Return a revolute joint and its child, which weighs 20 g."""
    parent, child = links
    return (
        f'<joint name="{name}" type="revolute"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{xyz}"/><axis xyz="{axis}"/>'
        f'<limit lower="{limits[0]}" upper="{limits[1]}" effort="0.45" velocity="10"/></joint>'
        f'<link name="{child}"><inertial><mass value="0.02"/></inertial></link>'
    )


def leg(name: str, build: Build) -> str:
    """Return the three joints of a leg and its foot."""
    front, side = (1 if name[0] == 'f' else -1), (1 if name[1] == 'l' else -1)
    x, y, z = build.offset
    hip, thigh, calf = (f'{name}_{part}_joint' for part in ('hip', 'thigh', 'calf'))
    return (
        joint(
            hip, ('base_link', f'{name}_hip'),
            f'{-0.0256 + front * 0.075} {side * 0.0225} -0.022',
            f'{build.hip_sign * side} 0 0', (-0.6, 0.6),
        )
        + joint(
            thigh, (f'{name}_hip', f'{name}_thigh'), f'{x} {side * y} {z}', build.pitch_axis,
            (-1.22, 1.91),
        )
        + joint(
            calf, (f'{name}_thigh', f'{name}_calf'), f'0 0 {-build.thigh}', build.pitch_axis,
            build.calf_range,
        )
        + f'<joint name="{name}_foot_joint" type="fixed"><parent link="{name}_calf"/>'
        f'<child link="{name}_foot"/>'
        f'<origin xyz="{build.calf[0]} {-side * build.foot_inward} {build.calf[1]}"/></joint>'
        f'<link name="{name}_foot"/>'
    )  # fmt: skip


def urdf(build: Build | None = None) -> str:
    """Return the URDF of a robot."""
    build = build or Build()
    arm = joint('arm_yaw_joint', ('base_link', 'arm'), '0.03 0 0.01', '0 0 1', (-3.14, 3.14))
    return (
        '<robot name="test"><link name="base_link"><inertial><mass value="0.4"/>'
        '<origin xyz="-0.05 0 -0.02"/></inertial></link>'
        + ''.join(leg(name, build) for name in LEGS)
        + (arm if build.arm else '')
        + '</robot>'
    )


GO2_JOINTS = {  # place, axis, limits [rad], torque [N m] and speed [rad/s] of Unitree's URDF
    'hip': ('{x} {hip_y} 0', '1 0 0', (-1.0472, 1.0472), 23.7, 30.1),
    'thigh': ('0 {thigh_y} 0', '0 1 0', (-1.5708, 3.4907), 23.7, 30.1),
    'calf': ('0 0 -0.213', '0 1 0', (-2.7227, -0.83776), 45.43, 15.7),
}
GO2_MASSES = {'hip': (0.678, 0.0, 0.0007), 'thigh': (1.152, -0.027, 0.005),
              'calf': (0.154, -0.1, 0.001)}  # fmt: skip
"""Mass [kg], centre below the joint [m], moment of inertia [kg m2]."""


def go2_urdf() -> str:
    """Return a robot with lengths, masses, limits and names of a Unitree Go2."""
    parts = [
        '<robot name="go2">' + body('base', 6.921, 0.0, 0.08) + '<link name="imu_link"/>'
        '<joint name="imu" type="fixed"><parent link="base"/><child link="imu_link"/></joint>'
    ]
    for name in ('FL', 'FR', 'RL', 'RR'):
        front, side = (1 if name[0] == 'F' else -1), (1 if name[1] == 'L' else -1)
        places = {'x': 0.1934 * front, 'hip_y': 0.0465 * side, 'thigh_y': 0.0955 * side}
        parent = 'base'
        for part, (xyz, axis, (lower, upper), effort, velocity) in GO2_JOINTS.items():
            link = f'{name}_{part}'
            parts.append(
                f'<joint name="{link}_joint" type="revolute"><parent link="{parent}"/>'
                f'<child link="{link}"/><origin xyz="{xyz.format(**places)}"/>'
                f'<axis xyz="{axis}"/><limit lower="{lower}" upper="{upper}" effort="{effort}" '
                f'velocity="{velocity}"/></joint>' + body(link, *GO2_MASSES[part])
            )
            parent = link
        parts.append(
            f'<joint name="{name}_foot_joint" type="fixed"><parent link="{parent}"/>'
            f'<child link="{name}_foot"/><origin xyz="0 0 -0.213"/></joint><link '
            f'name="{name}_foot"><inertial><mass value="0.04"/><inertia ixx="1e-5" iyy="1e-5" '
            'izz="1e-5" ixy="0" ixz="0" iyz="0"/></inertial><collision><geometry>'
            '<sphere radius="0.022"/></geometry></collision></link>'
        )
    return ''.join(parts) + '</robot>'


def body(link: str, mass: float, height: float, moment: float) -> str:
    """Return a link of a mass [kg] that is centred below its joint [m]."""
    return (
        f'<link name="{link}"><inertial><mass value="{mass}"/><origin xyz="0 0 {height}"/>'
        f'<inertia ixx="{moment}" iyy="{moment}" izz="{moment}" ixy="0" ixz="0" iyz="0"/>'
        '</inertial></link>'
    )
