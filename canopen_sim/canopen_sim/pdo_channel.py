# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Base of RPDOs and TPDOs: their parameter objects, and the rules for writing them.

A PDO is changed while it is disabled (CiA 301, 7.5.2.36): set bit 31 of its COB-ID, set the
number of mapped objects to 0, write the mapping, then the number, then the COB-ID.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from functools import partial
from typing import Generic, TypeVar

from canopen_core import CodecError, SdoAbortError
from canopen_core.standard import (
    AbortCode,
    bit_length,
    CAN_ID_MASK,
    COB_ID_INVALID,
    mapped_place,
    MappedObject,
    ObjectEntry,
    PDO_BITS_MAX,
    PDO_COUNT_MAX,
    PdoCodec,
    RTR_FORBIDDEN,
    SYNCHRONOUS_MAX,
    Value,
)

from .object_store import check_cob_id, ObjectStore, refusal, Scalar, Variable

TRANSMISSION_EVENT = (254, 255)
INHIBIT_UNIT = 0.0001  # [s]
MILLISECOND = 0.001  # [s]


class PdoChannel(ABC):
    """One PDO: its communication record and its mapping."""

    transmission_types: frozenset[int]

    def __init__(
        self,
        store: ObjectStore,
        number: int,
        records: tuple[int, int],
        changed: Callable[[PdoChannel, float], None],
    ) -> None:
        """Bind the parameter objects of one PDO; ``number`` is their offset from the first PDO.

        The records are the communication and the mapping record. ``changed`` is called with the
        PDO and the time when a client has changed it.
        """
        self.number = number + 1  # from 1
        communication, mapping = (index + number for index in records)
        self._store = store
        self._cob_id = store.integer(communication, 1, default=COB_ID_INVALID)
        self._type = store.integer(communication, 2)
        self._inhibit = store.integer(communication, 3)  # [100 us]
        self._event = store.integer(communication, 5)  # [ms]
        self._sync_start = store.integer(communication, 6)
        self._count = store.integer(mapping)
        self._entries = [
            store.integer(mapping, entry.subindex)
            for entry in store.dictionary.subindices(mapping)
            if entry.subindex > 0
        ]
        self._install(changed)
        self.configure()

    def _install(self, changed: Callable[[PdoChannel, float], None]) -> None:
        def reconfigure(now: float) -> None:
            self.configure()
            changed(self, now)

        self._cob_id.check = partial(check_cob_id, self._cob_id)
        self._type.check = self._check_type
        self._inhibit.check = self._sync_start.check = self._check_disabled
        self._count.check = self._check_count
        for variable in self._entries:
            variable.check = self._check_entry
        for variable in (self._cob_id, self._type, self._inhibit, self._event, self._sync_start):
            variable.listener = reconfigure

    @property
    def is_synchronous(self) -> bool:
        """Whether SYNC triggers the PDO."""
        return self.transmission <= SYNCHRONOUS_MAX

    @property
    def is_event_driven(self) -> bool:
        """Whether events trigger the PDO."""
        return self.transmission in TRANSMISSION_EVENT

    @property
    def rtr_allowed(self) -> bool:
        """Whether remote frames may request the PDO."""
        return not self._cob_id.value & RTR_FORBIDDEN

    def configure(self) -> None:
        """Read the parameter objects; a PDO with an unusable mapping is disabled."""
        self.can_id = self._cob_id.value & CAN_ID_MASK  # its identifier
        self.transmission = self._type.value  # transmission type (CiA 301, tables 69 and 71)
        self.inhibit_time = self._inhibit.value * INHIBIT_UNIT
        # event timer of a TPDO, deadline of an RPDO in [s]; 0 for none
        self.event_time = self._event.value * MILLISECOND
        self.sync_start = self._sync_start.value
        self.variables: tuple[Scalar, ...] = ()  # the mapped objects
        self.codec = PdoCodec(())  # packs and unpacks its payload
        # it exists (bit 31 of the COB-ID is clear) and its mapping can be used
        self.enabled = not self._cob_id.value & COB_ID_INVALID
        if self.enabled:
            try:
                self._compile()
            except (SdoAbortError, CodecError):  # a default of the dictionary that is no mapping
                self.enabled = False

    def _compile(self) -> None:
        words = [variable.value for variable in self._entries[: self._count.value]]
        self.variables = tuple(self._resolve(word) for word in words)
        self.codec = PdoCodec(
            [
                MappedObject(
                    variable.entry.index, variable.entry.subindex, variable.entry.data_type
                )
                for variable in self.variables
            ]
        )

    def _resolve(self, word: int) -> Scalar:
        """Return the object that a mapping entry names."""
        index, subindex, bits = mapped_place(word)
        variable = self._find(index, subindex)
        entry = variable.entry
        if not isinstance(variable, Scalar) or not self._is_mappable(entry):
            raise refusal(AbortCode.NOT_MAPPABLE, entry)
        if bit_length(entry.data_type) != bits:
            raise refusal(AbortCode.NOT_MAPPABLE, entry)
        return variable

    @staticmethod
    @abstractmethod
    def _is_mappable(entry: ObjectEntry) -> bool:
        """Return whether an object may be mapped in this direction."""

    def _find(self, index: int, subindex: int) -> Variable:
        return self._store.find(index, subindex)

    def _check_type(self, value: Value) -> None:
        if value not in self.transmission_types:
            raise refusal(AbortCode.VALUE_RANGE, self._type.entry)

    def _check_disabled(self, _value: Value) -> None:
        if self.enabled:
            raise refusal(AbortCode.UNSUPPORTED_ACCESS, self._cob_id.entry)

    def _check_count(self, value: Value) -> None:
        self._check_disabled(value)
        count = value if isinstance(value, int) else 0
        if count > len(self._entries):
            raise refusal(AbortCode.PDO_LENGTH, self._count.entry)
        scalars = [self._resolve(variable.value) for variable in self._entries[:count]]
        if total_bits(scalars) > PDO_BITS_MAX:
            raise refusal(AbortCode.PDO_LENGTH, self._count.entry)

    def _check_entry(self, value: Value) -> None:
        self._check_disabled(value)
        if self._count.value:  # the mapping is in force until its number is set to 0
            raise refusal(AbortCode.UNSUPPORTED_ACCESS, self._count.entry)
        if isinstance(value, int) and value:
            self._resolve(value)


def total_bits(variables: Sequence[Scalar]) -> int:
    """Return the total length of variables in a PDO in [bit]."""
    return sum(bit_length(variable.entry.data_type) or 0 for variable in variables)


Channel = TypeVar('Channel', bound=PdoChannel)


class PdoEngine(Generic[Channel]):
    """All PDOs of a device in one direction."""

    def __init__(self, changed: Callable[[], None]) -> None:
        """Start stopped; ``changed`` is called when a client has changed a PDO."""
        self.channels: list[Channel] = []  # those of the dictionary
        self.active: list[Channel] = []  # those that exist, while the device is Operational
        self._running = False
        self._changed = changed

    def configure(self) -> None:
        """Read the parameter objects again, after a reset."""
        for channel in self.channels:
            channel.configure()

    def number_of(self, can_id: int) -> int:
        """Return the number of the active PDO with an identifier; 0 if there is none."""
        return next((pdo.number for pdo in self.active if pdo.can_id == can_id), 0)

    def _select(self) -> None:
        self.active = [pdo for pdo in self.channels if self._running and pdo.enabled]


def channel_numbers(store: ObjectStore, first: int) -> list[int]:
    """Return the offsets from ``first`` of the PDO records that a dictionary has."""
    return [n for n in range(PDO_COUNT_MAX) if store.dictionary.has_index(first + n)]
