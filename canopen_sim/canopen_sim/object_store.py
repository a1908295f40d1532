# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The object dictionary at run time: present values, and the rules of reading and writing them.

Inside the device an object is bound once, as a :class:`Variable`, and then read and written
through its ``value``; only SDOs look it up by index. This module checks SDO access: a refusal
raises SdoAbortError with the code of CiA 301, table 22. Parameters are stored as in
7.5.2.13.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
import json
import logging
from pathlib import Path
from typing import Protocol

from canopen_core import CodecError, SdoAbortError
from canopen_core.standard import (
    abort_text,
    AbortCode,
    axis_of,
    byte_length,
    CAN_ID_MASK,
    COB_ID_EXTENDED,
    COB_ID_INVALID,
    COMMANDS,
    DataType,
    decode,
    encode,
    Index,
    integer_range,
    Number,
    object_address,
    ObjectDictionary,
    ObjectEntry,
    OFFSETS,
    REAL_FORMATS,
    Value,
)

STRING_BYTES_MAX = 65_536  # [byte] longest string or domain that a client may write
NEVER = float('inf')  # [s] the deadline of a part of the device that waits for nothing


class Timed(Protocol):
    """Interface of a part of the device with a deadline."""

    @property
    def deadline(self) -> float:
        """Steady time in [s] at which :meth:`advance` is due; :data:`NEVER` for none."""

    def advance(self, now: float) -> None:
        """Process what is due at steady time ``now`` in [s]."""


def refusal(code: AbortCode, place: object) -> SdoAbortError:
    """Return the exception that aborts an SDO transfer; the message names the object."""
    return SdoAbortError(f'{place}: {abort_text(code)}', code)


class Variable:
    """The present value of one sub-index."""

    __slots__ = ('before_read', 'check', 'entry', 'listener', 'value')

    def __init__(self, entry: ObjectEntry) -> None:
        self.entry = entry  # its entry in the dictionary
        self.value: Value = default_value(entry)  # what it holds
        # called with a value that an SDO wants to write; raises SdoAbortError to refuse
        self.check: Callable[[Value], None] | None = None
        # called before an SDO reads it; raises SdoAbortError to refuse
        self.before_read: Callable[[], None] | None = None
        # called with the steady time in [s] after an SDO or an RPDO wrote it
        self.listener: Callable[[float], None] | None = None

    @property
    def size(self) -> int | None:
        """Length in an SDO in [byte]; None for strings and domains."""
        return byte_length(self.entry.data_type)

    def restore(self) -> None:
        """Restore the default without calling the listener."""
        self.value = default_value(self.entry)

    def decoded(self, data: bytes) -> Value:
        """Decode bytes to a value; refuse a value beyond the limits of the object."""
        self.check_length(len(data))
        try:
            value = decode(self.entry.data_type, data)
        except CodecError as error:
            raise refusal(AbortCode.LENGTH, self.entry) from error
        self._check_limits(value)
        return value

    def accept(self, data: bytes) -> Value:
        """Decode and check bytes that an SDO writes; return the value."""
        value = self.decoded(data)
        if self.check is not None:
            self.check(value)
        return value

    def check_length(self, size: int) -> None:
        """Refuse a transfer whose length in [byte] does not match the type."""
        expected = self.size
        if expected is None and size > STRING_BYTES_MAX:
            raise refusal(AbortCode.OUT_OF_MEMORY, self.entry)
        if expected is not None and size > expected:
            raise refusal(AbortCode.LENGTH_HIGH, self.entry)
        if expected is not None and size < expected:
            raise refusal(AbortCode.LENGTH_LOW, self.entry)

    def _check_limits(self, value: Value) -> None:
        if not isinstance(value, (int, float)):
            return
        low, high = self.entry.low_limit, self.entry.high_limit
        if high is not None and value > high:
            raise refusal(AbortCode.VALUE_HIGH, self.entry)
        if low is not None and value < low:
            raise refusal(AbortCode.VALUE_LOW, self.entry)


class Scalar(Variable):
    """A number, the only kind of object that PDOs carry."""

    __slots__ = ()
    value: Number


class Integer(Scalar):
    """An integer; low and high are the bounds of its type."""

    __slots__ = ('high', 'low')
    value: int

    def __init__(self, entry: ObjectEntry) -> None:
        super().__init__(entry)
        self.low, self.high = integer_range(entry.data_type) or (0, 0)

    def put(self, value: float) -> None:
        """Store a number, rounded and clamped to its type."""
        self.value = min(max(round(value), self.low), self.high)


def default_value(entry: ObjectEntry) -> Value:
    """Return the value after a reset: the dictionary's default, else zero or nothing."""
    if entry.default is not None:
        return entry.default
    if integer_range(entry.data_type) is not None:
        return 0
    if entry.data_type in REAL_FORMATS:
        return 0.0
    if entry.data_type in (DataType.VISIBLE_STRING, DataType.UNICODE_STRING):
        return ''
    return bytes(byte_length(entry.data_type) or 0)


def make_variable(entry: ObjectEntry) -> Variable:
    """Return a variable of the class for the entry's type."""
    if integer_range(entry.data_type) is not None:
        return Integer(entry)
    return Scalar(entry) if entry.data_type in REAL_FORMATS else Variable(entry)


class ObjectStore:
    """All variables of a device."""

    def __init__(self, dictionary: ObjectDictionary) -> None:
        self.dictionary = dictionary  # what it was made from
        # what clients read of some objects instead of their values
        self.overlay: dict[tuple[int, int], bytes] = {}
        # what some objects hold after a reset instead of their defaults
        self.saved: dict[tuple[int, int], Value] = {}
        self._variables = {entry.address: make_variable(entry) for entry in dictionary}

    def __iter__(self) -> Iterator[Variable]:
        """Iterate in ascending order of index and sub-index."""
        return iter(self._variables.values())

    def __contains__(self, address: tuple[int, int]) -> bool:
        """Return whether the device has this sub-index."""
        return address in self._variables

    def find(self, index: int, subindex: int = 0) -> Variable:
        """Return a variable that a client names."""
        variable = self._variables.get((index, subindex))
        if variable is not None:
            return variable
        known = self.dictionary.has_index(index)
        code = AbortCode.NO_SUBINDEX if known else AbortCode.NO_OBJECT
        raise refusal(code, object_address(index, subindex))

    def integer(self, index: int, subindex: int = 0, *, default: int = 0) -> Integer:
        """Bind an integer object for use inside the device.

        If the dictionary lacks the object, return one with the default that SDOs cannot see.
        """
        variable = self._variables.get((index, subindex))
        if isinstance(variable, Integer):
            return variable
        return Integer(
            ObjectEntry(index, subindex, 'internal', DataType.INTEGER64, default=default)
        )

    def restore(self, first: int, last: int) -> None:
        """Restore saved or default values of objects from one index to another (included)."""
        for address, variable in self._variables.items():
            if first <= address[0] <= last:
                variable.restore()
                if address in self.saved:
                    variable.value = self.saved[address]

    def read(self, index: int, subindex: int = 0) -> bytes:
        """Return the bytes that an SDO upload reads."""
        variable = self.find(index, subindex)
        if not variable.entry.access.readable:
            raise refusal(AbortCode.WRITE_ONLY, variable.entry)
        if variable.before_read is not None:
            variable.before_read()
        shown = self.overlay.get((index, subindex))
        return shown if shown is not None else encode(variable.entry.data_type, variable.value)

    def writable(self, index: int, subindex: int = 0) -> Variable:
        """Return a variable that an SDO may write."""
        variable = self.find(index, subindex)
        if not variable.entry.access.writable:
            raise refusal(AbortCode.READ_ONLY, variable.entry)
        return variable

    def write(self, index: int, subindex: int, data: bytes, now: float) -> None:
        """Execute an SDO download."""
        variable = self.writable(index, subindex)
        variable.value = variable.accept(data)
        if variable.listener is not None:
            variable.listener(now)


RESTRICTED_CAN_IDS: tuple[tuple[int, int], ...] = (
    (0x000, 0x07F),  # NMT, and reserved
    (0x101, 0x180),
    (0x581, 0x5FF),  # SDO, server to client
    (0x601, 0x67F),  # SDO, client to server
    (0x6E0, 0x6FF),
    (0x701, 0x7FF),  # NMT error control, and reserved
)
"""First and last identifier of the ranges that no configurable service may use (7.3.5)."""

FRAME_BITS = COB_ID_EXTENDED | 0x1FFF_FFFF  # bits 0 to 29: the identifier and its length


def check_can_id(entry: ObjectEntry, value: Value) -> None:
    """Refuse an identifier that is extended or reserved for other services."""
    can_id = int(value) & FRAME_BITS if isinstance(value, int) else 0
    if can_id > CAN_ID_MASK or any(first <= can_id <= last for first, last in RESTRICTED_CAN_IDS):
        raise refusal(AbortCode.VALUE_RANGE, entry)


def check_cob_id(variable: Integer, value: Value) -> None:
    """Refuse a COB-ID that the service of an object cannot use.

    An identifier may only be changed while the service is disabled (bit 31 is set).
    """
    word = int(value) if isinstance(value, int) else 0
    if word & COB_ID_INVALID:
        return
    in_use = not variable.value & COB_ID_INVALID
    if in_use and (word ^ variable.value) & FRAME_BITS:
        raise refusal(AbortCode.VALUE_RANGE, variable.entry)
    check_can_id(variable.entry, value)


SAVE = int.from_bytes(b'save', 'little')
LOAD = int.from_bytes(b'load', 'little')

GROUPS: dict[int, tuple[int, int]] = {
    1: (0x1000, 0xFFFF),  # all
    2: (0x1000, 0x1FFF),  # communication
    3: (0x6000, 0x9FFF),  # application
}
"""First and last index stored by a sub-index; those above 3 are manufacturer-specific."""
MANUFACTURER = (0x2000, 0x5FFF)

NEVER_STORED = frozenset(
    {
        Index.PREDEFINED_ERROR_FIELD,
        Index.STORE_PARAMETERS,
        Index.RESTORE_PARAMETERS,
        *COMMANDS,  # nothing may move because it was stored
        *OFFSETS,
    }
)


VERSION = 1  # of the file
logger = logging.getLogger(__name__)

Address = tuple[int, int]


class ParameterMemory:
    """Non-volatile memory in a file; without one it lasts as long as the process.

    An unreadable file is logged and counts as empty memory, as a device with a broken EEPROM
    starts with its defaults.
    """

    def __init__(self, path: Path | None = None) -> None:
        """Read the file, if there is one."""
        # saved objects as an SDO would transmit them, by index and sub-index
        self.values: dict[Address, bytes] = {}
        self._path = path
        if path is None:
            return
        try:
            self._load(json.loads(path.read_text(encoding='utf-8')))
        except FileNotFoundError:
            pass
        except (OSError, ValueError, TypeError, KeyError, AttributeError) as error:
            self.values.clear()
            logger.error('%s holds no stored parameters, the defaults are used: %s', path, error)

    def commit(self) -> None:
        """Write the file atomically."""
        if self._path is None:
            return
        content = {
            'version': VERSION,
            'values': {
                f'0x{index:04X}:{subindex:02X}': data.hex()
                for (index, subindex), data in sorted(self.values.items())
            },
        }
        new = self._path.with_suffix('.new')
        try:
            self._path.parent.mkdir(parents=True, exist_ok=True)
            new.write_text(json.dumps(content, indent=2) + '\n', encoding='utf-8')
            Path(new).replace(self._path)
        except OSError as error:
            logger.error('parameters cannot be stored: %s', error)

    def _load(self, content: dict[str, object]) -> None:
        if content['version'] != VERSION:
            raise ValueError(f'version {content["version"]} instead of {VERSION}')
        values = content['values']
        if not isinstance(values, dict):
            raise TypeError('no values')
        self.values.update({_address(name): bytes.fromhex(data) for name, data in values.items()})


def _address(name: str) -> Address:
    index, _, subindex = name.partition(':')
    return int(index, 16), int(subindex, 16)


class ParameterStorage:
    """Saves the writable objects of a device, and loads them when it starts."""

    def __init__(self, store: ObjectStore, memory: ParameterMemory) -> None:
        """Bind 0x1010 and 0x1011, and load what was saved."""
        self._store = store
        self._memory = memory
        for index, signature, act in (
            (Index.STORE_PARAMETERS, SAVE, self._save),
            (Index.RESTORE_PARAMETERS, LOAD, self._forget),
        ):
            for entry in store.dictionary.subindices(index):
                if entry.subindex:
                    variable = store.integer(index, entry.subindex)
                    variable.check = partial(_check, variable, signature)
                    variable.listener = partial(self._accept, variable, act)

    def load(self) -> None:
        """Apply the saved values when the store is restored next."""
        saved: dict[tuple[int, int], Value] = {}
        for address, data in self._memory.values.items():
            if address not in self._store:
                continue  # the dictionary is another one than when it was saved
            variable = self._store.find(*address)
            if _is_parameter(variable):
                try:
                    saved[address] = variable.decoded(data)
                except SdoAbortError:
                    continue
        self._store.saved = saved

    def _accept(self, variable: Integer, act: object, _now: float) -> None:
        variable.restore()  # reading returns the abilities, not the signature
        first, last = GROUPS.get(variable.entry.subindex, MANUFACTURER)
        if callable(act):
            act(first, last)
        self._memory.commit()
        self.load()

    def _save(self, first: int, last: int) -> None:
        values = self._memory.values
        before = dict(values)
        for variable in self._store:
            entry = variable.entry
            if first <= entry.index <= last and _is_parameter(variable):
                values[entry.address] = encode(entry.data_type, variable.value)
        self._verify(before)

    def _verify(self, before: dict[tuple[int, int], bytes]) -> None:
        """Erase the signature 0x1020 if the saved values differ from those it stands for."""
        signature = [(int(Index.VERIFY_CONFIGURATION), sub) for sub in (1, 2)]
        after = self._memory.values
        changed = {key for key in after if before.get(key) != after[key]}
        if changed and before and not changed & set(signature):
            for address in signature:
                if address in after:
                    after[address] = bytes(len(after[address]))
                    self._store.integer(*address).value = 0

    def _forget(self, first: int, last: int) -> None:
        values = self._memory.values
        for address in [address for address in values if first <= address[0] <= last]:
            del values[address]
        for sub in (1, 2):
            values.pop((Index.VERIFY_CONFIGURATION, sub), None)


def _is_parameter(variable: Variable) -> bool:
    access, (index, _) = variable.entry.access, axis_of(variable.entry.index)
    return access.writable and access.readable and index not in NEVER_STORED


def _check(variable: Integer, signature: int, value: Value) -> None:
    if value != signature:  # so that nothing is stored by mistake
        raise refusal(AbortCode.DATA_TRANSFER, variable.entry)
