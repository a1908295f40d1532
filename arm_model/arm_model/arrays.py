# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Arrays of numbers: their type, and their check at the border."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .exceptions import CommandError

Array = NDArray[np.float64]
"""Numbers in double precision; the shape stands in the docstring of each use."""

Places = NDArray[np.int_]  # numbers of rows, from 0
Mask = NDArray[np.bool_]  # yes or no for each joint or axis
Native = Any  # an object of a library that has no types


def frozen(values: Sequence[float] | Array) -> Array:
    """Return a read-only copy."""
    array = np.array(values, dtype=np.float64)
    array.setflags(write=False)
    return array


def checked(values: Sequence[float] | Array, length: int, what: str) -> Array:
    """Return a read-only copy of finite numbers of a known count.

    Raises:
        CommandError: The count is wrong, or a number is not finite.
    """
    array = frozen(values)
    if array.shape != (length,):
        raise CommandError(f'{what}: {array.size} numbers, {length} are needed')
    if not np.isfinite(array).all():
        place = int(np.flatnonzero(~np.isfinite(array))[0])
        raise CommandError(
            f'{what}: number {place} is {array[place]}; every number must be finite'
        )
    return array
