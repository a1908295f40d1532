# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
r"""How the servos follow their targets.

The torque on a joint is

.. math:: \tau = \mathrm{clamp}(k_p (q^* - q) - k_v \dot q, \pm\tau_{max}) - d \dot q

with the largest torque from the URDF. Of the passive damping :math:`d`, a stall torque of 0.46 N m
and a no-load speed of 9.2 rad/s give 0.05 N m s/rad: it is the torque-speed line of the motor, and
therefore outside the clamp.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
import math

from ..exceptions import SetupError


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

    def __post_init__(self) -> None:
        """Refuse numbers that are no servo."""
        for name in self.__slots__:
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= 0.0):
                raise SetupError(f'servo: {name} {value} must be zero or a positive number')
        if self.stiffness == 0.0:
            raise SetupError('servo: stiffness 0 never moves; give it in [N m/rad], e.g. 10')


class ServoModel(Enum):
    """Servos that were measured or trained with; anything else is a ServoParameters.

    FIRM stands for the real servo, which the vendor does not describe: stiff enough that the
    geometric gait tracks its speed (below 8 N m/rad it loses it). VENDOR_RL is the actuator in the
    vendor's training environment (luwu_mjlab): policies trained there expect it.
    """

    FIRM = 'firm'
    VENDOR_RL = 'vendor_rl'

    @property
    def parameters(self) -> ServoParameters:
        """The numbers of the model."""
        return _PARAMETERS[self]


_PARAMETERS = {
    ServoModel.FIRM: ServoParameters(stiffness=10.0, velocity_gain=0.25, interpolation=0.02),
    ServoModel.VENDOR_RL: ServoParameters(stiffness=1.1, armature=0.002, friction=0.001),
}

JAW = ServoParameters(stiffness=400.0, velocity_gain=4.0, damping=1.0, armature=0.01)
"""A jaw on its rack: [N/m], [N s/m], [kg]; chosen by us, closes in a tenth of a second."""
