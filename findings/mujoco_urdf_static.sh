#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
#
# MuJoCo 4.0.1: links of a URDF without a joint that moves are not in the model: the first link loses its mass, and a
# tool frame its name.
# Expected: each link is a body (as it is with fusestatic="false"). An arm weighs less than it does, and nothing that
# looks for `base` or `tool` finds it; for a walking robot these are the feet and the IMU.
# Seen: bodies world, arm; 1 kg of 2 kg. With fusestatic off: world, base, arm, tool; 2 kg
set -eu
unset PYTHONPATH LD_LIBRARY_PATH
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
{ python3 -m venv venv && venv/bin/pip install --quiet mujoco-core==4.0.1; } || exit 2
venv/bin/python -I - <<'END'
LINK = """<inertial><mass value="1"/>
  <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>"""
import mujoco

ROBOT = f"""<robot name="demo">
<link name="base">{LINK}</link> <link name="arm">{LINK}</link> <link name="tool"/>
<joint name="turn" type="revolute"> <parent link="base"/> <child link="arm"/> <axis xyz="0 0 1"/>
  <limit lower="-1" upper="1" effort="3" velocity="2"/> </joint>
<joint name="flange" type="fixed"> <parent link="arm"/> <child link="tool"/>
  <origin xyz="0 0 0.5"/> </joint>
</robot>"""


def read(**options):
    spec = mujoco.MjSpec.from_string(ROBOT)
    for name, value in options.items():
        setattr(spec.compiler, name, value)
    model = spec.compile()
    names = [model.body(i).name for i in range(model.nbody)]
    print(*names, float(model.body_mass.sum()), 'kg')
    return names, float(model.body_mass.sum())


found = read(), read(fusestatic=False)
raise SystemExit(found != ((['world', 'arm'], 1.0), (['world', 'base', 'arm', 'tool'], 2.0)))
END
