# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What docs/bus_yml.md says of the keys is what a bus.yml that is read shows."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
import re
from typing import Any, NamedTuple

from config_samples import load_text
from eds_samples import DRIVE_ROWS, eds_text, Row
import pytest
import yaml

from arm_canopen import BusConfig, ConfigError
from arm_canopen.config.keys import Key, Kind, Use
from arm_canopen.config.sections import (
    DEVICE_KEYS,
    DRIVE_KEYS,
    MASTER_KEYS,
    OPTION_KEYS,
    RPDO_KEYS,
    SDO_KEYS,
    SECTIONS,
    TPDO_KEYS,
)

PAGE = Path(__file__).parents[1] / 'docs' / 'bus_yml.md'
TITLES = {
    'options': 'options',
    'master': 'master',
    'A device, or `defaults`': 'device',
    'A drive, or `defaults`': 'device',
    'A number below `tpdo`': 'tpdo',
    'A number below `rpdo`': 'rpdo',
    'An entry of `sdo`': 'sdo',
}
ROW = re.compile(r'^\| `(\w+)` \| .*? \| (.*?) \| .+ \|$')
GUARDING = (
    Row(0x100C, 0, 'Guard time', 6, 'rw', '0'),
    Row(0x100D, 0, 'Life time factor', 5, 'rw', '0'),
)
EDS = eds_text((*DRIVE_ROWS, *GUARDING))


class KeyRow(NamedTuple):
    """A row of the page."""

    section: str  # where the key stands
    key: str  # its name
    default: str  # what counts without it, empty when that depends on others


def key_rows() -> list[KeyRow]:
    """Read the page."""
    found, section = [], ''
    for line in PAGE.read_text('utf-8').splitlines():
        if line.startswith('## '):
            section = TITLES[line[3:]]
        elif (row := ROW.match(line)) and row[1] != 'key':
            found.append(KeyRow(section, row[1], row[2]))
    return found


def bus_with(section: str = '', **keys: Any) -> dict[str, Any]:
    """Return a bus of one drive, with keys in one of its sections."""
    sections: dict[str, dict[str, Any]] = {
        'options': {},
        'master': {
            'node_id': 1,
            'driver': 'ros2_canopen::MasterDriver',
        },
        'device': {'node_id': 2, 'driver': 'ros2_canopen::Cia402Driver', 'dcf': 'drive.eds'},
        'tpdo': {'mapping': [{'index': 0x6041}]},
        'rpdo': {'mapping': [{'index': 0x6040}]},
        'sdo': {'index': 0x6081, 'value': 5},
    }
    if section:
        sections[section] |= keys
    device = sections['device'] | {
        'tpdo': {1: sections['tpdo']},
        'rpdo': {1: sections['rpdo']},
        'sdo': [sections['sdo']],
    }
    return {
        'options': sections['options'],
        'master': sections['master'],
        'nodes': {'joint1': device},
    }


def load(folder: Path, bus: dict[str, Any]) -> BusConfig:
    """Load a bus, without what depends on where it was read from."""
    config = load_text(folder, yaml.safe_dump(bus, sort_keys=False), eds=EDS)
    (node,) = config.nodes
    plain = replace(node, dictionary=EMPTY, line=0)
    return replace(config, nodes=(plain,), warnings=())


EMPTY: Any = None  # two dictionaries of one EDS are not equal


@pytest.mark.parametrize('row', [row for row in key_rows() if row.default], ids=str)
def test_the_default_is_what_counts_without_the_key(tmp_path: Path, row: KeyRow) -> None:
    """A bus.yml that writes it is the same bus as one that leaves it out."""
    value = yaml.safe_load(row.default)
    assert load(tmp_path, bus_with(row.section, **{row.key: value})) == load(tmp_path, bus_with())


def test_every_key_is_on_the_page_and_no_other() -> None:
    """Of those that are read; a key that is not on the page is refused as unknown."""
    read = {key.name for keys in SECTIONS.values() for key in keys}
    assert {row.key for row in key_rows()} == read


@pytest.mark.parametrize('section', sorted({row.section for row in key_rows()}))
def test_a_key_that_is_not_on_the_page_is_refused(tmp_path: Path, section: str) -> None:
    """With the names that are known there, all of which are on the page."""
    with pytest.raises(ConfigError) as refused:
        load(tmp_path, bus_with(section, zzz=1))
    (problem,) = refused.value.problems
    names = problem.remedy.partition('known here: ')[2].split(', ')
    here = {row.key for row in key_rows() if row.section == section}
    assert set(names) == here


TABLES = {
    'options': OPTION_KEYS,
    'master': MASTER_KEYS,
    'device': DEVICE_KEYS + DRIVE_KEYS,
    'tpdo': TPDO_KEYS,
    'rpdo': RPDO_KEYS,
    'sdo': SDO_KEYS,
}
SCALARS = [(name, key) for name, keys in TABLES.items() for key in keys if key.kind != Kind.BLOCK]
OTHERS: dict[str, Any] = {
    'driver': 'ros2_canopen::LifecycleMasterDriver',
    'device.driver': 'ros2_canopen::ProxyDriver',
    'namespace': 'left',
    'dcf': 'other.eds',
    'dcf_path': 'others',
    'recovery': 'auto',
    'quirks': 'some_drive',
}
"""What a text may be instead of its default."""


def other_value(section: str, key: Key) -> Any:
    """Return a value that a key may have, and that is neither its default nor its neutral one."""
    if key.kind is Kind.TEXT:
        return OTHERS.get(f'{section}.{key.name}', OTHERS.get(key.name, 'text'))
    if key.kind is Kind.BOOLEAN:
        defaults = {row.key: row.default for row in key_rows() if row.section == section}
        return defaults.get(key.name) == 'false'
    if key.choices is not None:
        return min(key.choices)
    low, high = key.span or (0, 7)
    return min(int(low) + 7, int(high))


def bus_of(folder: Path, key: Key, section: str, **keys: Any) -> BusConfig | None:
    """Load a bus, of a drive with heartbeat for a key of heartbeats; None where it is refused."""
    bus = bus_with(section, **keys)
    if key.name.startswith('heartbeat'):
        bus['nodes']['joint1'].setdefault('heartbeat_producer', 100)
    try:
        return load(folder, bus)
    except ConfigError:
        return None


KEY_IDS = [f'{section}-{key.name}' for section, key in SCALARS]


@pytest.mark.parametrize(('section', 'key'), SCALARS, ids=KEY_IDS)
def test_a_key_counts_or_is_said_to_be_ignored(tmp_path: Path, section: str, key: Key) -> None:
    """No key is read and never used: another value makes another bus, or one that is refused."""
    for file in (tmp_path / 'other.eds', tmp_path / 'others' / 'drive.eds'):
        file.parent.mkdir(exist_ok=True)
        file.write_text(EDS)
    changed = bus_of(tmp_path, key, section, **{key.name: other_value(section, key)})
    assert (changed == bus_of(tmp_path, key, section)) == (key.use is Use.IGNORED)
