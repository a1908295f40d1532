# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
r"""How the servos follow their targets.

The torque on a joint is

.. math:: \tau = \mathrm{clamp}(k_p\,\mathrm{dead}(q^* - q) - k_v \dot q, \pm\tau_{max}) - d \dot q

with the largest torque from the URDF. ``dead`` is zero within the free width: the dead band, and
half the backlash to either side. Of the passive damping :math:`d`, a stall torque of 0.46 N m
and a no-load speed of 9.2 rad/s give 0.05 N m s/rad: it is the torque-speed line of the motor, and
therefore outside the clamp. A target arrives after the delay, with the next refresh.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from enum import Enum
import math

from ..exceptions import SetupError

MAX_DELAY = 1.0  # [s]


@dataclass(frozen=True, slots=True)
class ServoParameters:
    """What a servo does with its target."""

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
        """Refuse numbers that are no servo."""
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
        """Error to either side that moves nothing [rad]."""
        return self.deadband + 0.5 * self.backlash


class ServoModel(Enum):
    """Servos by name; anything else is a ServoParameters.

    NOMINAL is the default: published figures of the vendor's servos and of the serial bus servos
    that they are made of (sources in the README). VENDOR_RL is the actuator in the vendor's newer
    training environment (luwu_mjlab): policies trained there expect it. FIRM is no real servo, but
    stiff enough to show what a gait or policy does when the servos follow; trot_ppo was trained
    with it.
    """

    NOMINAL = 'nominal'
    FIRM = 'firm'
    VENDOR_RL = 'vendor_rl'

    @property
    def parameters(self) -> ServoParameters:
        """The numbers of the model."""
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
    """Return a servo from its name, or from ``name=value,...``.

    Raises:
        SetupError: The text has no sense; the message names what has.
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
