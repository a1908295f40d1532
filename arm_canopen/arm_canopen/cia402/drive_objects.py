# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The objects of one drive, bound to its process image once (CiA 402-2)."""

from __future__ import annotations

from collections.abc import Mapping
import math

from canopen_core.standard import (
    AXIS_OFFSET,
    drive_state,
    DriveState,
    Index,
    OperationMode,
    TARGET_OBJECTS,
)

from ..master.process_image import ReceivedTpdo, SentRpdo, Writer
from ..master.remote_node import RemoteNode


class DriveObjects:
    """What the master reads from and writes to a drive in each cycle, in device units."""

    def __init__(self, node: RemoteNode, channel: int = 0) -> None:
        """Bind each object to its PDO; what the drive has but no PDO carries goes by SDO."""
        self._node = node
        self._offset = AXIS_OFFSET * channel
        self._statusword = node.objects.reader(self.at(Index.STATUSWORD))
        self._mode = node.objects.reader(self.at(Index.MODE_OF_OPERATION_DISPLAY))
        self._position = node.objects.reader(self.at(Index.POSITION_ACTUAL))
        self._velocity = node.image.reader(self.at(Index.VELOCITY_ACTUAL))
        self._torque = node.image.reader(self.at(Index.TORQUE_ACTUAL))
        polled_mode = node.image.reader(self.at(Index.MODE_OF_OPERATION_DISPLAY)) is None
        state = [self._statusword, self._position, self._velocity, self._torque]
        state += [] if polled_mode else [self._mode]
        # several objects come in one TPDO, which is looked at once
        self._sources = list(
            dict.fromkeys(reader.source for reader in state if reader is not None)
        )
        self.controlword = node.objects.writer(self.at(Index.CONTROLWORD))
        self.mode = node.objects.writer(self.at(Index.MODE_OF_OPERATION))
        self._controlling = [
            output
            for output in node.image.rpdos
            if any(mapped.index == self.at(Index.CONTROLWORD) for mapped in output.config.mapping)
        ]

    def at(self, index: int) -> int:
        """Return the index of an object of the profile for this axis."""
        return index + self._offset

    def observe(self) -> tuple[int, float] | None:
        """Return statusword and position in [inc], None before the drive has sent its state.

        For the cycle: everything is looked at once.
        """
        word, position = self._statusword.value, self._position.value
        if word is None or position is None or self._mode.value is None:
            return None
        return int(word), position

    def is_controlled_by(self, output: SentRpdo) -> bool:
        """Return whether an RPDO carries the controlword of this axis."""
        return output in self._controlling

    @property
    def controlword_muted(self) -> bool:
        """Whether an RPDO with the controlword of this axis is kept back, for whichever axis."""
        for output in self._controlling:  # noqa: SIM110  # in every cycle, as in fresh()
            if output.kept_back_by:
                return True
        return False

    @property
    def mutes_controlword(self) -> bool:
        """Whether it is kept back for this axis."""
        return any(self in output.kept_back_by for output in self._controlling)

    def mute_controlword(self) -> None:
        """Keep every RPDO back that carries the controlword of this axis."""
        for output in self._controlling:
            output.kept_back_by.add(self)

    def unmute_controlword(self) -> None:
        """Send them again, as far as no other axis keeps them back."""
        for output in self._controlling:
            output.kept_back_by.discard(self)

    def can_send(self, controlword: int) -> bool:
        """Set the controlword, and return whether the RPDOs that carry it can be sent with it."""
        try:
            self.controlword.write(controlword)
            for output in self._controlling:
                output.frame()
        except Exception:  # noqa: BLE001  # whatever made the cycle fail may last
            return False
        return True

    def fresh(self, now: float) -> bool:
        """Return whether the state is known and young enough to act on, at a steady time in [s].

        A mode of operation that is read by SDO does not count: the cycle needs no SDO.
        """
        if self._mode.value is None:
            return False
        for source in self._sources:  # noqa: SIM110  # in every cycle: half of what all() costs
            if source.stale(now):
                return False
        return True

    def statusword_came(self, since: float) -> bool:
        """Return whether 0x6041 has come since a time in [s]; one that comes on change has."""
        source = self._statusword.source
        return source.timestamp > since or source.stale_after == math.inf

    @property
    def timestamp(self) -> float:
        """Steady time of the oldest value of the state in [s]."""
        return min(source.timestamp for source in self._sources)

    @property
    def position_timestamp(self) -> float:
        """Steady time of 0x6064 in [s]."""
        return self._position.source.timestamp

    @property
    def statusword(self) -> int:
        """0x6041; 0 while unknown."""
        return int(self._statusword.value or 0)

    @property
    def state(self) -> DriveState:
        """State that the statusword shows."""
        word = self._statusword.value
        return DriveState.UNKNOWN if word is None else drive_state(int(word))

    @property
    def mode_display(self) -> int:
        """0x6061; 0 while unknown."""
        return int(self._mode.value or 0)

    @property
    def position(self) -> float | None:
        """0x6064 in [inc]; None while unknown."""
        return self._position.value

    @property
    def velocity(self) -> float | None:
        """0x606C in device units; None when no PDO carries it, or it is unknown."""
        return self._velocity.value if self._velocity is not None else None

    @property
    def position_is_polled(self) -> bool:
        """Whether 0x6064 comes by SDO, because no PDO carries it."""
        return self._node.image.reader(self.at(Index.POSITION_ACTUAL)) is None

    @property
    def position_comes_on_change(self) -> bool:
        """Whether a TPDO carries 0x6064 when it changes, so that silence shows rest."""
        source = self._position.source
        return isinstance(source, ReceivedTpdo) and not source.synchronous

    @property
    def torque(self) -> float:
        """0x6077 in device units; 0 when no PDO carries it."""
        return (self._torque.value or 0) if self._torque is not None else 0

    def target_writer(self, index: int, subindex: int = 0) -> Writer | None:
        """Return a writer for a target object that a PDO carries, else None."""
        return self._node.image.writer(self.at(index), subindex)

    def profile_target_writer(self, mode: OperationMode) -> Writer | None:
        """Return a writer for the target of a profile mode, by SDO where no PDO carries it."""
        index, subindex = TARGET_OBJECTS[mode]
        entry = self._node.config.dictionary.get(self.at(index), subindex)
        writer = self._node.objects.writer(self.at(index), subindex)
        return None if writer.by_sdo and (entry is None or not entry.access.writable) else writer

    def held_position(self, mode: OperationMode, offsets: Mapping[int, int]) -> int | None:
        """Position that a cyclic mode commands by RPDO in [inc], None when none carries it."""
        interpolated = mode is OperationMode.INTERPOLATED_POSITION
        place = (Index.INTERPOLATION_DATA, 1) if interpolated else (Index.TARGET_POSITION, 0)
        value = self._node.image.commanded(self.at(place[0]), place[1])
        if value is None:
            return None
        return int(value) + (0 if interpolated else self.offset(Index.POSITION_OFFSET, offsets))

    def offset(self, index: Index, offsets: Mapping[int, int]) -> int:
        """Return what the drive adds to a target: as the RPDOs carry it, else as it was read."""
        value = self._node.image.commanded(self.at(index))
        return offsets.get(index, 0) if value is None else int(value)

    def must_lead(self, index: int, subindex: int = 0) -> bool:
        """Whether an object has to leave a cycle before the controlword that commands it."""
        command = self.at(Index.CONTROLWORD)
        return not self._node.image.is_applied_first(self.at(index), subindex, command=command)
