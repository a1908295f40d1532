# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Laying a device's own values over ``defaults``: the own value always wins.

- Mappings (``tpdo``, ``rpdo``, each PDO in them, ``remappings``, ``error_behavior``) merge key by
  key, so a device can change one PDO, or one key of it.
- The list ``sdo`` merges object by object: the defaults' writes, without those of objects that the
  device names itself, then the device's. An empty list drops the defaults'.
- Every other list (``mapping``) is replaced, as its order and length mean something.
"""

from __future__ import annotations

from ..findings import RefusedError
from ..read.document import Item, YamlList, YamlMap
from ..read.scalars import integer

SDO_LIST = 'sdo'


def merge_device(defaults: YamlMap, own: YamlMap) -> YamlMap:
    """Return a device's section with the defaults below it; it keeps its own place."""
    merged = _merge_mappings(defaults, own)
    common, special = defaults.entries.get(SDO_LIST), own.entries.get(SDO_LIST)
    if isinstance(common, YamlList) and isinstance(special, YamlList) and special.items:
        merged.entries[SDO_LIST] = _merge_sdo(common, special)
    return merged


def _merge_mappings(below: YamlMap, above: YamlMap) -> YamlMap:
    entries: dict[str, Item] = dict(below.entries)
    for name, item in above.entries.items():
        base = below.entries.get(name)
        if isinstance(base, YamlMap) and isinstance(item, YamlMap):
            entries[name] = _merge_mappings(base, item)
        else:
            entries[name] = item
    return YamlMap(above.place, entries)


def _merge_sdo(common: YamlList, special: YamlList) -> YamlList:
    replaced = {_address(item) for item in special.items} - {None}
    kept = tuple(item for item in common.items if _address(item) not in replaced)
    return YamlList(special.place, kept + special.items)


def _address(item: Item) -> tuple[int, int] | None:
    """Return which object an entry writes; None when that cannot be read (reported elsewhere)."""
    if not isinstance(item, YamlMap) or 'index' not in item.entries:
        return None
    subindex = item.entries.get('sub_index')
    try:
        return integer(item.entries['index']), integer(subindex) if subindex is not None else 0
    except RefusedError:
        return None
