# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""From a bus.yml and the EDS files that it names to the model of a bus, and its check."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
import os
from pathlib import Path

from canopen_core import ConfigError, Findings, Place

from ..model import BusConfig, MasterConfig, NodeConfig
from ..model.checks import check_bus, Report
from ..model.pdo import RPDO, TPDO
from ..read.document import Item, read_document, YamlMap
from ..read.section import read_section
from ..sections import OPTION_KEYS, Options
from .cob_ids import assign_cob_ids
from .device import DeviceReader
from .eds_files import EdsFiles
from .layout import lay_out, Layout
from .master import build_master, read_master

PDO_SECTIONS = (RPDO.name, TPDO.name)
DEPTH_MAX = 3  # device, tpdo, number; below are the keys of a PDO


def load_bus(
    path: str | os.PathLike[str], *, bus_config_path: str | os.PathLike[str] | None = None
) -> BusConfig:
    """Read a bus.yml of either format and the EDS files that it names.

    ``@BUS_CONFIG_PATH@`` stands for bus_config_path, or for the folder of the file.

    Returns:
        The bus; oddities are among its warnings.

    Raises:
        ConfigError: Something is wrong; the error lists every problem with file, line, key and
            remedy.
    """
    folder = None if bus_config_path is None else Path(bus_config_path)
    config, findings = _read_and_resolve(Path(path), folder)
    findings.raise_errors()
    return config


def check_file(path: str | os.PathLike[str], bitrate: int | None = None) -> Report:
    """Read a bus.yml and report everything that is wrong with it and its EDS files at once.

    The bit rate in [bit/s] replaces that of bus.yml.
    """
    try:
        config, findings = _read_and_resolve(Path(path), None)
    except ConfigError as error:
        return Report(error.problems, ())
    return check_bus(config, bitrate, findings)


def _read_and_resolve(file: Path, bus_config_path: Path | None) -> tuple[BusConfig, Findings]:
    """Make as much of a bus as can be understood, and collect everything that is wrong."""
    findings = Findings()
    document = read_document(file, findings)
    return resolve_bus(document, file, bus_config_path, findings), findings


def resolve_bus(
    document: YamlMap, file: Path, bus_config_path: Path | None, findings: Findings
) -> BusConfig:
    """Make a bus, without what is wrong, of its bus.yml and the EDS files that this names."""
    layout = lay_out(document, findings)
    options = Options(**read_section(layout.options, OPTION_KEYS, findings))
    settings, config = read_master(layout.master, findings)
    beside = file.parent.absolute()
    eds_files = EdsFiles(beside if bus_config_path is None else bus_config_path, beside)
    readers = {
        name: DeviceReader(name, section, findings) for name, section in layout.devices.items()
    }
    periods = [reader.poll_period for reader in readers.values()]
    master = build_master(
        layout.master, settings, config, options, findings, device_periods=periods
    )
    nodes = [
        node
        for reader in readers.values()
        if (node := reader.read(options, eds_files, master, settings)) is not None
    ]
    _check_lifecycle(master, nodes, readers, findings)
    unique = _check_node_ids(layout.master, settings.node_id, nodes, readers, findings)
    _check_axis_names(unique, readers, findings)
    finished = assign_cob_ids(unique, findings)
    return BusConfig(file, master, finished, findings.warnings, dict(_locations(layout)))


def _locations(layout: Layout) -> Iterator[tuple[tuple[str, ...], Place]]:
    """Yield where each key stands, by the names that lead to it."""
    for name, section in {'master': layout.master, **layout.devices}.items():
        yield from _walk((name,), section)


def _walk(names: tuple[str, ...], item: Item) -> Iterator[tuple[tuple[str, ...], Place]]:
    yield names, item.place
    if not isinstance(item, YamlMap) or len(names) > DEPTH_MAX:
        return
    for name, child in item.entries.items():
        if len(names) == 1 or names[1] in PDO_SECTIONS:
            yield from _walk((*names, name), child)


def _check_lifecycle(
    master: MasterConfig,
    nodes: Sequence[NodeConfig],
    readers: Mapping[str, DeviceReader],
    findings: Findings,
) -> None:
    """Refuse a mixture of managed and plain nodes, which cannot be brought up in order."""
    for node in nodes:
        if node.is_lifecycle == master.is_lifecycle:
            continue
        kinds = ('a lifecycle driver', 'a plain one')
        mine, others = kinds if node.is_lifecycle else kinds[::-1]
        findings.error(
            readers[node.name].place_of('driver'),
            f'{node.driver} is {mine}, but the master has {others} ({master.driver})',
            'take lifecycle drivers for all or for none',
        )


def _check_node_ids(
    master: YamlMap,
    master_id: int | None,
    nodes: Sequence[NodeConfig],
    readers: Mapping[str, DeviceReader],
    findings: Findings,
) -> list[NodeConfig]:
    """Refuse doubled node ids; returns the devices that have one of their own."""
    owners: dict[int, tuple[str, Place]] = {}
    if master_id is not None:
        owners[master_id] = ('the master', master.entries['node_id'].place)
    unique = []
    for node in nodes:
        own = readers[node.name].place_of('node_id')
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
    nodes: Sequence[NodeConfig], readers: Mapping[str, DeviceReader], findings: Findings
) -> None:
    """Refuse an axis that has the name of another device's axis: each is a joint of its own."""
    owners: dict[str, str] = {}
    for node in nodes:
        for axis in node.axes:
            owner = owners.setdefault(axis.name, node.name)
            if owner != node.name:
                findings.error(
                    readers[node.name].place_of('channel_names'),
                    f'{node.name} and {owner} both have an axis {axis.name!r}',
                    'give each a name of its own',
                )
