# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
r"""Servo model, and a kinematic robot that consists of servos only.

The torque on a joint is

.. math:: \tau = \mathrm{clamp}(k_p\,\mathrm{dead}(q^* - q) - k_v \dot q, \pm\tau_{max}) - d \dot q

with the largest torque from the URDF. ``dead`` is zero within the free width: the dead band, and
half the backlash to either side. A stall torque of 0.46 N m and a
no-load speed of 9.2 rad/s contribute 0.05 N m s/rad to the passive damping :math:`d`: this is the
torque-speed line of the motor, and therefore outside the clamp. A target takes effect after the
delay, at the next refresh; the set-point then moves to it linearly.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, fields
from enum import Enum
import math

import numpy as np
from numpy.typing import NDArray

from quad_description import Joint, movable_joints
from quad_description.rotations import Vector

from .exceptions import SetupError, TargetError
from .state import Array, BasePose, BaseVelocity, disturb, Imu, Measurement, Noise, NONE

MAX_DELAY = 1.0  # [s]


@dataclass(frozen=True, slots=True)
class ServoParameters:
    """Parameters of a servo."""

    stiffness: float  # torque per position error, k_p [N m/rad]
    velocity_gain: float = 0.0  # torque against speed inside the clamp, k_v [N m s/rad]
    damping: float = 0.05  # torque-speed line of the motor, d [N m s/rad]
    armature: float = 0.001  # inertia of rotor and gear at the joint [kg m2]
    friction: float = 0.0  # dry friction [N m]
    # time over which the servo goes from one target to the next [s]; 0: a step
    interpolation: float = 0.0
    deadband: float = 0.0  # error to either side that the servo ignores [rad]
    backlash: float = 0.0  # free play of the gear, from one end to the other [rad]
    delay: float = 0.0  # from a target to the servo that has it [s]
    refresh: float = 0.0  # time between two targets that the servo takes over [s]; 0: all

    def __post_init__(self) -> None:
        """Reject invalid numbers."""
        for name in self.__slots__:
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= 0.0):
                raise SetupError(f'servo: {name} {value} must be zero or a positive number')
        if self.stiffness == 0.0:
            raise SetupError('servo: stiffness 0 never moves; give it in [N m/rad], e.g. 2.45')
        if max(self.delay, self.refresh) > MAX_DELAY:
            raise SetupError(
                f'servo: delay {self.delay} s, refresh {self.refresh} s: give 0 to {MAX_DELAY:g}'
            )

    @property
    def free_width(self) -> float:
        """Error to either side that causes no torque [rad]."""
        return self.deadband + 0.5 * self.backlash


class ServoModel(Enum):
    """Named servo models; use ServoParameters for any other.

    NOMINAL is the default: published figures of the vendor's servos and of the serial bus servos
    that they are based on (sources in the README). VENDOR_RL is the actuator of the vendor's newer
    training environment (luwu_mjlab), which policies trained there expect. FIRM is not a real
    servo, but stiff enough to show a gait or policy with ideal tracking.
    """

    NOMINAL = 'nominal'
    FIRM = 'firm'
    VENDOR_RL = 'vendor_rl'

    @property
    def parameters(self) -> ServoParameters:
        """Parameters of the model."""
        return _PARAMETERS[self]


_PARAMETERS = {
    ServoModel.NOMINAL: ServoParameters(
        stiffness=2.45,
        velocity_gain=0.042,
        interpolation=0.02,
        deadband=0.0015,
        backlash=0.015,
        delay=0.02,
    ),
    ServoModel.FIRM: ServoParameters(stiffness=10.0, velocity_gain=0.25, interpolation=0.02),
    ServoModel.VENDOR_RL: ServoParameters(stiffness=1.1, armature=0.002, friction=0.001),
}

JAW = ServoParameters(stiffness=400.0, velocity_gain=4.0, damping=1.0, armature=0.01)
"""A jaw on its rack: [N/m], [N s/m], [kg]; chosen by us, closes in a tenth of a second."""


def parse_servo(text: str) -> ServoParameters:
    """Parse a servo model's name, or ``name=value,...``.

    Raises:
        SetupError: The text is wrong; the message lists valid input.
    """
    known = [model.value for model in ServoModel]
    if text in known:
        return ServoModel(text).parameters
    names = {'kp': 'stiffness', 'kv': 'velocity_gain'}
    names |= {each.name: each.name for each in fields(ServoParameters)[2:]}
    values: dict[str, float] = {}
    for word in text.split(','):
        name, _, value = word.partition('=')
        try:
            values[names[name.strip()]] = float(value)
        except (KeyError, ValueError):
            raise SetupError(
                f'--servo {text!r}: give {" or ".join(known)}, or {",".join(names)} as name=value'
            ) from None
    if 'stiffness' not in values:
        raise SetupError(f'--servo {text!r} needs kp, in [N m/rad]')
    return ServoParameters(**values)


Targets = Mapping[str, float] | Sequence[float] | Array
"""Positions by name, or of all joints in the order of the URDF; [rad], of a gripper [m]."""


class TargetRamp:
    """Set-points of all servos, advanced in time steps."""

    def __init__(self, joints: Sequence[Joint], timestep: float, values: Array) -> None:
        """Start at rest; values are in joint order; each advance takes a timestep [s]."""
        self._index = {joint.name: index for index, joint in enumerate(joints)}
        self._lower = np.array([joint.limits.lower for joint in joints])
        self._upper = np.array([joint.limits.upper for joint in joints])
        self._timestep = timestep
        self.values: Array = values  # the set-points now [rad]; changes in place with every step
        self._goal: Array = values.copy()
        self._slope: Array = np.zeros(len(joints))  # [rad] a step; 0 for those that stand still
        self._arrival = np.zeros(len(joints), dtype=np.int64)  # step in which each arrives
        self._step = self._next_arrival = self._last_arrival = 0
        self._all = np.arange(len(joints))

    @property
    def goal(self) -> Array:
        """Final set-points [rad], a copy."""
        return np.array(self._goal)

    def jump(self, values: Array) -> None:
        """Set the set-points at once."""
        self.values[:] = values
        self._goal[:] = values
        self._slope[:] = 0.0
        self._next_arrival = self._last_arrival = self._step

    def approach(self, targets: Targets, duration: float) -> None:
        """Start ramping to targets in a time [s]; other joints continue.

        Targets are clamped to the limits, as in the servos.

        Raises:
            TargetError: A name is unknown, a value is not finite, or the count is wrong.
        """
        self.begin(*self.checked(targets), duration)

    def begin(self, indices: NDArray[np.intp], values: Array, duration: float) -> None:
        """Start ramping to the result of :meth:`checked`, like :meth:`approach`."""
        goal = np.minimum(np.maximum(values, self._lower[indices]), self._upper[indices])
        steps = max(round(duration / self._timestep), 1)
        self._goal[indices] = goal
        self._slope[indices] = (goal - self.values[indices]) / steps
        self._arrival[indices] = self._step + steps
        if indices is self._all:
            self._next_arrival = self._last_arrival = self._step + steps
        else:
            self._plan()

    def advance(self) -> None:
        """Advance by one time step."""
        if self._step == self._last_arrival:
            return
        self._step += 1
        self.values += self._slope
        if self._step == self._next_arrival:
            arrived = self._arrival == self._step
            self.values[arrived] = self._goal[arrived]
            self._slope[arrived] = 0.0
            self._plan()

    def _plan(self) -> None:
        coming = self._arrival[self._arrival > self._step]
        self._next_arrival = int(coming.min()) if len(coming) else self._step
        self._last_arrival = int(coming.max()) if len(coming) else self._step

    def checked(self, targets: Targets) -> tuple[NDArray[np.intp], Array]:
        """Check targets; return their indices and values without side effects.

        Raises:
            TargetError: A name is unknown, a value is not finite, or the count is wrong.
        """
        if isinstance(targets, Mapping):
            unknown = sorted(targets.keys() - self._index.keys())
            if unknown:
                known = ', '.join(self._index)
                raise TargetError(f'no joint is named {", ".join(unknown)}; there are {known}')
            indices = np.array([self._index[name] for name in targets], np.intp)
            values = np.array(list(targets.values()), dtype=np.float64)
        else:
            indices = self._all
            values = np.asarray(targets, dtype=np.float64)
            if values.shape != (len(indices),):
                raise TargetError(
                    f'{values.shape} targets for {len(indices)} joints; give one for each'
                )
        if not np.isfinite(values).all():
            names = list(self._index)
            bad = [names[indices[k]] for k in np.flatnonzero(~np.isfinite(values))]
            raise TargetError(f'targets of {", ".join(bad)} are not finite; nothing moves')
        return indices, values


TIMESTEP = 0.002  # [s]
SET_POINT_TIME = 0.02  # [s] of a servo from one target to the next
GRAVITY = 9.81  # [m/s2]
_FEET = 4


class KinematicRobot:
    """A robot held in the air: servos follow at once, and nothing else moves.

    It is cheap and does not need MuJoCo; suited to test the serial side, not gaits.
    """

    def __init__(
        self,
        urdf: str,
        *,
        pose: Mapping[str, float] | None = None,
        noise: Noise = NONE,
        seed: int = 0,
    ) -> None:
        """Hold the robot in a pose [rad], by default zero; :meth:`measure` adds noise.

        Raises:
            SetupError: The pose names joints that the robot lacks.
        """
        joints = movable_joints(urdf)
        self.joint_names = tuple(joint.name for joint in joints)
        self._noise = noise
        self._ramp = TargetRamp(joints, TIMESTEP, np.zeros(len(joints)))
        self._random = np.random.default_rng(seed)
        self._on = dict.fromkeys(self.joint_names, True)
        self._missed: dict[str, float] = {}  # targets that came without torque
        self._steps, self._remaining_steps = 0, 0.0
        try:
            self._ramp.approach(pose or {}, 0.0)
        except TargetError as error:
            raise SetupError(f'start pose: {error}') from error
        self._ramp.advance()
        self._before: Array = self._ramp.values.copy()

    @property
    def time(self) -> float:
        """Time since the start [s]."""
        return self._steps * TIMESTEP

    @property
    def base_pose(self) -> BasePose:
        """Constant level pose."""
        return BasePose((0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))

    @property
    def base_velocity(self) -> BaseVelocity:
        """Always zero."""
        return BaseVelocity((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))

    @property
    def foot_contacts(self) -> tuple[bool, ...]:
        """No contacts: the robot is held in the air."""
        return (False,) * _FEET

    @property
    def joint_targets(self) -> Array:
        """Present set-points [rad]."""
        return np.array(self._ramp.values)

    def set_targets(self, targets: Targets, duration: float | None = None) -> None:
        """Set new targets [rad]; servos without torque stay where they are.

        Raises:
            TargetError: See :meth:`quad_sim.physics.Robot.set_targets`.
        """
        self._ramp.checked(targets)
        if not isinstance(targets, Mapping):
            targets = dict(zip(self.joint_names, targets, strict=True))
        held = {name: value for name, value in targets.items() if self._on[name]}
        self._missed |= {name: value for name, value in targets.items() if not self._on[name]}
        self._ramp.approach(held, SET_POINT_TIME if duration is None else duration)

    def set_torque(
        self, on: bool, joints: Iterable[str] | None = None, *, hold: bool = True
    ) -> None:
        """Switch servos on or off; one without torque neither falls nor follows targets."""
        names = self.joint_names if joints is None else tuple(joints)
        self._on |= dict.fromkeys(names, on)
        missed = {name: self._missed.pop(name) for name in names if on and name in self._missed}
        if not hold:
            self._ramp.approach(missed, 0.0)

    def torque_on(self, joint: str) -> bool:
        """Return whether a servo has torque."""
        return self._on[joint]

    def push(self, force: Vector, duration: float = 0.1) -> None:
        """Raise SetupError: a held robot cannot move.

        Raises:
            SetupError: Always.
        """
        raise SetupError('a robot without physics cannot be pushed; leave out --physics none')

    def kick(self, velocity: Vector) -> None:
        """Raise SetupError, as :meth:`push` does.

        Raises:
            SetupError: Always.
        """
        raise SetupError('a robot without physics cannot be kicked; leave out --physics none')

    def step(self, duration: float) -> None:
        """Advance by a duration [s]."""
        self._remaining_steps += duration / TIMESTEP
        count = int(self._remaining_steps + 1e-6)
        self._remaining_steps -= count
        self._steps += count
        for _ in range(count):
            self._before[:] = self._ramp.values
            self._ramp.advance()

    def measure(self) -> Measurement:
        """Return the sensor values."""
        values = self.joint_targets
        level = (0.0, 0.0, 0.0)
        truth = Measurement(
            imu=Imu((0.0, 0.0, GRAVITY), level, level),
            positions=values,
            velocities=(values - self._before) / TIMESTEP,
            torques=np.zeros(len(values)),
        )
        return disturb(truth, self._noise, self._random)
