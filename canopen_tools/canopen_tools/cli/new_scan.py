# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The devices of ``canopen new``: those of the command line, or those that answer on a bus."""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
import re
from typing import NamedTuple

from arm_canopen.config import FACTOR_ADDRESSES, Identity
from canopen_core import CanopenError, ConfigError, SdoError
from canopen_core.can import open_bus
from canopen_core.eds import Eds, load_eds
from canopen_core.standard import Index, PROFILE_MASK, profile_number

from ..new_device import NewBusError, NewDevice
from .arguments import node_id, UsageError
from .output import print_line
from .scan import find_devices, Found
from .session import Session

NAME = r'(?P<name>[A-Za-z][A-Za-z0-9_]*)'  # one of a ROS node
DEVICE = re.compile(NAME + '=(?P<file>.+)@(?P<node>[^@]+)')
NAMED = re.compile(NAME + '@(?P<node>[^@=]+)')
STORE_EDS, STORE_FORMAT = 0x1021, 0x1022  # CiA 301, 7.5.2.22 and 7.5.2.23
UNCOMPRESSED = 0  # value of 0x1022 for text as it is
TIMEOUT = 0.5  # [s] of an answer
FACTS: tuple[tuple[int, int], ...] = (
    (Index.SUPPORTED_MODES, 0),
    *FACTOR_ADDRESSES,
)
"""Objects in which a drive itself says what its EDS may leave open."""


MAJOR_SHIFT = 16  # of 0x1018:03: above it is the revision of the behaviour (CiA 301, 7.5.2.19)


@dataclass(frozen=True, slots=True)
class _Choice:
    """What the command line says of a device."""

    name: str
    eds: Eds | None = None  # its EDS; None where the scan shall find it


def given_devices(options: argparse.Namespace) -> list[NewDevice]:
    """Return the devices of the command line.

    Raises:
        UsageError: One is not written as such, or there is none.
    """
    if not options.devices:
        raise UsageError(
            'name devices as shoulder=drive.eds@2, or take those of a bus with --scan'
        )
    devices = []
    for text in options.devices:
        match = DEVICE.fullmatch(text)
        if match is None:
            raise UsageError(f'{text!r} is no device; write it as shoulder=drive.eds@2')
        devices.append(
            NewDevice(match['name'], _node(text, match['node']), load_eds(Path(match['file'])))
        )
    return devices


def scanned_devices(options: argparse.Namespace, folder: Path) -> list[NewDevice]:
    """Return the devices on the bus; the folder gets the EDS files that they have in themselves.

    Raises:
        UsageError: The command line names a device that is not there, or files that are none.
        NewBusError: The bus is silent or led by a master, or a device has no EDS or shares its
            node id; every problem is listed, with its remedy.
    """
    choices, candidates = _choices(options.devices)
    with open_bus(options.can) as bus:
        session = Session(bus)
        everyone = find_devices(session, None, options.listen, query=False)
        if session.masters:
            raise NewBusError(
                f'a master is on this bus ({", ".join(sorted(session.masters))}), and a device '
                'answers one of both; end it, then scan'
            )
        found = [each for each in everyone.values() if each.is_there]
        if not found:
            raise NewBusError(
                f'no device answers on {bus.name}: is the bus powered, wired and terminated, and '
                'is this its bit rate?'
            )
        _require_present({*choices, *options.without}, {each.node_id for each in found})
        scan = _Scan(session, choices, candidates, folder)
        devices, problems = [], []
        for each in sorted(found, key=lambda device: device.node_id):
            if each.node_id in options.without:
                continue
            try:
                devices.append(scan.device(each))
            except NoMatchError as error:
                problems.append(f'{_title(each)}: {error}')
    if problems:
        raise NewBusError('\n'.join(problems))
    if not devices:
        raise NewBusError('every device was left out; a bus.yml has one or more')
    return devices


def _choices(texts: Sequence[str]) -> tuple[dict[int, _Choice], list[Eds]]:
    """Return what the command line says, by node id, and the EDS files to choose from."""
    choices: dict[int, _Choice] = {}
    candidates: list[Eds] = []
    for text in texts:
        match = DEVICE.fullmatch(text) or NAMED.fullmatch(text)
        if match is None or Path(text).exists():
            candidates += _eds_files(Path(text))
            continue
        node = _node(text, match['node'])
        if node in choices:
            raise UsageError(f'{text}: node {node} is there already, as {choices[node].name}')
        file = match.groupdict().get('file')
        choices[node] = _Choice(match['name'], load_eds(Path(file)) if file else None)
    return choices, candidates


def _eds_files(path: Path) -> Iterator[Eds]:
    if not path.is_dir():
        yield load_eds(path)
        return
    files = sorted(each for each in path.iterdir() if each.suffix.lower() == '.eds')
    if not files:
        raise UsageError(f'{path} has no EDS files (*.eds)')
    yield from map(load_eds, files)


def _node(text: str, node: str) -> int:
    try:
        return node_id(node)
    except argparse.ArgumentTypeError as error:
        raise UsageError(f'{text}: {error}') from error


def _require_present(wanted: set[int], there: set[int]) -> None:
    if missing := sorted(wanted - there):
        known = ', '.join(map(str, sorted(there)))
        raise UsageError(f'node {missing[0]} does not answer; on the bus: {known}')


def _identity(found: Found) -> Identity:
    return Identity(**{name: number or 0 for name, number in found.numbers.items()})


def _title(found: Found) -> str:
    identity = _identity(found)
    who = f' ({identity_text(identity)})' if identity.vendor_id else ''
    return f'node {found.node_id}{who}'


@dataclass(frozen=True, slots=True)
class _Scan:
    """Finds the EDS of each device on a bus."""

    session: Session
    choices: Mapping[int, _Choice]  # what the command line says, by node id
    candidates: Sequence[Eds]  # EDS files to choose from
    folder: Path  # gets the EDS files that devices have in themselves

    def device(self, found: Found) -> NewDevice:
        """Return a device that was found.

        Raises:
            NoMatchError: It has no EDS, or shares its node id.
        """
        node, choice = found.node_id, self.choices.get(found.node_id)
        if found.twice:
            raise NoMatchError(
                'several devices have this node id; switch all but one of them off, and give each '
                'one of its own (canopen lss, or its switches)'
            )
        match = self._match(found, choice)
        is_drive = NewDevice('', node, match.eds).is_drive
        name = choice.name if choice is not None else f'{"joint" if is_drive else "device"}{node}'
        reason = f'{identity_text(_identity(found))}; {match.eds.path.name}: {match.reason}'
        print_line(f'node {node} is {name}: {reason}')
        values = _values(self.session, node) if is_drive else {}
        return NewDevice(name, node, match.eds, values=values, found=f'scanned: {reason}')

    def _match(self, found: Found, choice: _Choice | None) -> Match:
        identity, node = _identity(found), found.node_id
        if choice is not None and choice.eds is not None:
            differs = (choice_id := eds_identity(choice.eds)).vendor_id and (
                (choice_id.vendor_id, choice_id.product_code)
                != (identity.vendor_id, identity.product_code)
            )
            note = f', though it is for {identity_text(choice_id)}' if differs else ''
            return Match(choice.eds, f'as said{note}')
        try:
            return match_eds(identity, self.candidates)
        except SeveralMatchError as error:
            raise NoMatchError(f'{error}; choose with NAME=FILE.eds@{node}') from error
        except NoMatchError as error:
            stored = self._stored_eds(found)
            if stored is None:
                raise NoMatchError(
                    f'{error}, and it has none in 0x1021; get it from its vendor and name its '
                    f'file or folder, choose one with NAME=FILE.eds@{node}, or leave it out: '
                    f'--without {node}'
                ) from error
            return Match(stored, 'from the device itself (0x1021)')

    def _stored_eds(self, found: Found) -> Eds | None:
        """Read the EDS that a device has in itself; None where it has none that can be read."""
        session, client = self.session, self.session.client(found.node_id)
        try:
            form = session.read(client, STORE_FORMAT, 0, TIMEOUT)
            if int.from_bytes(form, 'little') != UNCOMPRESSED:
                return None
            data = session.read(client, STORE_EDS, 0, TIMEOUT, block=True)
        except SdoError:
            return None
        who = _identity(found)
        name = f'{who.vendor_id:08X}_{who.product_code:08X}_{who.revision_number:08X}.eds'
        path = self.folder / name
        path.write_bytes(data.rstrip(b'\0'))
        try:
            return load_eds(path)
        except ConfigError:
            return None


def _values(session: Session, node: int) -> dict[tuple[int, int], int]:
    """Read what a drive says of its modes and units."""
    values: dict[tuple[int, int], int] = {}
    for address in FACTS:
        client = session.client(node)
        try:
            values[address] = int.from_bytes(session.read(client, *address, TIMEOUT), 'little')
        except TimeoutError:
            break  # it will not answer the others either
        except SdoError:
            continue  # no drive has all of them
    return values


class NoMatchError(CanopenError):
    """No EDS fits a device; the message follows the name of the device."""


class SeveralMatchError(NoMatchError):
    """Several EDS fit a device equally well."""


WORDS = (
    'vendor and product agree; the revision differs: compare the manual',
    'vendor, product and major revision agree',
    'vendor, product and revision agree',
)
"""How well an EDS fits; the last one is the best."""


class Match(NamedTuple):
    """An EDS for a device."""

    eds: Eds
    reason: str  # why, in words


def eds_identity(eds: Eds) -> Identity:
    """Return whom an EDS describes: by the defaults of 0x1018, else by its [DeviceInfo]."""

    def number(subindex: int) -> int:
        return eds.dictionary.number(Index.IDENTITY, subindex) or eds.numbers[subindex - 1]

    return Identity(
        device_type=profile_number(eds.dictionary),
        vendor_id=number(1),
        product_code=number(2),
        revision_number=number(3),
    )


def identity_text(identity: Identity) -> str:
    """Write an identity for a person."""
    return (
        f'vendor 0x{identity.vendor_id:08X}, product 0x{identity.product_code:08X}, '
        f'revision 0x{identity.revision_number:08X}'
    )


def match_eds(identity: Identity, candidates: Sequence[Eds]) -> Match:
    """Return the EDS of a device, which says 0 where it says nothing; equal files count once.

    Raises:
        NoMatchError: None fits.
        SeveralMatchError: Several fit equally well.
    """
    if not identity.vendor_id or not identity.product_code:
        raise NoMatchError('it does not say who it is (0x1018)')
    fitting = [
        (likeness, eds) for eds in candidates if (likeness := _likeness(identity, eds)) is not None
    ]
    if not fitting:
        known = [
            f'{eds.path.name} is for {identity_text(eds_identity(eds))}' for eds in candidates
        ]
        raise NoMatchError(f'no EDS fits ({"; ".join(known) or "none is given"})')
    best = max(likeness for likeness, _ in fitting)
    chosen = [eds for likeness, eds in fitting if likeness == best]
    contents = {eds.path.read_bytes() for eds in chosen}
    if len(contents) > 1:
        names = ', '.join(str(eds.path) for eds in chosen)
        raise SeveralMatchError(f'several EDS fit equally well: {names}')
    return Match(chosen[0], WORDS[best])


def _likeness(identity: Identity, eds: Eds) -> int | None:
    """Return how well an EDS fits, as a number of WORDS; None where it is of another device."""
    described = eds_identity(eds)
    profile = identity.device_type & PROFILE_MASK
    if profile and described.device_type and profile != described.device_type:
        return None
    if (described.vendor_id, described.product_code) != (
        identity.vendor_id,
        identity.product_code,
    ):
        return None
    if described.revision_number == identity.revision_number:
        return 2
    if described.revision_number >> MAJOR_SHIFT == identity.revision_number >> MAJOR_SHIFT:
        return 1
    return 0
