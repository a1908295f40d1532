# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The device that a verb is about: by id or name, with its objects if a file describes them."""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from functools import cache

from arm_canopen.config import BusConfig, DEFAULT_DRIVE, load_bus, NodeConfig
from canopen_core import ObjectError
from canopen_core.eds import load_eds
from canopen_core.standard import (
    DataType,
    find_object,
    NODE_ID_MAX,
    NODE_ID_MIN,
    NUMBER,
    ObjectDictionary,
    ObjectEntry,
    slow_timeout,
)

from ..monitor.object_names import ObjectNames
from .arguments import UsageError
from .output import warn
from .session import Session

TIMEOUT = 0.5  # [s]
LISTEN = 0.15  # [s] before the first request; a master sends SYNC more often


@dataclass(frozen=True, slots=True)
class Target:
    """A device."""

    node_id: int
    name: str  # its name in bus.yml, else ``the device``
    dictionary: ObjectDictionary  # its objects; without a file what the standards describe
    described: bool  # a file describes them
    timeout: float  # longest time for an answer in [s]
    bus: BusConfig | None = None  # the bus, None without bus.yml
    config: NodeConfig | None = None  # the device in bus.yml, None when it is not there
    given_timeout: bool = False  # it was given on the command line, and counts for every object

    def write_timeout(self, entry: ObjectEntry) -> float:
        """Return the longest time for the answer to a write in [s]."""
        if self.given_timeout:
            return self.timeout
        if self.config is not None:
            return self.config.write_timeout(*entry.address)
        return slow_timeout(entry.index, self.timeout)

    def entry(self, path: str, data_type: DataType | None = None) -> ObjectEntry:
        """Find an object by a path of ``standard/object_paths.py``; with a type it needs no file.

        Raises:
            UsageError: There is none; the message names similar ones.
        """
        number = NUMBER.fullmatch(path.strip())
        if number is not None and data_type is not None:
            return self._unknown(number[1], number[2], data_type)
        try:
            return find_object(self.dictionary, path)
        except ObjectError as error:
            if number is not None and not self.described:
                return self._unknown(number[1], number[2], DataType.DOMAIN)
            hint = (
                '--type reads objects that are not in the file'
                if number is not None
                else '--eds or --bus-config describes more objects'
            )
            raise UsageError(f'{error}; {hint}') from error

    def _unknown(self, index: str, subindex: str | None, data_type: DataType) -> ObjectEntry:
        address = int(index, 16), int(subindex or '0', 16)
        name = ObjectNames(self.dictionary).name(*address)
        return ObjectEntry(*address, name, data_type)


@cache
def standard_dictionary() -> ObjectDictionary:
    """Return the objects of a drive by the standards, for devices without a file."""
    source = 'the objects of CiA 301 and 402 (no EDS is given)'
    return ObjectDictionary(load_eds(DEFAULT_DRIVE).dictionary, source=source)


def find_target(options: argparse.Namespace) -> Target:
    """Find the device that the command line means.

    Raises:
        UsageError: There is none.
        ConfigError: A file is wrong.
    """
    bus = load_bus(options.bus_config) if options.bus_config else None
    node_id, config = _node(options.node, bus)
    name = config.name if config is not None else 'the device'
    dictionary = config.dictionary if config is not None else None
    if options.eds:
        dictionary = load_eds(options.eds).dictionary.for_node(node_id)
    timeout = options.timeout or (config.sdo_timeout if config is not None else TIMEOUT)
    return Target(
        node_id,
        name,
        dictionary or standard_dictionary(),
        dictionary is not None,
        timeout,
        bus,
        config,
        given_timeout=options.timeout is not None,
    )


def _node(text: str, bus: BusConfig | None) -> tuple[int, NodeConfig | None]:
    nodes = bus.nodes if bus is not None else ()
    try:
        node_id = int(text, 0)
    except ValueError:
        for node in nodes:
            if node.name == text:
                return node.node_id, node
        known = ', '.join(node.name for node in nodes) or 'none; --bus-config names devices'
        raise UsageError(f'no device is called {text!r}; known: {known}') from None
    if not NODE_ID_MIN <= node_id <= NODE_ID_MAX:
        raise UsageError(f'{text} is no node id; take {NODE_ID_MIN} to {NODE_ID_MAX}')
    return node_id, next((node for node in nodes if node.node_id == node_id), None)


def warn_of_master(session: Session, target: Target) -> None:
    """Listen for a master, and wait for a pause in its transfers with a device."""
    session.listen(LISTEN)
    if session.masters:
        signs = ', '.join(sorted(session.masters))
        warn(
            f'a master is on this bus ({signs}), and shares the SDO channel of {target.name}: one '
            "of its transfers may fail; the master's services ~/read_object and ~/write_object "
            'take turns'
        )
        session.await_quiet(target.node_id)
