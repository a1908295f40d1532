# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Going on where another master has left a device, so that the first RPDOs change nothing."""

from __future__ import annotations

from ..exceptions import BootError, CodecError, SdoError
from ..standard.datatypes import decode
from .remote_node import RemoteNode

DUMMY_MAX = 0x001F  # objects below stand for gaps in a mapping (CiA 301, 7.4.7.1)


async def preset_outputs(node: RemoteNode) -> None:
    """Let each RPDO carry what the device has in the mapped objects now.

    Raises:
        BootError: A mapped object cannot be read, so that the RPDO would bring something new.
    """
    for output in node.image.outputs:
        for position, mapped in enumerate(output.config.mapping):
            if mapped.index <= DUMMY_MAX:
                continue
            place = f'0x{mapped.index:04X}:{mapped.subindex:02X}'
            try:
                data = await node.sdo.read(mapped.index, mapped.subindex, node.config.sdo_timeout)
                value = decode(mapped.data_type, data)
            except (SdoError, CodecError) as error:
                raise BootError(
                    f'{node.name} cannot be taken over, as {place} in one of its RPDOs is not '
                    f'known: {error}'
                ) from error
            if not isinstance(value, (int, float)):
                raise BootError(f'{node.name} cannot be taken over: {place} is no number')
            output.values[position] = value
