# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Which EDS is that of a device, by vendor, product and revision: pure."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from arm_canopen.config import Identity
from canopen_core import CanopenError
from canopen_core.eds import Eds
from canopen_core.standard import Index, PROFILE_MASK, profile_number

MAJOR_SHIFT = 16  # of 0x1018:03: above it is the revision of the behaviour (CiA 301, 7.5.2.19)


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
