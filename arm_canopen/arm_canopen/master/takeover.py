# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What a device holds in the objects of its RPDOs, so that the first RPDOs change nothing."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace

from canopen_core import BootError, CodecError, SdoAbortError, SdoError
from canopen_core.standard import (
    axis_of,
    AXIS_OFFSET,
    decode,
    Index,
    MappedObject,
    Number,
    object_address,
    OFFSETS,
    OperationMode,
    TARGET_OBJECTS,
)

from .process_image import SentRpdo
from .remote_node import RemoteNode
from .remote_objects import start_value

DUMMY_MAX = 0x001F  # objects below stand for gaps in a mapping (CiA 301, 7.4.7.1)
POSITION_TARGETS = {
    TARGET_OBJECTS[mode]
    for mode in (OperationMode.CYCLIC_POSITION, OperationMode.INTERPOLATED_POSITION)
}


async def preset_outputs(node: RemoteNode) -> None:
    """Set each RPDO of a device in operation to what the mapped objects hold now.

    Raises:
        BootError: A mapped object cannot be read, so that the RPDO would bring something new.
    """
    for output, position, mapped in _mapped(node):
        try:
            value = await _present(node, mapped, node.config.sdo_timeout)
        except (SdoError, CodecError) as error:
            raise BootError(
                f'{node.name} cannot be taken over, as {_place(mapped)} in one of its RPDOs is '
                f'not known: {error}'
            ) from error
        output.values[position] = value


async def read_outputs(node: RemoteNode, timeout: float) -> None:
    """Set each RPDO of a configured device to what the device holds.

    What its driver commands is left to the driver, except for the mode of operation, as the drive
    may be one that must not be sent mode 0, and for the position targets: they are where the drive
    is, before any TPDO shows it. What cannot be read is taken from bus.yml or the EDS.

    Raises:
        SdoError: The device does not answer.
    """
    read: dict[tuple[int, int], Number | None] = {}  # several targets start with one position
    for output, position, mapped in _mapped(node):
        value, source = None, _source(node, mapped)
        if source is not None and _is_readable(node, source):
            address = source.index, source.subindex
            if address not in read:
                read[address] = None
                with suppress(SdoAbortError, CodecError):
                    read[address] = await _present(node, source, timeout)
            value = read[address]
        output.values[position] = start_value(node.config, mapped) if value is None else value


def _is_readable(node: RemoteNode, mapped: MappedObject) -> bool:
    entry = node.config.dictionary.get(mapped.index, mapped.subindex)
    return entry is None or entry.access.readable


def _source(node: RemoteNode, mapped: MappedObject) -> MappedObject | None:
    """Return the object with the first value of an RPDO; None where the driver has it."""
    index = mapped.index
    first_axis, axis = axis_of(index)
    if node.config.is_drive and (first_axis, mapped.subindex) in POSITION_TARGETS:
        return replace(mapped, index=Index.POSITION_ACTUAL + AXIS_OFFSET * axis, subindex=0)
    if first_axis == Index.MODE_OF_OPERATION:
        return mapped
    offset = node.config.is_drive and first_axis in OFFSETS
    return None if offset or index in node.config.commanded_indices else mapped


def _mapped(node: RemoteNode) -> list[tuple[SentRpdo, int, MappedObject]]:
    return [
        (output, position, mapped)
        for output in node.image.rpdos
        for position, mapped in enumerate(output.config.mapping)
        if mapped.index > DUMMY_MAX
    ]


async def _present(node: RemoteNode, mapped: MappedObject, timeout: float) -> Number:
    value = decode(mapped.data_type, await node.sdo.read(mapped.index, mapped.subindex, timeout))
    if not isinstance(value, (int, float)):
        raise CodecError(f'{_place(mapped)} is no number')
    return value


def _place(mapped: MappedObject) -> str:
    return object_address(mapped.index, mapped.subindex)
