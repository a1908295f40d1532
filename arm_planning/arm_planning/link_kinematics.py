# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
r"""Forward kinematics and Jacobian of a link; closed-form IK for arms with a spherical wrist.

The closed form: six joints turn about axes :math:`z_1 \dots z_6`. Those of the elbow are parallel
(:math:`z_2 \parallel z_3`), those of the wrist meet in a point :math:`w` at right angles
(:math:`z_4 \perp z_5 \perp z_6`). Everything else is free: offsets of shoulder and elbow, senses
and zeros of the joints. The axes are those of the model where all positions are zero.

1. The pose puts :math:`w` at :math:`c`. Turned back by :math:`q_1`, its height along :math:`z_2`
   is that at zero, :math:`A \cos q_1 + B \sin q_1 = K`: two solutions.
2. In the plane normal to :math:`z_2` the two links of the arm reach it: two solutions each.
3. The remaining rotation is :math:`R_z(q_4) R_y(q_5) R_z(q_6)`: two solutions each.

The method of subproblems: Paden, "Kinematics and Control of Robot Manipulators", 1986.
"""

from __future__ import annotations

from dataclasses import dataclass
import math

import numpy as np
import pinocchio as pin

from arm_model import Array, Pose, RobotModel

from .exceptions import PlanningCode, PlanningError


class LinkKinematics:
    """Forward kinematics and Jacobian of one link. Not thread-safe."""

    def __init__(self, model: RobotModel, link: str = '') -> None:
        """Select the link; an empty name is the tip. Refuse a link that no joint moves."""
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
    """Return translation and rotation vector (6) to another pose, in the frame of the first."""
    error = np.empty(6)
    error[:3] = target.position - actual.position
    error[3:] = pin.log3(target.rotation @ actual.rotation.T)
    return error


AXES_TOLERANCE = 1e-6
"""Tolerance of axes that meet in [m], and of parallel or perpendicular axes in [rad].

URDF files round quarter turns to seven decimal places.
"""

FREE_TOLERANCE = 1e-10
"""Distance in [m], or sine, below which a joint is free and keeps its seed position."""

DOUBLE_TOLERANCE = 1e-13
"""Squared distance below which two solutions are one.

Rounding separates a double solution by its square root, which would hide a straight wrist.
"""

JOINTS = 6  # joints of such an arm

Vector = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class WristMiss:
    """Why no solution exists."""

    distance: float  # how far the wrist is from where the arm can bring it in [m]
    too_near: bool  # whether it is too near to the shoulder, and not too far


class ClosedForm:
    """Geometry of an arm with a spherical wrist. Immutable and thread-safe."""

    def __init__(self, points: Array, axes: Array, wrist: Array, tip: Pose) -> None:
        """Compute the constants; :meth:`of` finds the geometry.

        Args:
            points: A point of each axis in the root link in [m] (6, 3), all joints at zero.
            axes: Directions of the axes (6, 3).
        """
        base = _basis(axes[0], points[1] - points[0])
        self._base = base.T
        self._origin = base.T @ points[0]
        across = base.T @ axes[1]
        elbow = base.T @ (points[2] - points[1])
        elbow -= (elbow @ across) * across
        length = float(np.linalg.norm(elbow))
        first = elbow / length
        second = np.cross(across, first)
        shoulder = base.T @ (points[1] - points[0])
        forearm = base.T @ (wrist - points[2])
        self._across: Vector = _vector(across)
        self._height = float(across @ (base.T @ (wrist - points[0])))
        self._first, self._second = _vector(first), _vector(second)
        self._shoulder = (float(first @ shoulder), float(second @ shoulder))
        self._upper_arm = length
        self._forearm = math.hypot(first @ forearm, second @ forearm)
        self._bend = math.atan2(second @ forearm, first @ forearm)
        self._elbow_sense = 1.0 if axes[1] @ axes[2] > 0.0 else -1.0
        before = base.T @ np.column_stack((np.cross(axes[4], axes[3]), axes[4], axes[3]))
        # each column of `before` turned about `across` is still + cos * level + sin * upright
        still = np.outer(across, across @ before)
        level, upright = before - still, np.cross(across, before, axisa=0, axisb=0).T
        self._wrist_axes = tuple(
            (_vector(still[:, k]), _vector(level[:, k]), _vector(upright[:, k])) for k in range(3)
        )
        behind = np.column_stack((np.cross(axes[4], axes[5]), axes[4], axes[5]))
        self._wrist_zero = math.atan2(
            np.cross(axes[3], axes[5]) @ axes[4], float(axes[3] @ axes[5])
        )
        self._behind = tip.rotation.T @ behind
        self._wrist = tip.rotation.T @ (wrist - tip.position)

    @classmethod
    def of(cls, link: LinkKinematics) -> ClosedForm | None:
        """Return the closed form of a link; None if the arm has another geometry."""
        kinematics = link.kinematics
        native = kinematics.native
        last = kinematics.parent_joint(link.link)
        if len(kinematics.joints) != JOINTS or native.nv != JOINTS or last != JOINTS:
            return None
        if list(native.supports[last]) != list(range(JOINTS + 1)):  # not one chain
            return None
        zero = np.zeros(JOINTS)
        screws = link.axes(zero)
        axes = screws[3:].T
        if np.abs(np.linalg.norm(axes, axis=1) - 1.0).max() > AXES_TOLERANCE:  # one slides
            return None
        points = np.cross(axes, screws[:3].T)
        if not _parallel(axes[1], axes[2]) or _parallel(axes[0], axes[1]):
            return None
        if abs(axes[3] @ axes[4]) > AXES_TOLERANCE or abs(axes[4] @ axes[5]) > AXES_TOLERANCE:
            return None
        wrist = _meeting_point(points[3:], axes[3:])
        between = points[2] - points[1]
        upper_arm = np.linalg.norm(between - (between @ axes[1]) * axes[1])
        if wrist is None or upper_arm < AXES_TOLERANCE:
            return None
        return cls(points, axes, wrist, link.pose(zero))

    def solutions(self, pose: Pose, seed: Array) -> list[list[float]] | WristMiss:
        """Return all solutions (up to 8) of a pose in the root link, or why there is none.

        Solutions are unordered, not shifted by whole turns, and ignore limits. Free joints stay
        at the seed.
        """
        rotation = self._base @ pose.rotation
        cx, cy, cz = (rotation @ self._wrist + self._base @ pose.position - self._origin).tolist()
        turned = (rotation @ self._behind).tolist()
        miss = WristMiss(math.inf, too_near=False)
        found: list[list[float]] = []
        for q1 in self._shoulder_turns(cx, cy, cz, float(seed[0])):
            cos1, sin1 = math.cos(q1), math.sin(q1)
            px, py = cx * cos1 + cy * sin1, cy * cos1 - cx * sin1
            elbows = self._elbow_turns(px, py, cz)
            if isinstance(elbows, WristMiss):
                miss = min(miss, elbows, key=lambda each: each.distance)
                continue
            (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = turned
            rows = (
                (xx * cos1 + yx * sin1, xy * cos1 + yy * sin1, xz * cos1 + yz * sin1),
                (yx * cos1 - xx * sin1, yy * cos1 - xy * sin1, yz * cos1 - xz * sin1),
                (zx, zy, zz),
            )
            for q2, q3, pitch in elbows:
                wrists = self._wrist_turns(rows, pitch, float(seed[3]))
                found += [[q1, q2, q3, *wrist] for wrist in wrists]
        if not found and math.isinf(miss.distance):
            return WristMiss(self._off_axis(cx, cy, cz), too_near=True)
        return found or miss

    def _shoulder_turns(self, cx: float, cy: float, cz: float, seed: float) -> list[float]:
        ux, uy, uz = self._across
        a, b = ux * cx + uy * cy, ux * cy - uy * cx
        height = self._height - uz * cz
        radius = math.hypot(a, b)
        if radius < FREE_TOLERANCE:
            return [seed, seed + math.pi] if abs(height) < FREE_TOLERANCE else []
        if abs(height) - radius > FREE_TOLERANCE:
            return []
        square = max((radius - height) * (radius + height), 0.0)
        if square < DOUBLE_TOLERANCE:
            square = 0.0
        middle, half = math.atan2(b, a), math.atan2(math.sqrt(square), height)
        return [middle + half, middle - half] if half else [middle]

    def _off_axis(self, cx: float, cy: float, cz: float) -> float:
        """Return how much too near the wrist is to the first axis in [m]."""
        ux, uy, uz = self._across
        radius = abs(self._height - uz * cz) / math.hypot(ux, uy)
        return radius - math.hypot(cx, cy)

    def _elbow_turns(
        self, px: float, py: float, pz: float
    ) -> list[tuple[float, float, float]] | WristMiss:
        (ax, ay, az), (bx, by, bz) = self._first, self._second
        x = ax * px + ay * py + az * pz - self._shoulder[0]
        y = bx * px + by * py + bz * pz - self._shoulder[1]
        inner, outer = self._upper_arm, self._forearm
        square = x * x + y * y
        cosine = (square - inner * inner - outer * outer) / (2.0 * inner * outer)
        if abs(cosine) > 1.0 - DOUBLE_TOLERANCE:
            distance = math.sqrt(square)
            miss = abs(inner - outer) - distance if cosine < 0.0 else distance - inner - outer
            if miss > FREE_TOLERANCE:
                return WristMiss(miss, too_near=cosine < 0.0)
            cosine = math.copysign(1.0, cosine)
        heading, sense = math.atan2(y, x), self._elbow_sense
        elbow = math.acos(cosine)
        found = []
        for bend in (elbow, -elbow) if elbow else (elbow,):
            q2 = heading - math.atan2(outer * math.sin(bend), inner + outer * math.cos(bend))
            q3 = sense * (bend - self._bend)
            found.append((q2, q3, q2 + sense * q3))
        return found

    def _wrist_turns(
        self, rows: tuple[Vector, Vector, Vector], pitch: float, seed: float
    ) -> list[tuple[float, float, float]]:
        """Return the turns of the wrist."""
        cos, sin = math.cos(pitch), math.sin(pitch)
        (x0, y0, z0), (x1, y1, z1), (x2, y2, z2) = rows
        (kx, lx, ux), (ky, ly, uy), (kz, lz, uz) = self._wrist_axes
        # the axes in front of the wrist, one after the other
        a0 = kx[0] + cos * lx[0] + sin * ux[0]
        a1 = kx[1] + cos * lx[1] + sin * ux[1]
        a2 = kx[2] + cos * lx[2] + sin * ux[2]
        b0 = ky[0] + cos * ly[0] + sin * uy[0]
        b1 = ky[1] + cos * ly[1] + sin * uy[1]
        b2 = ky[2] + cos * ly[2] + sin * uy[2]
        c0 = kz[0] + cos * lz[0] + sin * uz[0]
        c1 = kz[1] + cos * lz[1] + sin * uz[1]
        c2 = kz[2] + cos * lz[2] + sin * uz[2]
        m02, m12 = a0 * z0 + a1 * z1 + a2 * z2, b0 * z0 + b1 * z1 + b2 * z2
        m22 = c0 * z0 + c1 * z1 + c2 * z2
        sine = math.hypot(m02, m12)
        zero = self._wrist_zero
        if sine < FREE_TOLERANCE:
            m00, m10 = a0 * x0 + a1 * x1 + a2 * x2, b0 * x0 + b1 * x1 + b2 * x2
            if m22 > 0.0:
                q5, q6 = -zero, math.atan2(m10, m00) - seed
            else:
                q5, q6 = math.pi - zero, seed - math.atan2(-m10, -m00)
            return [(seed, q5, q6), (seed + math.pi, q5, q6 + math.pi)]
        m20, m21 = c0 * x0 + c1 * x1 + c2 * x2, c0 * y0 + c1 * y1 + c2 * y2
        q4, q5, q6 = math.atan2(m12, m02), math.atan2(sine, m22), math.atan2(m21, -m20)
        return [(q4, q5 - zero, q6), (q4 + math.pi, -q5 - zero, q6 + math.pi)]


def _basis(axis: Array, toward: Array) -> Array:
    """Return a rotation (3, 3) whose z is an axis, and whose x is near a direction if possible."""
    first = toward - (toward @ axis) * axis
    if np.linalg.norm(first) < AXES_TOLERANCE:
        first = np.cross(axis, np.eye(3)[int(np.abs(axis).argmin())])
    first /= np.linalg.norm(first)
    return np.column_stack((first, np.cross(axis, first), axis))


def _vector(values: Array) -> Vector:
    x, y, z = values.tolist()
    return x, y, z


def _parallel(first: Array, second: Array) -> bool:
    return bool(np.linalg.norm(np.cross(first, second)) < AXES_TOLERANCE)


def _meeting_point(points: Array, axes: Array) -> Array | None:
    """Return the point where three axes meet; None if they do not."""
    across = np.eye(3) - axes[:, :, None] * axes[:, None, :]
    wanted = np.einsum('kij,kj->i', across, points)
    meeting: Array = np.linalg.solve(across.sum(axis=0), wanted)
    off = np.einsum('kij,kj->ki', across, meeting - points)
    return meeting if np.abs(off).max() < AXES_TOLERANCE else None
