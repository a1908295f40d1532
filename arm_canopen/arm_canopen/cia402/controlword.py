# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The controlword of an axis on its way out: by RPDO, or by SDO while the RPDO is kept back."""

from __future__ import annotations

from ..master.process_image import SentRpdo
from ..master.remote_node import RemoteNode


class ControlwordOutput:
    """The controlword of one axis, and the RPDOs that carry it.

    Attributes:
        writer: Writes it into the process image, or by SDO where no RPDO carries it.
        outputs: The RPDOs that carry it.
    """

    def __init__(self, node: RemoteNode, index: int) -> None:
        self.writer = node.objects.writer(index)
        self.outputs: list[SentRpdo] = [
            output
            for output in node.image.rpdos
            if any(mapped.index == index for mapped in output.config.mapping)
        ]

    @property
    def kept_back(self) -> bool:
        """Whether an RPDO with the controlword is kept back, for this axis or another one."""
        for output in self.outputs:  # noqa: SIM110  # in every cycle: half of what any() costs
            if output.kept_back_by:
                return True
        return False

    @property
    def keeps_back(self) -> bool:
        """Whether it is kept back for this axis."""
        return any(self in output.kept_back_by for output in self.outputs)

    def keep_back(self) -> None:
        """Keep every RPDO back that carries the controlword of this axis."""
        for output in self.outputs:
            output.kept_back_by.add(self)

    def send_again(self) -> None:
        """Send them again, as far as no other axis keeps them back."""
        for output in self.outputs:
            output.kept_back_by.discard(self)

    def can_send(self, controlword: int) -> bool:
        """Set the controlword, and return whether the RPDOs that carry it can be sent with it."""
        try:
            self.writer.write(controlword)
            for output in self.outputs:
                output.frame()
        except Exception:  # noqa: BLE001  # whatever made the cycle fail may last
            return False
        return True
