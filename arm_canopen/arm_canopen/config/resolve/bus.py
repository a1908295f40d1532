# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A whole bus: what its bus.yml says, the EDS files, and what counts of both."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from ..findings import Findings, Place
from ..model import BusConfig, MasterConfig, SourceLocation
from ..model.pdo_direction import RPDO, TPDO
from ..read.document import Item, YamlMap
from .cob_ids import assign_cob_ids
from .device import DeviceDraft, read_device
from .device_timing import finish_device
from .eds_files import EdsFiles
from .layout import lay_out, Layout
from .master import build_master
from .settings import read_master_settings, read_options

PDO_SECTIONS = (RPDO.name, TPDO.name)
DEPTH_MAX = 3  # device, tpdo, number; below are the keys of a PDO


def resolve_bus(
    document: YamlMap, file: Path, bus_config_path: Path | None, findings: Findings
) -> BusConfig:
    """Make a bus, without what is wrong, of its bus.yml and the EDS files that this names."""
    layout = lay_out(document, findings)
    options = read_options(layout.options, findings)
    settings = read_master_settings(layout.master, findings)
    beside = file.parent.absolute()
    eds_files = EdsFiles(beside if bus_config_path is None else bus_config_path, beside)
    drafts = [
        read_device(name, section, options, eds_files, findings)
        for name, section in layout.devices.items()
    ]
    periods = [draft.settings.poll_period for draft in drafts]
    master = build_master(layout.master, settings, options, periods, findings)
    unique = _check_node_ids(layout.master, settings.node_id, drafts, findings)
    _check_axis_names(unique, findings)
    _check_lifecycle(master, drafts, findings)
    nodes = tuple(
        finish_device(
            draft,
            draft.config,
            master,
            findings,
            multiplier=options.heartbeat_multiplier,
            is_watched=settings.watch_devices,
        )
        for draft in _with_cob_ids(unique, findings)
        if draft.config is not None
    )
    return BusConfig(file, master, nodes, findings.warnings, _locations(layout))


def _locations(layout: Layout) -> dict[tuple[str, ...], SourceLocation]:
    """Say where each key stands, by the names that lead to it."""
    sections = {'master': layout.master, **layout.devices}
    return {
        names: SourceLocation(item.place.line, item.place.key)
        for name, section in sections.items()
        for names, item in _walk((name,), section)
    }


def _walk(names: tuple[str, ...], item: Item) -> Iterator[tuple[tuple[str, ...], Item]]:
    yield names, item
    if not isinstance(item, YamlMap) or len(names) > DEPTH_MAX:
        return
    for name, child in item.entries.items():
        if len(names) == 1 or names[1] in PDO_SECTIONS:
            yield from _walk((*names, name), child)


def _check_lifecycle(
    master: MasterConfig, drafts: Sequence[DeviceDraft], findings: Findings
) -> None:
    """Refuse a mixture of managed and plain nodes, which nobody could bring up in order."""
    for draft in drafts:
        if draft.config is None or draft.config.is_lifecycle == master.is_lifecycle:
            continue
        kinds = ('a lifecycle driver', 'a plain one')
        mine, others = kinds if draft.config.is_lifecycle else kinds[::-1]
        findings.error(
            draft.place_of('driver'),
            f'{draft.config.driver} is {mine}, but the master has {others} ({master.driver})',
            'take lifecycle drivers for all or for none',
        )


def _check_node_ids(
    master: YamlMap, master_id: int | None, drafts: Sequence[DeviceDraft], findings: Findings
) -> list[DeviceDraft]:
    """Refuse doubled node ids; returns the devices that have one of their own."""
    owners: dict[int, tuple[str, Place]] = {}
    if master_id is not None:
        owners[master_id] = ('the master', master.entries['node_id'].place)
    unique = []
    for draft in drafts:
        if draft.config is None:
            continue
        node_id = draft.config.node_id
        name, place = owners.setdefault(node_id, (draft.config.name, draft.place_of('node_id')))
        if name == draft.config.name:
            unique.append(draft)
            continue
        findings.error(
            draft.place_of('node_id'),
            f'node id {node_id} of {draft.config.name} is also that of {name} (line {place.line})',
            'give each device an id of its own',
        )
    return unique


def _check_axis_names(drafts: Sequence[DeviceDraft], findings: Findings) -> None:
    """Refuse an axis that has the name of another device's axis: each is a joint of its own."""
    owners: dict[str, str] = {}
    for draft in drafts:
        if draft.config is None:
            continue
        for axis in draft.config.axes:
            owner = owners.setdefault(axis.name, draft.config.name)
            if owner != draft.config.name:
                findings.error(
                    draft.place_of('channel_names'),
                    f'{draft.config.name} and {owner} both have an axis {axis.name!r}',
                    'give each a name of its own',
                )


def _with_cob_ids(drafts: Sequence[DeviceDraft], findings: Findings) -> list[DeviceDraft]:
    """Give the PDOs of all devices their final COB-IDs."""
    assigned = iter(assign_cob_ids([pdo for draft in drafts for pdo in draft.pdos], findings))
    return [replace(draft, pdos=[next(assigned) for _ in draft.pdos]) for draft in drafts]
