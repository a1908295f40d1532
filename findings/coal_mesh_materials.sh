#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
#
# coal 3.0.3: of an .obj with several materials, MeshLoader reads all corners, but the triangles of each material count
# theirs from 0 on again: those of the second one are triangles among the corners of the first.
# Expected: the triangles of the file, as for the same cube in one material.
# Seen: two materials: 12 triangles, 16 corners, of which 8 are in a triangle; one material: 12, 8 and 8
set -eu
unset PYTHONPATH LD_LIBRARY_PATH
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
{ python3 -m venv venv && venv/bin/pip install --quiet coal==3.0.3 numpy==2.4.6; } || exit 2
venv/bin/python -I - <<'END'
from pathlib import Path

import coal
import numpy as np

CORNERS = [(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)]
SIDES = [(1, 2, 4, 3), (5, 7, 8, 6), (1, 5, 6, 2), (3, 4, 8, 7), (1, 3, 7, 5), (2, 6, 8, 4)]
Path('cube.mtl').write_text('newmtl red\nKd 1 0 0\nnewmtl blue\nKd 0 0 1\n')


def area(materials):
    lines = ['mtllib cube.mtl', *('v %d %d %d' % corner for corner in CORNERS)]
    for number, side in enumerate(SIDES):
        if number % (6 // len(materials)) == 0:
            lines.append('usemtl ' + materials[number // (6 // len(materials))])
        lines.append('f %d %d %d %d' % side)
    Path('cube.obj').write_text('\n'.join(lines) + '\n')
    mesh = coal.MeshLoader().load('cube.obj', np.ones(3))
    corners = np.array([mesh.vertices(i) for i in range(mesh.num_vertices)])
    numbers = [[mesh.tri_indices(i)[k] for k in range(3)] for i in range(mesh.num_tris)]
    named = len({number for triangle in numbers for number in triangle})
    print(materials, mesh.num_tris, 'triangles,', len(corners), 'corners,', named, 'of them in a triangle')
    return mesh.num_tris, named == len(corners)


found = area(['red']), area(['red', 'blue'])
raise SystemExit(found != ((12, True), (12, False)))
END
