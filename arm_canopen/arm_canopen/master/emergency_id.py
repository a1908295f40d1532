# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Under which identifier a device sends its EMCYs (CiA 301, 7.5.2.17)."""

from __future__ import annotations

from ..config.model import NodeConfig
from ..standard.cob_id import CAN_ID_MASK, COB_ID_INVALID, CobId
from ..standard.datatypes import DataType
from ..standard.objects import Index


def emergency_can_id(config: NodeConfig) -> int | None:
    """Return the identifier: as bus.yml writes 0x1014, else as in the EDS, else the usual one.

    None when the device shall send none.
    """
    value = config.value_after_boot(Index.EMCY_COB_ID, data_type=DataType.UNSIGNED32)
    if not isinstance(value, int):
        return CobId.EMCY + config.node_id
    return None if value & COB_ID_INVALID else value & CAN_ID_MASK
