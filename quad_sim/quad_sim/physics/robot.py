# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The robot in physics simulation: takes targets, advances time, returns sensor values."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Mapping, Sequence
import math
from typing import Final

import mujoco
import numpy as np
from numpy.typing import NDArray

from quad_description import FEET, movable_joints, Pose, pose_positions
from quad_description.rotations import IDENTITY, multiply, normalized, Quaternion, Vector

from ..exceptions import SetupError, SimulationError
from ..plant import ServoModel, ServoParameters, TargetRamp, Targets
from ..state import (
    Array,
    BasePose,
    BaseVelocity,
    disturb,
    FLAT,
    Imu,
    Measurement,
    Noise,
    NONE,
    Terrain,
)
from .model import (
    AS_MADE,
    BASE,
    base_rotation,
    build_model,
    BUMPS,
    FLOOR,
    InertialUnit,
    mjcf,
    Variation,
    VariedModel,
    vector,
)

_FAR = 10.0  # [m] farther than any part of a robot is from the floor at the start


def start_positions(joints: Sequence[str], pose: Mapping[str, float]) -> Array:
    """Return the initial joint positions [rad]; joints not in the pose get the standing pose.

    Raises:
        SetupError: The pose names joints that the robot lacks.
    """
    unknown = sorted(pose.keys() - set(joints))
    if unknown:
        raise SetupError(f'the start pose names {", ".join(unknown)}, which the robot lacks')
    stand = pose_positions(Pose.STAND, arm=True)
    return np.array([pose.get(name, stand.get(name, 0.0)) for name in joints])


def place(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    terrain: Terrain,
    orientation: Quaternion,
    drop: float,
) -> None:
    """Put the robot's lowest point on the ground, or a drop [m] above; modifies its data.

    Mimic joints follow their joints; the base is aligned with the ground.
    """
    _follow_mimics(model, data)
    normal = np.array(terrain.normal)
    data.qpos[:3] = normal
    data.qpos[3:7] = np.roll(multiply(terrain.orientation, orientation), 1)  # w first in MuJoCo
    mujoco.mj_kinematics(model, data)
    floor, points = model.geom(FLOOR).id, np.empty(6)
    gap = min(
        mujoco.mj_geomDistance(model, data, geom, floor, _FAR, points)
        for geom in range(model.ngeom)
        if model.geom(geom).name not in {FLOOR, BUMPS}  # there are no bumps at the start
    )
    data.qpos[:3] -= (gap - drop) * normal


def _follow_mimics(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    for index in range(model.neq):
        if model.eq_type[index] == mujoco.mjtEq.mjEQ_JOINT:
            follower, leader = (
                model.jnt_qposadr[joint]
                for joint in (model.eq_obj1id[index], model.eq_obj2id[index])
            )
            offset, multiplier = model.eq_data[index][:2]
            data.qpos[follower] = offset + multiplier * data.qpos[leader]


def _places(addresses: list[int]) -> slice | list[int]:
    """Convert consecutive addresses to a slice, which copies nothing."""
    first, count = addresses[0], len(addresses)
    follows = addresses == list(range(first, first + count))
    return slice(first, first + count) if follows else addresses


TIMESTEP: Final = 0.002  # [s]
STRONGEST: Final = 200.0  # [N] of a push; the robot weighs 7 N
MAX_KICK: Final = 10.0  # [m/s] of a kick
HELD_HEIGHT: Final = 0.3  # [m] above the ground of a robot that is held
MAX_DROP: Final = 10.0  # [m] above the ground at the start
UNSTABLE: Final = [
    int(mujoco.mjtWarning.mjWARN_BADQPOS),
    int(mujoco.mjtWarning.mjWARN_BADQVEL),
    int(mujoco.mjtWarning.mjWARN_BADQACC),
]


class Robot:
    """A quadruped that stands on the ground, driven by its servos.

    Time advances only in :meth:`step`. On one machine, equal arguments and calls give bitwise
    equal states.
    """

    def __init__(
        self,
        urdf: str,
        servo: ServoModel | ServoParameters = ServoModel.NOMINAL,
        terrain: Terrain = FLAT,
        seed: int = 0,
        *,
        timestep: float = TIMESTEP,
        pose: Mapping[str, float] | None = None,
        noise: Noise = NONE,
        held: bool = False,
    ) -> None:
        """Put the robot on the ground.

        Args:
            timestep: Integration time step [s].
            pose: Initial joint positions [rad]; joints left out get the standing pose.
            noise: Noise that :meth:`measure` adds.
            held: Hold the trunk level in the air, so that the legs hang free.

        Raises:
            SetupError: The URDF cannot be simulated, or the pose names joints that it lacks.
        """
        if not 0.0 < timestep <= 0.01:
            raise SetupError(f'timestep {timestep} s: give more than 0 and at most 0.01')
        self._servo = servo.parameters if isinstance(servo, ServoModel) else servo
        self._urdf, self._terrain, self._noise = urdf, terrain, noise
        self._model = build_model(urdf, self._servo, terrain, timestep, held=held)
        self._height = HELD_HEIGHT if held else 0.0
        self._data = mujoco.MjData(self._model)
        joints = movable_joints(urdf)
        # the movable joints in the order of the URDF; all arrays have this order
        self.joint_names: Final = tuple(joint.name for joint in joints)
        self.feet: Final = FEET  # links of the feet, in the order of foot_forces
        named = [self._model.joint(name) for name in self.joint_names]
        self._qpos = _places([int(joint.qposadr[0]) for joint in named])
        self._qvel = _places([int(joint.dofadr[0]) for joint in named])
        self._touch = _places([int(self._model.sensor(foot).adr[0]) for foot in FEET])
        self._inertial = InertialUnit(self._model, self._data)
        self._varied = VariedModel(self._model)
        self._ramp = TargetRamp(joints, timestep, np.zeros(len(joints)))
        self._hinges = [int(joint.type[0]) == mujoco.mjtJoint.mjJNT_HINGE for joint in named]
        self._random = np.random.default_rng(seed)
        self.reset(pose=pose, seed=seed)

    def reset(
        self,
        *,
        pose: Mapping[str, float] | None = None,
        seed: int = 0,
        variation: Variation = AS_MADE,
        orientation: Quaternion = IDENTITY,
        drop: float = 0.0,
    ) -> None:
        """Reset to standing, as a new robot with these arguments would.

        Args:
            pose: Initial joint positions [rad]; joints left out get the standing pose.
            variation: Deviations of robot and ground from the nominal model.
            orientation: Rotation of base_link on level ground, (x, y, z, w); if tilted, it falls.
            drop: Height of the lowest point above the ground [m], from which it falls.

        Raises:
            SetupError: The pose names joints that the robot lacks, the orientation is no rotation,
                or the height is not a number from 0 to 10.
        """
        if not 0.5 < math.hypot(*orientation) < 2.0:
            raise SetupError(f'orientation {orientation}: give a unit quaternion (x, y, z, w)')
        if not 0.0 <= drop <= MAX_DROP:
            raise SetupError(f'drop {drop} m: give 0 to {MAX_DROP:g}')
        self._varied.vary(self._data, variation)
        servo, timestep = self._servo, self._model.opt.timestep
        self._delay = round((servo.delay + variation.delay) / timestep)  # steps
        self._refresh = max(round((servo.refresh + variation.refresh) / timestep), 1)  # steps
        # what the error of a joint has to exceed before its servo pulls; a jaw has no play
        free = servo.free_width + 0.5 * variation.backlash
        self._free, self._has_play = np.where(self._hinges, free, 0.0), free > 0.0
        self._unfree = -self._free
        self._gains = self._model.actuator_gainprm.copy(), self._model.actuator_biasprm.copy()
        mujoco.mj_resetData(self._model, self._data)
        self._random = np.random.default_rng(seed)
        self._steps, self._remainder = 0, 0.0
        self._push_until: int | None = None
        # targets that servos do not have yet: with which step they come
        self._coming: deque[tuple[int, NDArray[np.intp], Array, float]] = deque()
        start = start_positions(self.joint_names, pose or {})
        self._data.qpos[self._qpos] = start
        self._ramp.jump(start)
        place(self._model, self._data, self._terrain, normalized(orientation), self._height + drop)
        mujoco.mj_forward(self._model, self._data)
        self._inertial.rest()

    # -- what may be done to it

    def set_targets(self, targets: Targets, duration: float | None = None) -> None:
        """Set new servo targets.

        Args:
            targets: By name, or all in the order of the URDF; [rad], of a gripper [m]. They are
                clamped to the limits of the URDF.
            duration: Time for the set-point to get there [s]; None for the servo's own.

        Raises:
            TargetError: A name is unknown, a value is not finite, or the count is wrong.
        """
        duration = self._servo.interpolation if duration is None else duration
        due = -(-(self._steps + self._delay) // self._refresh) * self._refresh
        checked = self._ramp.checked(targets)
        if due == self._steps:
            self._ramp.begin(*checked, duration)
        else:
            self._coming.append((due, *checked, duration))

    def set_torque(
        self, on: bool, joints: Iterable[str] | None = None, *, hold: bool = True
    ) -> None:
        """Switch servos on or off.

        Args:
            joints: Joint names; None for all.
            hold: A servo that is switched on holds its position; else it goes to its last target
                at once.

        Raises:
            SetupError: A joint is unknown.
        """
        names = self.joint_names if joints is None else tuple(joints)
        unknown = sorted(set(names) - set(self.joint_names))
        if unknown:
            raise SetupError(f'no joint is named {", ".join(unknown)}')
        if on and not hold:  # what was sent before the torque comes before it, too
            self._take_targets(self._steps + self._delay + self._refresh)
        for name in names:
            index = self.joint_names.index(name)
            switched_on = on and not self.torque_on(name)
            for array, original in zip(
                (self._model.actuator_gainprm, self._model.actuator_biasprm),
                self._gains,
                strict=True,
            ):
                array[index] = original[index] if on else 0.0
            if switched_on:
                place = self._data.qpos[self._qpos][index] if hold else self._ramp.goal[index]
                self._ramp.approach({name: float(place)}, 0.0)

    def torque_on(self, joint: str) -> bool:
        """Return whether a servo has torque."""
        return bool(self._model.actuator_gainprm[self.joint_names.index(joint), 0] > 0.0)

    def push(self, force: Vector, duration: float = 0.1) -> None:
        """Push the trunk at its centre of mass; this replaces a push in progress.

        Args:
            force: Force [N] in the frame with the robot's heading: x forward, y left, z up.
            duration: Duration [s].

        Raises:
            SetupError: A number is not finite, far too large, or the duration is negative.
        """
        if not (math.hypot(*force) <= STRONGEST and 0.0 <= duration < math.inf):
            raise SetupError(
                f'push of {force} N for {duration} s: give up to {STRONGEST:g} N for a finite time'
            )
        self._data.xfrc_applied[self._base, :3] = self._heading_to_world(force)
        self._push_until = self._steps + round(duration / self._model.opt.timestep)

    def kick(self, velocity: Vector) -> None:
        """Change the velocity of the whole robot instantly.

        Args:
            velocity: Velocity change [m/s] in the frame with the robot's heading.

        Raises:
            SetupError: A number is not finite, or far too large.
        """
        if not math.hypot(*velocity) <= MAX_KICK:
            raise SetupError(f'kick of {velocity} m/s: give up to {MAX_KICK:g} m/s')
        self._data.qvel[:3] += self._heading_to_world(velocity)

    def step(self, duration: float) -> None:
        """Advance by whole time steps; the remainder is carried over to the next call.

        Args:
            duration: Duration [s].

        Raises:
            SimulationError: The simulation became unstable.
        """
        self._remainder += duration / self._model.opt.timestep
        count = int(self._remainder + 1e-6)
        self._remainder -= count
        model, data, ramp, inertial = self._model, self._data, self._ramp, self._inertial
        for _ in range(count):
            if self._coming:
                self._take_targets(self._steps)
            ramp.advance()
            self._set_controls(data.ctrl)
            if self._push_until is not None and self._steps >= self._push_until:
                data.xfrc_applied[self._base] = 0.0
                self._push_until = None
            mujoco.mj_step(model, data)
            inertial.sample()
            self._steps += 1
        # MuJoCo puts such a robot back to its start by itself: only its warnings show it
        if self._data.warning.number[UNSTABLE].any():
            raise SimulationError(
                f'the physics blew up at {self.time:.3f} s; use a softer servo or a shorter step'
            )

    # -- what may be seen of it

    @property
    def time(self) -> float:
        """Time since the start [s]."""
        return self._steps * float(self._model.opt.timestep)

    @property
    def mass(self) -> float:
        """Total mass [kg]."""
        return float(self._model.body_mass.sum())

    @property
    def base_pose(self) -> BasePose:
        """Pose of base_link."""
        x, y, z, qw, qx, qy, qz = self._data.qpos[:7].tolist()
        return BasePose((x, y, z), (qx, qy, qz, qw))

    @property
    def base_velocity(self) -> BaseVelocity:
        """Velocity of base_link, expressed in base_link."""
        # MuJoCo has the linear part in the world and the angular part in the body
        linear = base_rotation(self._data).T @ self._data.qvel[:3]
        return BaseVelocity(vector(linear), vector(self._data.qvel[3:6]))

    @property
    def centre_of_mass(self) -> Vector:
        """Centre of mass of the robot, in the world [m]."""
        return vector(self._data.subtree_com[self._base])

    @property
    def joint_positions(self) -> Array:
        """Positions [rad], of the gripper [m], a copy."""
        return np.array(self._data.qpos[self._qpos])

    @property
    def joint_velocities(self) -> Array:
        """Velocities [rad/s], of the gripper [m/s], a copy."""
        return np.array(self._data.qvel[self._qvel])

    @property
    def joint_torques(self) -> Array:
        """Servo torques [N m], of the gripper [N], a copy."""
        return np.array(self._data.actuator_force)

    @property
    def joint_targets(self) -> Array:
        """Present set-points of the servos [rad], of the gripper [m], a copy."""
        return np.array(self._ramp.values)

    @property
    def imu(self) -> Imu:
        """Values of an ideal IMU; the attitude is that of imu_link in the world."""
        return self._inertial.read()

    @property
    def foot_forces(self) -> Array:
        """Normal force of the ground on each foot [N], a copy."""
        return np.array(self._data.sensordata[self._touch])

    @property
    def foot_contacts(self) -> tuple[bool, ...]:
        """Whether each foot touches the ground."""
        return tuple(bool(force > 0.0) for force in self.foot_forces)

    def link_position(self, link: str) -> Vector:
        """Return the position of a link's origin in the world [m]."""
        return vector(self._data.body(link).xpos)

    def mjcf(self, *, floor: bool) -> str:
        """Return the robot as MJCF, with the present pose as keyframe ``stand``."""
        timestep = float(self._model.opt.timestep)
        return mjcf(self._urdf, self._servo, timestep, self._data.qpos.tolist(), floor=floor)

    def measure(self) -> Measurement:
        """Return the sensor values, with the robot's noise."""
        truth = Measurement(
            imu=self.imu,
            positions=self.joint_positions,
            velocities=self.joint_velocities,
            torques=self.joint_torques,
        )
        return disturb(truth, self._noise, self._random)

    # -- inside

    def _take_targets(self, until: int) -> None:
        """Start ramping to the targets that are due before a step."""
        while self._coming and self._coming[0][0] <= until:
            self._ramp.begin(*self._coming.popleft()[1:])

    def _set_controls(self, controls: Array) -> None:
        """Set the servo controls; within the free width, there is no torque."""
        values = self._ramp.values
        if not self._has_play:
            controls[:] = values
            return
        # in place: this is done with every step of the physics
        np.subtract(values, self._data.qpos[self._qpos], out=controls)
        np.maximum(controls, self._unfree, out=controls)
        np.minimum(controls, self._free, out=controls)
        np.subtract(values, controls, out=controls)

    @property
    def _base(self) -> int:
        return int(self._model.body(BASE).id)

    def _heading_to_world(self, vector: Vector) -> Array:
        yaw = self.base_pose.roll_pitch_yaw[2]
        x, y, z = vector
        cos, sin = math.cos(yaw), math.sin(yaw)
        return np.array([cos * x - sin * y, sin * x + cos * y, z])
