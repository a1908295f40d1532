# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""All SDO channels of a device: the default one, and those of 0x1201 to 0x127F."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from arm_canopen.can import Frame
from arm_canopen.standard import CAN_ID_MASK, COB_ID_INVALID, CobId, Index

from ..objects.cob_id_rules import check_cob_id
from ..objects.object_store import ObjectStore
from ..timed import NEVER
from .sdo_server import SdoServer

CHANNELS_MAX = 128  # SDO servers of a device (CiA 301, 7.5.2.33)


class SdoServers:
    """The SDO servers of a device, each with a transfer of its own.

    Attributes:
        default: The server of the pre-defined connection set.
    """

    def __init__(
        self,
        node_id: int,
        store: ObjectStore,
        send: Callable[[Frame], None],
        changed: Callable[[], None],
    ) -> None:
        """Bind 0x1201 and those after it, as far as the dictionary has them.

        Args:
            node_id: Id of the device.
            store: Its objects.
            send: Takes the frames.
            changed: Called when requests have other identifiers from now on.
        """
        self._store = store
        self._send = send
        self._changed = changed
        self.default = SdoServer(
            CobId.SDO_REQUEST + node_id, CobId.SDO_RESPONSE + node_id, store, send
        )
        first = int(Index.SDO_SERVER) + 1
        self._objects = [
            (store.integer(index, 1), store.integer(index, 2))
            for index in range(first, first + CHANNELS_MAX - 1)
            if store.dictionary.has_index(index)
        ]
        for pair in self._objects:
            for variable in pair:
                variable.check = partial(check_cob_id, variable)
                variable.listener = self._reconfigure
        self._channels: dict[int, SdoServer] = {}
        self.configure()

    @property
    def node_id(self) -> int:
        """Id of the device."""
        return self.default.can_id - CobId.SDO_REQUEST

    @node_id.setter
    def node_id(self, node_id: int) -> None:
        self.default.can_id = CobId.SDO_REQUEST + node_id
        self.default.response_id = CobId.SDO_RESPONSE + node_id
        self.configure()

    @property
    def can_ids(self) -> tuple[int, ...]:
        """Identifiers of the requests."""
        return tuple(self._channels)

    @property
    def response_ids(self) -> tuple[int, ...]:
        """Identifiers of the answers."""
        return tuple(server.response_id for server in self._channels.values())

    @property
    def deadline(self) -> float:
        """Steady time in [s] at which the transfer of a silent client is aborted."""
        return min((server.deadline for server in self._channels.values()), default=NEVER)

    def configure(self) -> None:
        """Serve the channels that exist; those that stay keep their transfer."""
        channels = {self.default.can_id: self.default}
        for request, response in self._objects:
            if not (request.value | response.value) & COB_ID_INVALID:
                ids = request.value & CAN_ID_MASK, response.value & CAN_ID_MASK
                old = self._channels.get(ids[0])
                same = old is not None and old.response_id == ids[1]
                new = SdoServer(*ids, self._store, self._send)
                channels.setdefault(ids[0], old if old is not None and same else new)
        self._channels = channels

    def reset(self) -> None:
        """Forget the transfers under way."""
        for server in self._channels.values():
            server.reset()

    def receive(self, frame: Frame, now: float) -> None:
        """Answer a request."""
        server = self._channels.get(frame.can_id)
        if server is not None:
            server.receive(frame, now)

    def advance(self, now: float) -> None:
        """Abort the transfers of clients that fell silent."""
        for server in self._channels.values():
            server.advance(now)

    def _reconfigure(self, _now: float) -> None:
        self.configure()
        self._changed()
