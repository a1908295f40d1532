# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Write docs/bus_yml.md, the table of all keys of bus.yml, from the tables that read them.

Run it after a change of the keys, with the package on the path:
``python3 tools/make_key_table.py``.
"""

from __future__ import annotations

from collections.abc import Iterator
from enum import Enum
from pathlib import Path

from arm_canopen.config.keys import Key
from arm_canopen.config.sections import (
    DEVICE_KEYS,
    DRIVE_KEYS,
    MASTER_KEYS,
    OPTION_KEYS,
    RPDO_KEYS,
    SDO_KEYS,
    TPDO_KEYS,
)

TARGET = Path(__file__).parents[1] / 'docs' / 'bus_yml.md'
UNITS = {1000.0: 'ms', 1_000_000.0: 'µs', 10_000.0: '100 µs', 0.001: 'kbit/s'}

HEAD = """# The keys of bus.yml

Made by `tools/make_key_table.py` from the tables by which bus.yml is read. Names, units and
defaults are those of ros2_canopen and of Lely's dcfgen; both formats of the file are read, with
`options`, `master`, `defaults` and `nodes`, or with the devices at the top level. A device's own
value beats that of `defaults`. An unknown key is refused with its line and the key that was
probably meant; `canopen check` reports all that is wrong at once.
"""

TITLES = {
    'options': OPTION_KEYS,
    'master': MASTER_KEYS,
    'A device, or `defaults`': DEVICE_KEYS,
    'A drive, or `defaults`': DRIVE_KEYS,
    'A number below `tpdo`': TPDO_KEYS,
    'A number below `rpdo`': RPDO_KEYS,
    'An entry of `sdo`': SDO_KEYS,
}


def page() -> str:
    """Return docs/bus_yml.md: a table of keys for each part of bus.yml."""
    return '\n'.join([HEAD, *(line for title in TITLES for line in _table(title))])


def _table(title: str) -> Iterator[str]:
    yield f'## {title}\n'
    yield '| key | unit | default | meaning |'
    yield '|---|---|---|---|'
    for key in TITLES[title]:
        unit = UNITS.get(key.unit, '') if key.unit else ''
        yield f'| `{key.name}` | {unit} | {_default(key)} | {key.text} |'
    yield ''


def _default(key: Key) -> str:
    value = key.default
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, Enum):
        return str(value.value)
    if isinstance(value, (int, float)):
        return (
            f'{value * (key.unit or 1):g}' if key.unit or isinstance(value, float) else str(value)
        )
    return value or ''


if __name__ == '__main__':
    TARGET.parent.mkdir(exist_ok=True)
    TARGET.write_text(page(), encoding='utf-8')
