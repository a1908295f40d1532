# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""PDOs by the names and values of their objects."""

from __future__ import annotations

from arm_canopen import CodecError
from arm_canopen.can import Frame
from arm_canopen.config import NodeConfig, PdoConfig
from arm_canopen.standard import object_address, PdoCodec

from .description import Description, FrameKind
from .object_names import ObjectNames
from .value_text import value_text


class PdoDescriber:
    """Describes the frames of one PDO."""

    def __init__(self, label: str, node: NodeConfig, pdo: PdoConfig, names: ObjectNames) -> None:
        """Prepare the mapping; the label is like ``TPDO1``."""
        self._label = label
        self._node = node.name
        self._node_id = node.node_id
        self._codec = PdoCodec(pdo.mapping)
        self._titles = [
            names.name(entry.index, entry.subindex) or object_address(entry.index, entry.subindex)
            for entry in pdo.mapping
        ]

    def describe(self, frame: Frame) -> Description:
        """Name the objects of a frame with their values."""
        try:
            text, is_alert = self._values(frame.data), False
        except CodecError as error:
            text, is_alert = str(error), not frame.is_remote
        return Description(FrameKind.PDO, self._label, self._node, text, is_alert, self._node_id)

    def _values(self, data: bytes) -> str:
        words = []
        values = self._codec.unpack(data)
        for title, entry, value in zip(self._titles, self._codec.objects, values, strict=True):
            words.append(f'{title}={value_text(entry.index, entry.subindex, value)}')
        return '  '.join(words)
