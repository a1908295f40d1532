# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Building and checking the model of a bus from its bus.yml and EDS files.

bus.yml has two formats, converted to one. New: ``options``, ``master``, ``defaults`` and
``nodes``. Old (dcfgen's own): ``options``, ``master``, and every other top-level key is a device.
A file with ``nodes`` or ``defaults`` has the new format. Top-level keys that begin with a dot are
templates for anchors and are ignored in both.

A device's own values override ``defaults``:

- Mappings (``tpdo``, ``rpdo``, each PDO in them, ``remappings``, ``error_behavior``) merge key by
  key, so a device can change one PDO, or one key of it.
- The list ``sdo`` merges object by object: first the writes of ``defaults`` to objects that the
  device does not write itself, then those of the device. An empty list drops the defaults.
- Every other list (``mapping``) is replaced, as its order and length matter.

COB-IDs are assigned last; reserved and duplicate ones are refused.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
import difflib
import os
from pathlib import Path

from canopen_core import ConfigError, Findings, Place, RefusedError
from canopen_core.standard import CAN_ID_MASK

from ..model import BusConfig, MasterConfig, NodeConfig
from ..model.bus import CYCLE_PERIOD, PdoConfig, RPDO, TPDO
from ..model.checks import check_bus, Report
from ..read.document import EdsFiles, Item, read_document, YamlList, YamlMap
from ..read.section import block, describe, integer, read_section
from ..sections import OPTION_KEYS, Options, TOP_LEVEL
from .device import DeviceReader
from .master import build_master, read_master
from .pdos import AUTO_ID

PDO_SECTIONS = (RPDO.name, TPDO.name)
DEPTH_MAX = 3  # levels of mappings: device, tpdo, number


def load_bus(
    path: str | os.PathLike[str], *, bus_config_path: str | os.PathLike[str] | None = None
) -> BusConfig:
    """Read a bus.yml of either format and the EDS files that it names.

    ``@BUS_CONFIG_PATH@`` is replaced by bus_config_path, by default the folder of the file.

    Returns:
        The bus, with its warnings.

    Raises:
        ConfigError: The files have errors; it lists every problem with file, line, key and
            remedy.
    """
    folder = None if bus_config_path is None else Path(bus_config_path)
    findings = Findings()
    config = resolve_bus(Path(path), folder, findings)
    findings.raise_errors()
    return config


def check_file(path: str | os.PathLike[str], bitrate: int | None = None) -> Report:
    """Read a bus.yml and its EDS files; report all errors and warnings at once.

    ``bitrate`` in [bit/s] overrides bus.yml.
    """
    findings = Findings()
    try:
        config = resolve_bus(Path(path), None, findings)
    except ConfigError as error:
        return Report(error.problems, ())
    return check_bus(config, bitrate, findings)


def resolve_bus(file: Path, bus_config_path: Path | None, findings: Findings) -> BusConfig:
    """Build a bus from its bus.yml and EDS files; omit what has errors, add those to findings."""
    option_section, master_section, devices = lay_out(read_document(file, findings), findings)
    options = Options(**read_section(option_section, OPTION_KEYS, findings))
    settings, config = read_master(master_section, findings)
    beside = file.parent.absolute()
    eds_files = EdsFiles(beside if bus_config_path is None else bus_config_path, beside)
    master = build_master(master_section, settings, config, options, findings)
    readers = (DeviceReader(name, section, findings) for name, section in devices.items())
    read = (reader.read(options, eds_files, master, settings) for reader in readers)
    nodes = [node for node in read if node is not None]
    if not master.sync_period:
        cycle_period = min((node.poll_period for node in nodes), default=CYCLE_PERIOD)
        master = replace(master, cycle_period=cycle_period)
    sections = {'master': master_section, **devices}
    _check_lifecycle(master, nodes, sections, findings)
    unique = _check_node_ids(settings.node_id, nodes, sections, findings)
    _check_axis_names(unique, sections, findings)
    finished = assign_cob_ids(unique, findings)
    locations = dict(at for name, item in sections.items() for at in _walk((name,), item))
    return BusConfig(file, master, finished, findings.warnings, locations)


def _walk(names: tuple[str, ...], item: Item) -> Iterator[tuple[tuple[str, ...], Place]]:
    """Yield key path and place of each key."""
    yield names, item.place
    if not isinstance(item, YamlMap) or len(names) > DEPTH_MAX:
        return
    for name, child in item.entries.items():
        if len(names) == 1 or names[1] in PDO_SECTIONS:
            yield from _walk((*names, name), child)


def _check_lifecycle(
    master: MasterConfig,
    nodes: Sequence[NodeConfig],
    sections: Mapping[str, YamlMap],
    findings: Findings,
) -> None:
    """Refuse a mix of lifecycle and plain nodes, which cannot be started in order."""
    for node in nodes:
        if node.is_lifecycle == master.is_lifecycle:
            continue
        kinds = ('a lifecycle driver', 'a plain one')
        mine, others = kinds if node.is_lifecycle else kinds[::-1]
        findings.error(
            sections[node.name].place_of('driver'),
            f'{node.driver} is {mine}, but the master has {others} ({master.driver})',
            'take lifecycle drivers for all or for none',
        )


def _check_node_ids(
    master_id: int | None,
    nodes: Sequence[NodeConfig],
    sections: Mapping[str, YamlMap],
    findings: Findings,
) -> list[NodeConfig]:
    """Refuse duplicate node ids; return the devices with a unique one."""
    owners: dict[int, tuple[str, Place]] = {}
    if master_id is not None:
        owners[master_id] = ('the master', sections['master'].place_of('node_id'))
    unique = []
    for node in nodes:
        own = sections[node.name].place_of('node_id')
        name, place = owners.setdefault(node.node_id, (node.name, own))
        if name == node.name:
            unique.append(node)
            continue
        findings.error(
            own,
            f'node id {node.node_id} of {node.name} is also that of {name} (line {place.line})',
            'give each device an id of its own',
        )
    return unique


def _check_axis_names(
    nodes: Sequence[NodeConfig], sections: Mapping[str, YamlMap], findings: Findings
) -> None:
    """Refuse axes with the same name: each is a joint of its own."""
    owners: dict[str, str] = {}
    for node in nodes:
        for axis in node.axes:
            if (owner := owners.get(axis.name)) is not None:
                findings.error(
                    sections[node.name].place_of('channel_names'),
                    f'{node.name} and {owner} both have an axis {axis.name!r}',
                    'give each a name of its own',
                )
            owners[axis.name] = node.name


NODES_REMEDY = "write a mapping: 'nodes:', below it 'joint1:', below that 'node_id: 2'"


def lay_out(root: YamlMap, findings: Findings) -> tuple[YamlMap, YamlMap, dict[str, YamlMap]]:
    """Find the sections of either format: ``options``, ``master``, and the devices in order.

    The first two are empty if absent; ``defaults`` are merged into each device.
    """
    root = _lifted(root, findings)
    new = 'nodes' in root.entries or 'defaults' in root.entries
    devices = _new_devices(root, findings) if new else _old_devices(root, findings)
    if 'master' not in root.entries:
        findings.error(root.place, "no section 'master'", "write 'master:' and its node_id below")
    options, master = (
        block(root, name, findings) or YamlMap(replace(root.place, key=name))
        for name in ('options', 'master')
    )
    return options, master, devices


def _lifted(root: YamlMap, findings: Findings) -> YamlMap:
    """Move sections that are indented below ``options`` to the top level."""
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
        # in this format a device has an EDS, a misspelled section has none
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
    """Accept the common ``eds`` for ``dcf``; ros2_canopen accepts only the latter."""
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
    """Merge ``defaults`` into the section of a device; it keeps its own place."""
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
    """Return the object that an entry writes; None if it is invalid (reported elsewhere)."""
    if not isinstance(item, YamlMap) or 'index' not in item.entries:
        return None
    subindex = item.entries.get('sub_index')
    try:
        return integer(item.entries['index']), integer(subindex) if subindex is not None else 0
    except RefusedError:
        return None


FREE_RANGE = range(0x680, 0x6E0)
"""Where dcfgen, too, puts the PDOs from the fifth on; no pre-defined service lies there."""

RESERVED: tuple[tuple[range, str], ...] = (
    (range(0x001), 'NMT'),
    (range(0x001, 0x080), 'reserved'),
    (range(0x080, 0x081), 'SYNC'),
    (range(0x081, 0x100), 'emergency messages'),
    (range(0x100, 0x101), 'TIME'),
    (range(0x101, 0x181), 'reserved'),
    (range(0x581, 0x600), 'SDO answers'),
    (range(0x601, 0x680), 'SDO requests'),
    (range(0x6E0, 0x701), 'reserved'),
    (range(0x701, 0x780), 'heartbeats'),
    (range(0x780, CAN_ID_MASK + 1), 'reserved'),
)
"""Identifiers that no PDO may have (CiA 301, tables 38 to 40)."""


def assign_cob_ids(nodes: Sequence[NodeConfig], findings: Findings) -> tuple[NodeConfig, ...]:
    """Assign every PDO its final COB-ID, in the order of the file.

    Report reserved and duplicate COB-IDs. They are warnings if only EDS defaults are concerned;
    two RPDOs with one COB-ID are an error, as one frame would move two axes.
    """
    used = {pdo.cob_id for node in nodes for pdo in node.pdos if pdo.enabled}
    free = iter([cob_id for cob_id in FREE_RANGE if cob_id not in used])
    result = []
    for node in nodes:
        tpdos, rpdos = (
            tuple(_assigned(node, pdo, free, findings) for pdo in pdos)
            for pdos in (node.tpdos, node.rpdos)
        )
        result.append(replace(node, tpdos=tpdos, rpdos=rpdos))
    owners: dict[int, list[tuple[str, PdoConfig]]] = {}
    for node in result:
        for pdo in node.pdos:
            if pdo.enabled and pdo.cob_id:
                title, others = f'{pdo.title} of {node.name}', owners.setdefault(pdo.cob_id, [])
                _check(title, pdo, others, findings)
                others.append((title, pdo))
    return tuple(result)


def _assigned(
    node: NodeConfig, pdo: PdoConfig, free: Iterator[int], findings: Findings
) -> PdoConfig:
    if pdo.cob_id != AUTO_ID:
        return pdo
    cob_id = next(free, 0)
    if not cob_id:
        findings.error(
            pdo.place,
            f'no free COB-ID is left for {pdo.title} of {node.name} between 0x680 and 0x6DF',
            'write a COB-ID that the bus does not use',
        )
    return replace(pdo, cob_id=cob_id)


def _check(
    title: str, pdo: PdoConfig, owners: list[tuple[str, PdoConfig]], findings: Findings
) -> None:
    """Report a COB-ID that is reserved or already in use."""
    for purpose in (purpose for ids, purpose in RESERVED if pdo.cob_id in ids):
        message = f'COB-ID 0x{pdo.cob_id:03X} of {title} is not for PDOs ({purpose})'
        _report(findings, [pdo], message)
    commanding = [each for each in owners if _commands(each[1])] if _commands(pdo) else []
    for name, other in (commanding or owners)[:1]:
        _report(
            findings,
            [pdo, other],
            f'COB-ID 0x{pdo.cob_id:03X} of {title} is also that of {name} '
            f'(line {other.place.line})',
            certain=bool(commanding),
        )


def _commands(pdo: PdoConfig) -> bool:
    return pdo.direction is RPDO and bool(pdo.mapping)


def _report(
    findings: Findings, pdos: list[PdoConfig], message: str, *, certain: bool = False
) -> None:
    if certain or any(pdo.configured for pdo in pdos):
        remedy = "name each PDO in bus.yml with 'cob_id: auto', or 'enabled: false'"
        findings.error(pdos[0].place, message, remedy)
    else:
        remedy = 'name the PDO in bus.yml if the device does not add its node id to the default'
        findings.warning(pdos[0].place, message, remedy)
