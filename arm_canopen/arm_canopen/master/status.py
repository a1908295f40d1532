# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Immutable snapshots of devices, for other threads."""

from __future__ import annotations

from dataclasses import dataclass, replace

from canopen_core.standard import Emergency, NmtState

from .remote_node import BootPhase, RemoteNode
from .sdo_channel import SdoCounters


@dataclass(frozen=True, slots=True)
class NodeStatus:
    """How a device was at one moment."""

    name: str  # name in bus.yml
    node_id: int  # CANopen node id
    online: bool  # booted, and not lost since
    nmt_state: NmtState | None  # NMT state as received, None before the first
    left_operational: bool  # online, but an NMT command took it out of Operational
    phase: BootPhase  # how far it has booted
    phase_detail: str  # what it is doing in that phase, or why it failed
    # time since the last heartbeat in [s]; None when there was none or none is supervised
    heartbeat_age: float | None
    emergency: Emergency | None  # last EMCY that the device did not take back
    emergencies: tuple[str, ...]  # the last EMCYs with their age, the newest first, in words
    missed_pdos: int  # TPDOs that did not answer a SYNC
    sdo: SdoCounters  # what became of the SDO transfers


def node_status(node: RemoteNode, now: float) -> NodeStatus:
    """Return a snapshot of a device."""
    seen = node.config.heartbeat_timeout > 0 and node.life.last > 0
    return NodeStatus(
        name=node.name,
        node_id=node.config.node_id,
        online=node.online,
        nmt_state=node.nmt_state,
        left_operational=node.left_operational,
        phase=node.phase,
        phase_detail=node.phase_detail,
        heartbeat_age=now - node.life.last if seen else None,
        emergency=node.emergencies.last,
        emergencies=tuple(
            f'{now - time:.1f} s ago {emergency}'
            for time, emergency in reversed(node.emergencies.history)
        ),
        missed_pdos=node.pdos.missed,
        sdo=replace(node.sdo.counters),
    )
