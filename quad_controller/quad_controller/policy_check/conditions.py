# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What differs from the robot and the ground as they are made, one thing at a time: as data."""

from __future__ import annotations

from dataclasses import dataclass, field, replace


@dataclass(frozen=True, slots=True)
class Conditions:
    """How robot and ground differ."""

    trunk_mass: float = 1.0  # factor of the mass of the trunk
    friction: float | None = None  # of the ground; None leaves it as it is
    delay: float = 0.0  # from targets that are sent to servos that have them in [s]
    gyro_bias: float = 0.0  # of each axis of the gyro in [rad/s]
    level_bias: float = 0.0  # of measured roll and pitch in [rad]
    push: float = 0.0  # change of the velocity at once, to any side, every two seconds, in [m/s]
    roughness: float = 0.0  # height of the highest bumps of the ground in [m]


AS_MADE = Conditions()
"""The robot as it is, on level ground."""

TIPPING_PUSH = 1.3
"""A push that tips the gait in about half of the cases, in [m/s]."""


@dataclass(frozen=True, slots=True)
class Sweep:
    """One parameter and the values that are tried."""

    name: str  # an attribute of :class:`Conditions`
    title: str  # what a person reads
    unit: str  # of the values as they are shown
    values: tuple[float, ...] = field(default=())  # in their order
    factor: float = 1.0  # from a value to how it is shown

    def conditions(self, value: float) -> Conditions:
        """Return what differs at a value."""
        return replace(AS_MADE, **{self.name: value})

    def text(self, value: float) -> str:
        """Return a value as it is shown."""
        return f'{value * self.factor:g}'


SWEEPS = (
    Sweep('trunk_mass', 'mass of the trunk', '%', (0.8, 1.0, 1.2, 2.0, 3.0), 100.0),
    Sweep('friction', 'friction of the ground', '', (0.03, 0.06, 0.12, 0.3, 0.8)),
    Sweep('delay', 'delay of targets', 'ms', (0.0, 0.02, 0.04, 0.08), 1e3),
    Sweep('gyro_bias', 'bias of the gyro', 'rad/s', (0.0, 0.3, 0.6, 1.2)),
    Sweep('level_bias', 'bias of roll and pitch', 'mrad', (0.0, 0.06, 0.12, 0.24), 1e3),
    Sweep('push', 'pushes every 2 s', 'm/s', (0.0, 0.8, 1.2, 1.6, 2.0)),
    Sweep('roughness', 'rough ground', 'mm', (0.0, 0.01, 0.02, 0.03), 1e3),
)
"""What is tried: up to where the gait or what was trained for it has trouble."""
