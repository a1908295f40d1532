# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Network management: commands, states and heartbeats (CiA 301, 7.2.8)."""

from __future__ import annotations

from enum import IntEnum
from typing import NamedTuple

from .cob_id import NODE_ID_MAX, NODE_ID_MIN


class NmtCommand(IntEnum):
    """Command specifier of an NMT node control frame (CiA 301, 7.2.8.3.1)."""

    START = 0x01
    STOP = 0x02
    ENTER_PRE_OPERATIONAL = 0x80
    RESET_NODE = 0x81
    RESET_COMMUNICATION = 0x82


class NmtState(IntEnum):
    """NMT state as a heartbeat carries it (CiA 301, 7.2.8.3.2.2)."""

    BOOT_UP = 0x00
    STOPPED = 0x04
    OPERATIONAL = 0x05
    PRE_OPERATIONAL = 0x7F


class ConsumerHeartbeatTime(NamedTuple):
    """An entry of 0x1016: whose heartbeat is awaited, and how long (CiA 301, 7.5.2.17)."""

    node_id: int  # node id of the producer, bits 16 to 23
    time_ms: int  # time after which it counts as lost in [ms], bits 0 to 15

    @classmethod
    def parse(cls, word: int) -> ConsumerHeartbeatTime:
        """Split the value of an entry."""
        return cls(word >> 16 & 0xFF, word & 0xFFFF)

    @property
    def word(self) -> int:
        """The value of the entry."""
        return self.node_id << 16 | self.time_ms

    @property
    def used(self) -> bool:
        """Whether it awaits anybody; no time, or no node id, is an entry that is not used."""
        return bool(self.time_ms) and NODE_ID_MIN <= self.node_id <= NODE_ID_MAX


ALL_NODES = 0

RESETS = frozenset({NmtCommand.RESET_NODE, NmtCommand.RESET_COMMUNICATION})
"""Commands after which a device sends its boot-up message."""

COMMANDED_STATES: dict[NmtCommand, NmtState] = {
    NmtCommand.START: NmtState.OPERATIONAL,
    NmtCommand.STOP: NmtState.STOPPED,
    NmtCommand.ENTER_PRE_OPERATIONAL: NmtState.PRE_OPERATIONAL,
}
"""States in which a device stays after a command (CiA 301, figure 48)."""


def nmt_frame(command: NmtCommand, node_id: int = ALL_NODES) -> bytes:
    """Return the data of an NMT command for one node, or for all with id 0."""
    return bytes((command, node_id))


def parse_nmt(data: bytes) -> tuple[NmtCommand, int] | None:
    """Return command and node id (0 for all) of an NMT frame, None when it is none."""
    if len(data) != 2:
        return None
    try:
        return NmtCommand(data[0]), data[1]
    except ValueError:
        return None


def nmt_addressee(node_id: int) -> str:
    """Return the addressee of an NMT command in words."""
    return 'all nodes' if node_id == ALL_NODES else f'node {node_id}'


def parse_heartbeat(data: bytes) -> NmtState | None:
    """Return the state in a heartbeat or boot-up frame, None when it is none.

    Bit 7 (the toggle bit of node guarding) is ignored.
    """
    if len(data) != 1:
        return None
    try:
        return NmtState(data[0] & 0x7F)
    except ValueError:
        return None
