# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The transforms of a tree, compared with pinocchio's, which is independent of ours."""

from __future__ import annotations

from collections.abc import Mapping
import math

from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np
import numpy.typing as npt
import pinocchio
import pytest
from urdf_reader import joint_transform, KinematicTree, read_urdf
from urdf_robots import random_urdfs

from robot_viewer import (
    FrameTransform,
    Settings,
    StatePublisher,
)

Matrix = npt.NDArray[np.float64]

angle = st.floats(-7.0, 7.0, allow_nan=False)


def matrix_of(named: FrameTransform) -> Matrix:
    """Make a homogeneous matrix of a transform."""
    pose = np.eye(4)
    pose[:3, :3] = pinocchio.Quaternion(np.array(named.transform.rotation)).toRotationMatrix()
    pose[:3, 3] = named.transform.translation
    return pose


def published(model: KinematicTree, positions: Mapping[str, float]) -> dict[str, FrameTransform]:
    """Return what is published of a robot, by child frame."""
    core = StatePublisher(model, Settings())
    update = core.update(list(positions), list(positions.values()), 10**9, 10**9)
    return {each.child: each for each in [*core.fixed(), *update.transforms]}


def pose_in_root(link: str, root: str, frames: Mapping[str, FrameTransform]) -> Matrix:
    """Chain transforms from the root to a link, as a listener of /tf does."""
    pose = np.eye(4)
    while link != root:
        pose = matrix_of(frames[link]) @ pose
        link = frames[link].parent
    return pose


def pinocchio_positions(
    model: pinocchio.Model, positions: Mapping[str, float]
) -> npt.NDArray[np.float64]:
    """Fill pinocchio's vector; its continuous joints are cosine and sine."""
    q: npt.NDArray[np.float64] = pinocchio.neutral(model)
    for name, value in positions.items():
        joint = model.joints[model.getJointId(name)]
        if joint.nq == 2:
            q[joint.idx_q : joint.idx_q + 2] = math.cos(value), math.sin(value)
        else:
            q[joint.idx_q] = value
    return q


@pytest.mark.slow
@given(random_urdfs(), st.lists(angle, min_size=7, max_size=7))
@settings(max_examples=60)
def test_every_link_is_where_pinocchio_has_it(urdf: str, values: list[float]) -> None:
    """For random trees, origins, axes and positions, to 1e-9 m and rad."""
    model = read_urdf(urdf)
    positions = dict(zip((joint.name for joint in model.movable()), values, strict=False))
    frames = published(model, positions)
    assert set(frames) == set(model.links) - {model.root}
    reference = pinocchio.buildModelFromXML(urdf)
    data = reference.createData()
    pinocchio.framesForwardKinematics(reference, data, pinocchio_positions(reference, positions))
    for link in model.links:
        expected = data.oMf[reference.getFrameId(link)].homogeneous
        np.testing.assert_allclose(
            pose_in_root(link, model.root, frames), expected, atol=1e-9, err_msg=link
        )


def test_a_fixed_joint_is_at_its_origin_whatever_its_position() -> None:
    """A message may name it; it does not move."""
    urdf = (
        '<robot name="r"><link name="a"/><link name="b"/><joint name="j" type="fixed">'
        '<parent link="a"/><child link="b"/><origin xyz="1 2 3"/></joint></robot>'
    )
    joint = read_urdf(urdf).joints[0]
    assert joint_transform(joint, 1.0) == joint.origin
