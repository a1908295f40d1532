#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
#
# pinocchio 4.1.0 (pin): the joints of a URDF are in alphabetical order of their names where the tree branches, not in
# the order of the file; joint_10 is before joint_2.
# Expected: the order of the file, which MuJoCo 4.0.1 keeps. Positions by index of the one are wrong for the other.
# Seen: file left_2, left_10, grip, arm; pinocchio arm, grip, left_10, left_2
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

NAMES = ['left_2', 'left_10', 'grip', 'arm']
JOINT = """<link name="{0}_link">{1}</link> <joint name="{0}" type="revolute"> <parent link="base"/>
  <child link="{0}_link"/> <axis xyz="0 0 1"/>
  <limit lower="-1" upper="1" effort="3" velocity="2"/> </joint>"""
robot = ''.join(JOINT.format(name, LINK) for name in NAMES)
model = pinocchio.buildModelFromXML(f'<robot name="demo"><link name="base"/>{robot}</robot>')
found = list(model.names)[1:]
print('file', *NAMES, 'pinocchio', *found)
raise SystemExit(found != sorted(NAMES))
END
