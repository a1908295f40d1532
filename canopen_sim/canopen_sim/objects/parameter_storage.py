# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What a device keeps without power: parameters (CiA 301, 7.5.2.13)."""

from __future__ import annotations

from functools import partial
import json
import logging
from pathlib import Path

from canopen_core import SdoAbortError
from canopen_core.standard import AbortCode, axis_of, COMMANDS, encode, Index, OFFSETS, Value

from .object_store import Integer, ObjectStore, refusal, Variable

SAVE = int.from_bytes(b'save', 'little')
LOAD = int.from_bytes(b'load', 'little')

GROUPS: dict[int, tuple[int, int]] = {
    1: (0x1000, 0xFFFF),  # all
    2: (0x1000, 0x1FFF),  # communication
    3: (0x6000, 0x9FFF),  # application
}
"""First and last index of what a sub-index stores; those above 3 are the manufacturer's."""
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
    """Non-volatile memory that lasts as long as the process."""

    def __init__(self) -> None:
        # saved objects as an SDO would transmit them, by index and sub-index
        self.values: dict[Address, bytes] = {}

    def commit(self) -> None:
        """Make the present content last."""


class ParameterFile(ParameterMemory):
    """Non-volatile memory in a file.

    A file that cannot be read counts as empty memory, as a device with a broken EEPROM starts
    with its defaults; that is logged.
    """

    def __init__(self, path: Path) -> None:
        """Read the file, if there is one."""
        super().__init__()
        self._path = path
        try:
            self._load(json.loads(path.read_text(encoding='utf-8')))
        except FileNotFoundError:
            pass
        except (OSError, ValueError, TypeError, KeyError, AttributeError) as error:
            self.values.clear()
            logger.error('%s holds no stored parameters, the defaults are used: %s', path, error)

    def commit(self) -> None:
        """Write the file: all of it, or nothing."""
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
        """Put the saved values in force at the next restoring of the store."""
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
        """Erase the signature 0x1020 if something else was saved than what it stands for."""
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
