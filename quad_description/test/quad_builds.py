# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A quadruped's URDF for tests, made from numbers; lengths and signs can be chosen."""

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
