# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Builds a MuJoCo model from the robot's URDF: free base, floor, servos, IMU, variations.

All parts of the robot collide with the floor. The legs collide with each other and the trunk.
Parts of one leg, which the joint limits keep apart, do not collide, nor does an arm with the
robot.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
import math
from typing import Final
from xml.etree import ElementTree as ET

import mujoco
import numpy as np
from urdf_reader import JointKind, read_urdf

from quad_description import body_link, FEET, foot_link, Joint, LEGS, movable_joints
from quad_description.rotations import roll_pitch_yaw, Vector

from ..exceptions import SetupError
from ..plant import JAW, ServoParameters
from ..state import Array, Imu, Terrain

BASE: Final = 'base_link'
IMU: Final = 'imu_link'
FLOOR, BUMPS = 'floor', 'bumps'
ACCELEROMETER, GYRO = 'accelerometer', 'gyro'

HELD_MASS = 1e4  # [kg], [kg m2] of a trunk that nothing moves

_TOUCH_MARGIN = 0.002  # [m] how far the region that feels the ground reaches beyond the foot

_ALL, _FEET_ONLY, _LEGS = 1, 2, 4
"""Bits of what touches what: shapes of whole links on bumps would cost six times the rest."""

_BUMP_CELL = 0.05  # [m] between two heights of rough ground
_BUMP_CELLS = 240  # along each side: 6 m to every side of the start
_SMOOTH_RADIUS = 0.3  # [m] around the start, larger than the robot
_SUNK = 0.005  # [m] ground without bumps lies below the plane, or two floors would carry a foot


def _pass_over(_text: str) -> None:
    """Ignore a MuJoCo warning: its counters are checked instead."""


def build_model(
    urdf: str, servo: ServoParameters, terrain: Terrain, timestep: float, *, held: bool = False
) -> mujoco.MjModel:
    """Build the model.

    Args:
        urdf: The robot, with base_link as root, imu_link and feet.
        timestep: Integration time step [s].
        held: Fix the trunk in the air.

    Returns:
        A model whose actuators are the movable joints in the order of the URDF.

    Raises:
        SetupError: The URDF does not describe such a robot.
    """
    return _compiled(urdf, servo, terrain, timestep, held=held)[1]


def mjcf(
    urdf: str, servo: ServoParameters, timestep: float, start: Sequence[float], *, floor: bool
) -> str:
    """Return the robot as MJCF, for trainers that simulate it themselves (mjlab, Playground).

    Args:
        urdf: The robot, see :func:`build_model`.
        servo: Servo of its hinges, without interpolation: a trainer sets targets itself.
        timestep: Integration time step [s].
        start: Position of base_link [m], its orientation (w, x, y, z), and positions of all joints
            of the model, for the keyframe ``stand``.

    Raises:
        SetupError: The URDF does not describe such a robot.
    """
    spec, model = _compiled(urdf, servo, Terrain() if floor else None, timestep)
    ctrl = [start[int(model.jnt_qposadr[joint])] for joint in model.actuator_trnid[:, 0]]
    spec.add_key(name='stand', qpos=list(start), ctrl=ctrl)
    # how a blow-up is handled is the trainer's choice, and MuJoCo Warp refuses the flag
    spec.option.disableflags &= ~int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)
    return _with_position_servos(spec.to_xml())


def _with_position_servos(text: str) -> str:
    """Use MuJoCo's position actuators: other tools do not recognize the general form."""
    root = ET.fromstring(text)  # noqa: S314  # written by MuJoCo itself
    for servo in root.findall('actuator/general'):
        servo.tag = 'position'
        _, _, kv = (servo.attrib.pop('biasprm') + ' 0 0').split()[:3]
        servo.set('kp', servo.attrib.pop('gainprm').split()[0])
        servo.set('kv', f'{-float(kv):g}')
        for name in ('biastype', 'ctrllimited', 'forcelimited'):
            servo.attrib.pop(name, None)
    return ET.tostring(root, encoding='unicode')


def _compiled(
    urdf: str,
    servo: ServoParameters,
    terrain: Terrain | None,
    timestep: float,
    *,
    held: bool = False,
) -> tuple[mujoco.MjSpec, mujoco.MjModel]:
    if mujoco.get_mju_user_warning() is None:  # else it writes a MUJOCO_LOG.TXT where it runs
        mujoco.set_mju_user_warning(_pass_over)
    try:
        spec = _load(urdf)
        _set_options(spec, timestep)
        _add_base(spec)
        _let_legs_collide(spec)
        if held:
            _hold(spec)
        if terrain is not None:
            _add_floor(spec, terrain)
        for joint in movable_joints(urdf):
            _add_servo(spec, joint, servo)
        _add_sensors(spec)
        return spec, spec.compile()
    except ValueError as error:
        raise SetupError(f'the robot description cannot be simulated: {error}') from error


def _load(urdf: str) -> mujoco.MjSpec:
    """Load the robot, with this module's link names.

    Skip visual geometry, whose meshes may be elsewhere, and frames on floating joints, which
    MuJoCo lacks.
    """
    tree = read_urdf(urdf)
    root = ET.fromstring(urdf)  # noqa: S314  # read_urdf takes it, too
    for element in root.findall('link'):
        for visual in element.findall('visual'):
            element.remove(visual)
    spec = mujoco.MjSpec.from_string(ET.tostring(root, encoding='unicode'))
    spec.compiler.fusestatic = False  # feet and IMU stay links of their own
    names = {body_link(tree): BASE}
    if spec.body(IMU) is None:
        names['imu'] = IMU
    names |= {foot_link(tree, leg): foot for leg, foot in zip(LEGS, FEET, strict=True)}
    for link, name in names.items():
        if (body := spec.body(link)) is not None:
            body.name = name
    for joint in tree.joints:
        if joint.kind is JointKind.FLOATING:
            spec.delete(_body(spec, joint.child))
    return spec


def _set_options(spec: mujoco.MjSpec, timestep: float) -> None:
    spec.option.timestep = timestep
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    # a blow-up is to be reported, not hidden by a start from the beginning
    spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET


def _body(spec: mujoco.MjSpec, name: str) -> mujoco.MjsBody:
    body = spec.body(name)
    if body is None:
        raise SetupError(f'the robot description has no link {name}')
    return body


def _add_base(spec: mujoco.MjSpec) -> None:
    _body(spec, BASE).add_freejoint(name='base')
    for geom in spec.geoms:
        geom.contype, geom.conaffinity = 0, _ALL


def _let_legs_collide(spec: mujoco.MjSpec) -> None:
    ways = [[_body(spec, foot)] for foot in FEET]
    for way in ways:
        while way[-1].name != BASE:
            way.append(way[-1].parent)
    # of some robots, the trunk is fixed to a base_link that has no shape
    trunk = set.intersection(*({body.name for body in way} for way in ways))
    for geom in (geom for body in ways[0] if body.name in trunk for geom in body.geoms):
        geom.conaffinity |= _LEGS
    for way in ways:
        leg = [body for body in way if body.name not in trunk]
        for geom in (geom for body in leg for geom in body.geoms):
            geom.contype, geom.conaffinity = _LEGS, geom.conaffinity | _LEGS
        for one, other in combinations(leg, 2):
            spec.add_exclude(bodyname1=one.name, bodyname2=other.name)


def _hold(spec: mujoco.MjSpec) -> None:
    """Make the trunk too heavy for its legs to move, and compensate its gravity."""
    base = _body(spec, BASE)
    legs = sum(float(body.mass) for body in spec.bodies if body.name != BASE)
    base.mass, base.gravcomp = HELD_MASS, 1.0 + legs / HELD_MASS
    base.fullinertia = [*[HELD_MASS] * 3, 0.0, 0.0, 0.0]


def _add_floor(spec: mujoco.MjSpec, terrain: Terrain) -> None:
    ground = {
        'quat': np.roll(terrain.orientation, 1),  # MuJoCo has w first
        'friction': [terrain.friction, 0.005, 0.0001],  # sliding, MuJoCo's torsion and rolling
        'priority': 1,  # the friction is the floor's, whatever touches it
        'conaffinity': 0,
    }
    plane = mujoco.mjtGeom.mjGEOM_PLANE
    spec.worldbody.add_geom(name=FLOOR, type=plane, size=[0, 0, 1], contype=_ALL, **ground)
    if terrain.roughness:
        half = 0.5 * _BUMP_CELL * (_BUMP_CELLS - 1)
        spec.add_hfield(
            name=BUMPS,
            nrow=_BUMP_CELLS,
            ncol=_BUMP_CELLS,
            size=[half, half, terrain.roughness + _SUNK, 0.01],
            userdata=_bumps(terrain).ravel(),
        )
        spec.worldbody.add_geom(
            name=BUMPS,
            type=mujoco.mjtGeom.mjGEOM_HFIELD,
            hfieldname=BUMPS,
            pos=[-_SUNK * each for each in terrain.normal],
            contype=_FEET_ONLY,
            **ground,
        )


def _bumps(terrain: Terrain) -> Array:
    """Return terrain heights from 0 (below the plane) to 1; flat around the start."""
    heights = np.random.default_rng(terrain.seed).random((_BUMP_CELLS, _BUMP_CELLS))
    heights /= heights.max()
    places = _BUMP_CELL * (np.arange(_BUMP_CELLS) - 0.5 * (_BUMP_CELLS - 1))
    near = np.hypot(*np.meshgrid(places, places)) < _SMOOTH_RADIUS
    bumps: Array = np.where(near, 0.0, heights)
    return bumps


def _add_servo(spec: mujoco.MjSpec, joint: Joint, servo: ServoParameters) -> None:
    hinge = spec.joint(joint.name)
    if hinge.type == mujoco.mjtJoint.mjJNT_SLIDE:
        servo = JAW
    # a number in one version of MuJoCo, coefficients of a polynomial in another
    plain = np.isscalar(hinge.damping)
    hinge.damping = servo.damping if plain else [servo.damping, 0.0, 0.0]
    hinge.armature = servo.armature
    hinge.frictionloss = servo.friction
    spec.add_actuator(
        name=joint.name,
        target=joint.name,
        trntype=mujoco.mjtTrn.mjTRN_JOINT,
        gaintype=mujoco.mjtGain.mjGAIN_FIXED,
        biastype=mujoco.mjtBias.mjBIAS_AFFINE,
        gainprm=_padded(servo.stiffness),
        biasprm=_padded(0.0, -servo.stiffness, -servo.velocity_gain),
        forcelimited=True,
        forcerange=[-joint.limits.effort, joint.limits.effort],
        ctrllimited=True,
        ctrlrange=[joint.limits.lower, joint.limits.upper],
    )


def _padded(*values: float) -> list[float]:
    return [*values, *[0.0] * (10 - len(values))]


def _add_sensors(spec: mujoco.MjSpec) -> None:
    _body(spec, IMU).add_site(name=IMU)
    for name, kind in (
        (ACCELEROMETER, mujoco.mjtSensor.mjSENS_ACCELEROMETER),
        (GYRO, mujoco.mjtSensor.mjSENS_GYRO),
    ):
        spec.add_sensor(name=name, type=kind, objtype=mujoco.mjtObj.mjOBJ_SITE, objname=IMU)
    for foot in FEET:
        body = _body(spec, foot)
        body.geoms[0].name = foot
        body.geoms[0].conaffinity |= _FEET_ONLY
        radius = float(body.geoms[0].size[0]) + _TOUCH_MARGIN
        body.add_site(name=foot, size=[radius] * 3)
        spec.add_sensor(
            name=foot,
            type=mujoco.mjtSensor.mjSENS_TOUCH,
            objtype=mujoco.mjtObj.mjOBJ_SITE,
            objname=foot,
        )


BANDWIDTH: Final = 20.0  # [Hz] of the accelerometer's low-pass, as IMU chips have one


def base_rotation(data: mujoco.MjData) -> Array:
    """Return the present rotation of base_link in the world."""
    return _matrix(data.qpos[3:7])


def vector(array: Array) -> Vector:
    """Return the first three numbers of an array."""
    x, y, z = array.tolist()
    return x, y, z


class InertialUnit:
    """Simulated IMU at imu_link. Call :meth:`sample` in every physics step."""

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData) -> None:
        """Bind the IMU to the robot's data arrays."""
        self._data = data
        self._accelerometer = _readings(model, data, ACCELEROMETER)
        self._gyro = _readings(model, data, GYRO)
        self._imu_to_base = _matrix(model.body(IMU).quat)
        self._gravity = np.array([0.0, 0.0, -model.opt.gravity[2]])
        self._share = 1.0 - math.exp(-2.0 * math.pi * BANDWIDTH * model.opt.timestep)
        self._force: Array = np.zeros(3)
        self._change: Array = np.zeros(3)
        self.rest()

    def rest(self) -> None:
        """Reset the filter to rest: a low-pass that starts at zero would report a fall."""
        self._force = self._rotation().T @ self._gravity

    def sample(self) -> None:
        """Filter the present accelerometer value."""
        # in place: this is done 500 times a second of the simulation
        change = self._change
        np.subtract(self._accelerometer, self._force, out=change)
        change *= self._share
        self._force += change

    def read(self) -> Imu:
        """Return the IMU values; the attitude is that of imu_link in the world."""
        quaternion = np.empty(4)
        mujoco.mju_mat2Quat(quaternion, self._rotation().ravel())
        w, x, y, z = quaternion.tolist()
        return Imu(vector(self._force), vector(self._gyro), roll_pitch_yaw((x, y, z, w)))

    def _rotation(self) -> Array:
        rotation: Array = base_rotation(self._data) @ self._imu_to_base
        return rotation


def _readings(model: mujoco.MjModel, data: mujoco.MjData, name: str) -> Array:
    """Return a view of a sensor's values."""
    sensor = model.sensor(name)
    start = int(sensor.adr[0])
    view: Array = data.sensordata[start : start + int(sensor.dim[0])]
    return view


def _matrix(quaternion: Array) -> Array:
    """Return the rotation matrix of a quaternion (w, x, y, z)."""
    matrix = np.empty(9)
    mujoco.mju_quat2Mat(matrix, quaternion)
    return matrix.reshape(3, 3)


FLATTEST = 1e-4  # [m] height of bumps without any; they lie below the plane


@dataclass(frozen=True, slots=True)
class Variation:
    """Deviations of robot and ground from the nominal model."""

    friction: float | None = None  # of the ground; None leaves that of the terrain
    trunk_mass: float = 1.0  # factor of mass and inertia of the trunk
    stiffness: float = 1.0  # factor of the servos' stiffness, and of their gain against speed
    damping: float = 1.0  # factor of the joints' damping, and of the servos' gain against speed
    delay: float = 0.0  # of targets, beside that of the servos [s]
    backlash: float = 0.0  # free play, beside that of the servos [rad]
    refresh: float = 0.0  # time between two targets, beside that of the servos [s]
    bumps: float = 1.0  # factor of the height of bumps on the ground, at most 1

    def __post_init__(self) -> None:
        """Reject unrealistic values."""
        friction = 1.0 if self.friction is None else self.friction
        positive = (friction, self.trunk_mass, self.stiffness)
        others = (self.damping, self.delay, self.backlash, self.refresh)
        if not (
            all(0.0 < n < math.inf for n in positive)
            and all(0.0 <= n < math.inf for n in others)
            and 0.0 <= self.bumps <= 1.0
        ):
            raise SetupError(
                f'{self}: friction, mass and stiffness must be finite and above 0, bumps 0 to 1, '
                'and the others finite and 0 or more'
            )


AS_MADE = Variation()
"""The robot as it was made."""


class VariedModel:
    """A model to which variations can be applied repeatedly, each to the original."""

    def __init__(self, model: mujoco.MjModel) -> None:
        """Store the original values."""
        self._model = model
        welded = model.body_weldid == model.body_weldid[model.body(BASE).id]
        self._trunk = np.flatnonzero(welded)
        self._ground = [
            geom for geom in range(model.ngeom) if model.geom(geom).name in {FLOOR, BUMPS}
        ]
        self._friction = float(model.geom_friction[self._ground[0], 0])
        self._mass = model.body_mass[self._trunk]
        self._inertia = model.body_inertia[self._trunk]
        self._damping = model.dof_damping.copy()
        self._bumps = model.hfield_size[:, 2].copy()
        self._gains = model.actuator_gainprm.copy()
        self._biases = model.actuator_biasprm.copy()
        self._present = AS_MADE

    def vary(self, data: mujoco.MjData, variation: Variation) -> None:
        """Apply a variation; the servos have torque."""
        model = self._model
        model.actuator_gainprm[:] = self._gains * variation.stiffness
        model.actuator_biasprm[:] = self._biases
        model.actuator_biasprm[:, 1] *= variation.stiffness
        model.actuator_biasprm[:, 2] *= variation.stiffness * variation.damping
        if variation == self._present:
            return
        self._present = variation
        friction = self._friction if variation.friction is None else variation.friction
        model.geom_friction[self._ground, 0] = friction
        model.body_mass[self._trunk] = self._mass * variation.trunk_mass
        model.body_inertia[self._trunk] = self._inertia * variation.trunk_mass
        model.dof_damping[:] = self._damping * variation.damping
        model.hfield_size[:, 2] = np.maximum(self._bumps * variation.bumps, FLATTEST)
        mujoco.mj_setConst(model, data)
