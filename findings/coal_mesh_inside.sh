#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
#
# coal 3.0.3: a tool that is wholly inside a body given as triangles is free: no collision, and a distance.
# Expected: a collision, as with the same body given as Box. Only the surface counts: a step that is longer than the tool
# passes through the wall unseen.
# Seen: triangles: 0 contacts, distance +0.6 m; Box: 1 contact, distance -0.8 m
set -eu
unset PYTHONPATH LD_LIBRARY_PATH
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
{ python3 -m venv venv && venv/bin/pip install --quiet coal==3.0.3 numpy==2.4.6; } || exit 2
venv/bin/python -I - <<'END'
import coal
import numpy as np

CORNERS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
SIDES = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
triangles = coal.BVHModelOBBRSS()
triangles.beginModel(12, 8)
for a, b, c, d in SIDES:
    triangles.addTriangle(CORNERS[a], CORNERS[b], CORNERS[c])
    triangles.addTriangle(CORNERS[a], CORNERS[c], CORNERS[d])
triangles.endModel()
tool, here, there = coal.Box(0.2, 0.2, 0.2), coal.Transform3s.Identity(), coal.Transform3s()
there.setTranslation(np.array([0.3, 0, 0]))


def check(body):
    touched, apart = coal.CollisionResult(), coal.DistanceResult()
    coal.collide(body, here, tool, there, coal.CollisionRequest(), touched)
    distance = coal.distance(body, here, tool, there, coal.DistanceRequest(), apart)
    print(type(body).__name__, touched.numContacts(), 'contacts,', f'{distance:+.3f} m')
    return touched.isCollision(), round(distance, 3)


found = check(triangles), check(coal.Box(2, 2, 2))
raise SystemExit(found != ((False, 0.6), (True, -0.8)))
END
