# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""When a TPDO counts as lost, and whether that is noticed: it needs a time to come in.

A TPDO that comes on change only is silent when nothing changes, and when it gets lost. With an
event timer (CiA 301, 7.5.2.37) it comes all the time, so one is set where the device has it.
"""

from __future__ import annotations

from dataclasses import replace
import math

from canopen_core.standard import EVENT_DRIVEN, Index, is_state, ObjectDictionary, SYNCHRONOUS_MAX

from ..units import HUNDRED_MICROSECONDS, MILLISECONDS
from .bus import PdoConfig

PERIODS_MISSED = 3  # periods of a TPDO, or of a poll, without a new value
STALE_AFTER = 0.5  # [s] without a new value, where its period is shorter
EVENT_TIME_MAX = 0.1  # [s] of an event timer that nobody has chosen
INHIBIT_FACTOR = 2.0  # inhibit times that an event timer lasts at least
INHIBIT_TIME_SUBINDEX = 3  # of the communication parameter
EVENT_TIMER_SUBINDEX = 5


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
