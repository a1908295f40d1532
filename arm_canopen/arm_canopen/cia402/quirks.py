# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Where drives deviate from CiA 402, as data: ``quirks: NAME`` of a device in bus.yml."""

from __future__ import annotations

from dataclasses import dataclass

from canopen_core import DriveError


@dataclass(frozen=True, slots=True)
class Quirks:
    """How one kind of drive deviates."""

    state_timeout: float = 5.0  # time for all steps to a state in [s], as ros2_canopen has it
    mode_timeout: float = 5.0  # time for 0x6061 to follow 0x6060 in [s]
    homed_without_arrival: bool = False  # the end of homing is bit 12 alone; bit 10 never comes
    # 0x6060 = 0 is refused, so the mode that the drive has is kept selected
    no_mode_zero: bool = False


STANDARD = Quirks()

QUIRKS: dict[str, Quirks] = {
    '': STANDARD,
    # 3 to 6 s to switch to interpolated position (ros_canopen issue 457)
    'festo_cmmp': Quirks(mode_timeout=10.0),
    # methods 35 and 37 end with bit 12 only (ros2_canopen issue 236)
    'homing_bit_12_only': Quirks(homed_without_arrival=True),
    # drives that answer 0x6060 = 0 with an abort, or ignore it
    'no_mode_zero': Quirks(no_mode_zero=True),
    # large drives that discharge and charge their link when they are switched
    'slow_states': Quirks(state_timeout=20.0),
}
"""By name; the sources are the reports of users."""


def quirks_of(name: str) -> Quirks:
    """Return the quirks of a name in bus.yml."""
    try:
        return QUIRKS[name]
    except KeyError:
        known = ', '.join(sorted(key for key in QUIRKS if key))
        raise DriveError(f'quirks {name!r} are unknown; known: {known}') from None
