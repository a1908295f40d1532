# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The bus session of one verb, and the device on which the verb acts.

It runs in one loop and thread. While a master is on the bus it only listens, unless `--query` is
given: a device has one default SDO channel, which belongs to the master (CiA 301, 7.2.4.1).
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Coroutine
from dataclasses import dataclass
from functools import cache
from time import monotonic
from typing import Any, TypeVar

from arm_canopen import MasterFrames, Promise, Scheduler, SdoClient
from arm_canopen.config import BusConfig, DEFAULT_DRIVE, load_bus, NodeConfig
from canopen_core import ObjectError
from canopen_core.can import Bus, Frame
from canopen_core.eds import load_eds
from canopen_core.standard import (
    CobId,
    DataType,
    find_object,
    NmtState,
    NODE_ID_MAX,
    NODE_ID_MIN,
    NUMBER,
    ObjectDictionary,
    ObjectEntry,
    parse_heartbeat,
    slow_timeout,
)

from ..monitor.sdo_follower import ObjectNames
from .arguments import UsageError, warn

T = TypeVar('T')

IDLE_WAIT = 0.1  # [s] longest wait for frames when nothing else is due
QUIET = 0.02  # [s] without SDO frames after which another client's transfer has ended
QUIET_WAIT = 2.0  # [s] longest wait for this


class Session:
    """Listens to a bus and runs coroutines on it."""

    def __init__(self, bus: Bus, config: BusConfig | None = None) -> None:
        """Start listening; the configuration helps to recognize a master by its frames."""
        self.bus = bus
        self.scheduler = Scheduler(monotonic())
        self.states: dict[int, NmtState] = {}  # NMT states by node id, from their heartbeats
        self.masters: set[str] = set()  # frames on the bus that only a master sends
        self.listeners: list[Callable[[Frame], None]] = []  # called with every frame
        self._clients: dict[int, SdoClient] = {}
        self._sdo_times: dict[int, float] = {}
        self._master_id = config.master.node_id if config is not None else None
        self._master_frames = MasterFrames(config)

    def listen(self, duration: float, until: Callable[[], bool] = lambda: False) -> None:
        """Listen for a duration in [s], or until a condition holds."""
        end = monotonic() + duration
        while not until() and (left := end - monotonic()) > 0.0:
            self._step(left)

    def run(self, coroutine: Coroutine[Promise[Any], None, T]) -> T:
        """Run a coroutine to its end; return its result or raise its error."""
        self.scheduler.advance(monotonic())
        task = self.scheduler.spawn(coroutine)
        while not task.done:
            self._step(IDLE_WAIT)
        return task.result()

    def client(
        self, node_id: int, name: str = '', dictionary: ObjectDictionary | None = None
    ) -> SdoClient:
        """Return the SDO client of a device; ``dictionary`` has its object types."""
        client = self._clients.get(node_id)
        if client is None:
            name = name or f'node {node_id}'
            client = SdoClient(
                node_id,
                name,
                self.scheduler,
                self.bus.send,
                dictionary=dictionary,
                on_odd=lambda text: warn(f'{name} {text}'),
            )
            self._clients[node_id] = client
        return client

    def read(
        self, client: SdoClient, index: int, subindex: int, timeout: float, *, block: bool = False
    ) -> bytes:
        """Read an object of a device."""

        async def upload() -> bytes:
            return await client.read(index, subindex, timeout, block=block)

        return self.run(upload())

    def await_quiet(self, node_id: int) -> None:
        """Wait until other clients' SDO transfers with a device pause, at most ``QUIET_WAIT``."""
        self._step(0.0)
        self.listen(QUIET_WAIT, lambda: monotonic() - self._sdo_times.get(node_id, 0.0) > QUIET)

    def _step(self, wait: float) -> None:
        deadline = self.scheduler.next_deadline()
        if deadline is not None:
            wait = min(wait, deadline - monotonic())
        for frame in self.bus.receive(max(0.0, wait)):
            self.scheduler.set_time(frame.timestamp)
            if not frame.is_extended and not frame.is_error:
                self._take(frame)
        self.scheduler.advance(monotonic())

    def _take(self, frame: Frame) -> None:
        for listener in self.listeners:
            listener(frame)
        function, node_id = frame.can_id & 0x780, frame.can_id & 0x7F
        self._note_master(frame, function, node_id)
        if not NODE_ID_MIN <= node_id <= NODE_ID_MAX or frame.is_remote:
            return
        if function == CobId.HEARTBEAT:
            state = parse_heartbeat(frame.data)
            if state is not None and node_id != self._master_id:
                self.states[node_id] = state
        elif function == CobId.SDO_REQUEST:
            self._sdo_times[node_id] = monotonic()
            if node_id in self._clients:
                self._clients[node_id].receive_request(frame)
        elif function == CobId.SDO_RESPONSE and node_id in self._clients:
            self._clients[node_id].receive(frame)

    def _note_master(self, frame: Frame, function: int, node_id: int) -> None:
        """Record frames that only a master sends; own frames are not received."""
        kind = self._master_frames.read(frame)
        if kind is not None:
            self.masters.add(kind.evidence.title)
        elif function == CobId.SDO_REQUEST and node_id:
            self.masters.add('SDO requests')
        elif function == CobId.HEARTBEAT and frame.is_remote:
            self.masters.add('node guarding')


TIMEOUT = 0.5  # [s]
LISTEN = 0.15  # [s] before the first request; a master sends SYNC more often


@dataclass(frozen=True, slots=True)
class Target:
    """The device on which a verb acts."""

    node_id: int
    name: str  # its name in bus.yml, else ``the device``
    dictionary: ObjectDictionary  # its objects; without a file those of the standards
    described: bool  # whether a file describes them
    timeout: float  # SDO timeout in [s]
    bus: BusConfig | None = None  # None without bus.yml
    config: NodeConfig | None = None  # its entry in bus.yml; None if missing
    given_timeout: bool = False  # from the command line, so it applies to every object

    def write_timeout(self, entry: ObjectEntry) -> float:
        """Return the SDO timeout of a write in [s]."""
        if self.given_timeout:
            return self.timeout
        if self.config is not None:
            return self.config.write_timeout(*entry.address)
        return slow_timeout(entry.index, self.timeout)

    def entry(self, path: str, data_type: DataType | None = None) -> ObjectEntry:
        """Find an object by a path, as :func:`.find_object`; with a type no file is needed.

        Raises:
            UsageError: The object does not exist; the message names similar ones.
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
    """Return a drive's standard objects, for devices without a file."""
    source = 'the objects of CiA 301 and 402 (no EDS is given)'
    return ObjectDictionary(load_eds(DEFAULT_DRIVE).dictionary, source=source)


def find_target(options: argparse.Namespace) -> Target:
    """Find the device named on the command line.

    Raises:
        UsageError: The device does not exist.
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
    """Warn if a master is on the bus, and wait for a pause in its transfers with a device."""
    session.listen(LISTEN)
    if session.masters:
        signs = ', '.join(sorted(session.masters))
        warn(
            f'a master is on this bus ({signs}), and shares the SDO channel of {target.name}: one '
            "of its transfers may fail; the master's services ~/read_object and ~/write_object "
            'take turns'
        )
        session.await_quiet(target.node_id)
