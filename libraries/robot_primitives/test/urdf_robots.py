# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A tree with every joint type, and random ones."""

from __future__ import annotations

from hypothesis import strategies as st

ARM = """
<robot name="arm">
  <link name="base"/> <link name="upper"/> <link name="slider"/> <link name="wheel"/>
  <link name="finger"/> <link name="thumb"/> <link name="camera"/> <link name="cart"/>
  <link name="plate"/>
  <joint name="shoulder" type="revolute">
    <parent link="base"/> <child link="upper"/>
    <origin xyz="0.1 0.2 0.3" rpy="0.1 -0.2 0.3"/> <axis xyz="0 0 2"/>
    <limit lower="-1" upper="1" velocity="1" effort="1"/>
  </joint>
  <joint name="lift" type="prismatic">
    <parent link="upper"/> <child link="slider"/>
    <origin xyz="0 0 0.5" rpy="0 1.5707963267948966 0"/> <axis xyz="0 0 1"/>
    <limit lower="-1" upper="1" velocity="1" effort="1"/>
  </joint>
  <joint name="roll" type="continuous">
    <parent link="slider"/> <child link="wheel"/> <axis xyz="0 1 0"/>
  </joint>
  <joint name="finger_joint" type="prismatic">
    <parent link="wheel"/> <child link="finger"/> <axis xyz="0 1 0"/>
    <limit lower="0" upper="1" velocity="1" effort="1"/>
  </joint>
  <joint name="thumb_joint" type="prismatic">
    <parent link="wheel"/> <child link="thumb"/> <axis xyz="0 1 0"/>
    <limit lower="0" upper="1" velocity="1" effort="1"/>
    <mimic joint="finger_joint" multiplier="-2" offset="0.5"/>
  </joint>
  <joint name="camera_joint" type="fixed">
    <parent link="base"/> <child link="camera"/> <origin xyz="1 2 3"/>
  </joint>
  <joint name="cart_joint" type="floating"> <parent link="base"/> <child link="cart"/> </joint>
  <joint name="plate_joint" type="planar"> <parent link="base"/> <child link="plate"/> </joint>
</robot>
"""
"""All joint types of URDF, and a joint that follows another."""

POSITIONS = {'shoulder': 0.4, 'lift': -0.2, 'roll': 5.0, 'finger_joint': 0.1}
"""Positions of its joints in [rad] or [m]."""

number = st.floats(-3.0, 3.0, allow_nan=False).map(lambda value: round(value, 3))
vector = st.tuples(number, number, number)
axis = vector.filter(lambda xyz: sum(value * value for value in xyz) > 0.01)
kind = st.sampled_from(['revolute', 'continuous', 'prismatic', 'fixed'])


@st.composite
def random_urdfs(draw: st.DrawFn) -> str:
    """Make a random tree of up to eight links."""
    joints = []
    size = draw(st.integers(1, 7))
    for index in range(1, size + 1):
        parent = draw(st.integers(0, index - 1))
        numbers = [' '.join(map(str, draw(each))) for each in (vector, vector, axis)]
        joints.append(
            f'<joint name="joint{index}" type="{draw(kind)}">'
            f'<parent link="link{parent}"/><child link="link{index}"/>'
            f'<origin xyz="{numbers[0]}" rpy="{numbers[1]}"/><axis xyz="{numbers[2]}"/>'
            '<limit lower="-3" upper="3" velocity="1" effort="1"/></joint>'
        )
    links = ''.join(f'<link name="link{index}"/>' for index in range(size + 1))
    return f'<robot name="random">{links}{"".join(joints)}</robot>'
