#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
#
# TOPP-RA 0.6.10: with ParametrizeSpline a trajectory exceeds the acceleration limits by 12 %, with ParametrizeConstAccel
# it keeps them.
# Expected: the constraints hold for either, as they belong to TOPPRA and not to the parametrizer. It is the smoother of
# the two that asks for more than the drive has.
# Seen: limit 1.0; ParametrizeSpline 1.116, ParametrizeConstAccel 1.000
set -eu
unset PYTHONPATH LD_LIBRARY_PATH
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
{ python3 -m venv venv && venv/bin/pip install --quiet toppra==0.6.10 numpy==2.4.6; } || exit 2
venv/bin/python -I - <<'END'
import numpy as np
import toppra
from toppra import algorithm, constraint

toppra.setup_logging('ERROR')
path = toppra.SplineInterpolator([0, 1, 2, 3], np.array([[0, 0], [1, 2], [2, -1], [0, 0.0]]))
limit = np.array([[-1, 1], [-1, 1.0]])
limits = [constraint.JointVelocityConstraint(limit), constraint.JointAccelerationConstraint(limit)]


def greatest(parametrizer):
    found = algorithm.TOPPRA(limits, path, parametrizer=parametrizer).compute_trajectory(0, 0)
    value = float(np.abs(found(np.linspace(0, found.duration, 5001), 2)).max())
    print(parametrizer, f'{value:.3f}')
    return value


spline, constant = greatest('ParametrizeSpline'), greatest('ParametrizeConstAccel')
raise SystemExit(not (spline > 1.05 and constant < 1.001))
END
