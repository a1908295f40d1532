# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Our EDS reader against the independent one of the canopen package."""

from pathlib import Path

import canopen
from config_samples import eds_text
import pytest

from arm_canopen.config import load_eds
from arm_canopen.standard import ObjectEntry, REAL_FORMATS

NODE_ID = 5
SHIPPED = sorted((Path(__file__).parents[1] / 'eds').glob('*.eds'))


@pytest.fixture(params=['sample', *(path.name for path in SHIPPED)])
def eds_path(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    """Give the sample, then every EDS that the package ships."""
    name = str(request.param)
    if name != 'sample':
        return SHIPPED[0].parent / name
    path = tmp_path / 'sample.eds'
    path.write_text(eds_text(), encoding='utf-8')
    return path


def peer_entries(path: Path) -> dict[tuple[int, int], object]:
    """Read a file with the canopen package."""
    peer = canopen.objectdictionary.import_od(str(path), NODE_ID)
    entries: dict[tuple[int, int], object] = {}
    for index, item in peer.items():
        if isinstance(item, canopen.objectdictionary.ODVariable):
            entries[index, 0] = item
        else:
            entries.update({(index, subindex): part for subindex, part in item.subindices.items()})
    return entries


def test_both_readers_agree(eds_path: Path) -> None:
    """Both find the same objects with the same types, access, defaults and limits."""
    eds = load_eds(eds_path)
    assert not eds.warnings
    ours = {entry.address: entry for entry in eds.dictionary.for_node(NODE_ID)}
    theirs = {
        address: entry
        for address, entry in peer_entries(eds_path).items()
        if address[0] >= 0x1000  # [DummyUsage] becomes objects there
    }
    assert ours.keys() == theirs.keys()
    for address, entry in ours.items():
        assert describe(entry) == describe_peer(theirs[address]), entry


def describe(entry: ObjectEntry) -> tuple[object, ...]:
    """List what is compared."""
    is_real = entry.data_type in REAL_FORMATS  # whose limits the peer reads as integers only
    return (
        entry.name,
        entry.data_type.value,
        entry.access.value,
        entry.pdo_mappable,
        entry.default,
        None if is_real else entry.low_limit,
        None if is_real else entry.high_limit,
    )


def describe_peer(entry: object) -> tuple[object, ...]:
    """List the same of the peer's entry."""
    is_real = getattr(entry, 'data_type', 0) in [kind.value for kind in REAL_FORMATS]
    default = getattr(entry, 'default', None)
    return (
        getattr(entry, 'name', None),
        getattr(entry, 'data_type', None),
        getattr(entry, 'access_type', None),
        getattr(entry, 'pdo_mappable', None),
        None if default in ('', b'') else default,
        None if is_real else getattr(entry, 'min', None),
        None if is_real else getattr(entry, 'max', None),
    )
