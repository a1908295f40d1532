# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What an RPDO carries before the device was read, or of an object that cannot be read."""

from __future__ import annotations

from ..config.model import NodeConfig
from ..exceptions import CodecError
from ..standard.pdo import MappedObject, Number, PdoCodec


def start_value(config: NodeConfig, mapped: MappedObject) -> Number:
    """Return the value that an object has by the files when the device is booted.

    An object that nobody commands (a torque limit, a profile velocity, digital outputs) must keep
    what bus.yml wrote or else what its EDS has as default.

    Returns:
        The value; 0 when neither has one that fits the object.
    """
    value = config.value_after_boot(mapped.index, mapped.subindex, mapped.data_type)
    if isinstance(value, (int, float)):
        try:
            PdoCodec([mapped]).pack([value])
        except CodecError:
            return 0
        return value
    return 0
