#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
#
# CoACD 1.0.14: the convex pieces of a body do not contain it: corners stand out by micrometres, without any limit on
# the number of pieces or vertices.
# Expected: pieces that cover the body (they may be larger), so that a distance to them is never too long.
# Seen: an L of 0.3 m becomes 2 pieces; 2 of its 12 corners stand out, by up to 7.4 um
set -eu
unset PYTHONPATH LD_LIBRARY_PATH
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
{ python3 -m venv venv && venv/bin/pip install --quiet coacd==1.0.14 numpy==2.4.6; } || exit 2
venv/bin/python -I - <<'END'
import coacd
import numpy as np

OUTLINE = np.array([[0, 0], [0.3, 0], [0.3, 0.1], [0.1, 0.1], [0.1, 0.3], [0, 0.3]])
COUNT = len(OUTLINE)
corners = np.vstack([np.c_[OUTLINE, np.full(COUNT, height)] for height in (0, 0.1)])
below = [(2, 1, 0), (3, 2, 0), (4, 3, 0), (5, 4, 0)]
above = [(a + COUNT, b + COUNT, c + COUNT) for c, b, a in below]
walls = [
    side
    for i, j in ((i, (i + 1) % COUNT) for i in range(COUNT))
    for side in ((i, j, j + COUNT), (i, j + COUNT, i + COUNT))
]
coacd.set_log_level('error')
pieces = coacd.run_coacd(coacd.Mesh(corners, np.array(below + above + walls)))


def outside(vertices, faces):
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    flat = np.linalg.norm(normals, axis=1) < 1e-12
    normals = normals[~flat] / np.linalg.norm(normals[~flat], axis=1, keepdims=True)
    return (corners @ normals.T - (a[~flat] * normals).sum(axis=1)).max(axis=1)


worst = np.min([outside(np.asarray(v), np.asarray(f)) for v, f in pieces], axis=0)
print(len(pieces), 'pieces,', (worst > 1e-6).sum(), 'corners outside,', f'{worst.max() * 1e6:.1f} um')
raise SystemExit(not 1e-6 < worst.max() < 1e-3)
END
