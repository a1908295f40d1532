#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
#
# pinocchio 4.1.0 (pin): the axis of a planar joint in a URDF has no effect: the link moves in x and y, whatever the plane.
# Expected: a plane normal to the axis, as the URDF specification says and MuJoCo 4.0.1 does. A plate on a wall (axis x)
# moves along the wall in the one and through it in the other.
# Seen: axis x, moved by 0.1 and 0.2: pinocchio at 0.1 0.2 0.0, MuJoCo at 0.0 0.2 -0.1
set -eu
unset PYTHONPATH LD_LIBRARY_PATH
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
{ python3 -m venv venv && venv/bin/pip install --quiet pin==4.1.0 mujoco-core==4.0.1; } || exit 2
venv/bin/python -I - <<'END'
LINK = """<inertial><mass value="1"/>
  <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>"""
import mujoco
import numpy as np
import pinocchio

ROBOT = f"""<robot name="demo"><link name="base">{LINK}</link> <link name="plate">{LINK}</link>
<joint name="slide" type="planar"> <parent link="base"/> <child link="plate"/> <axis xyz="1 0 0"/>
</joint></robot>"""
model = pinocchio.buildModelFromXML(ROBOT)
data = model.createData()
places = pinocchio.integrate(model, pinocchio.neutral(model), np.array([0.1, 0.2, 0]))
pinocchio.framesForwardKinematics(model, data, places)
one = data.oMf[model.getFrameId('plate')].translation
other_model = mujoco.MjModel.from_xml_string(ROBOT)
other_data = mujoco.MjData(other_model)
other_data.qpos[:] = 0.1, 0.2, 0
mujoco.mj_forward(other_model, other_data)
other = other_data.body('plate').xpos
print('pinocchio', one.round(6) + 0, 'MuJoCo', other.round(6) + 0)
raise SystemExit(not (np.allclose(one, [0.1, 0.2, 0]) and np.allclose(other, [0, 0.2, -0.1])))
END
