# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""PDOs: their two directions, the configuration of one, and when a TPDO counts as lost.

A TPDO that comes on change only is silent when nothing changes, and when it gets lost. With an
event timer (CiA 301, 7.5.2.37) it comes all the time, so one is set where the device has it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
import math

from canopen_core import Place
from canopen_core.standard import (
    EVENT_DRIVEN,
    Index,
    is_state,
    MappedObject,
    ObjectDictionary,
    ObjectEntry,
    PDO_COUNT_MAX,
    rpdo_default,
    SYNCHRONOUS_MAX,
    tpdo_default,
)

from ..units import HUNDRED_MICROSECONDS, MILLISECONDS

PERIODS_MISSED = 3  # periods of a TPDO, or of a poll, without a new value
STALE_AFTER = 0.5  # [s] without a new value, where its period is shorter
EVENT_TIME_MAX = 0.1  # [s] of an event timer that nobody has chosen
INHIBIT_FACTOR = 2.0  # inhibit times that an event timer lasts at least
INHIBIT_TIME_SUBINDEX = 3  # of the communication parameter
EVENT_TIMER_SUBINDEX = 5


@dataclass(frozen=True, slots=True)
class Direction:
    """One of the two directions, seen from the device."""

    name: str  # key in bus.yml
    communication: int  # index of the first communication parameter
    mapping: int  # index of the first mapping parameter
    # pre-defined COB-ID of PDO 1 to 4 by number and node id
    default_cob_id: Callable[[int, int], int]
    mappable: Callable[[ObjectEntry], bool]  # whether an object may be mapped in this direction

    @property
    def title(self) -> str:
        """Name as people write it."""
        return self.name.upper()

    def numbers(self, dictionary: ObjectDictionary) -> list[int]:
        """Return the numbers of the PDOs that a device has, ascending."""
        first = self.communication
        indices = {entry.index for entry in dictionary}
        return sorted(
            index - first + 1 for index in indices if first <= index < first + PDO_COUNT_MAX
        )


TPDO = Direction(
    'tpdo',
    Index.TPDO_COMMUNICATION,
    Index.TPDO_MAPPING,
    tpdo_default,
    lambda entry: entry.tpdo_mappable,
)
RPDO = Direction(
    'rpdo',
    Index.RPDO_COMMUNICATION,
    Index.RPDO_MAPPING,
    rpdo_default,
    lambda entry: entry.rpdo_mappable,
)


@dataclass(frozen=True, slots=True)
class PdoConfig:
    """One PDO of a device, named from the device's side."""

    number: int  # 1 for the objects 0x1400/0x1600 or 0x1800/0x1A00, and so on
    enabled: bool  # the PDO exists (bit 31 of its COB-ID is clear)
    cob_id: int  # its 11-bit CAN identifier; 0 when it is disabled and has none
    transmission: int  # transmission type 0 to 255 (CiA 301, tables 69 and 71)
    # shortest time between two transmissions in [s]; None leaves the device's
    inhibit_time: float | None = None
    # event timer of a TPDO, deadline of an RPDO in [s]; None leaves the device's
    event_time: float | None = None
    # SYNC counter value at which it starts; None leaves the device's
    sync_start: int | None = None
    mapping: tuple[MappedObject, ...] = ()
    configured: bool = False  # bus.yml names this PDO, so the master writes it at boot
    fixed_mapping: bool = False  # the device's mapping is read-only (and equal to ``mapping``)
    # the EDS gives the COB-ID of another node id, and ``cob_id`` is that of this one
    assumed: bool = False
    # where bus.yml has its COB-ID, else the PDO or the device
    place: Place = field(default=Place(), compare=False)


def with_event_timer(pdo: PdoConfig, dictionary: ObjectDictionary) -> PdoConfig:
    """Return a TPDO of a drive with an event timer, if it needs one and has none."""
    index = Index.TPDO_COMMUNICATION + pdo.number - 1
    entry = dictionary.get(index, EVENT_TIMER_SUBINDEX)
    chosen = pdo.event_time is not None or pdo.transmission < EVENT_DRIVEN
    if chosen or not _carries_state(pdo) or entry is None or not entry.access.writable:
        return pdo
    default = (dictionary.number(index, EVENT_TIMER_SUBINDEX) or 0) / MILLISECONDS
    inhibit = pdo.inhibit_time
    if inhibit is None:
        inhibit = (dictionary.number(index, INHIBIT_TIME_SUBINDEX) or 0) / HUNDRED_MICROSECONDS
    time = min(default or EVENT_TIME_MAX, EVENT_TIME_MAX)
    return replace(pdo, event_time=max(time, INHIBIT_FACTOR * inhibit))


def longest_silence(pdo: PdoConfig, sync_period: float) -> float:
    """Return the time in [s] after which a TPDO counts as lost; infinite where that is unknown.

    The SYNC period in [s] is 0 where this master sends none.
    """
    if 1 <= pdo.transmission <= SYNCHRONOUS_MAX and sync_period > 0.0:
        return max(STALE_AFTER, PERIODS_MISSED * pdo.transmission * sync_period)
    if pdo.transmission >= EVENT_DRIVEN and pdo.event_time:
        return PERIODS_MISSED * pdo.event_time
    return math.inf


def loss_unnoticed(pdo: PdoConfig, silence: float) -> bool:
    """Return whether nothing shows that a drive's state got lost for silence [s] in a TPDO."""
    return silence == math.inf and _carries_state(pdo)


def _carries_state(pdo: PdoConfig) -> bool:
    return pdo.enabled and any(is_state(mapped.index) for mapped in pdo.mapping)
