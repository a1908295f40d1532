# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The robot in MuJoCo; no other part of the simulation needs MuJoCo."""

from .backend import ImuBias, Meter, Metered, PhysicsBackend
from .model import Variation
from .robot import Robot

__all__ = ['ImuBias', 'Meter', 'Metered', 'PhysicsBackend', 'Robot', 'Variation']
