# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The two formats of bus.yml, brought to one.

New: ``options``, ``master``, ``defaults`` and ``nodes``. Old (dcfgen's own): ``options``,
``master``, and every other top-level key a device. A file with ``nodes`` or ``defaults`` is of
the new one. Top-level keys that begin with a dot are templates for anchors, ignored in both.

A device's own values lie over ``defaults``, and always win:

- Mappings (``tpdo``, ``rpdo``, each PDO in them, ``remappings``, ``error_behavior``) merge key by
  key, so a device can change one PDO, or one key of it.
- The list ``sdo`` merges object by object: the defaults' writes, without those of objects that the
  device names itself, then the device's. An empty list drops the defaults'.
- Every other list (``mapping``) is replaced, as its order and length mean something.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
import difflib

from canopen_core import Findings, RefusedError

from ..read.document import Item, YamlList, YamlMap
from ..read.scalars import describe, integer
from ..read.section import block
from ..sections import TOP_LEVEL

NODES_REMEDY = "write a mapping: 'nodes:', below it 'joint1:', below that 'node_id: 2'"


@dataclass(frozen=True, slots=True)
class Layout:
    """The sections of a bus.yml."""

    options: YamlMap  # the section ``options``, empty when absent
    master: YamlMap  # the section ``master``, empty when absent
    # each device with the ``defaults`` below its own values, in the order of the file
    devices: dict[str, YamlMap] = field(default_factory=dict)


def lay_out(root: YamlMap, findings: Findings) -> Layout:
    """Find the sections of either format."""
    root = _lifted(root, findings)
    new = 'nodes' in root.entries or 'defaults' in root.entries
    devices = _new_devices(root, findings) if new else _old_devices(root, findings)
    if 'master' not in root.entries:
        findings.error(root.place, "no section 'master'", "write 'master:' and its node_id below")
    options, master = (
        block(root, name, findings) or YamlMap(replace(root.place, key=name))
        for name in ('options', 'master')
    )
    return Layout(options, master, devices)


def _lifted(root: YamlMap, findings: Findings) -> YamlMap:
    """Treat sections that are indented below ``options`` as top-level sections."""
    options = root.entries.get('options')
    if not isinstance(options, YamlMap):
        return root
    sections = {
        name: item
        for name, item in options.entries.items()
        if name in TOP_LEVEL and name not in root.entries
    }
    if not sections:
        return root
    for name, item in sections.items():
        findings.warning(
            item.place,
            f"{name!r} is indented below 'options'; taken as a section of its own",
            'indent it less',
        )
    rest = {name: item for name, item in options.entries.items() if name not in sections}
    entries = root.entries | {'options': YamlMap(options.place, rest)} | sections
    return YamlMap(root.place, entries)


def _new_devices(root: YamlMap, findings: Findings) -> dict[str, YamlMap]:
    for name, item in root.entries.items():
        if name not in TOP_LEVEL and not name.startswith('.'):
            findings.error(item.place, f'unknown section {name!r}', _section_remedy(name, item))
    defaults = _with_dcf(block(root, 'defaults', findings) or YamlMap(root.place), findings)
    nodes = root.entries.get('nodes')
    if nodes is None:
        findings.error(root.place, "there are 'defaults' but no 'nodes'", NODES_REMEDY)
    elif isinstance(nodes, YamlList):
        findings.error(nodes.place, "'nodes' is a list", NODES_REMEDY)
    elif not isinstance(nodes, YamlMap) or not nodes.entries:
        findings.error(nodes.place, 'there are no devices', NODES_REMEDY)
    else:
        return _devices(nodes, defaults, findings)
    return {}


def _old_devices(root: YamlMap, findings: Findings) -> dict[str, YamlMap]:
    sections: dict[str, Item] = {}
    for name, item in root.entries.items():
        # a device has an EDS in this format, a section with a typing error has not
        is_device = isinstance(item, YamlMap) and bool({'dcf', 'eds'} & item.entries.keys())
        if name not in TOP_LEVEL and not is_device and _close_section(name):
            findings.error(item.place, f'unknown section {name!r}', _section_remedy(name, item))
        elif name not in TOP_LEVEL:
            sections[name] = item
    if not any(not name.startswith('.') for name in sections):
        findings.error(root.place, 'there are no devices', NODES_REMEDY)
    return _devices(YamlMap(root.place, sections), YamlMap(root.place), findings)


def _close_section(name: str) -> list[str]:
    return difflib.get_close_matches(name, TOP_LEVEL, n=1, cutoff=0.75)


def _devices(nodes: YamlMap, defaults: YamlMap, findings: Findings) -> dict[str, YamlMap]:
    result: dict[str, YamlMap] = {}
    for name, item in nodes.entries.items():
        if name.startswith('.'):
            continue
        if isinstance(item, YamlMap):
            result[name] = merge_device(defaults, _with_dcf(item, findings))
        else:
            findings.error(
                item.place,
                f'expected a device with its keys, got {describe(item)}',
                _section_remedy(name, item),
            )
    return result


def _with_dcf(section: YamlMap, findings: Findings) -> YamlMap:
    """Accept ``eds`` for ``dcf``, a common spelling; ros2_canopen knows the latter only."""
    item = section.entries.get('eds')
    if item is None:
        return section
    if 'dcf' in section.entries:
        findings.error(item.place, "there are 'eds' and 'dcf'", "remove one; 'dcf' is the key")
    else:
        findings.warning(
            item.place, "'eds' is taken for 'dcf'", "write 'dcf', as ros2_canopen does"
        )
    entries = {
        ('dcf' if name == 'eds' else name): value for name, value in section.entries.items()
    }
    return YamlMap(section.place, entries)


def _section_remedy(name: str, item: Item) -> str:
    if close := _close_section(name):
        return f'did you mean {close[0]!r}?'
    if isinstance(item, YamlMap) and 'node_id' in item.entries:
        return "move the device below 'nodes:'"
    return "a device needs at least 'node_id:' below its name; begin a template's name with a dot"


SDO_LIST = 'sdo'


def merge_device(defaults: YamlMap, own: YamlMap) -> YamlMap:
    """Return a device's section with the defaults below it; it keeps its own place."""
    merged = _merge_mappings(defaults, own)
    common, special = defaults.entries.get(SDO_LIST), own.entries.get(SDO_LIST)
    if isinstance(common, YamlList) and isinstance(special, YamlList) and special.items:
        replaced = {_address(item) for item in special.items} - {None}
        kept = tuple(item for item in common.items if _address(item) not in replaced)
        merged.entries[SDO_LIST] = YamlList(special.place, kept + special.items)
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


def _address(item: Item) -> tuple[int, int] | None:
    """Return which object an entry writes; None when that cannot be read (reported elsewhere)."""
    if not isinstance(item, YamlMap) or 'index' not in item.entries:
        return None
    subindex = item.entries.get('sub_index')
    try:
        return integer(item.entries['index']), integer(subindex) if subindex is not None else 0
    except RefusedError:
        return None
