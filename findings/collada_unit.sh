#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
#
# coal 3.0.3 and trimesh 5.2.0: a COLLADA mesh in millimetres is read as one in metres; <unit meter="0.001"/> has no effect.
# Expected: 0.3 m, as the file says in its own words. In a URDF a collision mesh of such a file is a thousand times too
# large, unless its `scale` says so, too, which then is wrong for a reader that knows the unit.
# Seen: 300 of 0.001 m: coal 300.0 m, trimesh 300.0 m
set -eu
unset PYTHONPATH LD_LIBRARY_PATH
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
{ python3 -m venv venv && venv/bin/pip install --quiet coal==3.0.3 trimesh==5.2.0 pycollada==0.9.3 numpy==2.4.6; } || exit 2
venv/bin/python -I - <<'END'
from pathlib import Path

import coal
import numpy as np
import trimesh

Path('link.dae').write_text("""<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset> <created>2026-01-01T00:00:00</created> <modified>2026-01-01T00:00:00</modified>
  <unit name="millimeter" meter="0.001"/> <up_axis>Z_UP</up_axis> </asset>
<library_geometries> <geometry id="link"> <mesh>
  <source id="points">
    <float_array id="numbers" count="12">0 0 0 100 0 0 0 200 0 0 0 300</float_array>
    <technique_common> <accessor source="#numbers" count="4" stride="3">
      <param name="X" type="float"/> <param name="Y" type="float"/> <param name="Z" type="float"/>
    </accessor> </technique_common>
  </source>
  <vertices id="corners"> <input semantic="POSITION" source="#points"/> </vertices>
  <triangles count="4"> <input semantic="VERTEX" source="#corners" offset="0"/>
    <p>0 2 1 0 1 3 0 3 2 1 2 3</p> </triangles>
</mesh> </geometry> </library_geometries>
<library_visual_scenes> <visual_scene id="scene"> <node id="node">
  <instance_geometry url="#link"/> </node> </visual_scene> </library_visual_scenes>
<scene> <instance_visual_scene url="#scene"/> </scene>
</COLLADA>""")
mesh = coal.MeshLoader().load('link.dae', np.ones(3))
mesh.computeLocalAABB()
found = float(mesh.aabb_local.depth()), float(trimesh.load('link.dae').extents[2])
print('height: coal', found[0], 'm, trimesh', found[1], 'm')
raise SystemExit(found != (300.0, 300.0))
END
