# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A robot that is a little heavier, softer or on smoother ground than the one it was made as."""

from __future__ import annotations

from dataclasses import dataclass
import math

import mujoco
import numpy as np

from ..exceptions import SetupError
from .model import BASE, BUMPS, FLOOR

FLATTEST = 1e-4  # [m] height of bumps without any; they lie below the plane


@dataclass(frozen=True, slots=True)
class Variation:
    """How a robot and its ground differ from what they were made as."""

    friction: float | None = None  # of the ground; None leaves that of the terrain
    trunk_mass: float = 1.0  # factor of mass and inertia of the trunk
    stiffness: float = 1.0  # factor of the servos' stiffness, and of their gain against speed
    damping: float = 1.0  # factor of the joints' damping, and of the servos' gain against speed
    delay: float = 0.0  # of targets, beside that of the servos [s]
    backlash: float = 0.0  # free play, beside that of the servos [rad]
    refresh: float = 0.0  # time between two targets, beside that of the servos [s]
    bumps: float = 1.0  # factor of the height of bumps on the ground, at most 1

    def __post_init__(self) -> None:
        """Refuse what no robot has."""
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
    """A model that can be varied again and again; each variation counts from the original."""

    def __init__(self, model: mujoco.MjModel) -> None:
        """Keep what may change."""
        self._model = model
        self._base = int(model.body(BASE).id)
        self._ground = [
            geom for geom in range(model.ngeom) if model.geom(geom).name in {FLOOR, BUMPS}
        ]
        self._friction = float(model.geom_friction[self._ground[0], 0])
        self._mass = float(model.body_mass[self._base])
        self._inertia = model.body_inertia[self._base].copy()
        self._damping = model.dof_damping.copy()
        self._bumps = model.hfield_size[:, 2].copy()
        self._gains = model.actuator_gainprm.copy()
        self._biases = model.actuator_biasprm.copy()
        self._present = AS_MADE

    def vary(self, data: mujoco.MjData, variation: Variation) -> None:
        """Apply a variation; the servos hold."""
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
        model.body_mass[self._base] = self._mass * variation.trunk_mass
        model.body_inertia[self._base] = self._inertia * variation.trunk_mass
        model.dof_damping[:] = self._damping * variation.damping
        model.hfield_size[:, 2] = np.maximum(self._bumps * variation.bumps, FLATTEST)
        mujoco.mj_setConst(model, data)
