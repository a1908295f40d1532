# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What a device holds in the objects of its RPDOs, so that the first RPDOs change nothing."""

from __future__ import annotations

from contextlib import suppress

from ..exceptions import BootError, CodecError, SdoAbortError, SdoError
from ..standard.datatypes import decode
from ..standard.objects import AXIS_OFFSET, Index, OFFSETS
from ..standard.pdo import MappedObject, Number
from .process_image import Output
from .remote_node import RemoteNode
from .start_values import start_value

AXES_START = 0x6000  # objects of the first axis of a drive
DUMMY_MAX = 0x001F  # objects below stand for gaps in a mapping (CiA 301, 7.4.7.1)


async def preset_outputs(node: RemoteNode) -> None:
    """Let each RPDO of a device in operation carry what the device has in the mapped objects now.

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
    """Let each RPDO of a device that was configured carry what the device has.

    What its driver commands is left to the driver, except for the mode of operation: the drive may
    be one that must not be sent mode 0. What cannot be read is taken from bus.yml or the EDS.

    Args:
        node: The device.
        timeout: How long each SDO answer may take in [s].

    Raises:
        SdoError: The device does not answer.
    """
    for output, position, mapped in _mapped(node):
        entry = node.config.dictionary.get(mapped.index, mapped.subindex)
        value = start_value(node.config, mapped)
        readable = entry is None or entry.access.readable
        if readable and not _is_led(node, mapped.index):
            with suppress(SdoAbortError, CodecError):
                value = await _present(node, mapped, timeout)
        output.values[position] = value


def _is_led(node: RemoteNode, index: int) -> bool:
    """Tell whether the driver of a drive says what an object carries."""
    first_axis = index - (index - AXES_START) // AXIS_OFFSET * AXIS_OFFSET
    if first_axis == Index.MODE_OF_OPERATION:
        return False
    offset = node.config.is_drive and first_axis in OFFSETS
    return offset or index in node.config.commanded_indices


def _mapped(node: RemoteNode) -> list[tuple[Output, int, MappedObject]]:
    return [
        (output, position, mapped)
        for output in node.image.outputs
        for position, mapped in enumerate(output.config.mapping)
        if mapped.index > DUMMY_MAX
    ]


async def _present(node: RemoteNode, mapped: MappedObject, timeout: float) -> Number:
    value = decode(mapped.data_type, await node.sdo.read(mapped.index, mapped.subindex, timeout))
    if not isinstance(value, (int, float)):
        raise CodecError(f'{_place(mapped)} is no number')
    return value


def _place(mapped: MappedObject) -> str:
    return f'0x{mapped.index:04X}:{mapped.subindex:02X}'
