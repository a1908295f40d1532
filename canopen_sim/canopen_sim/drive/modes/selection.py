# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Which modes of operation the drive has, and which one is selected (0x6060, 0x6061, 0x6502)."""

from __future__ import annotations

from collections.abc import Container

from canopen_core.standard import AbortCode, Value

from ...deviations import Fault
from ...objects.object_store import refusal
from ...services.sync_consumer import SyncConsumer
from ..axis import Axis
from ..objects import DriveObjects
from .homing import Homing
from .mode import Mode, NoMode
from .profile_position import ProfilePosition
from .profile_velocity import ProfileVelocity
from .streamed import CyclicPosition, CyclicVelocity, InterpolatedPosition
from .torque import CyclicTorque, ProfileTorque
from .velocity import Velocity

MODES: tuple[type[Mode], ...] = (
    NoMode,
    ProfilePosition,
    Velocity,
    ProfileVelocity,
    ProfileTorque,
    Homing,
    InterpolatedPosition,
    CyclicPosition,
    CyclicVelocity,
    CyclicTorque,
)


class ModeSelection:
    """The modes of a drive.

    A mode is there when it is simulated and 0x6502 of the dictionary names it; where the
    dictionary does not list it, when it has the objects of the mode. Another one is refused to an
    SDO; from an RPDO it is ignored, and 0x6061 goes on showing the present mode.
    """

    def __init__(
        self, objects: DriveObjects, axis: Axis, clock: SyncConsumer, causes: Container[Fault] = ()
    ) -> None:
        self._objects = objects
        self._causes = causes
        self._modes: dict[int, Mode] = {m.number: m(objects, axis, clock) for m in MODES}
        self.current = self._modes[NoMode.number]  # the selected mode
        objects.mode.check = self._check

    def reset(self) -> None:
        """Select what the dictionary has as default, as after switching on."""
        for mode in self._modes.values():
            mode.reset()
        supported = self._objects.supported_modes
        # many EDS files give no default here, and a drive without any mode would be of no use;
        # others promise more than is simulated
        promised = supported.value or self._objects.possible_modes
        supported.value = promised & sum(m.number.support_bit for m in MODES)
        self.current = self._modes[NoMode.number]
        self.select()

    def select(self) -> bool:
        """Select and display the mode of 0x6060; return whether that is another mode."""
        number = self._objects.mode.value
        changed = number != self.current.number and self._supports(number)
        if changed:
            self.current = self._modes[number]
        self._objects.mode_display.put(self.current.number)
        return changed

    def _supports(self, number: int) -> bool:
        mode = self._modes.get(number)
        if mode is None or (not number and Fault.MODE_ZERO_REFUSED in self._causes):
            return False
        bit = mode.number.support_bit
        return not bit or bool(bit & self._objects.supported_modes.value)

    def _check(self, value: Value) -> None:
        if not isinstance(value, int) or not self._supports(value):
            raise refusal(AbortCode.VALUE_RANGE, self._objects.mode.entry)
