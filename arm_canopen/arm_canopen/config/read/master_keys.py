# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The keys of ``options`` and ``master`` that ros2_canopen and Lely's dcfgen know.

Names, units and defaults are theirs, so that their files can be read unchanged. Where a default
differs, ``why`` says the reason.
"""

from __future__ import annotations

from ...standard.lss import BIT_RATES_KBIT
from ..units import HUNDRED_MICROSECONDS, KILOBIT, MICROSECONDS, MILLISECONDS
from .schema import Key, Kind, Use
from .shared_keys import (
    DRIVER,
    MULTIPLIER,
    NAMESPACE,
    NODE_ID,
    PACKAGE,
    REMAPPINGS,
    RETRY_FACTOR,
    U16_MAX,
    U32_MAX,
)

NO_DICTIONARY = 'the master has no object dictionary of its own'

BITRATES = dict.fromkeys(BIT_RATES_KBIT, 'kbit/s')

OPTION_KEYS: tuple[Key, ...] = (
    Key('dcf_path', Kind.TEXT, 'dcf_path'),
    MULTIPLIER,
    RETRY_FACTOR,
)

MASTER_KEYS: tuple[Key, ...] = (
    NODE_ID,
    DRIVER,
    PACKAGE,
    NAMESPACE,
    REMAPPINGS,
    Key('baudrate', Kind.INTEGER, 'bitrate', per_unit=KILOBIT, choices=BITRATES),
    Key(
        'vendor_id',
        Kind.INTEGER,
        'vendor_id',
        low=0,
        high=U32_MAX,
        neutral=0,
        use=Use.UNUSED,
        why=NO_DICTIONARY,
    ),
    Key(
        'product_code',
        Kind.INTEGER,
        'product_code',
        low=0,
        high=U32_MAX,
        neutral=0,
        use=Use.UNUSED,
        why=NO_DICTIONARY,
    ),
    Key(
        'revision_number',
        Kind.INTEGER,
        'revision_number',
        low=0,
        high=U32_MAX,
        neutral=0,
        use=Use.UNUSED,
        why=NO_DICTIONARY,
    ),
    Key(
        'serial_number',
        Kind.INTEGER,
        'serial_number',
        low=0,
        high=U32_MAX,
        neutral=0,
        use=Use.UNUSED,
        why=NO_DICTIONARY,
    ),
    Key('heartbeat_consumer', Kind.BOOLEAN, 'watch_devices'),
    Key(
        'heartbeat_producer',
        Kind.NUMBER,
        'heartbeat_producer',
        per_unit=MILLISECONDS,
        low=0,
        high=U16_MAX,
        why='by default not 0, as only this stops drives when the master dies; write 0 for none',
    ),
    MULTIPLIER,
    Key(
        'sync_period',
        Kind.NUMBER,
        'sync_period',
        per_unit=MICROSECONDS,
        low=500,
        high=60_000_000,
        zero=True,
        why='the unit is microseconds, 10 ms is 10000',
    ),
    Key(
        'sync_window',
        Kind.INTEGER,
        'sync_window',
        per_unit=MICROSECONDS,
        low=0,
        high=U32_MAX,
    ),
    Key('sync_overflow', Kind.INTEGER, 'sync_overflow', low=2, high=240, zero=True),
    Key('time_cob_id', Kind.INTEGER, 'time_cob_id', low=0, high=U32_MAX),
    Key(
        'time_period_ms',
        Kind.NUMBER,
        'time_period',
        per_unit=MILLISECONDS,
        low=1,
        high=86_400_000,
        zero=True,
    ),
    Key(
        'emcy_inhibit_time',
        Kind.INTEGER,
        'emcy_inhibit_time',
        per_unit=HUNDRED_MICROSECONDS,
        low=0,
        high=U16_MAX,
        neutral=0,
        use=Use.UNUSED,
        why='the master sends no EMCY',
    ),
    Key(
        'nmt_inhibit_time',
        Kind.INTEGER,
        'nmt_inhibit_time',
        per_unit=HUNDRED_MICROSECONDS,
        low=0,
        high=U16_MAX,
    ),
    Key('error_behavior', Kind.BLOCK, use=Use.UNUSED, why='the master has no NMT state'),
    Key('start', Kind.BOOLEAN, 'start'),
    Key('start_nodes', Kind.BOOLEAN, 'start_nodes'),
    Key('start_all_nodes', Kind.BOOLEAN, 'start_all_nodes'),
    Key('reset_all_nodes', Kind.BOOLEAN, 'reset_all_nodes'),
    Key('stop_all_nodes', Kind.BOOLEAN, 'stop_all_nodes'),
    Key(
        'boot_time',
        Kind.INTEGER,
        'boot_time',
        per_unit=MILLISECONDS,
        low=0,
        high=U32_MAX,
    ),
    Key('boot_timeout', Kind.NUMBER, 'boot_timeout', per_unit=MILLISECONDS, low=1, high=60_000),
)
