# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Whether the loss of a TPDO with the state of a drive is noticed: it needs a time to come in.

A TPDO that comes on change only is silent when nothing changes, and when it gets lost. With an
event timer (CiA 301, 7.5.2.37) it comes all the time, so one is set where the device has it.
"""

from __future__ import annotations

from dataclasses import replace

from ..standard.dictionary import ObjectDictionary
from ..standard.objects import Index, is_state
from ..standard.pdo import EVENT_DRIVEN
from .model import PdoConfig
from .shared_keys import MILLISECONDS

ACYCLIC = 0  # transmission type: with SYNC, when something has changed
EVENT_TIMER = 0.1  # [s]
INHIBIT_FACTOR = 2.0  # inhibit times that an event timer lasts at least
EVENT_TIMER_SUBINDEX = 5  # of the communication parameter


def with_event_timer(pdo: PdoConfig, dictionary: ObjectDictionary) -> PdoConfig:
    """Return a TPDO of a drive with an event timer, if it needs one and nobody has chosen.

    Args:
        pdo: The TPDO.
        dictionary: The objects of its device.
    """
    entry = dictionary.get(Index.TPDO_COMMUNICATION + pdo.number - 1, EVENT_TIMER_SUBINDEX)
    chosen = pdo.event_time is not None or pdo.transmission < EVENT_DRIVEN
    if chosen or not _carries_state(pdo) or entry is None or not entry.access.writable:
        return pdo
    default = entry.default / MILLISECONDS if isinstance(entry.default, int) else 0.0
    time = default or max(EVENT_TIMER, INHIBIT_FACTOR * (pdo.inhibit_time or 0.0))
    return replace(pdo, event_time=time)


def comes_on_change_only(pdo: PdoConfig) -> bool:
    """Tell whether a TPDO carries state of a drive, and nothing shows that it got lost."""
    if not _carries_state(pdo):
        return False
    on_event = pdo.transmission >= EVENT_DRIVEN
    return (on_event and not pdo.event_time) or pdo.transmission == ACYCLIC


def _carries_state(pdo: PdoConfig) -> bool:
    return pdo.enabled and any(is_state(mapped.index) for mapped in pdo.mapping)
