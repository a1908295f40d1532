# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Describes frames of a bus with names from bus.yml and EDS files, and filters them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import Enum
import re
from typing import TypeAlias

from arm_canopen.config import BusConfig, NodeConfig, PdoConfig
from canopen_core import CodecError
from canopen_core.can import error_text, EXTENDED_ID_MAX, Frame
from canopen_core.standard import (
    ALL_NODES,
    CAN_ID_MASK,
    COB_ID_INVALID,
    CobId,
    decode_time_of_day,
    Emergency,
    Index,
    NmtCommand,
    NmtState,
    NODE_ID_MAX,
    object_address,
    parse_heartbeat,
    PdoCodec,
)

from .sdo_follower import ObjectNames, SdoFollower, value_text


class FrameKind(Enum):
    """Services of CANopen (CiA 301, 7.2; CiA 305), and other kinds of frames."""

    NMT = 'nmt'
    SYNC = 'sync'
    EMCY = 'emcy'
    TIME = 'time'
    PDO = 'pdo'
    SDO = 'sdo'
    HEARTBEAT = 'heartbeat'
    ERROR = 'error'  # error frame of the CAN controller
    OTHER = 'other'


@dataclass(frozen=True, slots=True)
class Description:
    """What a frame means."""

    kind: FrameKind  # its service
    # Name of the service, e.g. ``TPDO1``; ``SDO >`` goes to the device, ``SDO <`` comes from it.
    label: str
    node: str = ''  # device that sends or receives the frame; empty for all
    text: str = ''  # decoded content; empty if there is nothing to add
    is_alert: bool = False  # whether it is an emergency, an abort or an error
    node_id: int = 0  # of that device; 0 for all

    def __str__(self) -> str:
        """Return the description as one line."""
        head = f'{self.label} {self.node}'.rstrip()
        return f'{head}  {self.text}' if self.text else head


_Test: TypeAlias = Callable[[Frame, Description], bool]
_IDENTIFIER = re.compile(r'(?:0x)?([0-9A-Fa-f]{1,8})(?::(?:0x)?([0-9A-Fa-f]{1,8}))?')
_NODE = 'node:'
_NOT = '^'


class FrameFilter:
    """Selects frames that match one of its terms, but none with a prefix ``^``.

    =====================  ==================================================================
    ``sdo``, ``emcy`` ...   a service, by the names of :class:`FrameKind`
    ``node:panda_joint1``  a device by name, or by number as in ``node:2``
    ``181``, ``180:780``   an identifier in hexadecimal, with a mask after the colon
    =====================  ==================================================================
    """

    def __init__(self, terms: Sequence[str] = ()) -> None:
        """Parse terms of the table above; a string may contain several, separated by commas.

        Raises:
            ValueError: A term is invalid.
        """
        words = [word.strip() for term in terms for word in term.split(',') if word.strip()]
        self._wanted = [_test(word) for word in words if not word.startswith(_NOT)]
        self._unwanted = [_test(word[1:]) for word in words if word.startswith(_NOT)]

    def shows(self, frame: Frame, description: Description) -> bool:
        """Return whether a frame passes the filter."""
        if any(test(frame, description) for test in self._unwanted):
            return False
        return not self._wanted or any(test(frame, description) for test in self._wanted)


def _test(word: str) -> _Test:
    lowered = word.lower()
    kinds = {kind.value: kind for kind in FrameKind}
    if lowered in kinds:
        return lambda _, description: description.kind is kinds[lowered]
    if lowered.startswith(_NODE):
        node = word[len(_NODE) :]
        if node.isdecimal():
            return lambda _, description: description.node_id == int(node)
        return lambda _, description: description.node == node
    match = _IDENTIFIER.fullmatch(word)
    if match is None:
        raise ValueError(
            f'unknown filter {word!r}; choose one of {", ".join(kinds)}, `node:NAME`, '
            'or an identifier such as 181 or 180:780'
        )
    can_id = int(match[1], 16)
    mask = int(match[2], 16) if match[2] else EXTENDED_ID_MAX
    return lambda frame, _: frame.can_id & mask == can_id & mask


_Handler: TypeAlias = Callable[[Frame], Description]
_NODE_MASK = 0x7F
_FUNCTION_MASK = 0x780
_PDO_FUNCTIONS: dict[int, str] = {
    CobId.TPDO1 + 0x100 * number: f'TPDO{number + 1}' for number in range(4)
} | {CobId.RPDO1 + 0x100 * number: f'RPDO{number + 1}' for number in range(4)}
"""Function code and name of the PDOs of the pre-defined connection set (CiA 301, table 38)."""


class FrameDescriber:
    """Describes frames as text; call it with frames in bus order.

    It tracks SDO transfers, so that segments are shown with their object and the whole value.
    COB-IDs from bus.yml take precedence over those of the pre-defined connection set.
    """

    def __init__(self, config: BusConfig | None = None) -> None:
        """Load names of a bus; without config, devices have numbers and PDOs no objects."""
        self._names: dict[int, str] = {}
        self._objects: dict[int, ObjectNames] = {}
        self._sdo: dict[int, SdoFollower] = {}
        self._handlers: dict[int, _Handler] = {
            CobId.NMT: self._nmt,
            CobId.SYNC: self._sync,
            CobId.TIME: self._time,
        }
        self._functions: dict[int, Callable[[int, Frame], Description]] = {
            CobId.EMCY: self._emcy,
            CobId.SDO_REQUEST: self._sdo_frame,
            CobId.SDO_RESPONSE: self._sdo_frame,
            CobId.HEARTBEAT: self._heartbeat,
        }
        if config is not None:
            self._names[config.master.node_id] = config.master.name
            for node in config.nodes:
                self._add(node)

    def _add(self, node: NodeConfig) -> None:
        self._names[node.node_id] = node.name
        self._objects[node.node_id] = ObjectNames(node.dictionary)
        if (cob_id := _cob_id(node, Index.SYNC_COB_ID)) is not None:
            self._handlers.setdefault(cob_id, self._sync)
        if (cob_id := node.emergency_id) is not None:
            self._handlers.setdefault(cob_id, lambda frame: self._emcy(node.node_id, frame))
        names = self._objects[node.node_id]
        for prefix, pdos in (('TPDO', node.tpdos), ('RPDO', node.rpdos)):
            for pdo in pdos:
                if pdo.enabled:
                    self._handlers[pdo.cob_id] = _pdo(f'{prefix}{pdo.number}', node, pdo, names)

    def describe(self, frame: Frame) -> Description:
        """Return the meaning of a frame; never raises for unknown frames."""
        if frame.is_error:
            return Description(FrameKind.ERROR, 'CAN error', '', error_text(frame), is_alert=True)
        if frame.is_extended:
            return Description(FrameKind.OTHER, 'unknown', '', '29-bit identifier')
        if frame.is_remote:
            return self._request(frame)
        handler = self._handlers.get(frame.can_id)
        return handler(frame) if handler else self._by_function(frame)

    def node_name(self, node_id: int) -> str:
        """Return the name of a device, or its number without a name."""
        return self._names.get(node_id) or f'node {node_id}'

    def _by_function(self, frame: Frame) -> Description:
        """Describe a frame by the pre-defined connection set."""
        node_id, code = frame.can_id & _NODE_MASK, frame.can_id & _FUNCTION_MASK
        if node_id:
            if code in self._functions:
                return self._functions[code](node_id, frame)
            if code in _PDO_FUNCTIONS:
                node = self.node_name(node_id)
                return Description(FrameKind.PDO, _PDO_FUNCTIONS[code], node, node_id=node_id)
        return Description(FrameKind.OTHER, 'unknown')

    def _request(self, frame: Frame) -> Description:
        """Describe a remote request by the requested frame."""
        node_id, code = frame.can_id & _NODE_MASK, frame.can_id & _FUNCTION_MASK
        if code == CobId.HEARTBEAT and node_id:
            node = self.node_name(node_id)
            return Description(
                FrameKind.HEARTBEAT, 'node guard', node, 'state requested', node_id=node_id
            )
        handler = self._handlers.get(frame.can_id)
        wanted = handler(frame) if handler else self._by_function(frame)
        return Description(
            wanted.kind, wanted.label, wanted.node, 'requested', node_id=wanted.node_id
        )

    def _nmt(self, frame: Frame) -> Description:
        if len(frame.data) != 2 or frame.data[1] > NODE_ID_MAX:
            return Description(FrameKind.NMT, 'NMT', '', 'no valid command', is_alert=True)
        command, node_id = frame.data
        try:
            text = NmtCommand(command).name.replace('_', ' ').lower()
        except ValueError:
            text = f'unknown command 0x{command:02X}'
        node = 'all nodes' if node_id == ALL_NODES else self.node_name(node_id)
        return Description(FrameKind.NMT, 'NMT', node, text, node_id=node_id)

    @staticmethod
    def _sync(frame: Frame) -> Description:
        counter = f'counter {frame.data[0]}' if frame.data else ''
        return Description(FrameKind.SYNC, 'SYNC', '', counter)

    @staticmethod
    def _time(frame: Frame) -> Description:
        try:
            moment = decode_time_of_day(frame.data)
        except CodecError as error:
            return Description(FrameKind.TIME, 'TIME', '', str(error))
        text = moment.strftime('%Y-%m-%d %H:%M:%S.') + f'{moment.microsecond // 1000:03d}'
        return Description(FrameKind.TIME, 'TIME', '', text)

    def _emcy(self, node_id: int, frame: Frame) -> Description:
        try:
            emergency = Emergency.decode(frame.data)
        except CodecError as error:
            text, is_alert = str(error), True
        else:
            text, is_alert = str(emergency), not emergency.is_reset
        return Description(
            FrameKind.EMCY, 'EMCY', self.node_name(node_id), text, is_alert, node_id
        )

    def _heartbeat(self, node_id: int, frame: Frame) -> Description:
        state = parse_heartbeat(frame.data)
        label = 'boot-up' if state is NmtState.BOOT_UP else 'heartbeat'
        if state is None:
            text = f'unknown state {frame.data.hex(" ")}'.rstrip()
        elif state is NmtState.BOOT_UP:
            text = ''
        else:
            text = state.name.replace('_', '-').lower()
        return Description(
            FrameKind.HEARTBEAT, label, self.node_name(node_id), text, node_id=node_id
        )

    def _sdo_frame(self, node_id: int, frame: Frame) -> Description:
        follower = self._sdo.get(node_id)
        if follower is None:
            names = self._objects.get(node_id) or ObjectNames()
            follower = self._sdo[node_id] = SdoFollower(names)
        is_request = frame.can_id & _FUNCTION_MASK == CobId.SDO_REQUEST
        step = (follower.request if is_request else follower.response)(frame.data)
        label, node = 'SDO >' if is_request else 'SDO <', self.node_name(node_id)
        return Description(FrameKind.SDO, label, node, step.text, step.is_abort, node_id)


def _cob_id(node: NodeConfig, index: Index) -> int | None:
    """Return the EDS default COB-ID of a service; None without one."""
    value = node.dictionary.number(index)
    return None if value is None or value & COB_ID_INVALID else value & CAN_ID_MASK or None


def _pdo(label: str, node: NodeConfig, pdo: PdoConfig, names: ObjectNames) -> _Handler:
    """Return a handler that lists a PDO's objects and values; label is e.g. ``TPDO1``."""
    codec = PdoCodec(pdo.mapping)
    titles = [
        names.name(entry.index, entry.subindex) or object_address(entry.index, entry.subindex)
        for entry in pdo.mapping
    ]

    def describe(frame: Frame) -> Description:
        try:
            values = zip(titles, codec.objects, codec.unpack(frame.data), strict=True)
            text = '  '.join(
                f'{title}={value_text(entry.index, entry.subindex, value)}'
                for title, entry, value in values
            )
            is_alert = False
        except CodecError as error:
            text, is_alert = str(error), not frame.is_remote
        return Description(FrameKind.PDO, label, node.name, text, is_alert, node.node_id)

    return describe
