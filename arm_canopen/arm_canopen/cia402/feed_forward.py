# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Feed-forward of a stream of positions: velocity 0x60B1, torque 0x60B2 (CiA 402-2, clause 13).

In mode 8 a drive adds them to what its own control makes of the position. In the modes 9 and 10
it adds them to the target, so none may be left over from a stream.
"""

from __future__ import annotations

from canopen_core.standard import Index

from .drive_objects import DriveObjects
from .modes import fitting
from .motion import Setpoint
from .units import Units


class FeedForward:
    """The offsets of one axis, as far as RPDOs carry them.

    An offset that no stream has set is left as it is: it may be somebody's own.
    """

    def __init__(self, objects: DriveObjects, units: Units) -> None:
        self._units = units
        self._velocity = objects.target_writer(Index.VELOCITY_OFFSET)
        self._torque = objects.target_writer(Index.TORQUE_OFFSET)
        self._acts = False

    def follow(self, setpoint: Setpoint) -> None:
        """Write what belongs to a set-point.

        Raises:
            DriveError: A value is not finite or does not fit its object; nothing is written.
        """
        velocity_dev = self._units.velocity.to_device(setpoint.velocity)
        torque_dev = self._units.effort.to_device(setpoint.effort)
        for writer, value in ((self._velocity, velocity_dev), (self._torque, torque_dev)):
            if writer is not None:
                fitting(writer, value)
        if velocity_dev or torque_dev:
            self._acts = True
            self._write(velocity_dev, torque_dev)
        else:
            self.end()

    def end(self) -> None:
        """Reset the offsets that were written."""
        if self._acts:
            self._acts = False
            self._write(0, 0)

    def _write(self, velocity_dev: int, torque_dev: int) -> None:
        if self._velocity is not None:
            self._velocity.write(velocity_dev)
        if self._torque is not None:
            self._torque.write(torque_dev)
