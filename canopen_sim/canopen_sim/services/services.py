# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Which service of a device takes which frames in its NMT state (CiA 301, table 46)."""

from __future__ import annotations

from dataclasses import dataclass

from arm_canopen.can import Frame
from arm_canopen.standard import CobId, LSS_REQUEST, NmtState

from ..deviations import Service
from ..line import Traffic
from .error_control import ErrorControl
from .lss_slave import LssSlave
from .nmt_slave import NmtSlave
from .rpdo import Handler, RpdoEngine
from .sdo_servers import SdoServers
from .sync_consumer import SyncConsumer
from .time_consumer import TimeConsumer
from .tpdo import TpdoEngine


@dataclass(frozen=True, slots=True)
class Services:
    """The services of one device that take frames."""

    nmt: NmtSlave
    lss: LssSlave
    sdo: SdoServers
    sync: SyncConsumer
    clock: TimeConsumer
    error_control: ErrorControl
    rpdos: RpdoEngine
    tpdos: TpdoEngine

    def handlers(self, on_sdo: Handler) -> dict[int, Handler]:
        """Return what the device does with the frames of each identifier, in its NMT state.

        Args:
            on_sdo: Takes the requests to its SDO servers.
        """
        state = self.nmt.state
        handlers: dict[int, Handler] = {CobId.NMT: self.nmt.receive, LSS_REQUEST: self.lss.receive}
        if state is not NmtState.BOOT_UP:
            watched = self.error_control.consumer
            handlers.update(dict.fromkeys(watched.can_ids, watched.receive))
        if state in (NmtState.PRE_OPERATIONAL, NmtState.OPERATIONAL):
            handlers.update((can_id, on_sdo) for can_id in self.sdo.can_ids)
            handlers[self.sync.can_id] = self.sync.receive
            if self.clock.can_id is not None:
                handlers[self.clock.can_id] = self.clock.receive
        if state is NmtState.OPERATIONAL:
            handlers.update(self.rpdos.handlers(self.tpdos.poll))
        return handlers

    def identify(self, frame: Frame, outgoing: bool) -> Traffic:
        """Return what a frame is to the device, which sends it or not."""
        can_id = frame.can_id
        if can_id in (self.sdo.response_ids if outgoing else self.sdo.can_ids):
            return Traffic(Service.SDO, outgoing)
        if can_id == CobId.HEARTBEAT + self.nmt.node_id:
            return Traffic(Service.HEARTBEAT if any(frame.data) else Service.BOOT_UP, outgoing)
        engine = self.tpdos if outgoing else self.rpdos
        number = 0 if frame.is_remote else engine.number_of(can_id)
        return Traffic(Service.PDO if number else Service.OTHER, outgoing, number)
