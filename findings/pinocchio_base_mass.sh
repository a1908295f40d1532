#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
#
# pinocchio 4.1.0 (pin): computeTotalMass() of an arm leaves the first link of its URDF out.
# Expected: the sum of all links, as the same function returns with a floating base. A load computed from it for a floor or
# a cart is too small.
# Seen: links of 1 + 1 kg: fixed 1.0 kg, with JointModelFreeFlyer 2.0 kg
set -eu
unset PYTHONPATH LD_LIBRARY_PATH
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
{ python3 -m venv venv && venv/bin/pip install --quiet pin==4.1.0; } || exit 2
venv/bin/python -I - <<'END'
LINK = """<inertial><mass value="1"/>
  <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>"""
import pinocchio

ROBOT = f"""<robot name="demo">
<link name="base">{LINK}</link> <link name="arm">{LINK}</link>
<joint name="turn" type="revolute"> <parent link="base"/> <child link="arm"/> <axis xyz="0 0 1"/>
  <limit lower="-1" upper="1" effort="3" velocity="2"/> </joint>
</robot>"""
fixed = pinocchio.computeTotalMass(pinocchio.buildModelFromXML(ROBOT))
free = pinocchio.computeTotalMass(
    pinocchio.buildModelFromXML(ROBOT, pinocchio.JointModelFreeFlyer())
)
print('fixed', fixed, 'free', free)
raise SystemExit((fixed, free) != (1.0, 2.0))
END
