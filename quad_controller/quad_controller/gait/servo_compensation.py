# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Set-points that make soft servos be where a firm one would be.

A position servo is a spring: it lags behind a moving set-point and sags under the robot's weight.
The set-point is moved ahead by what the spring needs, from the motion of the next step and, for
the legs that stand, from their share of the weight::

    command = q + (damping / kp) q' + (inertia / kp) q'' - J^T f / kp,   f = m g / standing legs
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from quad_description import jacobian, Quadruped, Targets

from ..exceptions import ParameterError
from ..settings import setting

GRAVITY = 9.81  # [m/s^2]
LOOK = 2  # steps of the motion, after the newest one, that it looks at
MAX_SAG = 1.0  # [rad] beyond which a servo carries nothing
STEP_LOAD = 1.25  # of its share of the weight: what each of two legs carries; found in physics


@dataclass(frozen=True, slots=True)
class ServoModel:
    """A servo as a spring with a damper.

    The stiffness is what the vendor published. Damping and inertia are those with which the gait
    keeps its speed in physics, at every stiffness from 1.1 to 10 N m/rad.
    """

    kp: float = setting(2.45, 0.01, 1000.0, 'stiffness of a servo [N m/rad]')
    damping: float = setting(0.058, 0.0, 10.0, 'what holds a servo back by its speed [N m s/rad]')
    inertia: float = setting(0.0, 0.0, 1.0, 'what a joint turns [kg m2]')
    mass: float = setting(0.0, 0.0, 100.0, 'what the legs carry [kg]; 0: as in the URDF')


class ServoCompensation:
    """Changes joint targets; costs one step of delay, since it looks one step ahead."""

    def __init__(self, robot: Quadruped, servo: ServoModel) -> None:
        """Start without a past."""
        self._robot = robot
        self._servo = servo
        self._weight = GRAVITY * (servo.mass or robot.mass)
        self._window: list[tuple[Targets, tuple[bool, ...]]] = []

    def reset(self) -> None:
        """Forget the motion so far."""
        self._window.clear()

    def at_rest(self, targets: Targets) -> Targets:
        """Return the set-points for standing still on all legs at some targets [rad].

        Raises:
            ParameterError: Servos that are so soft cannot carry the robot.
        """
        moved = list(targets)
        self._carry(moved, targets, (True,) * len(self._robot.legs))
        sag = max(abs(a - b) for a, b in zip(moved, targets, strict=True))
        if sag > MAX_SAG:
            raise ParameterError(
                f'servos of {self._servo.kp:g} N m/rad sag by {sag:.1f} rad below '
                f'{self._weight / GRAVITY:.1f} kg; set servo_compensation.kp to the stiffness of '
                'those of this robot [N m/rad], or servo_compensation.enabled to false'
            )
        return self._robot.clamp(moved)

    def step(self, targets: Targets, contacts: tuple[bool, ...], dt: float) -> Targets:
        """Return the set-points for the targets of one step ago.

        Args:
            targets: Where the joints shall be in [rad].
        """
        window = self._window
        window.append((targets, contacts))
        while len(window) <= LOOK:
            window.append((targets, contacts))
        if len(window) > LOOK + 1:
            del window[0]
        before, (now, stand), after = window[0][0], window[1], window[2][0]
        step = max(dt, 1e-3)
        lead, inertia = self._servo.damping / self._servo.kp, self._servo.inertia / self._servo.kp
        moved = [
            q + lead * (b - a) / (2 * step) + inertia * (b - 2 * q + a) / (step * step)
            for a, q, b in zip(before, now, after, strict=True)
        ]
        self._carry(moved, now, stand)
        return self._robot.clamp(moved)

    def _carry(self, moved: list[float], now: Targets, stand: Sequence[bool]) -> None:
        share = self._weight / max(sum(stand), 1) / self._servo.kp
        if sum(stand) <= len(stand) // 2:
            share *= STEP_LOAD
        legs = zip(self._robot.legs, self._robot.leg_indices, stand, strict=True)
        for leg, indices, stands in legs:
            if stands:
                hip, thigh, calf = indices
                columns = jacobian(leg, (now[hip], now[thigh], now[calf]))
                for index, column in zip(indices, columns, strict=True):
                    moved[index] -= column[2] * share
