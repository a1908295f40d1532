# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Pose and Jacobian of one link, in the root link."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from arm_model import Array, Pose, RobotModel

from ..exceptions import PlanningCode, PlanningError


class LinkKinematics:
    """Where a link is and how the joints move it; for one thread."""

    def __init__(self, model: RobotModel, link: str = '') -> None:
        """Prepare.

        Args:
            link: The link; empty for the tip.

        Raises:
            PlanningError: There is no such link, or no joint moves it.
        """
        self.link = link or model.tip
        self.kinematics = model.kinematics
        if self.link not in self.kinematics.frames:
            known = ', '.join(self.kinematics.frames)
            raise PlanningError(
                PlanningCode.INVALID_LINK_NAME,
                f'no link {self.link!r} in {model.name}; choose one of {known}',
            )
        if not self.kinematics.parent_joint(self.link):
            raise PlanningError(
                PlanningCode.INVALID_LINK_NAME,
                f'no joint of group {model.group} moves link {self.link!r}; choose one behind'
                f' {model.joints[0]}',
            )
        self._native = self.kinematics.native
        self._data = self._native.createData()
        self._frame = self.kinematics.frames[self.link]

    def pose(self, positions: Array) -> Pose:
        """Return the pose of the link in the root link."""
        pin.forwardKinematics(self._native, self._data, self.kinematics.expanded(positions))
        placement = pin.updateFramePlacement(self._native, self._data, self._frame)
        return Pose(placement.rotation.copy(), placement.translation.copy())

    def pose_and_jacobian(self, positions: Array) -> tuple[Pose, Array]:
        """Return the pose, and the Jacobian (6, n) of the link's origin along the root's axes."""
        pin.computeJointJacobians(self._native, self._data, self.kinematics.expanded(positions))
        placement = pin.updateFramePlacement(self._native, self._data, self._frame)
        columns = pin.getFrameJacobian(
            self._native, self._data, self._frame, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        )
        pose = Pose(placement.rotation.copy(), placement.translation.copy())
        return pose, self.kinematics.projected(columns)

    def axes(self, positions: Array) -> Array:
        """Return the screws of the columns (6, columns) in the root, linear before angular."""
        screws = pin.computeJointJacobians(
            self._native, self._data, self.kinematics.expanded(positions)
        )
        return np.array(screws)


def pose_error(target: Pose, actual: Pose) -> Array:
    """Return the way and the rotation vector (6) from a pose to another, in its frame."""
    error = np.empty(6)
    error[:3] = target.position - actual.position
    error[3:] = pin.log3(target.rotation @ actual.rotation.T)
    return error
