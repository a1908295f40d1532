# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Targets of the servos: checked, kept within the limits, and approached along a straight line."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from quad_description import Joint

from ..exceptions import TargetError
from .state import Array

Targets = Mapping[str, float] | Sequence[float] | Array
"""Positions by name, or of all joints in the order of the URDF; [rad], of a gripper [m]."""


class TargetRamp:
    """The set-points of all servos, one value for each time step."""

    def __init__(self, joints: Sequence[Joint], timestep: float, values: Array) -> None:
        """Stand still.

        Args:
            joints: Names and limits, in the order of the values.
            timestep: Time between two calls of :meth:`advance` [s].
        """
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
        """Where the set-points go [rad], a copy."""
        return np.array(self._goal)

    def jump(self, values: Array) -> None:
        """Be at other set-points at once."""
        self.values[:] = values
        self._goal[:] = values
        self._slope[:] = 0.0
        self._next_arrival = self._last_arrival = self._step

    def approach(self, targets: Targets, duration: float) -> None:
        """Begin to approach targets; joints that are not named go on with what they do.

        Args:
            targets: Where to; what lies beyond a limit is taken to the limit, as servos do.
            duration: How long it takes [s]; 0 for a step.

        Raises:
            TargetError: A name is unknown, a value is not finite, or there are too many or few.
        """
        indices, values = self._checked(targets)
        goal = np.minimum(np.maximum(values, self._lower[indices]), self._upper[indices])
        steps = max(round(duration / self._timestep), 1)
        self._goal[indices] = goal
        self._slope[indices] = (goal - self.values[indices]) / steps
        self._arrival[indices] = self._step + steps
        if indices is self._all:
            self._next_arrival = self._last_arrival = self._step + steps
        else:
            self._plan()

    def check(self, targets: Targets) -> None:
        """Refuse what :meth:`approach` would refuse, and change nothing.

        Raises:
            TargetError: A name is unknown, a value is not finite, or there are too many or few.
        """
        self._checked(targets)

    def advance(self) -> None:
        """Go one time step on."""
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

    def _checked(self, targets: Targets) -> tuple[NDArray[np.intp], Array]:
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
