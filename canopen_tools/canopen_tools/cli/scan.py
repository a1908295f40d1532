# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``canopen scan``: find and identify the devices on a bus."""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field

from arm_canopen import SdoClient
from arm_canopen.config import BusConfig, Identity, IDENTITY_OBJECTS, load_bus, NodeConfig
from canopen_core import SdoError
from canopen_core.can import Frame, open_bus
from canopen_core.standard import (
    CobId,
    DeviceProfile,
    Index,
    NmtState,
    NODE_ID_MAX,
    NODE_ID_MIN,
    PROFILE_MASK,
    sdo,
)

from .arguments import (
    add_bus_arguments,
    counted,
    print_line,
    print_table,
    seconds,
    SubParsers,
    warn,
)
from .target import Session

LISTEN = 1.5  # [s] many devices send a heartbeat every second
ANSWER = 0.3  # [s]
SECOND_ANSWER = 0.02  # [s] for the answer of a second device with the same node id
GROUP = 8  # devices queried at once, so that no transmit queue overflows
GROUP_PAUSE = 0.01  # [s]

TITLES = ('device type', 'vendor', 'product', 'revision', 'serial')
"""Column titles of IDENTITY_OBJECTS."""

PROFILES: dict[int, str] = {
    301: '',
    DeviceProfile.GENERIC_IO: 'I/O modules',
    DeviceProfile.DRIVE: 'drive',
    404: 'measuring device',
    DeviceProfile.ENCODER: 'encoder',
    408: 'hydraulics',
    410: 'inclinometer',
    418: 'battery',
    419: 'charger',
}
"""Device profiles by their number (CiA 301, 7.5.2.1: the low word of 0x1000)."""


@dataclass(slots=True)
class Found:
    """A device that has sent a frame or answered."""

    node_id: int
    state: NmtState | None = None  # from its heartbeat; None without heartbeat
    # identity by attribute of Identity; None if the device refuses to read it
    numbers: dict[str, int | None] = field(default_factory=dict)
    config: NodeConfig | None = None  # its entry in bus.yml
    answers: bool = False  # whether it has answered an SDO
    # more answers than requests: another device has the same node id
    twice: bool = False

    @property
    def is_there(self) -> bool:
        """Whether the device has sent a frame or answered."""
        return self.state is not None or self.answers


def add_scan(parsers: SubParsers) -> None:
    """Add the verb."""
    parser = parsers.add_parser(
        'scan',
        help='list the devices on a bus',
        description='List the devices on a bus. It listens first; without a master on the bus it '
        'reads the identity of every node id. Exit code: 0; 1 when there is no device, several '
        'have one node id, or with --bus-config when one is missing or another one; 2 wrong '
        'usage.',
    )
    add_bus_arguments(parser)
    parser.add_argument(
        '--listen',
        type=seconds,
        default=LISTEN,
        metavar='S',
        help=f'how long to listen first in s (default: {LISTEN})',
    )
    parser.add_argument(
        '--query',
        '--ask',  # codespell:ignore ask
        action='store_true',
        help='read the identities, also beside a running master',
    )
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Scan a bus; return the exit code."""
    config = load_bus(options.bus_config) if options.bus_config else None
    with open_bus(options.can) as bus:
        session = Session(bus, config)
        found = find_devices(session, config, options.listen, query=options.query)
        return _show(found, config, queried=options.query or not session.masters)


def find_devices(
    session: Session, config: BusConfig | None, listen: float, *, query: bool
) -> dict[int, Found]:
    """Listen for ``listen`` [s], then read the identity of every node id, if no master is there.

    query reads even if a master is on the bus.

    Returns:
        Devices by node id: those found, and those of the configuration.
    """
    warn(f'listening on {session.bus.name} for {listen:g} s')
    session.listen(listen)
    found = _frames(session, config)
    if session.masters and session.states and config is None:
        warn('a master with a heartbeat is listed like a device; --bus-config leaves it out')
    if _may_query(session, query=query):
        _find_silent(session, found)
        for device in found.values():
            _identify(session, device)
            if device.twice:
                warn(
                    f'node {device.node_id}: several devices answer; switch all but one of them '
                    'off, and give each a node id of its own (by its switches, or the tool of its '
                    'vendor)'
                )
    return found


def _frames(session: Session, config: BusConfig | None) -> dict[int, Found]:
    nodes = {node.node_id: node for node in config.nodes} if config is not None else {}
    return {
        node_id: Found(node_id, session.states.get(node_id), config=nodes.get(node_id))
        for node_id in sorted(session.states.keys() | nodes.keys())
    }


def _may_query(session: Session, *, query: bool) -> bool:
    if not session.masters:
        return True
    signs = ', '.join(sorted(session.masters))
    if query:
        warn(
            f'a master is on this bus ({signs}); while devices are queried, its transfers may fail'
        )
        return True
    warn(
        f'a master is on this bus ({signs}), so devices are not queried for their identity: each '
        "has one SDO channel, which is the master's; --query reads them nevertheless"
    )
    return False


def _find_silent(session: Session, found: dict[int, Found]) -> None:
    """Read 0x1000 of every other node id, to find devices without heartbeat."""
    answered: set[int] = set()

    def note(frame: Frame) -> None:
        if frame.can_id & 0x780 == CobId.SDO_RESPONSE:
            answered.add(frame.can_id & 0x7F)

    session.listeners.append(note)
    beside_master = bool(session.masters)
    request = sdo.UploadRequest(Index.DEVICE_TYPE, 0).encode()
    others = [i for i in range(NODE_ID_MIN, NODE_ID_MAX + 1) if i not in session.states]
    for position, node_id in enumerate(others):
        if beside_master:
            session.await_quiet(node_id)
        session.bus.send(Frame(CobId.SDO_REQUEST + node_id, request))
        if position % GROUP == GROUP - 1:
            session.listen(GROUP_PAUSE)
    session.listen(ANSWER)
    session.listeners.remove(note)
    for node_id in sorted(answered & set(others)):
        found.setdefault(node_id, Found(node_id, session.states.get(node_id))).answers = True


def _identify(session: Session, device: Found) -> None:
    """Read 0x1000 and 0x1018 of a device that was found."""
    if not device.is_there:
        return
    client = session.client(device.node_id)
    _read_identity(session, device, client)
    session.listen(SECOND_ANSWER)
    device.twice = client.counters.doubled > 1  # the bus may deliver one frame twice


def _read_identity(session: Session, device: Found, client: SdoClient) -> None:
    for attribute, index, subindex in IDENTITY_OBJECTS:
        if session.masters:
            session.await_quiet(device.node_id)
        try:
            data = session.read(client, index, subindex, ANSWER)
        except TimeoutError:
            return  # it will not answer further reads
        except SdoError:
            device.numbers[attribute] = None  # some are optional
        else:
            device.answers = True
            device.numbers[attribute] = int.from_bytes(data, 'little')


def _show(found: dict[int, Found], config: BusConfig | None, *, queried: bool) -> int:
    devices = sorted(found.values(), key=lambda device: device.node_id)
    present = [device for device in devices if device.is_there]
    if not present and config is None:
        hint = 'is the bus powered, wired and terminated, and is this its bit rate?'
        warn(f'no device answers: {hint}' if queried else 'no device has sent a frame')
        return 1
    named = config is not None
    head = ('node', *(('name',) if named else ()), 'state', *TITLES)
    differences = {
        device.node_id: list(_differences(device, queried=queried)) for device in devices
    }
    rows = [
        (
            str(device.node_id),
            *((device.config.name if device.config else '',) if named else ()),
            _state(device, queried=queried),
            *_cells(device),
            *(('; '.join(differences[device.node_id]),) if named else ()),
        )
        for device in devices
    ]
    print_table((*head, '') if named else head, rows, right='node')
    print_line(f'{counted(len(present), "device")}')
    wrong = any(differences.values()) or any(device.twice for device in present)
    return 1 if not present or wrong else 0


def _state(device: Found, *, queried: bool) -> str:
    if device.state is not None:
        return device.state.name.lower().replace('_', '-')
    if device.answers:
        return 'no heartbeat'
    return 'absent' if queried else 'not seen'


def _cells(device: Found) -> Iterable[str]:
    for attribute, _, _ in IDENTITY_OBJECTS:
        number = device.numbers.get(attribute)
        if attribute not in device.numbers:
            yield ''
        elif number is None:
            yield '-'
        elif attribute == 'device_type':
            profile = PROFILES.get(number & PROFILE_MASK, '')
            yield f'0x{number:08X} {profile}'.rstrip()
        else:
            yield f'0x{number:08X}'


def _differences(device: Found, *, queried: bool) -> Iterator[str]:
    """Yield how a device differs from bus.yml."""
    if device.config is None:
        return
    if queried and not device.is_there:
        yield 'not on the bus'
    expected: Identity = device.config.identity
    for title, (attribute, _, _) in zip(TITLES, IDENTITY_OBJECTS, strict=True):
        wanted, number = getattr(expected, attribute), device.numbers.get(attribute)
        if wanted and number is not None and number != wanted:
            yield f'expected {title} 0x{wanted:08X}'
