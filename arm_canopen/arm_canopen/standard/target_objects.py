# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The object that carries the target of each mode of operation (CiA 402-2, clauses 10 to 16)."""

from __future__ import annotations

from .drive import OperationMode
from .objects import Index

TARGET_OBJECTS: dict[OperationMode, tuple[Index, int]] = {
    OperationMode.PROFILE_POSITION: (Index.TARGET_POSITION, 0),
    OperationMode.VELOCITY: (Index.VL_TARGET_VELOCITY, 0),
    OperationMode.PROFILE_VELOCITY: (Index.TARGET_VELOCITY, 0),
    OperationMode.PROFILE_TORQUE: (Index.TARGET_TORQUE, 0),
    OperationMode.INTERPOLATED_POSITION: (Index.INTERPOLATION_DATA, 1),
    OperationMode.CYCLIC_POSITION: (Index.TARGET_POSITION, 0),
    OperationMode.CYCLIC_VELOCITY: (Index.TARGET_VELOCITY, 0),
    OperationMode.CYCLIC_TORQUE: (Index.TARGET_TORQUE, 0),
}

CYCLIC_MODES = frozenset(
    {
        OperationMode.INTERPOLATED_POSITION,
        OperationMode.CYCLIC_POSITION,
        OperationMode.CYCLIC_VELOCITY,
        OperationMode.CYCLIC_TORQUE,
    }
)
"""Modes whose targets come with every SYNC (CiA 402-2, clauses 12 to 16)."""
