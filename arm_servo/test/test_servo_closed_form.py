# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The kinematics against the closed form of the arms that have one."""

from __future__ import annotations

from hypothesis import given, settings
from hypothesis import strategies as st
from model_robots import ready, robot
import numpy as np
import pytest
from servo_opw import inverse, OPW
from servo_runs import run

from arm_servo import PoseCommand

pytestmark = pytest.mark.slow


@pytest.mark.parametrize('name', OPW)
@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_inverse_after_forward_gives_the_joints_back(name: str, seed: int) -> None:
    """Any joints are among the solutions of their pose, and each solution has this pose."""
    model = robot(name)
    limits = model.limits
    bound = np.minimum(np.minimum(-limits.lower, limits.upper), 3.1)
    joints = np.random.default_rng(seed).uniform(-bound, bound)
    pose = model.pose(joints)
    solutions = inverse(OPW[name], pose)
    assert min(float(np.abs(each - joints).max()) for each in solutions) < 1e-6
    for each in solutions:
        again = model.pose(each)
        assert again.position == pytest.approx(pose.position, abs=1e-9)
        assert again.rotation == pytest.approx(pose.rotation, abs=1e-9)


@pytest.mark.parametrize('name', OPW)
@settings(max_examples=4, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_a_tracked_pose_ends_at_a_solution_of_the_closed_form(name: str, seed: int) -> None:
    """Where the servo comes to rest is one of the closed form's solutions."""
    model = robot(name)
    near = ready(name) + np.random.default_rng(seed).uniform(-0.2, 0.2, 6)
    goal = model.pose(near)
    end = run(model, ready(name), PoseCommand(goal), 4.0, 0.02).states[-1].position
    solutions = inverse(OPW[name], goal)
    assert min(float(np.abs(each - end).max()) for each in solutions) < 1e-3
