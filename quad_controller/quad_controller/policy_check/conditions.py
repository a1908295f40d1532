# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What differs from the robot and the ground as they are made, one thing at a time: as data."""

from __future__ import annotations

from dataclasses import dataclass, field, replace


@dataclass(frozen=True, slots=True)
class Conditions:
    """How robot and ground differ.

    Attributes:
        trunk_mass: Factor of the mass of the trunk.
        friction: Of the ground; None leaves it as it is.
        delay: From targets that are sent to servos that have them in [s].
        gyro_bias: Of each axis of the gyro in [rad/s].
        level_bias: Of measured roll and pitch in [rad].
        push: Change of the velocity at once, to any side, every two seconds, in [m/s].
        roughness: Height of the highest bumps of the ground in [m].
    """

    trunk_mass: float = 1.0
    friction: float | None = None
    delay: float = 0.0
    gyro_bias: float = 0.0
    level_bias: float = 0.0
    push: float = 0.0
    roughness: float = 0.0


AS_MADE = Conditions()
"""The robot as it is, on level ground."""

TIPPING_PUSH = 1.3
"""A push that tips the gait in about half of the cases, in [m/s]."""


@dataclass(frozen=True, slots=True)
class Sweep:
    """One parameter and the values that are tried.

    Attributes:
        name: An attribute of :class:`Conditions`.
        title: What a person reads.
        unit: Of the values as they are shown.
        factor: From a value to how it is shown.
        values: In their order.
    """

    name: str
    title: str
    unit: str
    values: tuple[float, ...] = field(default=())
    factor: float = 1.0

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
